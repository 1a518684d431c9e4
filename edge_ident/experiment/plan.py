"""Design the motion that separates what a diagnosis leaves open; then judge what it settles."""

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import count
from os import PathLike
from typing import Final

import numpy as np

from edge_ident.diagnosis.above_band.held import held
from edge_ident.diagnosis.diagnose import diagnose
from edge_ident.diagnosis.measures import TOLERANCE, SpectralLine, Verdict
from edge_ident.diagnosis.result import AxisDiagnosis, Diagnosis
from edge_ident.drive.description import Drive, given_drive
from edge_ident.errors import DataError
from edge_ident.experiment.design import (
    AxisCase,
    DesignOfKind,
    axis_case,
    design_of_kind,
    evaluations,
    motion_kinds,
)
from edge_ident.experiment.limits import MARGIN, Allowed, Loops, Use
from edge_ident.experiment.open_causes import explanations, structure_in_band, tied_to_time, without
from edge_ident.experiment.result import AxisUse, MotionPlan, PlannedPair
from edge_ident.experiment.rivals import error_probability
from edge_ident.model.model import BOARD_UNITS, Model
from edge_ident.signals.metrics import rms
from edge_ident.signals.recording import Recording
from edge_ident.signals.recording_files import Given, given_recordings
from edge_ident.support.given import check_type, number
from edge_ident.support.given import seed as check_seed
from edge_ident.support.words import listed
from firmware_interface.board_types import AxisLimits
from firmware_interface.gains import AxisGains

Progress = Callable[[str, int, int], None]

_TOLD_EVERY: Final = 10  # motions, a tenth of a second: whoever is told has a board to hold


@dataclass(frozen=True)
class BoardSide:
    """What a board knows, and no drive description: its limits, the gains in force, its delay.

    Attributes
    ----------
    limits : mapping of axis name to AxisLimits
    gains : mapping of axis name to AxisGains
    control_delay_s : float
    """

    limits: Mapping[str, AxisLimits]
    gains: Mapping[str, AxisGains]
    control_delay_s: float


def plan_motion(
    diagnosis: Diagnosis,
    recordings: Given | Iterable[Given],
    drive: Drive | str | PathLike[str] | None = None,
    *,
    board: BoardSide | None = None,
    duration_s: float | None = None,
    seed: int = 0,
    budget: float = 1.0,
    on_progress: Progress = lambda stage, done, of: None,
) -> MotionPlan:
    """Design the motion that separates the causes that a diagnosis cannot tell apart.

    Parameters
    ----------
    diagnosis : Diagnosis
    recordings : Recording, str, Path or data frame, or a sequence of these
        Those of the diagnosis.
    drive : Drive, str or Path, optional
        Its limits are kept; without one, the built-in feed drive's.
    board : BoardSide, optional
        The board's own limits are kept too, and its loop is the one that may overshoot.
    duration_s : float, optional
        Of the recorded motion; default from the drive description.
    seed : int
        Of the search: the same for the same input.
    budget : float
        Length of the search; at 1 it takes one to two seconds.
    on_progress : callable
        Gets the stage, the number of motions compared and about how many there will be.

    Returns
    -------
    MotionPlan

    Raises
    ------
    DataError
        The drive description has other axes or units than the recordings, or its effort limit
        leaves nothing beyond friction.

    Examples
    --------
    >>> import edge_ident
    >>> recording = edge_ident.simulate()
    >>> plan = edge_ident.plan_motion(edge_ident.diagnose(recording), recording)
    >>> sorted({pair.first for pair in plan.pairs if pair.separated})
    ['actuator_deadband', 'load_dependent_friction']
    """
    recordings, drive = given_recordings(recordings), given_drive(drive)
    _check_given(diagnosis, duration_s, budget)
    check_seed(seed)
    _check_axes(diagnosis, drive)
    duration_s = drive.trajectory().duration_s if duration_s is None else duration_s
    allowed = _allowed(diagnosis, drive, board)
    lead_in_s = _longest_lead_in_s(drive, allowed)
    cases = {
        name: axis_case(name, axis, recordings, drive, allowed[name], duration_s, lead_in_s)
        for name, axis in diagnosis.axes.items()
    }
    left_out = tuple(left for name, case in cases.items() for left in case.rivals.reported(name))
    words = next(iter(allowed.values())).loops.words
    if not any(case.problem.pairs for case in cases.values()):
        return MotionPlan(None, {}, (), left_out, MARGIN, words, 0)
    searches = motion_kinds(duration_s)
    told = _told(on_progress, sum(evaluations(kind, cases, budget) for kind in searches))
    designs = [
        design_of_kind(kind, drive, cases, duration_s, lead_in_s, seed, budget, told)
        for kind in searches
    ]
    chosen = _better(designs)
    pairs = _pairs(cases, designs, chosen)
    tried = sum(design.tried for design in designs)
    if not any(pair.separated for pair in pairs):
        pairs = tuple(replace(pair, after=0.0, error_probability=0.5) for pair in pairs)
        return MotionPlan(None, {}, pairs, left_out, MARGIN, words, tried)
    uses = {name: AxisUse(*chosen.uses[name], allowed[name].limit) for name in cases}
    return MotionPlan(chosen.trajectory, uses, pairs, left_out, MARGIN, words, tried)


