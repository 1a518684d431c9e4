"""What a recording may have of its own and is no cause: a filter, a clock, a zero, a scale."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
import scipy.optimize
import scipy.signal
from numpy.typing import NDArray

from edge_ident.diagnosis.elsewhere import (
    fitted_anew,
    lasting_terms,
    leaves_structure,
    residual_elsewhere,
)
from edge_ident.diagnosis.fit.candidates import one_way, own_columns, own_limits
from edge_ident.diagnosis.fit.fitting import FittedModel, fit
from edge_ident.diagnosis.fit.held_out import model_discrepancy
from edge_ident.diagnosis.fit.linear import solve_within
from edge_ident.diagnosis.fit.summary import nonzero_rms
from edge_ident.diagnosis.measures import TOLERANCE
from edge_ident.diagnosis.prepare.axis_data import AxisData, Segment
from edge_ident.diagnosis.prepare.timing import SHARE_OF_DELAY, whole_shift
from edge_ident.diagnosis.result import AxisDiagnosis
from edge_ident.diagnosis.select.acceptance import about_alike
from edge_ident.diagnosis.select.search import independent_samples
from edge_ident.diagnosis.select.second_looks import OwnScale
from edge_ident.diagnosis.select.selection import Selected, selected_model
from edge_ident.diagnosis.select.thresholds import ADDED_TERM, DECISIVE
from edge_ident.estimation.least_squares import coloured_std
from edge_ident.estimation.trust import Finding
from edge_ident.model.effects import named
from edge_ident.model.model import PARAMETERS, POSITIVE, AxisModel, regressor
from edge_ident.signals.conditioning import unit_length
from edge_ident.signals.metrics import rms
from edge_ident.signals.recording import Recording
from edge_ident.signals.timing import CERTAIN, REACH_S, beyond_limit
from edge_ident.support.words import listed

Array = NDArray[np.float64]


# An effort that was smoothed before it was recorded, and the position was not.
#
# An amplifier's measured current often passes a low-pass filter. What then lags behind the motion
# is late at each frequency, and the friction turns over gradually where the axis turns. So the base
# model behind a filter looks like a spring, a soft coupling or presliding.

_ORDERS: Final = (1, 2)
"""Of the filters that are tried; those of amplifiers are hardly steeper."""
_LAGS: Final = 12
"""Time constants that are tried for each, in a geometric series."""
_MORE: Final = 2
"""Parameters beside those of the base model: the time constant and the order."""


def filter_instead(selected: Selected, tolerance: float) -> Finding | None:
    """What forbids to name causes where a low-pass filter of the effort explains, alone, about as
    much: most of what the base model leaves beyond noise.

    Where nothing was selected, it has to explain the effort: else a search goes on.

    Parameters
    ----------
    selected : Selected
    tolerance : float
        Smallest share of the rms effort that is worth naming.
    """
    search, model, data = selected.search, selected.supported.model, selected.search.data
    if selected.late or search.criterion.room(selected.start, search.noise) <= ADDED_TERM.value:
        return None
    least_s = min(s.raw_period_s for s in data.segments)
    most_s = min(REACH_S, search.excitation.quarter_turn_s)
    error, hz = min(_best(data, order, least_s, max(most_s, 2.0 * least_s)) for order in _ORDERS)
    beyond, of_base = (max(e - search.noise, 0.0) for e in (error, selected.start.error))
    costs = search.criterion.misfit(error) + _MORE * math.log(search.criterion.samples)
    if beyond > (1.0 - SHARE_OF_DELAY) * of_base:
        return None
    if costs > search.criterion.value(model) + DECISIVE.value:
        return None
    filtered = replace(selected.start, error=error)
    if not model.terms and leaves_structure(data, selected.start, filtered, tolerance):
        return None
    left = math.sqrt(error / np.count_nonzero(data.valid)) / nonzero_rms(data.effort[data.valid])
    return Finding(
        "undetermined_filter",
        f"behind a low-pass filter of {hz:.2g} Hz the effort fits the motion about as well without "
        f"any cause: {left:.1%} of it is left. The effort may be smoothed, and the position not",
        "look for a filter of the measured current or torque, and switch it off or give it a "
        "higher frequency; record a motion of several frequencies, such as --motion multisine",
        blocks=True,
    )


def _best(data: AxisData, order: int, least_s: float, most_s: float) -> tuple[float, float]:
    """Sum of squares behind the best filter of an order, and where that falls by 3 dB, in Hz."""
    logs = np.linspace(math.log(least_s), math.log(most_s), _LAGS)
    best = int(np.argmin([_left(data, order, math.exp(log)) for log in logs]))
    around = logs[max(best - 1, 0)], logs[min(best + 1, _LAGS - 1)]
    found = scipy.optimize.minimize_scalar(
        lambda log: _left(data, order, math.exp(log)), bounds=around, options={"xatol": 1e-3}
    )
    falls = math.sqrt(2.0 ** (1.0 / order) - 1.0) / (math.tau * math.exp(found.x))
    return float(found.fun), falls


def _left(data: AxisData, order: int, lag_s: float) -> float:
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
    rows = regressor(segment.motion.velocity, segment.motion.acceleration).T
    kept = math.exp(-segment.period_s / lag_s)
    for _ in range(order):
        before = kept * rows[:, :1]
        rows = scipy.signal.lfilter([1.0 - kept], [1.0, -kept], rows, zi=before)[0]
    return np.asarray(segment.filter(rows)).T


# Whether the effort of one recording is late beside its motion, and that of another is not.
#
# A delay is common to all recordings of a machine. One that a single file has is that of its clock,
# and no model of all of them has it.


def may_differ(data: AxisData, model: AxisModel) -> bool:
    """Whether some recordings are late, or early, beside the terms of a model, and others not."""
    late = {
        s.motion.clock: beyond_limit(whole_shift(s, model), s.raw_period_s) for s in data.segments
    }
    return any(late.values()) and not all(late.values())


def timing_differs(alone: Mapping[str, AxisDiagnosis]) -> list[Finding]:
    """Which recordings have a delay of their own, from the diagnosis of each alone.

    Parameters
    ----------
    alone : mapping of source to AxisDiagnosis
    """
    delays = {
        source: float(cause.term.values[delay])
        for source, found in alone.items()
        for cause in found.causes
        if (delay := named(cause.term.effect).effort_delay)
    }
    in_step = [source for source in alone if source not in delays]
    if not in_step:
        return []
    return [
        Finding(
            "timing_differs",
            f"the effort of {source} is {1e3 * abs(delay):.3g} ms "
            f"{'late' if delay > 0.0 else 'early'}, and that of {in_step[0]} is not: no model fits "
            "both",
            "record both columns of all files by one clock, or diagnose each file alone",
            blocks=False,
        )
        for source, delay in delays.items()
    ]


# Whether the position of one recording counts from another zero than that of another.
#
# What depends on the position, such as a weight or a ripple, then stands elsewhere, and no model of
# both recordings has it. With one shift, a model of the first recording fits the other about as
# well as one of its own. A ripple alone tells the shift but for whole periods: the smallest is
# named.

_PER_LENGTH: Final = 0.5
"""Step of the shifts that are tried, of the length over which a model bends."""
_MOST_STEPS: Final = 200
"""To either side."""
_MOST_REFINED: Final = 12
"""Least misfits along the shifts, the nearest to none, that are made exact."""
_PROBE: Final = 1e-4
"""Of the travel: a shift that shows how a model bends along the position."""


@dataclass(frozen=True)
class OtherZero:
    """The position of a recording reads more than it would from the zero of another.

    Attributes
    ----------
    place : int
        Of the recording, or of its first part.
    shift : float
        In the unit of the position.
    """

    place: int
    shift: float


def zero_instead(selected: Selected, tolerance: float) -> OtherZero | None:
    """Another zero of one recording than of the first, by which the model of the first alone fits
    the other about as well as one of its own would; None where there is none.

    Parameters
    ----------
    selected : Selected
        A model of all recordings that leaves structure.
    tolerance : float
        Smallest share of the rms effort that is worth naming.
    """
    data = selected.search.data
    clocks = [s.motion.clock for s in data.segments]
    reference, *others = dict.fromkeys(clocks)
    if not others:
        return None
    first = data.of_clock(reference)
    alone = selected_model(first, selected.start.template).supported.model
    for clock in others:
        shift = shift_of_zero(first, data.of_clock(clock), alone, tolerance)
        if shift is not None:
            return OtherZero(clocks.index(clock), shift)
    return None


def zero_differs(
    recording: Recording, reference: Recording, name: str, shift: float, *, blocks: bool
) -> Finding:
    """What is said of an axis whose position another zero shifts, and may forbid to name causes:
    it would hide them or make them up."""
    unit = reference.axes[name].position_unit
    return Finding(
        "zero_differs",
        f"the position of {recording.source} is {shift:+.3g} {unit} from that of "
        f"{reference.source} at the same place: so shifted, one model fits both",
        f"give both the same zero: add {-shift:.3g} {unit} to the position of {recording.source}",
        blocks=blocks,
    )


def shift_of_zero(
    first: AxisData, other: AxisData, model: FittedModel, tolerance: float
) -> float | None:
    """By how much the position of another recording reads more than that of the first.

    Parameters
    ----------
    model : FittedModel
        Of the first alone.

    Returns
    -------
    float or None
        None where one model fits both without a shift, or what the shift changes is not worth
        naming; and where models of their own leave less than one with a shift does by more than is
        worth naming, or than a small share of what it explains: what its formulas may be off.
    """
    zero = _Zero(other, model)
    terms = lasting_terms(model)
    if (near := zero.near()) is None:
        return None

    def both(shift: float) -> AxisData:
        return first.joined(other.from_zero(shift))

    def of_both(shift: float) -> FittedModel:
        return fit(both(shift), model.template, model.base, terms)

    best = scipy.optimize.minimize_scalar(
        lambda shift: of_both(shift).error, bounds=near, method="bounded"
    )
    shift = float(best.x)
    shifted, unshifted = of_both(shift), of_both(0.0)
    gain, count = unshifted.error - shifted.error, np.count_nonzero(other.valid)
    least = tolerance * nonzero_rms(other.effort[other.valid])
    if gain <= count * least**2 or not _decided(both(shift), shifted, unshifted):
        return None
    compared = count + np.count_nonzero(first.valid)
    here, there = (fit(data, model.template, model.base, terms).error for data in (first, other))
    if not terms:  # known ripples have no size of their own
        there = min(there, here * count / (compared - count))
    effects = [t.effect for t in model.axis.terms[1:]]
    off = max(named(effect).search.discrepancy for effect in effects)
    alike = about_alike(shifted.error - here - there, gain, off, compared * least**2)
    return shift if alike else None


def _decided(data: AxisData, shifted: FittedModel, unshifted: FittedModel) -> bool:
    """Whether the criterion decidedly prefers the model with a shift."""
    samples, off = independent_samples(data, shifted), model_discrepancy(data, shifted)
    gain = samples * np.log((unshifted.error + off) / (shifted.error + off))
    return bool(gain - np.log(samples) > DECISIVE.value)


@dataclass(frozen=True)
class _Zero:
    """Another recording beside a model, along the shifts of its position."""

    other: AxisData
    model: FittedModel

    def left(self, shift: float) -> float:
        """Sum of squares that the model leaves, with an offset and a timing of the recording."""
        anew = fitted_anew(self.model)
        left = residual_elsewhere(self.other, self.model, anew, self.other.from_zero(shift))
        return float(left @ left)

    def near(self) -> tuple[float, float] | None:
        """Two shifts around the smallest that leaves about least; None where no shift does anything
        that no offset does."""
        found = [*self._refined()]
        if not found:
            return None
        alike = 1.0 + DECISIVE.value / np.count_nonzero(self.other.valid)
        most = alike * min(error for _, _, error in found)
        around, _, _ = min((e for e in found if e[2] <= most), key=lambda e: abs(e[1]))
        return around

    def _refined(self) -> Iterator[tuple[tuple[float, float], float, float]]:
        """The shifts nearest to none that leave less than two around them: those, it, and what it
        leaves."""
        travel = float(np.ptp(self.other.of_motion("position")))
        reach = max(travel, np.pi) if self.model.axis.position_unit == "rad" else travel
        length = self._length(_PROBE * travel)
        if not 0.0 < length <= reach:
            return
        step = _PER_LENGTH * length
        count = min(int(reach / step), _MOST_STEPS) + 1
        shifts = step * np.arange(-count, count + 1)
        left = np.array([self.left(float(shift)) for shift in shifts])
        inner = np.nonzero((left[1:-1] <= left[:-2]) & (left[1:-1] <= left[2:]))[0] + 1
        for k in sorted(inner, key=lambda k: abs(shifts[k]))[:_MOST_REFINED]:
            around = (float(shifts[k - 1]), float(shifts[k + 1]))
            best = scipy.optimize.minimize_scalar(self.left, bounds=around, method="bounded")
            yield around, float(best.x), float(best.fun)

    def _length(self, probe: float) -> float:
        """Over which what depends on the position bends: of a ripple, its period over 2 pi;
        zero where nothing depends on it, and very long where nothing bends."""
        less, here, more = (
            self.other.from_zero(s).predicted(self.model.axis) for s in (-probe, 0.0, probe)
        )
        slope, bend = (more - less) / 2.0, more - 2.0 * here + less
        at = self.other.valid
        return probe * rms(slope[at]) / max(rms(bend[at]), np.finfo(float).eps * rms(here[at]))


# In what base parameters several recordings of an axis differ, in words.

_OF_COLUMN: Final = {
    "effort": ("a motion", "torque constant, rated torque and units"),
    "position": ("an effort", "gear ratio, resolution of the encoder and units"),
    "time": ("an effort", "sampling period and units"),
}
"""What is the same beside a column of another scale, and what to compare."""


_SHARED: Final = Finding(
    "offset_shared",
    "each recording moves one way, so one offset is taken for all: Coulomb friction is wrong by as "
    "much as their offsets differ",
    "record one motion that goes both ways, or do not tare the effort in between",
    blocks=False,
)


def own_values(
    recordings: Sequence[Recording], name: str, data: AxisData, model: FittedModel
) -> list[Finding]:
    """Say by how much, where that is certain and worth naming; nothing otherwise.

    Parameters
    ----------
    recordings : sequence of Recording
    name : str
        Of the axis.
    data : AxisData
    model : FittedModel
        Fitted to all of them.
    """
    if len(recordings) < 2:
        return []
    if one_way(data):
        return [_SHARED]
    offsets, frictions = [], []
    last, effort_unit = recordings[-1].source, recordings[-1].axes[name].effort_unit
    for parameter, source, value in _certain(recordings, data, model):
        if parameter == "offset":
            offsets.append(f"{value:+.3g} {effort_unit} in {source}")
        else:
            share = value / float(model.base[PARAMETERS.index(parameter)])
            frictions.append(f"{parameter.replace('_', ' ')} {share:+.1%} in {source}")
    found = []
    if offsets:
        found.append(
            Finding(
                "offsets_differ",
                "each recording was fitted with its own offset of the effort, because they differ: "
                f"{listed(offsets)}, relative to {last}",
                "let the machine warm up before each recording, and do not tare the effort in "
                "between",
                blocks=False,
            )
        )
    if frictions:
        found.append(
            Finding(
                "friction_differs",
                "each recording was fitted with its own friction, because they differ: "
                f"{listed(frictions)}, relative to {last}; the model has the mean",
                "let the machine warm up before each recording: friction falls as it does",
                blocks=False,
            )
        )
    return found


def scale_differs(source: str, scale: OwnScale) -> Finding:
    """What forbids to name causes that one factor of a recording's column explains as well.

    Parameters
    ----------
    source : str
        The recording.
    scale : OwnScale
    """
    such, compare = _OF_COLUMN[scale.column]
    return Finding(
        "scale_differs",
        f"the {scale.column} of {source} is {scale.factor:.3g} times what the other recordings "
        f"have for such {such}: with that factor, one model fits all",
        f"compare {compare} of the recordings; if they are the same, the machine is not",
        blocks=True,
    )


def _certain(
    recordings: Sequence[Recording], data: AxisData, model: FittedModel
) -> Iterator[tuple[str, str, float]]:
    """Own parameters that certainly differ by what is worth naming: name, recording and value."""
    first = len(PARAMETERS) + len(recordings)
    columns = model.jacobian[data.valid]
    unit, length = unit_length(columns)
    std = coloured_std(unit, (data.effort - model.predicted)[data.valid]) / length
    scale = rms(data.effort[data.valid])
    places = range(first, model.base_columns.stop)
    each = [(parameter, r.source) for parameter in data.own for r in recordings[:-1]]
    for place, (parameter, source) in zip(places, each, strict=True):
        value = float(model.linear_parameters[place])
        size = abs(value) * rms(columns[:, PARAMETERS.index(parameter)])
        if abs(value) > CERTAIN * std[place] and size > TOLERANCE * scale:
            yield parameter, source, value
