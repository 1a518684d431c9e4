"""What controller gains do about an effect."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Literal

Over = Literal["", "speed", "position"]


def _none(values: Mapping[str, float], top_speed: float) -> str:
    return ""


@dataclass(frozen=True)
class Compensation:
    """What gains make of an effect's parameters, or why they make nothing of them.

    `edge_ident.control.compensation` carries it out.

    Attributes
    ----------
    feedforward : mapping of parameter name to gain name
        Fields of `firmware_interface.gains.AxisGains` that take the parameters. A field with
        several places takes one term in each, the largest terms first.
    times : mapping of parameter name to float or base parameter
        What a parameter is multiplied by on its way to its field.
    takes_over : mapping of parameter name to gain name
        Fields that hold the parameter already, as part of the base model, and must lose it.
    over : "", "speed" or "position"
        The effort depends on the velocity alone, or on position and direction alone. It is sampled
        into a curve or a table, whatever its formula.
    resonance : tuple of parameter names
        Inertia, rate (rad/s) and damping ratio of a sprung load, which the loop's margins bear.
    series_resonance : tuple of parameter names
        One over the square of the resonance (s²), and damping ratio, of a spring that the whole
        effort passes, which the loop's margins bear.
    loop_delay : str
        A time (s) of either sign, whose size the loop's margins bear.
    at_end : bool
        The effect changes base parameters in time. Gains fit their values at the end of the
        recording.
    limit : str
        The most effort that the actuator gives: feed-forward has to stay below it.
    objection : callable
        From the values of a term and the top speed that is supported to the reason why gains must
        leave it alone; empty where they need not.
    note : str
        What else a person should know where gains use it; a part of a sentence.
    without : str
        Why no gain cures it; a part of a sentence. Only where nothing above is there.

    Examples
    --------
    >>> import edge_ident
    >>> edge_ident.Compensation(over="speed").used
    True
    """

    feedforward: Mapping[str, str] = field(default_factory=dict)
    times: Mapping[str, float | str] = field(default_factory=dict)
    takes_over: Mapping[str, str] = field(default_factory=dict)
    over: Over = ""
    resonance: tuple[str, ...] = ()
    series_resonance: tuple[str, ...] = ()
    loop_delay: str = ""
    at_end: bool = False
    limit: str = ""
    objection: Callable[[Mapping[str, float], float], str] = _none
    note: str = ""
    without: str = ""

    @property
    def used(self) -> bool:
        """Whether gains use the effect at all."""
        return bool(self.feedforward or self.over or self.at_end or self.borne)

    @property
    def borne(self) -> bool:
        """Whether the design bears the effect, without a number of the law for it."""
        resonance = self.resonance or self.series_resonance
        return bool(resonance or self.loop_delay or self.limit)

    @property
    def parameters(self) -> frozenset[str]:
        """Names of the parameters that this names."""
        single = {name for name in (self.loop_delay, self.limit) if name}
        fed = {*self.feedforward, *self.times, *self.takes_over}
        return frozenset({*fed, *self.resonance, *self.series_resonance} | single)
