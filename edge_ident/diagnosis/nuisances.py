"""What a recording may have of its own and is no cause: a clock, a filter, a zero, a scale.

Each nuisance changes what was recorded by one number. One procedure serves all: the number at which
the model leaves least, refined between the values that are tried; what is left then, against what
the selected model leaves; and the finding, which forbids to name a cause.
"""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Final, NamedTuple

import numpy as np
import scipy.linalg
import scipy.optimize
from numpy.typing import NDArray

from edge_ident.diagnosis.elsewhere import (
    lasting_terms,
    leaves_structure,
)
from edge_ident.diagnosis.fit.candidates import one_way, own_columns, own_limits
from edge_ident.diagnosis.fit.fitting import FittedModel, FittedTerm, fit
from edge_ident.diagnosis.fit.held_out import model_discrepancy, standard_deviations
from edge_ident.diagnosis.fit.linear import solve_within
from edge_ident.diagnosis.fit.summary import nonzero_rms
from edge_ident.diagnosis.measures import TOLERANCE
from edge_ident.diagnosis.prepare.axis_data import AxisData, Segment
from edge_ident.diagnosis.prepare.timing import SHARE_OF_DELAY
from edge_ident.diagnosis.select.acceptance import about_alike
from edge_ident.diagnosis.select.search import independent_samples
from edge_ident.diagnosis.select.second_looks import along_one_sinusoid, shift_step_s
from edge_ident.diagnosis.select.selection import Selected, fitted_base, selected_model
from edge_ident.diagnosis.select.thresholds import ADDED_TERM, DECISIVE, STRUCTURE
from edge_ident.estimation.trust import Finding
from edge_ident.model.effects import named
from edge_ident.model.model import PARAMETERS, POSITIVE, regressor
from edge_ident.model.search import SearchSpec
from edge_ident.signals.metrics import rms
from edge_ident.signals.recording import Recording
from edge_ident.signals.timing import CERTAIN, REACH_S
from edge_ident.support.words import listed

Array = NDArray[np.float64]

_PER_LENGTH: Final = 0.5
"""Step of the sizes that are tried, of the length over which what they change bends."""
_MOST_STEPS: Final = 200
"""To either side."""
_MOST_REFINED: Final = 12
"""Sizes with the least sums of squares, the nearest to none, that are made exact."""


def _least(
    left: Callable[[float], float], tried: Array, samples: int
) -> tuple[float, float] | None:
    """The smallest size that leaves about least, and the sum of squares that it leaves; None where
    there is none inside those that are tried (k,)."""
    errors = np.array([left(float(size)) for size in tried])
    inner = np.nonzero((errors[1:-1] <= errors[:-2]) & (errors[1:-1] <= errors[2:]))[0] + 1
    found = []
    for k in sorted(inner, key=lambda k: abs(tried[k]))[:_MOST_REFINED]:
        around = tried[k - 1], tried[k + 1]
        best = scipy.optimize.minimize_scalar(left, bounds=around, method="bounded")
        found.append((float(best.x), float(best.fun)))
    most = (1.0 + DECISIVE / samples) * min((error for _, error in found), default=0.0)
    alike = [each for each in found if each[1] <= most]
    return min(alike, key=lambda each: abs(each[0]), default=None)


# What the effort of all recordings may be: behind a filter, or of another clock than the motion.
#
# An amplifier's measured current often passes a low-pass filter. What then lags behind the motion
# is late at each frequency, and the friction turns over gradually where the axis turns. So the base
# model behind a filter looks like a spring, a soft coupling or presliding. Along one sinusoid, a
# shift of the effort does as well.

_ORDERS: Final = (1, 2)
"""Of the filters that are tried; those of amplifiers are hardly steeper."""


class _Instead(NamedTuple):
    """A change of the effort that may explain what causes do: what the base model leaves at a size,
    the sizes that are tried, how many parameters they are worth, and what is said of one, with what
    is left."""

    left: Callable[[float], float]
    tried: Array
    parameters: int
    said: Callable[[float, str], Finding]


