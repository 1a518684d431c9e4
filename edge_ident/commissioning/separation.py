"""The motions that an open diagnosis asks for: designed, announced, made, and judged together.

They end when one explanation is left for every axis, when the motions or their time are used up, or
when no motion inside the limits separates what is left.
"""

import logging
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from edge_ident.commissioning.identification_motions import (
    IdentificationMotion,
    Study,
    capture_file,
    captured,
    duration_s,
    identified,
    progress_on,
)
from edge_ident.diagnosis.result import AxisDiagnosis, Diagnosis
from edge_ident.errors import DataError
from edge_ident.experiment.announcement import announced, inseparable_sentence
from edge_ident.experiment.open_causes import explanations, is_open, questions, without_causes
from edge_ident.experiment.result import MotionPlan
from edge_ident.identification.identify import identify
from edge_ident.identification.result import Identification
from edge_ident.signals.data_checks import check_recording
from edge_ident.signals.recording import Recording

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
    """Of the axes whose base model was not enough."""
    every = {name: axis.diagnosis for name, axis in found.axes.items()}
    return {name: axis for name, axis in every.items() if axis is not None}


def separate(study: Study, first: IdentificationMotion) -> Separation:
    """Make motions until one explanation is left, as far as the study may go.

    Every capture is saved as it is made. The machine is at rest in between.

    Raises
    ------
    LinkError, BoardError
        A motion did not get to its end.
    """
    motions = [first]
    while any(map(is_open, _left(motions).values())):
        if len(motions) >= study.most_motions:
            return Separation(tuple(motions), _used_up(len(motions)))
        try:
            ended = _further(study, motions)
        except DataError as error:
            ended = f"no further motion: {error.cause}"
        if ended:
            return Separation(tuple(motions), ended)
    return Separation(tuple(motions), _settled(motions))


def _left(motions: Sequence[IdentificationMotion]) -> dict[str, AxisDiagnosis]:
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


def _settled(motions: Sequence[IdentificationMotion]) -> str:
    """What there is to say where no motion is to be made any more."""
    still = [
        name for name, axis in diagnoses(motions[-1].found).items() if is_open(questions(axis))
    ]
    if still:
        return f"axis {', '.join(still)}: what is left stayed open on a motion that was made for it"
    return "one explanation is left" if len(motions) > 1 else ""


def _used_up(motions: int) -> str:
    return "several explanations are left after " + (
        "the one motion that was allowed" if motions == 1 else f"the {motions} that were allowed"
    )


def _further(study: Study, motions: list[IdentificationMotion]) -> str:
    """Add a motion; or say why none is made."""
    plan = _designed(study, motions)
    trajectory = plan.trajectory
    if trajectory is None:
        return _inseparable(plan)
    spent_s = sum(motion.duration_s for motion in motions)
    wanted_s = duration_s(trajectory)
    if spent_s + wanted_s > study.most_s:
        return (
            f"several explanations are left: the next motion would take {wanted_s:.0f} s, "
            f"{max(study.most_s - spent_s, 0.0):.0f} s of {study.most_s:.0f} s are left"
        )
    number = len(motions) + 1
    for line in (f"motion {number}, {wanted_s:.0f} s, is designed", *announced(plan)):
        study.observer.say(line)
        log.info(line)
    capture = captured(study, trajectory, number)
    study.board.finish()
    check_recording(capture.recording)
    made = IdentificationMotion(
        capture_file(number), trajectory, capture, motions[-1].found, plan, {}
    )
    motions.append(judged(study, motions, made, plan))
    return ""


def _designed(study: Study, motions: Sequence[IdentificationMotion]) -> MotionPlan:
    """The motion that separates what is left; the experiment loads here, with scipy."""
    from edge_ident.experiment.plan import BoardSide, plan_motion

    board = study.board
    side = BoardSide(board.limits(), board.active_gains(), board.identity.control_delay_s)
    recordings = [motion.recording for motion in motions]
    return plan_motion(
        Diagnosis(_asked(study, motions, recordings), (), {}),
        recordings,
        study.drive,
        board=side,
        seed=study.seed,
        on_progress=progress_on(study),
    )


def _asked(
    study: Study, motions: Sequence[IdentificationMotion], recordings: Sequence[Recording]
) -> dict[str, AxisDiagnosis]:
    """What is to be settled on each axis; an adequate one moves along, and nothing is asked of it.

    A diagnosis tells its noise and its model, too.
    """
    from edge_ident.diagnosis.diagnose import diagnose

    open_axes, found = _left(motions), motions[-1].found
    others = [name for name in found.axes if name not in open_axes]
    if not others:
        return open_axes
    beside = diagnose(
        recordings, model=study.model, stability=False, only=others, on_progress=progress_on(study)
    )
    return {
        name: open_axes[name] if name in open_axes else without_causes(beside.axes[name])
        for name in found.axes
    }


def judged(
    study: Study,
    earlier: Sequence[IdentificationMotion],
    made: IdentificationMotion,
    plan: MotionPlan,
) -> IdentificationMotion:
    """A motion with what is known once it is diagnosed together with those before."""
    from edge_ident.experiment.together import diagnose_together

    before = diagnoses(made.found)
    seen = identify(made.recording, None, model=study.model, diagnose=False)
    names = [
        name for name, axis in seen.axes.items() if name in before or not axis.adequacy.adequate
    ]
    after = diagnose_together(
        [motion.recording for motion in (*earlier, made)],
        names,
        before=before,
        plan=plan,
        model=study.model,
        on_progress=progress_on(study),
    )
    found = identified(study, earlier[0].capture.recording, after)
    return IdentificationMotion(
        made.file, made.trajectory, made.capture, found, plan, _ruled_out(before, after)
    )


def _ruled_out(
    before: Mapping[str, AxisDiagnosis], after: Mapping[str, AxisDiagnosis]
) -> dict[str, tuple[str, ...]]:
    """Possible causes of before that are none any more, by axis."""
    return {
        name: tuple(sorted(explanations(axis) - explanations(after[name])))
        for name, axis in before.items()
    }


def _inseparable(plan: MotionPlan) -> str:
    """Why no motion was designed, with the numbers that show it."""
    return "several explanations are left: " + "; ".join(_reasons(plan))


def _reasons(plan: MotionPlan) -> Iterator[str]:
    for pair in plan.pairs:
        yield f"axis {pair.axis}, {inseparable_sentence(pair)}"
    for left in plan.left_out:
        yield f"axis {left.axis}, {left.effect.replace('_', ' ')}: {left.reason}"
