"""What a physical effect is: parameters, and how it acts on an axis.

An axis resists its motion with the sum of what its terms contribute; the drive must supply that
sum. A term says what it contributes by overriding the hooks that its physics needs, and each hook
serves both directions: along a known motion, where the sum is the effort (the inverse direction,
`edge_ident.model.inverse`), and inside the equations of motion (`edge_ident.simulation`)::

    command ─▶ torque ─▶ (inertia) acceleration = torque - load - friction · direction ─▶ position
       │     actuator                                                                       │
       └─ recorded ─▶ effort column                          position column ◀─ reading ────┘

All hooks broadcast: values of shape (1,) or (D, 1) along a motion of (N,) samples, values of
shape (D,) at one instant of D drives.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from edge_ident.model.strengths import Draws, Scale

Array = NDArray[np.float64]
Values = Mapping[str, Array]
"""Values of an effect's parameters by name, each of the shape of the drives."""

_NOTHING = np.zeros(())
_ENTANGLING = ("true_motion", "reading", "command", "torque", "recorded", "withheld")


@dataclass(frozen=True)
class Parameter:
    """One number that an effect needs.

    Attributes
    ----------
    name : str
    unit : str
        Template over {effort}, {position} and {inertia}: the units of an axis.
    low, high : float
        Physical bounds, both allowed.
    description : str
        One line.
    default : float or None
        Value where a model names none; None if it has to.
    """

    name: str
    unit: str
    low: float
    high: float
    description: str
    default: float | None = None


@dataclass(frozen=True)
class Form:
    """A way in which an effect may befall a drive: the parameters that it then has.

    Attributes
    ----------
    linear : tuple of parameter names
        The effort is proportional to them, or nearly so while they are small; those of other
        forms are zero.
    nonlinear : tuple of parameter names
        The others that matter, found by search (`Effect.grid`).
    coupled : bool
        Whether another axis takes part.
    rotary : bool
        Whether it takes positions for angles.
    """

    linear: tuple[str, ...]
    nonlinear: tuple[str, ...] = ()
    coupled: bool = False
    rotary: bool = False


@dataclass(frozen=True)
class Excitation:
    """What a recording reaches: the measure of what can be searched for in it.

    Attributes
    ----------
    travel : float
        From the lowest to the highest position.
    speed, acceleration, effort : float
        Peak, rms, peak.
    typical_speed : float
        Rms.
    resolution : float
        Of the encoder.
    duration_s, cutoff_hz : float
    base : (4,) array
        Base parameters, fitted without any effect.
    """

    travel: float
    speed: float
    typical_speed: float
    acceleration: float
    effort: float
    resolution: float
    duration_s: float
    cutoff_hz: float
    base: Array

    def moved(self, inertia: Array) -> bool:
        """Whether the drive could have moved this much."""
        return bool(np.all(inertia * self.acceleration < self.effort))

    def orders(self, lowest: float, highest: float, step: float = 0.5) -> Array:
        """Periods of position whose waves the filter lets through, `step` apart over the travel."""
        passed = 2.0 * self.cutoff_hz * self.travel / self.typical_speed
        count = max(2, int((min(highest, passed) - lowest) / step) + 1)
        return np.asarray(self.travel / (lowest + step * np.arange(count)))


@dataclass(frozen=True)
class Motion:
    """Where an axis is, along time or at one instant.

    Attributes
    ----------
    time_s, position, velocity, acceleration : arrays
        (N,) along a motion, evenly sampled; (D,) at one instant of D drives. Time zero is the
        first captured sample. At an instant, only `rates` may ask for the acceleration.
    direction : array
        -1, 0 or 1: where the axis slides to; 0 while it sticks.
    transmitted : array
        Effort that passes through the transmission to inertia and constant load.
    accelerated, rubbed : arrays
        What inertia (at an instant: and its friction, if it is load-dependent), and what viscous
        and Coulomb friction of the axis take, wherever they are.
    memory : (M, ...) array
        States of the effect that is asked, at an instant.
    source : Motion or None
        The axis that acts on this one, for effects that need or take one.
    """

    time_s: Array
    position: Array
    velocity: Array
    acceleration: Array
    direction: Array
    transmitted: Array = field(default_factory=lambda: _NOTHING)
    accelerated: Array = field(default_factory=lambda: _NOTHING)
    rubbed: Array = field(default_factory=lambda: _NOTHING)
    memory: Array = field(default_factory=lambda: _NOTHING)
    source: "Motion | None" = None

    @classmethod
    def known(
        cls, time_s: Array, position: Array, velocity: Array, acceleration: Array
    ) -> "Motion":
        """A motion of which everything is known; it slides wherever it moves."""
        return cls(time_s, position, velocity, acceleration, np.sign(velocity))

    @property
    def partner(self) -> "Motion":
        """The axis that acts on this one; the model makes sure that there is one."""
        assert self.source is not None
        return self.source