def _check_given(diagnosis: object, duration_s: float | None, budget: float) -> None:
    check_type(diagnosis, Diagnosis, "give what diagnose returned")
    if duration_s is not None:
        number("duration_s", duration_s, 1e-3, 1e5, "give seconds, or leave it out")
    number("budget", budget, 1e-3, 1e3, "give 1 for a search of one to two seconds")


def _told(on_progress: Progress, of: int) -> Callable[[], None]:
    """Count the motions that are compared, and tell now and then."""
    tried = count(1)

    def tell() -> None:
        done = next(tried)
        if done % _TOLD_EVERY == 0:
            on_progress("design of a motion", min(done, of), of)

    return tell


def _allowed(diagnosis: Diagnosis, drive: Drive, board: BoardSide | None) -> dict[str, Allowed]:
    """What each axis may be asked for."""
    limits = {name: Use.of_drive(axis) for name, axis in drive.axes.items()}
    if board is not None:
        limits = {n: use.smaller(Use.of_board(board.limits[n])) for n, use in limits.items()}
    fastest = max(use.speed_rad_s for use in limits.values())
    return {
        name: Allowed(limits[name], _loops(name, axis, board), fastest)
        for name, axis in diagnosis.axes.items()
    }


def _loops(name: str, axis: AxisDiagnosis, board: BoardSide | None) -> Loops:
    if board is None:
        return Loops.unknown()
    inertia, viscous, _, _ = axis.extended.estimate.parameters.tolist()
    return Loops.known(board.gains[name], inertia, viscous, board.control_delay_s)


def _longest_lead_in_s(drive: Drive, allowed: Mapping[str, Allowed]) -> float:
    """A lead-in that moves at no more than half of the speed limits, from rest in the middle.

    The quintic that blends it in moves at 15/8 of its mean speed.
    """
    slowest = max(
        1.875 * one.limit.travel_rad / (0.5 * one.limit.speed_rad_s) for one in allowed.values()
    )
    return max(drive.lead_in_s, slowest)


def _better(designs: Sequence[DesignOfKind]) -> DesignOfKind:
    """The better kind; pairs that neither kind can separate do not count."""
    reachable = {
        name: np.max([design.best[name] / design.needed[name] for design in designs], axis=0) >= 1.0
        for name in designs[0].distances
    }
    return max(designs, key=lambda design: design.value(reachable))


def _pairs(
    cases: Mapping[str, AxisCase], designs: Sequence[DesignOfKind], chosen: DesignOfKind
) -> tuple[PlannedPair, ...]:
    found = []
    for name, apart in chosen.distances.items():
        case = cases[name]
        best = np.max([design.best[name] for design in designs], axis=0)
        for k, pair in enumerate(case.problem.pairs):
            found.append(
                PlannedPair(
                    axis=name,
                    first=pair.first.effect,
                    second=None if pair.second is None else pair.second.effect,
                    why=pair.why,
                    before=float(case.before[k]),
                    after=float(apart[k]),
                    best=float(best[k]),
                    needed=float(chosen.needed[name][k]),
                    error_probability=error_probability(float(apart[k])),
                )
            )
    return tuple(found)


def _check_axes(diagnosis: Diagnosis, drive: Drive) -> None:
    """Raise DataError where limits and recordings cannot be compared."""
    drive.check_axes(diagnosis.axes)
    for name, axis in diagnosis.axes.items():
        if axis.model.units != BOARD_UNITS:
            raise DataError(
                f"axis {name} was recorded in {listed(axis.model.units)}, the limits of a drive "
                "description are in rad and N*m",
                "convert the recording with --unit, --resolution or --torque-constant",
            )


# All motions of a machine together: what the last of them settles.
#
# The recordings are diagnosed as one. What belongs to the time of a recording does not allow that:
# a machine that has warmed up, or whose amplifier has drifted, is another one in the next
# recording. Where such a cause is in question, and one model leaves far more of all recordings than
# each of them leaves with its own, the last recording is diagnosed by itself. An effect that its
# motion would have shown, and that it does not show, is ruled out; the explanation of the
# recordings before stays.
#
# Above the band, a line in time is a vibration from outside if other motions hold it, too. One that
# the recordings before do not hold, or that the last one certainly does not, comes from the motion
# itself: from friction at its reversals. Where the base model was enough for the recordings before,
# so does an order without a name.

