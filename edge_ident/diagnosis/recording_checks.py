"""Checks of a diagnosed axis: what speaks against any cause, or limits what the recording shows."""

from collections.abc import Iterable, Sequence
from dataclasses import replace
from itertools import combinations
from typing import Final, NamedTuple

import numpy as np
import scipy.optimize
from numpy.typing import NDArray

from edge_ident.diagnosis.fit.candidates import base_regressor
from edge_ident.diagnosis.fit.fitting import FittedModel
from edge_ident.diagnosis.fit.linear import solve
from edge_ident.diagnosis.fit.noise_floor import NoiseFloor
from edge_ident.diagnosis.measures import TOLERANCE
from edge_ident.diagnosis.prepare.axis_data import AxisData, Segment
from edge_ident.errors import DataError
from edge_ident.estimation import least_squares
from edge_ident.estimation.effort_checks import UNRELATED, check_effort, unbounded, unphysical
from edge_ident.estimation.trust import Finding, check_estimate
from edge_ident.model.effects import named
from edge_ident.model.model import PARAMETERS
from edge_ident.signals.conditioning import condition, filtered_regressor, unit_length
from edge_ident.signals.data_checks import check_usable
from edge_ident.signals.filters import ONE_LINE, lowpass, strongest_line
from edge_ident.signals.metrics import rms
from edge_ident.signals.recording import AxisRecord, Recording
from edge_ident.signals.time_stamps import EvenGrid
from edge_ident.support.words import listed, spoken

Array = NDArray[np.float64]


_INDEPENDENT: Final = 0.5
"""Share of the effort's variance along the reference, from which the reference drives the axis."""
_ONE_SPEED: Final = 0.1
"""Standard deviation of the velocity over its mean, up to which an axis keeps one speed."""
_BEYOND_NOISE: Final = 2.0
"""What is left over the noise floor, from which it is no noise whatever the floor's uncertainty."""
_MOST_LEFT: Final = 0.5
"""Of the effort's squares, below which a model explains most of it."""
_OF_POSITION: Final = 0.03
"""Share of the effort up to which it is a law of the position: as far as a formula of the catalogue
may be off (`SearchSpec.discrepancy`)."""
_INDEPENDENT_EXCITATION: Final = (
    "record a motion that does not depend on the axis: a reference that moves, such as "
    "--motion multisine"
)


def findings(
    recordings: Sequence[Recording],
    name: str,
    data: AxisData,
    extended: FittedModel,
    said: Sequence[Finding],
) -> tuple[Finding, ...]:
    """Check one axis.

    Parameters
    ----------
    extended : FittedModel
        That the selection ends with.
    said : sequence of Finding
        What `effort_findings` and `controllers_laws` found in each recording.

    Returns
    -------
    tuple of Finding
        Where one has `blocks`, no cause may be named.
    """
    related = _explains(data, extended)
    found = [f for f in said if f.code != UNRELATED or not related]
    if not any(finding.blocks for finding in found):
        found += _unphysical(data, base_regressor(data), extended)
    found += [*_narrow_excitation(data), *_of_position(data, extended)]
    return _each_once(found)


def controllers_laws(recordings: Sequence[Recording], name: str, data: AxisData) -> list[Finding]:
    """Recordings of an axis whose effort follows from the motion by a controller's law as well as
    by dynamics: no cause may be named then."""
    found: list[Finding] = []
    parts = map(data.by_segment, (data.effort, base_regressor(data)))
    for recording, segment, *signals in zip(recordings, data.segments, *parts, strict=True):
        laws = _controllers_law(recording, recording.axes[name], segment, *signals)
        found += _naming(recording, laws, len(recordings) > 1)
    return found


def _of_position(data: AxisData, model: FittedModel) -> list[Finding]:
    """Whether the effort is a law of the position, and none of the motion.

    A controller that compensates gravity makes such an effort while a hand moves the axis, and so
    does a load on an axis that moves slowly: no inertia is seen in either.
    """
    effort = data.effort[data.valid]
    efforts = model.jacobian[data.valid] * model.linear_parameters
    along = np.zeros(len(model.linear_parameters), dtype=np.bool_)
    along[PARAMETERS.index("offset")] = True
    laws = []
    for k, term in enumerate(model.terms):
        effect = named(term.candidate.effect)
        if effect.compensation.over == "position" and effect.overrides("load"):
            along[model.columns_of(k)] = True
            laws.append(term)
    rest, inertia = effort - np.sum(efforts[:, along], axis=1), rms(efforts[:, 0])
    scale = rms(effort)
    if not laws or rms(rest) > _OF_POSITION * scale or inertia > TOLERANCE * scale:
        return []
    values = [
        f"{spoken(term.candidate.effect)} with "
        + ", ".join(f"{name} {float(value):.4g}" for name, value in term.linear.items() if value)
        for term in laws
    ]
    return [
        Finding(
            "effort_of_position",
            f"the effort is a law of the position to {rms(rest) / scale:.1%}: a load, or a "
            f"controller that makes it ({listed(values)}); inertia is not in this recording",
            "record the effort that reaches the axis, with a drive that accelerates it: "
            "--motion multisine, and a controller that compensates no load",
            blocks=False,
        )
    ]


