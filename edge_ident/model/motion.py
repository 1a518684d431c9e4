"""The motion of an axis, as effects and estimators read it."""

from dataclasses import dataclass, field
from typing import Final

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_NOTHING: Final = np.zeros(())


@dataclass(frozen=True)
class Motion:
    """The motion of an axis, along time or at one instant.

    Attributes
    ----------
    time_s, position, velocity, acceleration : arrays
        (N,) along a motion, evenly sampled; (D,) at one instant of D drives. Time zero is the
        first captured sample. At an instant, only `rates` may ask for the acceleration.
    direction : array
        -1, 0 or 1: where the axis slides to; 0 while it sticks.
    transmitted : array
        Effort that passes through the transmission to inertia, constant load and load along the
        stroke.
    inertia_effort, friction_effort : arrays
        Effort that inertia takes, and effort that viscous and Coulomb friction take. At an instant,
        the first includes load-dependent friction.
    memory : (M, ...) array
        States of the effect whose hook is called, at an instant.
    driven : array
        Effort that the actuator gives, at an instant.
    source : Motion or None
        The axis that acts on this one, for effects that need or take one.
    clock : int
        Of the times. Those of recordings on different clocks have nothing to do with each other.
    """

    time_s: Array
    position: Array
    velocity: Array
    acceleration: Array
    direction: Array
    transmitted: Array = field(default_factory=lambda: _NOTHING)
    inertia_effort: Array = field(default_factory=lambda: _NOTHING)
    friction_effort: Array = field(default_factory=lambda: _NOTHING)
    memory: Array = field(default_factory=lambda: _NOTHING)
    driven: Array = field(default_factory=lambda: _NOTHING)
    source: "Motion | None" = None
    clock: int = 0

    @classmethod
    def known(
        cls,
        time_s: Array,
        position: Array,
        velocity: Array,
        acceleration: Array,
        *,
        clock: int = 0,
    ) -> "Motion":
        """A measured motion: the axis slides wherever it moves."""
        return cls(time_s, position, velocity, acceleration, np.sign(velocity), clock=clock)

    @property
    def partner(self) -> "Motion":
        """The axis that acts on this one; the model makes sure that there is one."""
        assert self.source is not None
        return self.source