class Effect:
    """One physical effect; a subclass overrides the hooks that its physics needs.

    The first line of its module's docstring is its title.
    """

    parameters: ClassVar[tuple[Parameter, ...]]
    forms: ClassVar[tuple[Form, ...]] = ()
    """As what the diagnosis looks for it, the simplest first."""
    signature: ClassVar[str] = ""
    """What sets it apart."""
    rivals: ClassVar[tuple[str, ...]] = ()
    """Effects that look like it."""
    experiment: ClassVar[str] = ""
    """The motion that shows it, and tells it from its rivals."""
    discrepancy: ClassVar[float] = 0.03
    """Share of its effort by which the formula may be off on a machine that has the effect: what
    is left within that is no evidence of another one. A judgement, not a measurement."""
    open_ended: ClassVar[tuple[str, ...]] = ()
    """Shapes whose grid ends where more makes no difference: the best may lie on its edge."""
    essential: ClassVar[tuple[str, ...]] = ()
    """Amplitudes without which it is something else."""
    needs_reversals: ClassVar[bool] = False
    """Whether it shows only where the motion turns."""
    follows_base: ClassVar[bool] = False
    """Whether its effort follows from the base parameters too."""
    repeats: ClassVar[bool] = False
    """Whether a drive may have several of it at once."""
    memory_size: ClassVar[int] = 0
    """States that the effect brings into the equations of motion."""
    needs_source: ClassVar[bool] = False
    """Whether another axis must be named."""
    takes_source: ClassVar[bool] = False
    """Whether another axis may be named."""

    def complete(self, values: Mapping[str, float | Array]) -> dict[str, float | Array]:
        """A term's values, with defaults for those that it does not name."""
        defaults = {p.name: p.default for p in self.parameters if p.default is not None}
        return {**defaults, **values}

    @property
    def name(self) -> str:
        """The name in model files: that of the module."""
        return type(self).__module__.rpartition(".")[2]

    @property
    def additive(self) -> bool:
        """Whether its effort just adds to that of the others, in proportion to its amplitudes."""
        return not (self.follows_base or any(self.overrides(hook) for hook in _ENTANGLING))

    @property
    def bounds(self) -> dict[str, tuple[float, float]]:
        """Physical bounds of the parameters, by name."""
        return {parameter.name: (parameter.low, parameter.high) for parameter in self.parameters}

    def has_source(self, source: str | None) -> bool:
        """Whether another axis takes part, where a term names this one or none."""
        return self.needs_source or (self.takes_source and source is not None)

    def overrides(self, hook: str) -> bool:
        """Whether the effect acts through this hook."""
        return getattr(type(self), hook) is not getattr(Effect, hook)

    def draw(self, draws: Draws, scale: Scale) -> dict[str, Array]:
        """Random values, from hardly visible to a machine that needs repair."""
        raise NotImplementedError

    def possible(self, values: Values, excitation: Excitation) -> bool:
        """Whether a recording of this excitation can tell values as large as these."""
        return True

    def grid(self, excitation: Excitation) -> dict[str, Array]:
        """Values of the shape parameters to search through, arrays of one length."""
        return {}

    # ---- what the axis resists with

    def load(self, at: Motion, values: Values) -> Array:
        """Resisting effort that does not depend on the direction of sliding."""
        return _NOTHING

    def friction(self, at: Motion, values: Values) -> Array:
        """Level of dry friction; it acts against the direction, and holds an axis at rest."""
        return _NOTHING

    def inertia(self, at: Motion, values: Values) -> Array:
        """Inertia that takes part in the axis's own motion, on the encoder's side."""
        return _NOTHING

    def cross_inertia(self, at: Motion, values: Values) -> Array:
        """Effort per acceleration of the source axis."""
        return _NOTHING

    def resistance(self, motion: Motion, values: Values) -> Array:
        """All of the above along a known motion; effects with memory integrate it here."""
        effort = (
            self.load(motion, values)
            + self.friction(motion, values) * motion.direction
            + self.inertia(motion, values) * motion.acceleration
        )
        if motion.source is not None:
            effort = effort + self.cross_inertia(motion, values) * motion.source.acceleration
        return effort

    # ---- states of their own, in the equations of motion

    def start(self, at: Motion, values: Values) -> Array:
        """States (M, D) of an axis that has stood still."""
        return np.zeros((self.memory_size, *np.shape(at.position)))

    def rates(self, at: Motion, values: Values) -> Array:
        """Time derivatives (M, D) of the states."""
        raise NotImplementedError

    def fastest_rate(self, values: Values, inertia: Array, speed: float) -> Array:
        """Fastest rate (1/s) that the effect brings into the equations of motion.

        Parameters
        ----------
        values : Values
        inertia : (D,) array
            On the encoder's side.
        speed : float
            Top speed of the motion.
        """
        return _NOTHING

    # ---- between effort column, actuator, encoder and position column

    def true_motion(self, motion: Motion, values: Values) -> Motion:
        """The motion of the axis, from the one that the encoder reads."""
        return motion

    def reading(self, position: Array, values: Values) -> Array:
        """What the encoder reads at a position."""
        return position

    def command(self, torque: Array, time_s: Array, values: Values) -> Array:
        """Commanded effort that makes the actuator give this much."""
        return torque

    def torque(self, command: Array, time_s: Array, values: Values) -> Array:
        """What the actuator makes of a commanded effort."""
        return command

    def withheld(self, effort: Array, values: Values) -> Array:
        """Part of a recorded effort that the actuator did not give."""
        return np.zeros_like(effort)

    def recorded(self, effort: Array, time_s: Array, values: Values) -> Array:
        """The effort column (..., N), from the commanded effort at its time stamps."""
        return effort