def _explains(data: AxisData, model: FittedModel) -> bool:
    """Whether a model explains most of an effort. Of one that is mostly weight, inertia and
    friction alone explain nothing."""
    return model.error < _MOST_LEFT * float(np.sum(np.square(data.effort[data.valid])))


def _each_once(findings: Iterable[Finding]) -> tuple[Finding, ...]:
    """The first of each code, unless another forbids to name a cause."""
    kept: dict[str, Finding] = {}
    for finding in findings:
        known = kept.setdefault(finding.code, finding)
        if finding.blocks and not known.blocks:
            kept[finding.code] = finding
    return tuple(kept.values())


def contradicted(efforts: Sequence[Sequence[Finding]]) -> bool:
    """Whether the effort of an axis cannot be that of its motion, in any recording.

    A controller's law is no contradiction: cogging shows in a loop, too.

    Parameters
    ----------
    efforts : sequence of sequences of Finding
        What `effort_findings` found in each recording.
    """
    return any(finding.blocks for found in efforts for finding in found)


def effort_findings(recordings: Sequence[Recording], name: str) -> list[list[Finding]]:
    """Check the effort of one axis against its motion, as identification does.

    None of its doubts about a parameter forbids a cause. Of several recordings, each is named.
    """
    several = len(recordings) > 1
    return [_naming(each, _checked(each, name), several) for each in recordings]


def _naming(recording: Recording, findings: Sequence[Finding], several: bool) -> list[Finding]:
    """Findings that say in which of several recordings they are."""
    if not several:
        return list(findings)
    return [replace(each, message=f"in {recording.source}, {each.message}") for each in findings]


def _checked(recording: Recording, name: str) -> list[Finding]:
    """Findings against the effort of an axis in one recording."""
    axis = recording.axes[name]
    signals = condition(
        recording.time_s, axis.position, axis.effort, effort_shift_s=recording.effort_shift_s
    )
    part = least_squares.estimation_part(signals)
    effort = signals.effort[part.samples]
    doubts = check_estimate(least_squares.fit(signals, part), part.columns, effort, 0.0)
    return check_effort(signals, part) + _doubts(doubts)


def _doubts(doubts: Sequence[Finding]) -> list[Finding]:
    """Doubts about parameters of the base model, in one sentence."""
    parameters = [
        name
        for name in PARAMETERS
        if any(doubt.code in (f"undetermined_{name}", f"weak_{name}") for doubt in doubts)
    ]
    found = [replace(doubt, blocks=False) for doubt in doubts if doubt.code == "inseparable"]
    if parameters and not found:
        names = ", ".join(parameters).replace("_", " ")
        found.append(
            Finding(
                "undetermined",
                f"the base model alone hardly determines its {names} here: look at the standard "
                "deviations",
                next(doubt.next_step for doubt in doubts if doubt.code.endswith(parameters[0])),
                blocks=False,
            )
        )
    return found


def _unphysical(data: AxisData, columns: Array, extended: FittedModel) -> list[Finding]:
    """Whether the extended model is physical at its own optimum, which knows no bounds.

    The selection itself names no cause beside which the model is not (`judge.judgement`).
    """
    jacobian = np.hstack([columns, extended.jacobian[:, len(PARAMETERS) :]])[data.valid]
    others = extended.predicted - extended.jacobian @ extended.linear_parameters
    return unphysical(unbounded(jacobian, (data.effort - others)[data.valid]))


