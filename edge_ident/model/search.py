"""How the diagnosis searches for an effect: its forms, the grid, and what tells it from others."""

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from typing import Final, NamedTuple

import numpy as np

from edge_ident.model.motion import Array, Values

SOUND_RESONANCE_HZ: Final = 15.0
"""Frequency at which a load swings on a sound drive's chain, at least. No chain is rigid: dry
friction winds it up at each reversal, and an encoder on the motor resolves that. Feed drives are
built with their first resonance well above this, and their position loops end well below. A
judgement, not a measurement."""


_TINY: Final = float(np.finfo(float).tiny)


class Link(Enum):
    """Which of two links an axis moves, where one carries the other."""

    INNER = "it carries the other axis"
    OUTER = "the other axis carries it"


@dataclass(frozen=True)
class Form:
    """One way in which an effect may act on a drive: the parameters that it then has.

    Attributes
    ----------
    linear : tuple of parameter names
        The effort is proportional to them, or nearly so while they are small. Those of other
        forms are zero.
    nonlinear : tuple of parameter names
        The others that matter. A grid search finds them (`SearchSpec.grid`).
    coupled : bool
        Whether another axis takes part.
    link : Link, optional
        Which of two links it belongs to. Recordings list joints from the base outwards.
    rotary : bool
        Whether positions are taken for angles.
    turning : bool
        Whether those of the other axis are.
    senses : bool
        Whether it matters in which sense the other joint counts its angle: it turns in one plane
        with this one.
    across : bool
        Whether the other joint turns about an axis across that of this one.
    sums : bool
        Whether two of them may take part by the sum of their angles, in any sense of each.
    known : tuple of pairs of parameter name and float
        Values that follow from that, and need no search.
    several_speeds : bool
        Whether it needs several speeds at one place: where the speed follows from the position, as
        along one sinusoid, friction over the position is friction over the speed, and inertia over
        the position is a load.
    grid : callable, optional
        Of its nonlinear parameters, where they are others than those of `SearchSpec.grid`.

    Examples
    --------
    >>> import edge_ident
    >>> edge_ident.Form(("level",), ("speed",)).nonlinear
    ('speed',)
    """

    linear: tuple[str, ...]
    nonlinear: tuple[str, ...] = ()
    coupled: bool = False
    link: Link | None = None
    rotary: bool = False
    turning: bool = False
    senses: bool = False
    across: bool = False
    sums: bool = False
    known: tuple[tuple[str, float], ...] = ()
    several_speeds: bool = False
    grid: "Callable[[Excitation], dict[str, Array]] | None" = None


class Span(NamedTuple):
    """Time that recordings on one clock cover."""

    clock: int
    begin_s: float
    end_s: float


@dataclass(frozen=True)
class Excitation:
    """What a recording excites: the scale of what can be searched for in it.

    Attributes
    ----------
    lowest, travel : float
        The lowest position, and how far it is from there to the highest.
    speed, acceleration, effort : float
        Peak, rms, peak.
    typical_speed : float
        Rms.
    resolution : float
        Of the encoder.
    duration_s, cutoff_hz : float
    sampling_s : float
        Sampling period of the recording.
    base : (4,) array
        Base parameters, fitted without any effect.
    spans : tuple of Span
        One for each clock of the recordings.
    """

    lowest: float
    travel: float
    speed: float
    typical_speed: float
    acceleration: float
    effort: float
    resolution: float
    duration_s: float
    cutoff_hz: float
    sampling_s: float
    base: Array
    spans: tuple[Span, ...]

    @property
    def turning_rate(self) -> float:
        """Angular frequency (rad/s) of a sine with the same typical speed and acceleration."""
        return self.acceleration / self.typical_speed

    @property
    def quarter_turn_s(self) -> float:
        """Of such a sine: what is later by more has the other sign."""
        return float(0.5 * np.pi / self.turning_rate)

    def periods(self, lowest: float, highest: float, step: float = 0.5) -> Array:
        """Periods of position, from `lowest` to `highest` waves over the travel, `step` apart.

        They end where the filter no longer passes the waves.
        """
        passed = 2.0 * self.cutoff_hz * self.travel / self.typical_speed
        count = max(2, int((min(highest, passed) - lowest) / step) + 1)
        return np.asarray(self.travel / (lowest + step * np.arange(count)))

    def waves(self, highest: float) -> dict[str, Array]:
        """Waves to search, from a quarter of one over the travel to so many, about its middle."""
        periods = self.periods(0.25, highest, step=0.25)
        middle = self.lowest + 0.5 * self.travel
        return {"period": periods, "centre": np.full(len(periods), middle)}

    def places(self) -> dict[str, Array]:
        """Places along the travel, half a width apart.

        Widths are a twenty-fifth of the travel to a third: the widest, and others that the filter
        passes.
        """
        passed = 0.3 * self.typical_speed / self.cutoff_hz
        *narrower, widest = self.travel * np.array([0.04, 0.08, 0.16, 0.32])
        widths = [*(w for w in narrower if w >= passed), widest]
        steps = [np.arange(0.5 * w, self.travel, 0.5 * w) for w in widths]
        return {
            "place": self.lowest + np.concatenate(steps),
            "width": np.repeat(widths, [len(step) for step in steps]),
        }