def instead_of_causes(selected: Selected, tolerance: float) -> Finding | None:
    """What forbids to name causes where a change of the effort explains, alone, about as much: most
    of what the base model leaves beyond noise.

    Where nothing was selected, it has to explain the effort: else a search goes on. Where a delay
    was, a filter has to be decidedly better: by either the effort is late.
    """
    search, start, data = selected.search, selected.start, selected.search.data
    model, count = selected.supported.model, int(np.sum(data.valid))
    noise = search.noise
    if search.room <= ADDED_TERM:
        return None
    # two that leave no structure are not told apart by what they leave
    least = STRUCTURE**2 * noise
    most = search.value(replace(model, error=max(model.error, least)))
    most += -DECISIVE if selected.late else DECISIVE
    of_base = max(start.error - noise, 0.0)
    for one in (*_another_clock(selected), *_behind_filters(selected)):
        size, error = _least(one.left, one.tried, count) or (0.0, start.error)
        value = search.misfit(max(error, least)) + one.parameters * math.log(search.samples)
        if value > most or error - noise > (1.0 - SHARE_OF_DELAY) * of_base:
            continue
        changed = replace(start, error=error)
        if model.terms or not leaves_structure(data, start, changed, tolerance):
            left = math.sqrt(error / count) / nonzero_rms(data.effort[data.valid])
            return one.said(size, f"{left:.1%} of it is left")
    return None


def _another_clock(selected: Selected) -> Iterator[_Instead]:
    """Along one sinusoid, an effort with a clock of its own."""
    from_s, data = along_one_sinusoid(selected), selected.search.data
    if selected.late or not from_s:  # a delay is such a clock
        return
    step_s = shift_step_s(data)
    inner, count = data.without_ends(abs(from_s) + 2.0 * step_s), np.count_nonzero(data.valid)

    def left(late_s: float) -> float:
        segments = tuple(s.in_step(late_s) for s in inner.segments)
        moved = fitted_base(inner.with_efforts_of(segments), selected.start.template)
        return moved.error * count / np.count_nonzero(inner.valid)

    tried = np.asarray(from_s + step_s * np.arange(-2, 3), dtype=np.float64)
    yield _Instead(left, tried, 1, _shifted)


def _shifted(late_s: float, rest: str) -> Finding:
    return Finding(
        "undetermined_delay",
        f"{'later' if late_s > 0.0 else 'earlier'} by {abs(late_s):.2g} s the effort fits the "
        f"motion about as well without any cause: {rest}. The motion has one frequency, and so "
        "cannot tell a cause from two columns with clocks of their own",
        "record a motion of several frequencies, such as --motion multisine, and both columns at "
        "once",
        blocks=True,
    )


def _behind_filters(selected: Selected) -> Iterator[_Instead]:
    """A low-pass filter of the effort, of each order; its size is the logarithm of its lag, in
    sampling periods."""
    data = selected.search.data
    period_s = min(s.raw_period_s for s in data.segments)
    most_s = max(min(REACH_S, selected.search.excitation.quarter_turn_s), 2.0 * period_s)
    tried = np.arange(0.0, math.log(most_s / period_s) + _PER_LENGTH, _PER_LENGTH)
    for order in _ORDERS:

        def left(size: float, order: int = order) -> float:
            return _left_behind(data, order, period_s * math.exp(size))

        # two parameters: the order was chosen, too
        yield _Instead(left, tried, 2, partial(_smoothed, order, period_s))


def _smoothed(order: int, period_s: float, size: float, rest: str) -> Finding:
    hz = math.sqrt(2.0 ** (1.0 / order) - 1.0) / (math.tau * period_s * math.exp(size))
    return Finding(
        "undetermined_filter",
        f"behind a low-pass filter of {hz:.2g} Hz the effort fits the motion about as well without "
        f"any cause: {rest}. The effort may be smoothed, and the position not",
        "look for a filter of the measured current or torque, and switch it off or give it a "
        "higher frequency; record a motion of several frequencies, such as --motion multisine",
        blocks=True,
    )


def _left_behind(data: AxisData, order: int, lag_s: float) -> float:
    """Sum of squares that the base model leaves behind filters of one time constant."""
    columns = np.vstack([_lagging(s, order, lag_s) for s in data.segments])
    columns = np.hstack([columns, own_columns(data)])[data.valid]
    effort = data.effort[data.valid]
    early, late = own_limits(data, shifted=True)
    low = np.append(np.where(POSITIVE, 0.0, -np.inf), early)
    high = np.append(np.full(len(PARAMETERS), np.inf), late)
    found = solve_within(columns, effort, low, high).solution
    return float(np.sum((effort - columns @ found) ** 2))


