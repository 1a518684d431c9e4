"""When an estimate may be acted on, and what to tell the user where it may not.

The limits follow from the use of the estimate, not from test drives. Gains are guesses if the model
misses a sixth of the effort, or if the uncertainty of one parameter changes the effort by a
twentieth.
"""

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.estimation.least_squares import Columns
from edge_ident.model.model import (
    PARAMETERS,
    POSITIVE,
    Estimate,
    SupportedRange,
    Term,
    quantity_unit,
)
from edge_ident.model.motion import LARGEST_SHIFT, Array, Timing
from edge_ident.signals.conditioning import Signals, condition
from edge_ident.signals.recording import AxisRecord, Recording
from edge_ident.signals.time_stamps import UNEVEN, even_rows_sentence, lost_rows_sentence
from edge_ident.signals.tracking import OFF, tracking
from edge_ident.support.words import spoken

if TYPE_CHECKING:
    from edge_ident.model.model_files import GivenModel
    from edge_ident.signals.recording_files import Given


RESIDUAL_LIMIT: Final = 0.15
"""Relative residual above which the model does not describe the drive."""
UNCERTAIN_EFFORT_LIMIT: Final = 0.05
"""Share of the rms effort that a parameter's uncertainty may move."""
WEAK: Final = "weak_"
"""Beginning of the code of a finding on a parameter that is weakly determined."""
WEAK_LIMIT: Final = 0.10
"""Relative standard deviation above which a parameter is called weakly determined."""
TARGET: Final = 0.05
"""Relative standard deviation that a suggested motion should reach."""
AGREEMENT: Final = 3.0
"""Combined standard deviations by which two estimators may differ: 0.3 % by chance."""
CERTAIN_SIGN: Final = 2.0
"""Standard deviations from which a sign is certain: 2.3 % by chance."""
# Singular value over the largest, columns of unit length, that counts as zero.
_SAME_DIRECTION: Final = 1e-6
UNDETERMINED: Final = "undetermined_"
"""Beginning of the code of a finding against a parameter. It does not block where friction trades
places among the terms of the model, and its line is known."""
# Beginnings of the codes of findings that a livelier motion settles.
_OF_THE_MOTION: Final = ("inseparable", "negative_", UNDETERMINED)
OF_PARAMETERS: Final = (*_OF_THE_MOTION, "estimators_disagree_")
"""Beginnings of the codes of findings against single parameters, whose names follow."""
# At one frequency, the effort of a spring is that of a negative inertia.
_SPOKEN: Final = {"negative_inertia": "inertia cannot be told from a spring"}
_TINY: Final = np.finfo(float).tiny


@dataclass(frozen=True)
class Finding:
    """One thing the user should know.

    Attributes
    ----------
    code : str
    message, next_step : str
        One line each.
    blocks : bool
        Whether the parameters count as not known.
    contradicts : bool
        Whether the data contradict themselves, so that nothing follows from them: no gains, either.
    """

    code: str
    message: str
    next_step: str
    blocks: bool = False
    contradicts: bool = False


def check_estimate(
    estimate: Estimate,
    columns: Columns,
    effort: Array,
    relative_residual: float,
    line: Estimate | None = None,
) -> list[Finding]:
    """Findings against an estimate.

    Parameters
    ----------
    estimate : Estimate
    columns : Columns
        (N, 4).
    effort : (N,) array
    relative_residual : float
    line : Estimate, optional
        With friction as the line through the friction curve, where that bends.
    """
    rms_effort = float(np.sqrt(np.mean(effort**2)))
    rms_columns = np.sqrt(np.mean(columns.values**2, axis=0))
    poor_fit = Finding(
        "poor_fit",
        f"over all samples, the model leaves {relative_residual:.1%} of the effort "
        f"(limit {RESIDUAL_LIMIT:.0%})",
        "check the units, and look for effects that the model lacks: a changing load, backlash, "
        "ripple",
        blocks=True,
    )
    findings = [poor_fit] if relative_residual > RESIDUAL_LIMIT else []
    findings += _inseparable(columns)
    for index in range(len(PARAMETERS)):
        finding = _check_parameter(index, estimate, rms_columns, rms_effort)
        if line is not None:
            of_line = _check_parameter(index, line, rms_columns, rms_effort)
            finding = _beside_line(finding, of_line, index, line)
        if finding:
            findings.append(finding)
    return findings