class Yardstick(Enum):
    """What the size of an effect is measured by, on the machine that has it."""

    TURN = "its own period"
    WAVE = "its own wave"
    TRAVEL = "the travel"
    EFFORT = "the peak effort"
    INERTIA = "the inertia that the drive could have moved"

    def on(self, values: Values, excitation: Excitation) -> Array | float:
        """Its value, for values (D,) of the effect."""
        if self is Yardstick.TURN:
            return values["period"]
        if self is Yardstick.WAVE:
            return np.hypot(values["cosine"], values["sine"])
        if self is Yardstick.TRAVEL:
            return excitation.travel
        if self is Yardstick.EFFORT:
            return excitation.effort
        return excitation.effort / max(excitation.acceleration, _TINY)


class Largest(NamedTuple):
    """The largest size that an effect has on a machine.

    Attributes
    ----------
    parameters : tuple of str
        The size is the root of the sum of their squares.
    share : float
    of : Yardstick
    """

    parameters: tuple[str, ...]
    share: float
    of: Yardstick

    def holds(self, values: Values, excitation: Excitation) -> bool:
        """Whether values (D,) are no larger."""
        size = np.sqrt(sum(np.square(values[name]) for name in self.parameters))
        return bool(np.all(size <= self.share * self.of.on(values, excitation)))

    def __str__(self) -> str:
        names = " and ".join(f"`{name}`" for name in self.parameters)
        return f"{names} {self.share:g} of {self.of.value}"


def _no_grid(excitation: Excitation) -> dict[str, Array]:
    return {}


def _always(values: Values, excitation: Excitation) -> bool:
    return True


def _never(values: Values, excitation: Excitation) -> bool:
    return False


def _not_degenerate(values: Values, inertia: float) -> str:
    return ""


def heavier_than(inertia: float, values: Values) -> str:
    """Why a load is no part of an axis of this inertia; nothing where it may be."""
    load = float(np.max(values["load_inertia"]))
    if not 0.0 < inertia < load:
        return ""
    return f"its load would be {load / inertia:.1f} times the inertia of the whole axis"


@dataclass(frozen=True)
class SearchSpec:
    """How the diagnosis searches for one effect.

    Attributes
    ----------
    forms : tuple of Form
        The simplest first.
    signature : str
        What tells the effect from others.
    alternatives : tuple of effect names
        Effects that look like it.
    experiment : str
        The motion that shows it, and tells it from its alternatives.
    grid : callable
        From an `Excitation` to values of the nonlinear parameters, arrays of one length. A form
        without nonlinear parameters takes the first values, and those that it knows.
    physical : callable
        Whether values (a mapping of arrays) may be seen in a recording of an `Excitation`.
    largest : tuple of Largest
        The sizes that a machine can have, in units of its own.
    discrepancy : float
        Share of its effort by which the formula may be off on a machine that has the effect. What
        the residual holds within that share is no evidence of another effect. A judgement, not a
        measurement.
    open_ended : tuple of parameter names
        Nonlinear parameters whose grid ends where more makes no difference: the best value may lie
        on the edge.
    between_recordings : tuple of parameter names
        Times whose grid begins, of several recordings, where one begins: the best may lie there.
    essential : tuple of parameter names
        Parameters without which it is another effect, so that the data have to determine them.
    needs_reversals : bool
        Whether the effect shows only where the motion turns.
    curve : (str, str) or None
        What a curve is of, and over which quantity, that says what the effect does: where such a
        curve describes the effort better than the formula, it may be this effect all the same.
    repeats : bool
        Whether a drive may have several terms of it at once.
    shares_friction : bool
        Whether it makes up the axis's friction together with the base model's: then only the sum
        has to be positive.
    sound : callable
        Whether values (a mapping of arrays) are those that every sound drive has as well.
    degenerate : callable
        Why values are those of another effect, to which this one tends, or of no axis with that
        inertia; nothing where they are neither.

    Examples
    --------
    >>> import edge_ident
    >>> edge_ident.SearchSpec(forms=(edge_ident.Form(("level",)),)).linear
    frozenset({'level'})
    """

    forms: tuple[Form, ...] = ()
    signature: str = ""
    alternatives: tuple[str, ...] = ()
    experiment: str = ""
    grid: Callable[[Excitation], dict[str, Array]] = _no_grid
    physical: Callable[[Values, Excitation], bool] = _always
    largest: tuple[Largest, ...] = ()
    discrepancy: float = 0.03
    open_ended: tuple[str, ...] = ()
    between_recordings: tuple[str, ...] = ()
    essential: tuple[str, ...] = ()
    needs_reversals: bool = False
    curve: tuple[str, str] | None = None
    repeats: bool = False
    shares_friction: bool = False
    sound: Callable[[Values, Excitation], bool] = _never
    degenerate: Callable[[Values, float], str] = _not_degenerate

    def possible(self, values: Values, excitation: Excitation) -> bool:
        """Whether a machine can have values (a mapping of arrays), and the recording show them."""
        fits = all(largest.holds(values, excitation) for largest in self.largest)
        return fits and self.physical(values, excitation)

    @property
    def linear(self) -> frozenset[str]:
        """Linear parameters of any form."""
        return frozenset(name for form in self.forms for name in form.linear)