def _lagging(segment: Segment, order: int, lag_s: float) -> Array:
    """Columns (n, 4) of the base model behind so many first-order filters."""
    columns = regressor(segment.motion.velocity, segment.motion.acceleration)
    kept = math.exp(-segment.period_s / lag_s)
    recursion = np.array([[1.0], [-kept]]) * np.ones(len(columns))
    for _ in range(order):
        columns[1:] *= 1.0 - kept  # the first is what came before it
        columns = scipy.linalg.solve_banded((1, 0), recursion, columns)
    return np.asarray(segment.filter(columns.T)).T


# What one recording may have beside another: another zero of its position, another clock of its
# effort, and a column in another scale.
#
# From another zero, what depends on the position stands elsewhere. A torque constant or a gain that
# differs makes inertia and all friction differ by one factor; a gear ratio or a resolution of the
# encoder, inertia and viscous friction; a sampling period, the inertia by its square. A payload and
# friction of their own explain that, too, and need more parameters.
#
# With one number, a model of the first recording fits the other about as well as one of its own. A
# ripple alone tells a zero but for whole periods: the smallest is named.

_PROBE: Final = 1e-4
"""Of the travel: a shift that shows how a model bends along the position."""
_LARGEST_FACTOR: Final = 1e3
"""Of a column: that of a unit with a prefix."""
_POWERS: Final[Mapping[str, Mapping[str, int]]] = {
    "effort": {},
    "position": {"position": -1, "velocity": -1, "acceleration": -1},
    "time": {"time_s": -1, "velocity": 1, "acceleration": 2},
}
"""Of the factor of a column, by which a motion is multiplied to take it back."""
_SCALED: Final = (
    "scale_differs",
    "the {kind} of {source} is {factor:.3g} times what {other} has for such {same}: with that "
    "factor, one model fits both",
    "compare {compare} of the recordings; if they are the same, the machine is not",
)
_SAID: Final = {
    "zero": (
        "zero_differs",
        "the position of {source} is {size:+.3g} {unit} from that of {other} at the same place: so "
        "shifted, one model fits both",
        "give both the same zero: add {back:.3g} {unit} to the position of {source}",
    ),
    "late": (
        "timing_differs",
        "the effort of {source} is {ms:.3g} ms {way}, beside its motion, than that of {other}: so "
        "shifted, one model fits both",
        "record both columns of all files by one clock, or diagnose each file alone",
    ),
} | dict.fromkeys(_POWERS, _SCALED)
"""Code, message and next step of each kind of difference."""
_COMPARE: Final = {
    "effort": ("a motion", "torque constant, rated torque and units"),
    "position": ("an effort", "gear ratio, resolution of the encoder and units"),
    "time": ("an effort", "sampling period and units"),
}
"""What is the same beside a column of another scale, and what to compare."""


@dataclass(frozen=True)
class Difference:
    """A column of one recording is not as in another.

    Attributes
    ----------
    kind : {"zero", "late", "effort", "position", "time"}
        Another zero of the position, a later effort, or a larger column.
    size : float
        By how much, in the unit of the position, in s, or the factor's logarithm.
    """

    kind: str
    size: float

    @property
    def effort_factor(self) -> float:
        """By which the effort is larger."""
        return math.exp(self.size) if self.kind == "effort" else 1.0

    def taken_back(self, data: AxisData) -> AxisData:
        """The data of the recording without the difference."""
        if self.kind == "zero":
            return data.from_zero(self.size)
        if self.kind == "late":
            moved = (replace(s.in_step(self.size), applied_s=0.0) for s in data.segments)
            return data.with_efforts_of(tuple(moved))
        return data.with_efforts_of(tuple(map(self._scaled_back, data.segments)))

    def _scaled_back(self, segment: Segment) -> Segment:
        factor, motion = math.exp(self.size), segment.motion
        powers = _POWERS[self.kind].items()
        scaled = {name: getattr(motion, name) * factor**power for name, power in powers}
        efforts = ("raw_effort", "effort", "timing_column")
        made = {name: getattr(segment, name) / self.effort_factor for name in efforts}
        return replace(
            segment, motion=replace(motion, **scaled), cache={} if scaled else segment.cache, **made
        )

    def finding(
        self, recording: Recording, reference: Recording, name: str, *, blocks: bool
    ) -> Finding:
        """What is said of an axis, and may forbid to name causes: it would hide them or make them
        up."""
        same, compare = _COMPARE.get(self.kind, ("", ""))
        values = {
            "kind": self.kind,
            "source": recording.source,
            "other": reference.source,
            "size": self.size,
            "back": -self.size,
            "ms": 1e3 * abs(self.size),
            "way": "later" if self.size > 0.0 else "earlier",
            "factor": math.exp(self.size) if self.kind in _POWERS else 1.0,
            "unit": reference.axes[name].position_unit,
            "same": same,
            "compare": compare,
        }
        code, message, next_step = _SAID[self.kind]
        return Finding(code, message.format(**values), next_step.format(**values), blocks=blocks)


