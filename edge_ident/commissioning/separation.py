"""The motions that an open diagnosis asks for: designed, announced, made, and judged together.

Where a base model fits, but the motion could not show its parameters, the drive's own livelier
motion comes first. The motions end when one explanation is left for every axis, when the motions or
their time are used up, or when no motion inside the limits separates what is left.
"""

import logging
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

from edge_ident.commissioning.further_motions import (
    changes_in_doubt,
    lines_in_doubt,
    livelier_motion,
    not_shown,
)
from edge_ident.commissioning.gain_change import Recorded
from edge_ident.commissioning.identification_motions import (
    IdentificationMotion,
    OutOfTimeError,
    Progress,
    Study,
    capture_file,
    captured,
    duration_s,
    with_diagnoses,
)
from edge_ident.diagnosis.result import AxisDiagnosis, Diagnosis
from edge_ident.errors import DataError
from edge_ident.experiment.open_causes import explanations, is_open, questions, without_causes
from edge_ident.experiment.result import MotionPlan, announced, inseparable_reasons
from edge_ident.identification.adequacy import LARGEST_MOVE, SIGNIFICANT
from edge_ident.identification.identify import identify
from edge_ident.identification.result import AxisIdentification, Identification, ParameterSource
from edge_ident.model.effects import named
from edge_ident.model.model import PARAMETERS, Model
from edge_ident.signals.data_checks import check_recording
from edge_ident.signals.recording import Recording
from firmware_interface.errors import MotionRefusedError
from firmware_interface.motion import Trajectory

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Separation:
    """All identification motions of a run, and why there were no more.

    Attributes
    ----------
    motions : tuple of IdentificationMotion
    ended : str
        One sentence; empty where one motion left no question.
    """

    motions: tuple[IdentificationMotion, ...]
    ended: str = ""

    @property
    def found(self) -> Identification:
        """What is known after the last motion."""
        return self.motions[-1].found


def diagnoses(found: Identification) -> dict[str, AxisDiagnosis]:
    """Diagnoses of the axes whose base model was not enough."""
    every = {name: axis.diagnosis for name, axis in found.axes.items()}
    return {name: axis for name, axis in every.items() if axis is not None}


def separate(study: Study, made: Sequence[IdentificationMotion]) -> Separation:
    """Make further motions until one explanation is left, as far as the study may go.

    Every capture is saved as it is made. The machine is at rest in between.

    Parameters
    ----------
    study : Study
    made : sequence of IdentificationMotion
        At least one.

    Raises
    ------
    LinkError, BoardError
        A motion did not get to its end.
    """
    motions = list(made)
    while _doubts(study, motions) or any(map(is_open, _open_questions(motions).values())):
        if len(motions) >= study.plan.most_motions:
            return Separation(tuple(motions), _motions_used_up(motions))
        try:
            ended = _make_next_motion(study, motions)
        except DataError as error:
            ended = f"no further motion: {error.cause}"
        except OutOfTimeError as error:
            ended = error.cause
        if ended:
            return Separation(tuple(motions), ended)
    return Separation(tuple(motions), _conclusion(motions))


def _open_questions(motions: Sequence[IdentificationMotion]) -> dict[str, AxisDiagnosis]:
    """What is to be settled on each axis whose base model was not enough."""
    pairs = [pair for made in motions if made.plan is not None for pair in made.plan.pairs]
    asked: dict[str, set[frozenset[str]]] = {}
    for pair in pairs:
        if pair.separated:
            effects = frozenset({pair.first} if pair.second is None else {pair.first, pair.second})
            asked.setdefault(pair.axis, set()).add(effects)
    return {
        name: questions(axis, asked.get(name, ()))
        for name, axis in diagnoses(motions[-1].found).items()
    }


def _conclusion(motions: Sequence[IdentificationMotion]) -> str:
    """What there is to say where no motion is to be made any more."""
    still = [
        name for name, axis in diagnoses(motions[-1].found).items() if is_open(questions(axis))
    ]
    unseen = not_shown(motions[-1].found) if len(motions) > 1 else {}
    if unseen:
        return f"{_listed(unseen)}: a livelier motion did not show more"
    if still:
        return f"axis {', '.join(still)}: what is left stayed open on a motion that was made for it"
    return "one explanation is left" if len(motions) > 1 else ""