def _controllers_law(
    recording: Recording, axis: AxisRecord, segment: Segment, effort: Array, regressor: Array
) -> list[Finding]:
    """Whether the effort follows from the motion by a controller's law as well as by dynamics."""
    effort_unit, unit = axis.effort_unit, axis.position_unit
    law = feedback_law(segment, effort, regressor, unit == "rad")
    if not law.describes or _driven_by_reference(recording, axis, segment.cutoff_hz):
        return []
    gains = []
    if law.velocity_gain > 0.0:
        gains.append(f"{law.velocity_gain:.3g} {effort_unit} per {unit}/s of speed")
    if law.position_gain > 0.0:
        gains.append(f"{law.position_gain:.3g} {effort_unit} per {unit} of position")
    return [
        Finding(
            "feedback_law",
            f"a controller's law ({' and '.join(gains)}) describes the effort as well as the "
            f"machine's dynamics do ({law.over_base:.2f} of their residual): what was recorded "
            "is the loop, not the machine",
            _INDEPENDENT_EXCITATION,
            blocks=True,
            contradicts=True,
        )
    ]


def _driven_by_reference(recording: Recording, axis: AxisRecord, cutoff_hz: float) -> bool:
    """Whether the reference, and not a disturbance, explains most of the effort."""
    if axis.reference is None:
        return False
    grid = EvenGrid.of(recording.time_s)
    regressor = filtered_regressor(grid.resampled(axis.reference), cutoff_hz, grid.period_s)
    effort = lowpass(grid.resampled(axis.effort), cutoff_hz, grid.period_s)
    left = float(np.var(effort - regressor @ solve(regressor, effort)))
    return left < (1.0 - _INDEPENDENT) * float(np.var(effort))


def _narrow_excitation(data: AxisData) -> list[Finding]:
    """What a motion at one speed or at one frequency cannot show."""
    velocity = data.of_motion("velocity")[data.valid]
    if np.std(velocity) < _ONE_SPEED * abs(np.mean(velocity)):
        return [
            Finding(
                "one_speed",
                f"the axis keeps one speed, {np.mean(velocity):.3g} on average: viscous friction, "
                "Coulomb friction and offset cannot be told apart, and inertia hardly shows",
                "record several speeds both ways, such as --motion staircase",
                blocks=False,
            )
        ]
    lines = [strongest_line(s.motion.velocity, s.period_s, s.cutoff_hz) for s in data.segments]
    weakest = min(lines, key=lambda line: line.share)
    apart_hz = np.ptp([line.frequency_hz for line in lines])
    if weakest.share < ONE_LINE or apart_hz > 0.1 * weakest.frequency_hz:
        return []
    return [
        Finding(
            "one_frequency",
            f"{weakest.share:.1%} of the motion is one line at {weakest.frequency_hz:.3g} Hz: "
            "inertia cannot be told from a spring or weight along the stroke, nor viscous "
            "friction from a delay",
            "record a motion of several frequencies, such as --motion multisine",
            blocks=False,
        )
    ]


def with_other_axes(
    checks: tuple[Finding, ...],
    recordings: Sequence[Recording],
    data: AxisData,
    extended: FittedModel,
    floor: NoiseFloor,
) -> tuple[Finding, ...]:
    """Add to the checks that the extended model leaves more than noise, on an axis that was
    recorded alone, or as one of several joints."""
    left = rms((data.effort - extended.predicted)[data.valid])
    share = left / max(rms(data.effort[data.valid]), np.finfo(float).tiny)
    blocked = any(check.blocks for check in checks)
    if blocked or share < TOLERANCE or left < _BEYOND_NOISE * floor.rms:
        return checks
    if all(len(recording.positions) == 1 for recording in recordings):
        alone = Finding(
            "other_axes_not_recorded",
            f"{share:.1%} of the effort is left, and this axis was recorded alone: if the machine "
            "has more axes that move, they may push this one, or change its inertia and load by "
            "their pose",
            "record all axes of the machine that move, or keep the others at rest",
            blocks=False,
        )
        return (*checks, alone)
    joints = [name for name in recordings[0].positions if name in recordings[0].turning]
    if len(joints) < 2:
        return checks
    ordered = Finding(
        "order_of_joints",
        f"{share:.1%} of the effort is left. Each joint is taken to carry those behind it in the "
        f"recording: {', '.join(joints)}",
        "if they are no such chain in this order, list them from the base outwards: --axis "
        f"{' --axis '.join(reversed(joints))}, say",
        blocks=False,
    )
    return (*checks, ordered)


# Whether recordings can be pooled: fitted together, or used to validate each other.


_ROWS: Final = 16
"""In a row whose equal bits tell where two recordings may be one."""
_COPIED: Final = 0.1
"""Of what changes in the shorter recording, from which an equal stretch is a copy: noise makes any
chance of it vanish, and at rest nothing changes."""