def _inseparable(columns: Columns) -> list[Finding]:
    """Parameters whose columns of the regressor are the same in this motion.

    Standard deviations do not show this: least squares splits such parameters evenly.
    """
    _, singular, directions = columns.svd
    lost = directions[singular < _SAME_DIRECTION * singular[0]]
    names = [
        name.replace("_", " ")
        for i, name in enumerate(PARAMETERS)
        if np.any(np.abs(lost[:, i]) > 0.1)
    ]
    if not names:
        return []
    return [
        Finding(
            "inseparable",
            f"{' and '.join(names)} cannot be distinguished in this motion",
            "record a motion that goes both ways at several speeds, such as --motion staircase",
            blocks=True,
        )
    ]


def with_timing(doubts: list[Finding], timing: Timing) -> list[Finding]:
    """Doubts in parameters, and before them what may be behind these: friction follows the shift
    between effort and position, and where a recording does not show that, its interval is wide."""
    if not (doubts and timing.unknown):
        return doubts
    unknown = Finding(
        "timing_unknown",
        "the recording does not show how late the effort is, and friction follows that: its "
        f"interval allows for ± {LARGEST_SHIFT:g} samples",
        "record at a higher sample rate, so that the filter leaves more between two reversals",
    )
    return [unknown, *doubts]


def not_shown(findings: Iterable[Finding]) -> tuple[str, ...]:
    """Why parameters that fit a motion are not to be trusted, where a livelier one shows more.

    Parameters
    ----------
    findings : iterable of Finding
        Those about the data are left out: another motion would have them, too.

    Returns
    -------
    tuple of str
        Parts of a sentence.
    """
    blocking = [finding for finding in findings if finding.blocks]
    own = [one for one in blocking if one.code.startswith(_OF_THE_MOTION)]
    beside = [one for one in blocking if one.code.startswith("estimators_disagree_")]
    return tuple(dict.fromkeys(_SPOKEN.get(one.code) or _brief(one) for one in own or beside))


def _brief(finding: Finding) -> str:
    """What a finding says, without its numbers."""
    return finding.message.partition(": ")[0].partition(" (")[0].replace("_", " ")


def negative(name: str, value: float, std: float, *, blocks: bool) -> Finding:
    """A parameter that is below zero beyond doubt, and that no machine has there."""
    return Finding(
        f"negative_{name}",
        f"the best fit has a negative {name.replace('_', ' ')}: {value:.3g} ± {std:.2g}, which no "
        "machine has. The effort is that of a controller, or of a load that is not in the "
        "catalogue",
        "check the sign and the unit of the effort; then record a motion that does not depend on "
        "the axis, such as --motion multisine, and the effort that reaches the axis",
        blocks=blocks,
    )


def _check_parameter(
    index: int, estimate: Estimate, rms_columns: Array, rms_effort: float
) -> Finding | None:
    name = PARAMETERS[index]
    value, std = float(estimate.parameters[index]), float(estimate.std[index])
    spoken = name.replace("_", " ")
    if POSITIVE[index] and value < -CERTAIN_SIGN * std:
        return negative(name, value, std, blocks=True)
    moved = std * rms_columns[index] / max(rms_effort, _TINY)
    if moved > UNCERTAIN_EFFORT_LIMIT or (POSITIVE[index] and value <= 0):
        return Finding(
            f"{UNDETERMINED}{name}",
            f"{spoken} is not determined: {value:.4g} ± {std:.2g}, which alone "
            f"moves the effort by {moved:.1%}",
            _better_motion(index),
            blocks=True,
        )
    share = value * float(rms_columns[index]) / rms_effort if rms_effort else 0.0
    if POSITIVE[index] and std > WEAK_LIMIT * value:
        return Finding(
            f"{WEAK}{name}",
            f"{spoken} is known only to ±{std / value:.0%}: it makes up "
            f"{share:.1%} of the effort in this motion",
            _better_motion(index, std / value, float(rms_columns[0]), share),
        )
    return None


def _beside_line(
    finding: Finding | None, of_line: Finding | None, index: int, line: Estimate
) -> Finding | None:
    """What is found against a parameter, beside what is known of the line through the friction."""
    if of_line is not None and of_line.blocks:
        return finding if finding is not None and finding.blocks else of_line
    if finding is None or not finding.code.startswith(UNDETERMINED):
        return finding
    value, std = line.parameters[index], line.std[index]
    return replace(
        finding,
        message=f"{finding.message}; it trades places with other terms of the friction. Of the "
        f"line through the friction curve it is {value:.4g} ± {std:.2g}",
        blocks=False,
    )