def _doubts(study: Study, motions: Sequence[IdentificationMotion]) -> dict[str, tuple[str, ...]]:
    """What a livelier motion would show, by axis, unless it was made already."""
    if not study.plan.diagnose or any(motion.sought for motion in motions):
        return {}
    return _every_doubt(motions[-1].found)


def _every_doubt(found: Identification) -> dict[str, tuple[str, ...]]:
    return lines_in_doubt(found) | changes_in_doubt(found) | not_shown(found)


def _what_is_open(motions: Sequence[IdentificationMotion]) -> str:
    """What is not settled, for a sentence on why no motion follows."""
    unseen = _every_doubt(motions[-1].found)
    return _listed(unseen) if unseen else "several explanations are left"


def _listed(unseen: Mapping[str, Sequence[str]]) -> str:
    return "; ".join(f"axis {name}, {' and '.join(reasons)}" for name, reasons in unseen.items())


def _motions_used_up(motions: Sequence[IdentificationMotion]) -> str:
    made = "one motion that was" if len(motions) == 1 else f"{len(motions)} that were"
    return f"{_what_is_open(motions)} after the {made} allowed"


@dataclass(frozen=True)
class _NextMotion:
    """A motion to make, and what it is for; or why there is none."""

    trajectory: Trajectory | None
    instead: str
    told: tuple[str, ...]
    plan: MotionPlan | None = None
    sought: Mapping[str, tuple[str, ...]] = field(default_factory=dict)


def _next_motion(study: Study, motions: Sequence[IdentificationMotion]) -> _NextMotion:
    """The drive's own livelier motion where one is needed, else the one that is designed.

    None is designed beside an axis that is not to be trusted: its effort cannot be forecast. Nor is
    one designed for changes with time: any other motion shows how they go on.
    """
    found, sought = motions[-1].found, _doubts(study, motions)
    own_one = not_shown(found) or (sought and changes_in_doubt(found))
    if not own_one and any(map(is_open, _open_questions(motions).values())):
        plan = _designed(study, motions)
        if plan.trajectory is not None or not sought:
            told = ("it is designed", *announced(plan))
            return _NextMotion(plan.trajectory, inseparable_reasons(plan), told, plan)
    trajectory = livelier_motion(study, motions[0]) if sought else None
    instead = f"{_what_is_open(motions)}: this drive has no livelier motion of its own"
    told = ("it is the drive's own multisine", f"on {motions[-1].file}: {_listed(sought)}")
    return _NextMotion(trajectory, instead, told, sought=sought)


def _make_next_motion(study: Study, motions: list[IdentificationMotion]) -> str:
    """Add a motion; or say why none is made."""
    following = _next_motion(study, motions)
    trajectory = following.trajectory
    if trajectory is None:
        return following.instead
    spent_s = sum(motion.duration_s for motion in motions)
    wanted_s = duration_s(trajectory)
    if spent_s + wanted_s > study.plan.most_s:
        return (
            f"{_what_is_open(motions)}: the next motion would take {wanted_s:.0f} s, "
            f"{max(study.plan.most_s - spent_s, 0.0):.0f} s of {study.plan.most_s:.0f} s are left"
        )
    number = len(motions) + 1
    first, *rest = following.told
    for line in (f"motion {number}, {wanted_s:.0f} s: {first}", *rest):
        study.tell(line)
    try:
        capture = captured(study, trajectory, number, motions[0].capture)
    except MotionRefusedError as error:  # the gains in force may ask for more than the forecast
        return f"{_what_is_open(motions)}: the next motion was not made: {error.cause}"
    study.board.finish()
    check_recording(capture.recording)
    made = IdentificationMotion(
        capture_file(number), trajectory, capture, motions[-1].found, following.plan, {},
        following.sought,
    )  # fmt: skip
    motions.append(judged(study, motions, made))
    return ""