def check_pooled(recordings: Sequence[Recording]) -> None:
    """Refuse what no model can be fitted to.

    Raises
    ------
    DataError
        An effort never changes, axes or units differ, or two recordings hold the same samples.
    """
    for recording in recordings:
        check_usable(recording)
    for one, other in combinations(recordings, 2):
        _check_pair(one, other)


def _check_pair(one: Recording, other: Recording) -> None:
    if set(other.positions) != set(one.positions):
        raise DataError(
            f"{other.source} has axes {', '.join(other.positions)}, {one.source} has "
            f"{', '.join(one.positions)}",
            "give recordings of the same machine, or rename columns with --column",
        )
    shared = {n: (axis, other.axes[n]) for n, axis in one.axes.items() if n in other.axes}
    for name, (axis, there) in shared.items():
        units, others = axis.units, there.units
        if units != others:
            raise DataError(
                f"axis {name} is in {listed(units)} in {one.source}, and in {listed(others)} in "
                f"{other.source}",
                "convert one of them: edge-ident import, with --unit, --resolution or "
                "--torque-constant",
            )
    if not shared:
        return
    if all(np.array_equal(a.effort, b.effort) for a, b in shared.values()):
        raise DataError(
            f"{one.source} and {other.source} hold the same recording",
            "give it once: a copy shows nothing new, and would make the intervals too narrow",
        )
    begin, begin_there, count = _longest_copy(*(_rows(each, shared) for each in (one, other)))
    if count:
        raise DataError(
            f"{count} rows are the same in {one.source}, from {one.time_s[begin]:.4g} s on, and in "
            f"{other.source}, from {other.time_s[begin_there]:.4g} s on",
            "cut them off one of the recordings: a copy shows nothing new, makes the intervals too "
            "narrow, and tests no model",
        )


def _rows(recording: Recording, names: Iterable[str]) -> Array:
    """Position and effort of the axes of these names, (N, 2 K)."""
    axes = [recording.axes[name] for name in names]
    return np.column_stack([each for axis in axes for each in (axis.position, axis.effort)])


def _longest_copy(one: Array, other: Array) -> tuple[int, int, int]:
    """The longest stretch of the same rows: where it begins in each, and how many there are; none
    where it holds little of what changes in either.

    The lag at which most short stretches agree is the only one that is looked at.
    """
    _, here, there = np.intersect1d(_keys(one), _keys(other), return_indices=True)
    if not len(here):
        return 0, 0, 0
    lags, votes = np.unique(here - there, return_counts=True)
    lag = int(lags[np.argmax(votes)])
    first, second = max(lag, 0), max(-lag, 0)
    count = min(len(one) - first, len(other) - second)
    same = np.all(one[first : first + count] == other[second : second + count], axis=1)
    run = np.cumsum(~same)
    changed, changed_there = _changed(one), _changed(other)
    changes = np.bincount(run, weights=same * changed[first : first + count])
    if max(changes) <= _COPIED * min(np.sum(changed), np.sum(changed_there)):
        return 0, 0, 0
    (places,) = np.nonzero(same & (run == np.argmax(changes)))
    return first + int(places[0]), second + int(places[0]), len(places)


def _keys(rows: Array) -> NDArray[np.uint64]:
    """A number for each `_ROWS` rows that follow each other, the same for the same bits."""
    odd = np.random.default_rng(0).integers(2**63, size=(2, max(_ROWS, rows.shape[1])))
    of_column, of_row = 2 * odd.astype(np.uint64) + 1
    bits = np.ascontiguousarray(rows + 0.0).view(np.uint64) @ of_column[: rows.shape[1]]
    return np.asarray(np.convolve(bits, of_row[:_ROWS], "valid"))


def _changed(rows: Array) -> NDArray[np.bool_]:
    """Whether a row differs from the one before, (N,)."""
    return np.asarray(np.any(np.diff(rows, axis=0, prepend=rows[:1]) != 0.0, axis=1))


# A controller's law, fitted to a recording in the place of the machine's dynamics.
#
# A loop that holds a speed or a position answers every disturbance by effort = gain·(reference -
# motion). Where the reference hardly moves, this law is all that the recording shows: least squares
# finds minus the controller's gain and calls it friction (Ljung, System Identification, 1999,
# section 13.4). The law differs from the dynamics by its signs: effort falls where position or
# velocity is too high. It never acts before the motion that it answers. So does the weight of an
# arm that stands on its joint: what a law explains by an angle, the dynamics may explain by a
# weight.