def _better_motion(
    index: int, relative_std: float = math.inf, acceleration: float = 0.0, share: float = 0.0
) -> str:
    """The motion that would determine a parameter.

    Parameters
    ----------
    index : int
    relative_std : float
        Deviation over value; infinite where the value is not known.
    acceleration : float
        Of this motion, rms.
    share : float
        Part of the rms effort that the inertia takes in it: with all of it, the drive accelerates
        by one over that share as much.
    """
    name = PARAMETERS[index]
    if name == "inertia":
        wanted = relative_std / TARGET
        if wanted * share <= 1.0:
            return (
                f"record a motion that accelerates {wanted:.2g} times as much: with "
                f"{wanted * acceleration:.2g} rms instead of {acceleration:.2g}, in the position's "
                "unit per s²"
            )
        return (
            "record a motion in which most of the effort goes into acceleration: quick reversals "
            "over a short stroke, such as --motion multisine"
        )
    if name == "offset":
        return "record a motion that goes both ways at the same speeds"
    return "record several speeds both ways, such as --motion staircase"


def tied_to_time(effects: tuple[str, ...]) -> list[Finding]:
    """Compensated effects that hold only for the recording that they were found in."""
    return [
        Finding(
            f"tied_to_time_{effect}",
            f"{effect} was compensated at the times that the model gives, counted from the first "
            "sample",
            "remove it from the model file, unless this is the recording that it was found in",
        )
        for effect in effects
    ]


def compare_estimators(network: Estimate, least_squares: Estimate) -> list[Finding]:
    """Where the network and least squares contradict each other."""
    combined = np.hypot(network.std, least_squares.std)
    distance = np.abs(network.parameters - least_squares.parameters)
    return [
        Finding(
            f"estimators_disagree_{name}",
            f"network and least squares differ in {spoken(name)} by "
            f"{distance[i] / combined[i]:.1f} standard deviations "
            f"({network.parameters[i]:.4g} against {least_squares.parameters[i]:.4g})",
            "one of them is wrong for this drive: examine the residual over time",
            blocks=True,
        )
        for i, name in enumerate(PARAMETERS)
        if distance[i] > AGREEMENT * combined[i]
    ]


# What of a recording was used, and what was done to it before anything was estimated.

UNKNOWN_LIMIT: Final = 0.05
"""Share of a record that is clipped, above which the rest may be another motion."""
_MOST_MISSING: Final = 0.5  # share that is in gaps, above which most of the motion is unknown
_FEW_UNKNOWN: Final = 0.001  # share of such samples below which it is not worth a sentence


def describe_data(signals: Signals, stamp_jitter: float = 0.0, lost_rows: int = 0) -> list[Finding]:
    """What was done to the data before anything was estimated.

    Parameters
    ----------
    signals : Signals
    stamp_jitter : float
    lost_rows : int
        See `edge_ident.signals.recording.Recording`.
    """
    return list(_of_data(signals, stamp_jitter, lost_rows))


def _of_data(signals: Signals, stamp_jitter: float, lost_rows: int) -> Iterator[Finding]:
    if stamp_jitter:
        yield Finding(
            "jittering_stamps",
            even_rows_sentence(stamp_jitter),
            "record with the board's clock, or read the file with --period",
        )
    if lost_rows:
        yield Finding(
            "lost_rows",
            lost_rows_sentence(lost_rows),
            "look for a recorder that is too slow or a line that drops packets",
        )
    elif signals.jitter > UNEVEN:
        yield Finding(
            "uneven_sampling",
            f"time stamps are up to {signals.jitter:.2g} sampling periods off an even "
            "grid; samples were interpolated",
            "record with the board's clock if results look noisy",
        )
    yield from _unknown(signals)
    standing = 1.0 - float(np.mean(signals.moving))
    if standing > 0 and not signals.unknown_share:
        yield Finding(
            "standstill",
            f"{standing:.1%} of the recording are standstills, with what the filter mixes with "
            "them; this part was not used",
            "use stiffer feedback or friction feed-forward to shorten the rest at reversals",
        )