def _designed(study: Study, motions: Sequence[IdentificationMotion]) -> MotionPlan:
    """The motion that separates what is left; the experiment loads here, with scipy."""
    from edge_ident.experiment.plan import BoardSide, plan_motion

    board = study.board
    side = BoardSide(board.limits(), board.active_gains(), board.identity.control_delay_s)
    recordings = [motion.recording for motion in motions]
    to_separate = Diagnosis(_to_separate(study, motions, recordings), (), {})
    return study.computed(
        lambda progress: plan_motion(
            to_separate,
            recordings,
            study.drive,
            board=side,
            seed=study.plan.seed,
            on_progress=progress,
        )
    )


def _to_separate(
    study: Study, motions: Sequence[IdentificationMotion], recordings: Sequence[Recording]
) -> dict[str, AxisDiagnosis]:
    """What is to be settled on each axis; an adequate one moves along, and nothing is asked of it.

    A diagnosis tells its noise and its model, too.
    """
    from edge_ident.diagnosis.diagnose import diagnose

    open_axes, found = _open_questions(motions), motions[-1].found
    others = [name for name in found.axes if name not in open_axes]
    if not others:
        return open_axes
    beside = study.computed(
        lambda progress: diagnose(
            recordings, model=study.plan.model, only=others, on_progress=progress
        )
    )
    return {
        name: open_axes[name] if name in open_axes else without_causes(beside.axes[name])
        for name in found.axes
    }


def judged(
    study: Study, earlier: Sequence[IdentificationMotion], made: IdentificationMotion
) -> IdentificationMotion:
    """A motion with what is known once it is diagnosed together with those before."""
    from edge_ident.experiment.plan import diagnose_together

    before, motions = diagnoses(made.found), (*earlier, made)
    seen = identify(made.recording, None, model=study.plan.model, diagnose=False)
    names = [
        name
        for name, axis in seen.axes.items()
        if name in before or name in made.sought or not axis.adequacy.adequate
    ]
    after = study.computed(
        lambda progress: diagnose_together(
            [motion.recording for motion in motions],
            names,
            before=before,
            plan=made.plan,
            model=study.plan.model,
            on_progress=progress,
        )
    )
    found = _reidentified(study, motions, after)
    return replace(made, found=found, ruled_out=_ruled_out(before, after))


def _reidentified(
    study: Study, motions: Sequence[IdentificationMotion], after: Mapping[str, AxisDiagnosis]
) -> Identification:
    """Every axis on the first motion, or on the one that shows its parameters.

    An extended model is that of all motions; so one on which it is trusted is enough.
    """
    found = with_diagnoses(study, motions[0].capture.recording, after)
    axes = dict(found.axes)
    for made in (motion for motion in motions if motion.sought):
        shown = identify(
            made.recording, None, model=study.plan.model, diagnose=False, diagnosed=after
        )
        for name in made.sought:
            extended = axes[name].source is ParameterSource.EXTENDED_MODEL
            if shown.axes[name].trusted or not (extended and axes[name].trusted):
                axes[name] = shown.axes[name]
    return replace(found, axes=axes)


def _ruled_out(
    before: Mapping[str, AxisDiagnosis], after: Mapping[str, AxisDiagnosis]
) -> dict[str, tuple[str, ...]]:
    """Possible causes of before that are none any more, by axis."""
    return {
        name: tuple(sorted(explanations(axis) - explanations(after[name])))
        for name, axis in before.items()
    }


# The diagnosis of a run, and whether what it found carries over to the second motion.
#
# Every axis whose base model is not enough is diagnosed on the first motion. What stays open is
# separated by further motions. One motion may hide an effect that another one shows: on one
# sinusoid, a spring is a smaller inertia. The second motion of a trial is recorded anyway. So the
# model is fitted to it as well. Where that is not enough, or gives other parameters, the recording
# joins those of the identification, and all are diagnosed together.


def diagnosed(study: Study, separation: Separation, second: Recorded | None) -> Separation:
    """Find out what the base model lacks, within the time that the study has for it.

    Parameters
    ----------
    study : Study
    separation : Separation
        The first motion alone.
    second : Recorded or None
        The second motion of a trial, with the gains in force before.

    Returns
    -------
    Separation
        With all motions that were made for it, and what is known then.

    Raises
    ------
    LinkError, BoardError
        A motion that is designed to separate what is left did not get to its end.
    """
    try:
        first, missed = _diagnosed_first(study, separation.motions[0])
        separation = Separation((first,), missed)
        if missed:
            study.tell(missed)
            return separation
        separation = separate(study, [first])
        return separation if second is None else _reconsidered(study, separation, second)
    except OutOfTimeError as error:
        study.tell(error.cause)
        return replace(separation, ended=error.cause)


