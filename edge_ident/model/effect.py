"""What a physical effect is: parameters, and how it acts on an axis.

The terms of a model resist the motion of an axis. Their contributions add up, and the drive must
supply the sum. A term states its contribution by overriding the hooks that its physics needs. Each
hook serves two directions: along a known motion, where the sum is the effort (the inverse
direction, `edge_ident.model.inverse`), and inside the equations of motion
(`edge_ident.simulation`)::

    command ─▶ torque ─▶ (inertia) acceleration = torque - load - friction · direction ─▶ position
       │     actuator                                                                       │
       └─ recorded ─▶ effort column                          position column ◀─ reading ────┘

A spring before the encoder may hold back some of the torque (`transmitted`).
All hooks broadcast: values of shape (1,) or (D, 1) along a motion of (N,) samples, values of
shape (D,) at one instant of D drives.

An effect carries four more things that are not physics: how the diagnosis searches for it
(`edge_ident.model.search`), how strengths are drawn for training (`edge_ident.model.effect`),
how controller gains compensate it (`edge_ident.model.effect`), and what it means to the
person at the machine (`edge_ident.model.effect`). What all of this must
satisfy is checked once, in `edge_ident.model.registration`.
"""

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import ClassVar, Final, Literal

import numpy as np

from edge_ident.model.motion import Array, Motion, Values
from edge_ident.model.search import SearchSpec

# Random strengths of effects, in proportion to the axis that they act on.


@dataclass(frozen=True)
class Scale:
    """What is large and small for drives on a motion; arrays of the shape of the drives.

    Attributes
    ----------
    inertia, viscous_friction, coulomb_friction : arrays
        Of the base model.
    effort, peak_effort : arrays
        Rms and peak of the base model's.
    speed, acceleration : arrays
        Peak speed and rms acceleration.
    travel : array
        From the lowest to the highest position.
    duration_s, period_s : arrays
        Of the record and between its samples.
    """

    inertia: Array
    viscous_friction: Array
    coulomb_friction: Array
    effort: Array
    peak_effort: Array
    speed: Array
    acceleration: Array
    travel: Array
    duration_s: Array
    period_s: Array


def scale_of(
    parameters: Array, time_s: Array, position: Array, velocity: Array, acceleration: Array
) -> Scale:
    """Scales of drives that all make one motion.

    Parameters
    ----------
    parameters : (..., 4) array
        Of the base model; the leading shape is that of the drives.
    time_s, position, velocity, acceleration : (N,) arrays

    Returns
    -------
    Scale
        With arrays of the shape of the drives.
    """
    inertia, viscous, coulomb, offset = (parameters[..., i] for i in range(4))
    smooth = inertia[..., None] * acceleration + viscous[..., None] * velocity + offset[..., None]
    effort = smooth + coulomb[..., None] * np.sign(velocity)

    def rms(signal: Array) -> Array:
        return np.asarray(np.sqrt(np.mean(signal**2, axis=-1)))

    def everywhere(value: float | Array) -> Array:
        return np.full(inertia.shape, value)

    return Scale(
        inertia=inertia,
        viscous_friction=viscous,
        coulomb_friction=coulomb,
        effort=rms(effort),
        peak_effort=np.max(np.abs(effort), axis=-1),
        speed=everywhere(np.max(np.abs(velocity))),
        acceleration=everywhere(rms(acceleration)),
        travel=everywhere(np.ptp(position)),
        duration_s=everywhere(time_s[-1] - time_s[0]),
        period_s=everywhere((time_s[-1] - time_s[0]) / (len(time_s) - 1)),
    )