_LAGS: Final = (0.0, 0.5, 1.0, 1.5, 2.0, 3.0, 5.0)
"""Sampling periods from a motion to the answer: calculation, and filters of position and speed."""
_AS_WELL: Final = 1.1
"""Residual of the law over that of the base model, up to which the law describes the effort as
well: with 100 independent samples two equally good models differ by a tenth."""
_EXPLAINS: Final = 0.7
"""Residual over the variation of the effort, up to which the law explains half of its variance."""


class FeedbackLaw(NamedTuple):
    """The best causal law, and what it leaves.

    Attributes
    ----------
    over_base : float
        Residual over that of base model and weight with physical signs, the larger of two: with and
        without the strongest line of the motion. At one frequency any law describes any effort.
    left : float
        Residual over the variation of the effort, the larger of the same two.
    position_gain, velocity_gain : float
        Effort per unit of position and velocity, never negative.
    """

    over_base: float
    left: float
    position_gain: float
    velocity_gain: float

    @property
    def describes(self) -> bool:
        """Whether the effort follows from the motion by the law as well as by dynamics."""
        return self.over_base < _AS_WELL and self.left < _EXPLAINS


def feedback_law(segment: Segment, effort: Array, regressor: Array, rotary: bool) -> FeedbackLaw:
    """Fit the law of a controller whose reference rests or moves at constant speed.

    Parameters
    ----------
    effort : (n,) array
        Filtered, at the compared samples.
    regressor : (n, 4) array
        Columns of the base model, filtered alike.
    rotary : bool
        Whether positions are angles, which a weight may follow.
    """
    valid = segment.valid
    answers = [_answer(segment, lag)[valid] for lag in _LAGS]
    time_s = (segment.sample_index * segment.period_s)[valid]
    line = strongest_line(segment.motion.velocity, segment.period_s, segment.cutoff_hz)
    angle = 2.0 * np.pi * line.frequency_hz * time_s
    resting = segment.filter(np.ones(len(segment.motion.position)))[valid]
    ramp = segment.filter(segment.motion.time_s - np.mean(segment.motion.time_s))[valid]
    slow = np.stack([resting, ramp], axis=1)
    tone = np.stack([resting * np.sin(angle), resting * np.cos(angle)], axis=1)
    weight = _weight(segment)[valid] if rotary else np.empty((len(time_s), 0))
    dynamics = np.hstack([regressor[valid], -regressor[valid, 3:], weight, -weight])
    alone, beside_line = (
        _fitted(effort[valid], dynamics, answers, known)
        for known in (slow, np.hstack([slow, tone]))
    )
    over_base, left, *_ = np.maximum(alone, beside_line).tolist()
    return alone._replace(over_base=over_base, left=left)


def _answer(segment: Segment, lag: float) -> Array:
    """Position and velocity (n, 2) a few sampling periods ago, with the sign of an answer."""
    time_s = segment.motion.time_s
    before_s = time_s - lag * segment.raw_period_s
    motion = (segment.motion.position, segment.motion.velocity)
    before = np.stack([np.interp(before_s, time_s, x) for x in motion])
    return -segment.filter(before).T


def _weight(segment: Segment) -> Array:
    """What a weight on the axis adds, per its two parts, (n, 2)."""
    angle = segment.motion.position
    return segment.filter(np.stack([np.cos(angle), np.sin(angle)])).T


def _fitted(effort: Array, regressor: Array, answers: list[Array], known: Array) -> FeedbackLaw:
    """The law and dynamics (n, P) of no negative amounts, both beside columns (n, K) that explain
    nothing."""
    basis = np.linalg.qr(known / np.linalg.norm(known, axis=0))[0]

    def beside(signal: Array) -> Array:
        return np.asarray(signal - basis @ (basis.T @ signal))

    target = beside(effort)
    variation = float(np.linalg.norm(target))
    columns, _ = unit_length(beside(regressor))
    floor = np.finfo(float).eps * float(np.linalg.norm(effort))
    dynamics = max(float(scipy.optimize.nnls(columns, target)[1]), floor)
    laws = []
    for answer in answers:
        columns, length = unit_length(beside(answer))
        gains, left = scipy.optimize.nnls(columns, target)
        laws.append(FeedbackLaw(left / dynamics, left / max(variation, floor), *(gains / length)))
    return min(laws)