def _diagnosed_first(study: Study, first: IdentificationMotion) -> tuple[IdentificationMotion, str]:
    """The first motion with a diagnosis of each axis whose base model is not enough; and what to
    say where time did not allow that of every axis."""
    found: dict[str, AxisDiagnosis] = {}
    missed = ""
    for name, axis in first.found.axes.items():
        if axis.adequacy.adequate:
            continue
        try:
            found[name] = study.computed(partial(_of_axis, first.recording, name, study.plan.model))
        except DataError as error:
            study.tell(f"axis {name} could not be diagnosed: {error.cause}")
        except OutOfTimeError as error:
            missed = error.cause
            break
    if found:
        first = replace(first, found=with_diagnoses(study, first.recording, found))
    return first, missed


def _of_axis(
    recording: Recording, name: str, model: Model | None, on_progress: Progress
) -> "AxisDiagnosis":
    from edge_ident.diagnosis.diagnose import diagnose

    found = diagnose([recording], model=model, only=[name], on_progress=on_progress)
    return found.axes[name]


def _reconsidered(study: Study, separation: Separation, second: Recorded) -> Separation:
    """The motions of a run with the second one of a trial, if that contradicts what was found."""
    if len(separation.motions) >= study.plan.most_motions:
        return separation
    try:
        against = contradictions(separation.found, second.capture.recording)
        if not against:
            return separation
        for name, sentences in against.items():
            said = "; ".join(sentences)
            study.tell(f"axis {name}: {said}; {second.file} joins the identification")
        trajectory, capture, found = second.motion.trajectory, second.capture, separation.found
        made = IdentificationMotion(second.file, trajectory, capture, found, None, {}, against)
        motions = separation.motions
        return separate(study, [*motions, judged(study, motions, made)])
    except DataError as error:
        log.info("the second motion cannot be judged: %s", error.cause)
        return separation


def contradictions(found: Identification, recording: Recording) -> dict[str, tuple[str, ...]]:
    """What another recording of the machine says against what was identified.

    Parameters
    ----------
    found : Identification
    recording : Recording
        Not used for it.

    Returns
    -------
    mapping of axis name to tuple of str
        Sentences; axes without any are left out. An axis is not judged if a term of its model
        belongs to the time of the recordings before.

    Raises
    ------
    DataError
        Hardly any sample shows an axis in motion.
    """
    seen = identify(recording, model=found.model, diagnose=False)
    said = {
        name: _against(axis, seen.axes[name])
        for name, axis in found.axes.items()
        if not any(named(effect).tied_to_time for effect in axis.compensated_effects)
    }
    return {name: sentences for name, sentences in said.items() if sentences}


def _against(before: AxisIdentification, now: AxisIdentification) -> tuple[str, ...]:
    """What the same model, fitted to another recording, says against it."""
    adequacy = now.adequacy
    found = () if adequacy.adequate else (f"on the second motion, {adequacy.reason}",)
    return found + tuple(
        f"the second motion's {name} is {value:.3g} and not {expected:.3g} {unit}"
        for name, value, expected, unit in _moved(before, now)
    )


def _moved(
    before: AxisIdentification, now: AxisIdentification
) -> Iterator[tuple[str, float, float, str]]:
    """Parameters that both recordings claim to know, and of which they know different values.

    The offset is left out: it drifts, and both motions show it.
    """
    old, new = before.estimate, now.estimate
    apart = np.abs(new.parameters - old.parameters)
    size = np.maximum(np.abs(new.parameters), np.abs(old.parameters))
    moved = (apart > LARGEST_MOVE * size) & (apart > SIGNIFICANT * np.hypot(old.std, new.std))
    for n, name in enumerate(PARAMETERS[:3]):
        if moved[n]:
            yield name.replace("_", " "), new.parameters[n], old.parameters[n], before.units[n]