@dataclass(frozen=True)
class Draws:
    """Random numbers of the shape of the drives."""

    rng: "np.random.Generator"  # a string: numpy.random loads when it is used
    shape: tuple[int, ...]

    def uniform(self, low: float, high: float) -> Array:
        """Evenly between two bounds."""
        return self.rng.uniform(low, high, self.shape)

    def log_uniform(self, low: float, high: float) -> Array:
        """Every decade between two positive bounds equally likely."""
        return np.exp(self.rng.uniform(np.log(low), np.log(high), self.shape))

    def sign(self) -> Array:
        """Plus or minus one."""
        return self.rng.choice(np.array([-1.0, 1.0]), self.shape)

    def strength(self) -> Array:
        """Share of the effort's rms that an effect is to have: 2 % to 30 %."""
        return self.log_uniform(0.02, 0.3)

    def phase(self) -> tuple[Array, Array]:
        """Cosine and sine of a random angle."""
        angle = self.uniform(0.0, 2.0 * np.pi)
        return np.cos(angle), np.sin(angle)


Draw = Callable[[Draws, Scale], dict[str, Array]]
"""Random values of an effect's parameters for every drive of a scale; of those that it leaves out,
the defaults count."""


def no_draw(draws: Draws, scale: Scale) -> dict[str, Array]:
    """No values: terms outside the catalogue are not drawn at random."""
    return {}


# What controller gains do about an effect.

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
        into a curve or a table, whatever its formula; not where fields take all that a term has.
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

    def sampled(self, values: Mapping[str, float | Array]) -> Over:
        """Over what a term with these values is sampled; over nothing where fields take it all."""
        fed = self.feedforward
        in_fields = fed and all(name in fed or not np.any(x) for name, x in values.items())
        return "" if in_fields else self.over

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


# What an effect means to the person at the machine, in everyday words.


@dataclass(frozen=True)
class Advice:
    """Where an effect comes from on a machine, and what to do about it.

    Attributes
    ----------
    in_words : str
        What happens, as a person at the machine would say it; a part of a sentence.
    part : str
        The part of the machine to look at; a part of a sentence.
    action : str
        What to do next, with or without a board; whole sentences.
    size : str
        How large it is, over names of parameters in braces; a part of a sentence. Without it, its
        share of the effort says that.

    Examples
    --------
    >>> import edge_ident
    >>> edge_ident.Advice("drag fades with speed", "magnets near the axis", "Move them.").part
    'magnets near the axis'
    """

    in_words: str = ""
    part: str = ""
    action: str = ""
    size: str = ""