# Residual of one model for all recordings, over that of a model for each, from which the machine
# changed in between: the sum of two independent errors is 1.4 times as large as one.
_CHANGED: Final = 2.0


def diagnose_together(
    recordings: Sequence[Recording],
    names: Collection[str],
    *,
    before: Mapping[str, AxisDiagnosis],
    plan: MotionPlan | None,
    model: Model | None,
    on_progress: Progress,
) -> dict[str, AxisDiagnosis]:
    """Diagnose axes on all recordings.

    Parameters
    ----------
    recordings : sequence of Recording
        The last one is that of the motion which was made for what was open.
    names : collection of str
        Axes whose base model is not adequate on each of them, or not to be trusted.
    before : mapping of axis name to AxisDiagnosis
        On the recordings but the last, where there is one.
    plan : MotionPlan or None
        What the last motion was designed for.
    model : Model or None
        Effects that the machine is known to have.
    on_progress : callable

    Raises
    ------
    DataError
        An axis hardly moves.
    """

    def judged(name: str) -> AxisDiagnosis:
        earlier = before.get(name)
        together = _diagnosed(recordings, name, recordings[0], model, on_progress)
        together = _without_own_lines(together, earlier, recordings[-1], name)
        if earlier is None or together.verdict.complete:
            return together
        if not tied_to_time(earlier):
            return together
        alone = _diagnosed(recordings[-1:], name, recordings[0], model, on_progress)
        if not _changed(together, earlier, alone):
            return together
        asked = plan.pairs if plan is not None else ()
        pairs = [pair for pair in asked if pair.axis == name and pair.separated]
        return _settled(earlier, alone, pairs, recordings[-1].source)

    return {name: judged(name) for name in names}


def _diagnosed(
    recordings: Sequence[Recording],
    name: str,
    first: Recording,
    model: Model | None,
    on_progress: Progress,
) -> AxisDiagnosis:
    """What is worth naming on the first motion is worth naming beside a livelier one."""
    efforts = np.concatenate([recording.axes[name].effort for recording in recordings])
    share = rms(first.axes[name].effort) / rms(efforts)
    found = diagnose(
        recordings,
        model=model,
        tolerance=TOLERANCE * min(share, 1.0),
        only=[name],
        on_progress=on_progress,
    )
    return found.axes[name]


def _without_own_lines(
    together: AxisDiagnosis, earlier: AxisDiagnosis | None, last: Recording, name: str
) -> AxisDiagnosis:
    """The diagnosis without lines that only the last motion holds, or only those before.

    Those of an order stay where the axis was diagnosed before.
    """
    resolved_hz = 1.0 / float(last.time_s[-1] - last.time_s[0])
    known = [line.frequency_hz for line in (earlier.lines if earlier else ()) if line.frequency_hz]

    def lasts(line: SpectralLine) -> bool:
        found = line.frequency_hz
        if found is None:
            return earlier is not None
        if not any(abs(found - other) < resolved_hz for other in known):
            return False
        # inside the band of a livelier motion, the comparison tells
        return found >= together.cutoff_hz or structure_in_band(together)

    lasting = [line for line in together.lines if lasts(line)]
    above = [line for line in lasting if (line.frequency_hz or 0.0) >= together.cutoff_hz]
    gone = set(above).difference(held(last, name, above, together.model))
    lines = tuple(line for line in lasting if line not in gone)
    if lines == together.lines:
        return together
    verdict = together.verdict
    if not (lines or together.external_vibrations or structure_in_band(together)):
        verdict = _without_lines(together)
    return replace(together, lines=lines, verdict=verdict)


def _without_lines(axis: AxisDiagnosis) -> Verdict:
    """The verdict on an axis that lines alone kept open. Curves stand in its model where the base
    model leaves structure in the band that no cause names."""
    if axis.curves:
        return Verdict.PARTLY_EXPLAINED
    return Verdict.EXPLAINED if axis.causes else Verdict.ADEQUATE


def _changed(together: AxisDiagnosis, earlier: AxisDiagnosis, alone: AxisDiagnosis) -> bool:
    """Whether one model leaves more of all recordings than each leaves with its own."""
    apart = max(earlier.extended.fitted, alone.extended.fitted)
    return together.extended.fitted > _CHANGED * apart


def _settled(
    earlier: AxisDiagnosis, alone: AxisDiagnosis, pairs: Sequence[PlannedPair], source: str
) -> AxisDiagnosis:
    """The explanation of before, without what the last motion would have shown."""
    sought = {effect for pair in pairs for effect in (pair.first, pair.second) if effect}
    return without(
        earlier, sought - explanations(alone), f"{source} would have shown it, and does not"
    )