def _unknown(signals: Signals) -> Iterator[Finding]:
    """Samples inside gaps of the time stamps, or with a clipped effort."""
    share, clipped = signals.unknown_share, signals.clipped_share
    if share < _FEW_UNKNOWN:
        return
    said = (
        f"in {share:.1%} of the recording the effort is clipped at its highest or lowest value, or "
        "samples are missing; this part was not used"
    )
    next_step = "record with a larger range of the effort, a gentler motion, and without pauses"
    most = UNKNOWN_LIMIT
    if clipped < _FEW_UNKNOWN:  # an effort that is clipped says less than one that is not there
        said = (
            f"{share:.1%} of the recording lies in gaps of the time stamps; this part was not used"
        )
        next_step, most = "record without pauses", _MOST_MISSING
    yield Finding("clipped_or_missing", said, next_step, share > most, share > most)


# Where a motion leaves the range in which a model's terms were supported.


def outside_support(model: "GivenModel", recording: "Given") -> dict[str, list[Finding]]:
    """Say where a recording leaves the range of a model's terms.

    Parameters
    ----------
    model : Model, result with a model, str or Path
    recording : Recording, str, Path or data frame
        Axes that the model does not know are passed over.

    Returns
    -------
    mapping of axis name to list of Finding
        The list is empty where the motion stays inside, or the ranges are not known.

    Examples
    --------
    >>> import edge_ident
    >>> recording = edge_ident.simulate()
    >>> model = edge_ident.identify(recording).model
    >>> edge_ident.outside_support(model, recording)
    {'x': [], 'z': []}
    """
    from edge_ident.model.model_files import given_model
    from edge_ident.signals.recording_files import given_recording

    model, recording = given_model(model), given_recording(recording, "compare with a model")
    found = {}
    for name, axis in recording.axes.items():
        if name in model.axes:
            signals = condition(
                recording.time_s,
                axis.position,
                axis.effort,
                effort_shift_s=recording.effort_shift_s,
            )
            seen = range_of(signals, axis, signals.moving, signals.effort)
            found[name] = departures(model.axes[name].terms, seen, axis)
    return found


def range_of(
    signals: Signals, axis: AxisRecord, part: NDArray[np.bool_] | NDArray[np.intp], effort: Array
) -> SupportedRange:
    """The range of an axis at some samples.

    Parameters
    ----------
    signals : Signals
        Of N samples.
    axis : AxisRecord
        As recorded.
    part : (N,) array of bool, or array of int
        The samples.
    effort : (N,) array
        Filtered as the signals, with what was compensated.
    """
    position = signals.grid.resampled(axis.position)
    columns = (position, signals.regressor[:, 1], signals.regressor[:, 0], effort)
    return SupportedRange.of(*(column[part] for column in columns))


def departures(terms: Sequence[Term], seen: SupportedRange, axis: AxisRecord) -> list[Finding]:
    """One finding for each range that a motion leaves; terms of one range share it.

    Parameters
    ----------
    terms : sequence of Term
    seen : SupportedRange
        Of the motion.
    axis : AxisRecord
        Tells the units.
    """
    by_range: dict[SupportedRange, list[str]] = {}
    for term in terms:
        if term.supported is not None:
            by_range.setdefault(term.supported, []).append(term.effect)
    found = []
    for supported, effects in by_range.items():
        left = [
            departure.sentence(quantity_unit(departure.quantity, *axis.units))
            for departure in supported.left_by(seen)
        ]
        if left:
            said = (
                f"the motion leaves the range in which {', '.join(dict.fromkeys(effects))} was "
                f"supported: {', '.join(left)}"
            )
            step = "diagnose a recording of this motion; outside the range the model extrapolates"
            found.append(Finding("outside_support", said, step))
    return found


# Whether an axis follows its reference, as a finding.


def check_tracking(recordings: Sequence[Recording], name: str) -> list[Finding]:
    """Say of each recording in which an axis does not follow its reference where and by how much.

    It blocks nothing: the effort may well be that of the motion that was made.
    """
    found = []
    for recording in recordings:
        seen = tracking(recording, name) if name in recording.axes else None
        if seen is not None and seen.off:
            said = seen.sentence(recording.axes[name].position_unit)
            where = f"in {recording.source}, " if len(recordings) > 1 else ""
            found.append(Finding(OFF, where + said, seen.next_step))
    return found


def off_reference(findings: Sequence[Finding]) -> Finding | None:
    """The finding that an axis does not follow its reference, None where it does."""
    return next((finding for finding in findings if finding.code == OFF), None)