_CAPITAL: Final = re.compile(r"(?<!^)([A-Z])")
_NOTHING: Final = np.zeros(())
_NO_SEARCH: Final = SearchSpec()
_NO_COMPENSATION: Final = Compensation()
_NO_ADVICE: Final = Advice()
# Hooks that act on what other terms contribute.
_NONADDITIVE_HOOKS: Final = (
    "true_motion", "reading", "command", "torque", "transmitted", "recorded", "withheld"
)  # fmt: skip


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

    Examples
    --------
    >>> import edge_ident
    >>> edge_ident.Parameter("level", "{effort}", 0.0, 1e9, "at unit speed").unit
    '{effort}'
    """

    name: str
    unit: str
    low: float
    high: float
    description: str
    default: float | None = None


CLOCK: Final = Parameter(
    "clock", "1", 0.0, 1e9, "of its time, among those of several recordings", default=0.0
)
"""Parameter of an effect that happens at one moment: which recording (`Motion.clock`)."""


class Effect:
    """One physical effect; a subclass overrides the hooks that its physics needs.

    The first line of its module's docstring is its title.

    Parameters
    ----------
    search : SearchSpec
        How the diagnosis searches for it.
    draw : callable
        Random values for the drives of a `Scale`, from hardly visible to a machine that needs
        repair. They serve training.
    compensation : Compensation
        What gains do about it.
    advice : Advice
        Which part of the machine it points at, and what to do next.

    Examples
    --------
    >>> import edge_ident
    >>> class SquareDrag(edge_ident.Effect):
    ...     parameters = (edge_ident.Parameter("level", "{effort}", 0.0, 1e9, "at unit speed"),)
    ...     def load(self, at, values):
    ...         return values["level"] * at.velocity * abs(at.velocity)
    >>> SquareDrag().name
    'square_drag'
    """

    parameters: ClassVar[tuple[Parameter, ...]]
    memory_size: ClassVar[int] = 0
    """States that the effect brings into the equations of motion."""
    memory_scale: ClassVar[str] = ""
    """The one parameter to which the effort of an effect is proportional that resists with
    memory."""
    follows_base: ClassVar[bool] = False
    """Whether its effort depends on the base parameters too, and on the loads that are carried."""
    carried: ClassVar[bool] = False
    """Whether its load is carried through the transmission, as inertia and constant load are."""
    part_of_friction: ClassVar[str] = ""
    """Parameter that says how much of the Coulomb friction acts in this way, and no other."""
    changes_base: ClassVar[tuple[str, ...]] = ()
    """Base parameters that the effect changes in time, where that is all it does."""
    tied_to_time: ClassVar[bool] = False
    """Whether the same motion a record later would meet another effort. Such a term belongs to its
    recording, and is not carried on to another."""
    needs_source: ClassVar[bool] = False
    """Whether another axis must be named."""
    takes_source: ClassVar[bool] = False
    """Whether another axis may be named."""
    effort_delay: ClassVar[str] = ""
    """Parameter by which the effort column is late. A recording is shifted by it instead of being
    compensated."""

    def __init__(
        self,
        search: SearchSpec = _NO_SEARCH,
        draw: Draw = no_draw,
        compensation: Compensation = _NO_COMPENSATION,
        advice: Advice = _NO_ADVICE,
    ) -> None:
        self.search = search
        self.draw = draw
        self.compensation = compensation
        self.advice = advice

    def complete(self, values: Mapping[str, float | Array]) -> dict[str, float | Array]:
        """A term's values, with defaults for those that it does not name."""
        defaults = {p.name: p.default for p in self.parameters if p.default is not None}
        return {**defaults, **values}

    @cached_property
    def name(self) -> str:
        """The name in model files: that of the class, in words joined by underscores."""
        return _CAPITAL.sub(r"_\1", type(self).__name__).lower()

    @property
    def title(self) -> str:
        """What it is, in a line: the first one of the class's docstring."""
        return (type(self).__doc__ or self.name.replace("_", " ")).strip().split("\n")[0]

    @cached_property
    def additive(self) -> bool:
        """Whether its effort adds to that of the others, in proportion to linear parameters."""
        return not (self.follows_base or any(map(self.overrides, _NONADDITIVE_HOOKS)))

    @property
    def bounds(self) -> dict[str, tuple[float, float]]:
        """Physical bounds of the parameters, by name."""
        return {parameter.name: (parameter.low, parameter.high) for parameter in self.parameters}

    def has_source(self, source: str | None) -> bool:
        """Whether another axis takes part, where a term names this one or none."""
        return self.needs_source or (self.takes_source and source is not None)

    def overrides(self, hook: str) -> bool:
        """Whether the effect acts through this hook."""
        return hook in self._overridden

    @cached_property
    def _overridden(self) -> frozenset[str]:
        own = (name for name in vars(Effect) if callable(getattr(Effect, name)))
        return frozenset(n for n in own if getattr(type(self), n) is not getattr(Effect, n))

    # ---- what the axis resists with

    def load(self, at: Motion, values: Values) -> Array:
        """Resisting effort that does not depend on the direction of sliding."""
        return _NOTHING

    def held_travel(self, values: Values) -> Array:
        """Travel of the encoder's side in which dry friction may hold what lies behind."""
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
        """All of the above along a known motion; an effect with memory integrates it here."""
        effort = self.load(motion, values)
        # no pass over all samples for a hook that the effect lacks
        if self.overrides("friction"):
            effort = effort + self.friction(motion, values) * motion.direction
        if self.overrides("inertia"):
            effort = effort + self.inertia(motion, values) * motion.acceleration
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

    def transmitted(self, at: Motion, values: Values) -> Array:
        """What arrives of the actuator's effort on the encoder's side, at an instant."""
        return at.driven

    def withheld(self, effort: Array, values: Values) -> Array:
        """Part of a recorded effort that the actuator did not give."""
        return np.zeros_like(effort)

    def recorded(self, effort: Array, time_s: Array, values: Values) -> Array:
        """The effort column (..., N), from the commanded effort at its time stamps."""
        return effort
