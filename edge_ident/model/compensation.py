"""What controller gains do about an effect."""

from collections.abc import Mapping
from dataclasses import dataclass, field


@dataclass(frozen=True)
class Compensation:
    """What gains make of an effect's parameters; of most effects nothing, and feedback remains.

    `edge_ident.control.compensation` carries it out.

    Attributes
    ----------
    feedforward : mapping of parameter name to gain name
        Fields of `firmware_interface.gains.AxisGains` that take the parameters. A field with
        several places takes one term in each, the largest terms first.
    resonance : tuple of parameter names
        Inertia, rate (rad/s) and damping ratio of a sprung load, which the loop's margins bear.
    loop_delay : str
        A time (s) of either sign, whose size the loop's margins bear.
    """

    feedforward: Mapping[str, str] = field(default_factory=dict)
    resonance: tuple[str, ...] = ()
    loop_delay: str = ""

    @property
    def used(self) -> bool:
        """Whether gains use the effect at all."""
        return bool(self.feedforward or self.resonance or self.loop_delay)

    @property
    def parameters(self) -> frozenset[str]:
        """Names of the parameters that gains use."""
        delay = (self.loop_delay,) if self.loop_delay else ()
        return frozenset((*self.feedforward, *self.resonance, *delay))