def differences(
    recordings: Sequence[Recording], name: str, selected: Selected, tolerance: float, *, anew: bool
) -> list[Finding]:
    """What forbids to name causes of several recordings, if a column of one is not as in the first.

    Parameters
    ----------
    selected : Selected
        Of all recordings.
    anew : bool
        Whether a model is selected from the first recording alone: that of all leaves structure.
    """
    data, template = selected.search.data, selected.start.template
    clocks = [s.motion.clock for s in data.segments]
    reference, *others = dict.fromkeys(clocks)
    if not others:
        return []
    first = replace(data.of_clock(reference), own=("offset",))
    model = (selected_model(first, template) if anew else selected).supported.model
    for clock in others:
        found = difference(first, data.of_clock(clock), model, tolerance)
        if found is not None:
            recording = recordings[clocks.index(clock)]
            return [found.finding(recording, recordings[0], name, blocks=True)]
    return []


def difference(
    first: AxisData, other: AxisData, model: FittedModel, tolerance: float
) -> Difference | None:
    """By what a column of another recording is not as in the first.

    Parameters
    ----------
    model : FittedModel
        Its terms are asked, but for those that are tied to time.

    Returns
    -------
    Difference or None
        None where one model fits both without any, or what it changes is not worth naming; and
        where models of their own leave less than one does with it by more than is worth naming, or
        than a small share of what it explains: what its formulas may be off.
    """
    reach_s = min(REACH_S, first.excitation(model.base).quarter_turn_s)
    pair = _Pair(first, other.without_ends(reach_s), model, lasting_terms(model))
    counts = [int(np.sum(data.valid)) for data in (first, pair.other)]
    if not counts[1]:
        return None
    efforts = [data.effort[data.valid] for data in (first, pair.other)]
    square = (tolerance * nonzero_rms(np.concatenate(efforts))) ** 2
    here, there = (pair.fit(data).error for data in (first, pair.other))
    if not pair.terms:  # known ripples have no size of their own
        there = min(there, here * counts[1] / counts[0])
    unchanged, own = pair.both(Difference("zero", 0.0))[1], here + there
    if unchanged.error - own <= counts[1] * square:
        return None
    found = [each for kind in _SAID if (each := pair.least(kind, reach_s, counts[1])) is not None]
    if not found:
        return None
    best = min(found, key=lambda each: each[1])[0]
    data, changed = pair.both(best)
    gain = unchanged.error - changed.error
    if gain <= counts[1] * square or not _decided(data, changed, unchanged):
        return None
    known = [named(t.effect).search.discrepancy for t in changed.axis.terms[1:]]
    off = max([SearchSpec.discrepancy, *known])
    return best if about_alike(changed.error - own, gain, off, sum(counts) * square) else None


def _decided(data: AxisData, changed: FittedModel, unchanged: FittedModel) -> bool:
    """Whether the criterion decidedly prefers the model with a difference."""
    samples, off = independent_samples(data, changed), model_discrepancy(data, changed)
    gain = samples * np.log((unchanged.error + off) / (changed.error + off))
    return bool(gain - np.log(samples) > DECISIVE)


@dataclass(frozen=True)
class _Pair:
    """Two recordings, and a model with the terms that both may have."""

    first: AxisData
    other: AxisData
    model: FittedModel
    terms: tuple[FittedTerm, ...]

    def fit(self, data: AxisData) -> FittedModel:
        """The model, fitted to other data."""
        return fit(data, self.model.template, self.model.base, self.terms)

    def both(self, difference: Difference) -> tuple[AxisData, FittedModel]:
        """Both recordings without a difference, and one model of them; its error is that of the
        efforts as they were recorded."""
        data = self.first.joined(difference.taken_back(self.other))
        found = self.fit(data)
        factor = np.ones(len(data.effort))
        factor[len(self.first.effort) :] = difference.effort_factor
        left = (factor * (data.effort - found.predicted))[data.valid]
        return data, replace(found, error=float(left @ left))

    def least(self, kind: str, reach_s: float, samples: int) -> tuple[Difference, float] | None:
        """The smallest difference of a kind that leaves about least, and what it leaves; None where
        none does anything that no offset does."""
        best = _least(
            lambda size: self.both(Difference(kind, size))[1].error,
            self._tried(kind, reach_s),
            samples,
        )
        return None if best is None else (Difference(kind, best[0]), best[1])

    def _tried(self, kind: str, reach_s: float) -> Array:
        """Sizes of a kind of difference, to either side of none."""
        length, reach = 1.0, math.log(_LARGEST_FACTOR)
        if kind == "late":
            length, reach = shift_step_s(self.other) / _PER_LENGTH, reach_s
        elif kind == "zero":
            travel = float(np.ptp(self.other.of_motion("position")))
            reach = max(travel, np.pi) if self.model.axis.position_unit == "rad" else travel
            length = self._length(_PROBE * travel)
        if not 0.0 < length <= reach:
            return np.empty(0)
        step = _PER_LENGTH * length
        count = min(int(reach / step), _MOST_STEPS) + 1
        return np.asarray(step * np.arange(-count, count + 1))

    def _length(self, probe: float) -> float:
        """Over which what depends on the position bends: of a ripple, its period over 2 pi;
        zero where nothing depends on it, and very long where nothing bends."""
        axis, at = self.fit(self.first).axis, self.other.valid
        less, here, more = (
            self.other.from_zero(s).predicted(axis)[at] for s in (-probe, 0.0, probe)
        )
        bend = max(rms(more - 2.0 * here + less), np.finfo(float).eps * rms(here))
        return probe * rms(more - less) / 2.0 / bend


# In what base parameters several recordings of an axis differ, in words.

_SHARED: Final = Finding(
    "offset_shared",
    "each recording moves one way, so one offset is taken for all: Coulomb friction is wrong by as "
    "much as their offsets differ",
    "record one motion that goes both ways, or do not tare the effort in between",
    blocks=False,
)


_DIFFER: Final = {
    "offset": ("offsets_differ", "", ", and do not tare the effort in between"),
    "friction": ("friction_differs", "; the model has the mean", ": friction falls as it does"),
}
"""Code, and what is added to message and next step."""


def own_values(
    recordings: Sequence[Recording], name: str, data: AxisData, model: FittedModel
) -> list[Finding]:
    """Say by how much, where that is certain and worth naming; nothing otherwise.

    Parameters
    ----------
    model : FittedModel
        Fitted to all of them.
    """
    if len(recordings) < 2:
        return []
    if one_way(data):
        return [_SHARED]
    last, axis = recordings[-1].source, recordings[-1].axes[name]
    units = dict(zip(PARAMETERS, axis.parameter_units, strict=True))
    differ: dict[str, list[str]] = {}
    for parameter, source, value in _certain(recordings, data, model):
        said = f"{value:+.3g} {units[parameter]} in {source}"
        if parameter == "offset":
            differ.setdefault("offset", []).append(said)
        else:
            differ.setdefault("friction", []).append(f"{parameter.replace('_', ' ')} {said}")
    return [
        Finding(
            _DIFFER[what][0],
            f"each recording was fitted with its own {what}, because they differ: {listed(each)}, "
            f"relative to {last}{_DIFFER[what][1]}",
            f"let the machine warm up before each recording{_DIFFER[what][2]}",
            blocks=False,
        )
        for what, each in differ.items()
    ]


def _certain(
    recordings: Sequence[Recording], data: AxisData, model: FittedModel
) -> Iterator[tuple[str, str, float]]:
    """Own parameters that certainly differ by what is worth naming: name, recording and value."""
    first = len(PARAMETERS) + len(recordings)
    columns, std = model.jacobian[data.valid], standard_deviations(data, model)
    scale = rms(data.effort[data.valid])
    places = range(first, model.base_columns.stop)
    each = [(parameter, r.source) for parameter in data.own for r in recordings[:-1]]
    for place, (parameter, source) in zip(places, each, strict=True):
        value = float(model.linear_parameters[place])
        size = abs(value) * rms(columns[:, PARAMETERS.index(parameter)])
        if abs(value) > CERTAIN * std[place] and size > TOLERANCE * scale:
            yield parameter, source, value
