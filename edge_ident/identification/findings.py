"""What the check of the base model and the diagnosis say about an answer."""

from typing import TYPE_CHECKING

from edge_ident.diagnosis.verdict import Verdict
from edge_ident.errors import DataError
from edge_ident.estimation.effort_checks import UNRELATED, check_effort
from edge_ident.estimation.least_squares import EstimationPart
from edge_ident.estimation.trust import Finding
from edge_ident.identification.adequacy import Adequacy
from edge_ident.signals.conditioning import Signals
from edge_ident.signals.recording import Recording
from edge_ident.signals.scale_checks import check_inertia, check_scale
from edge_ident.signals.tracking import OFF
from edge_ident.support.next_step import PAGE
from edge_ident.support.words import listed, spoken

if TYPE_CHECKING:
    from edge_ident.diagnosis.result import AxisDiagnosis


def describe_model(
    adequacy: Adequacy, outcome: "AxisDiagnosis | DataError | None", *, extended: bool
) -> list[Finding]:
    """Findings about the model that an answer belongs to.

    Parameters
    ----------
    adequacy : Adequacy
        Of the base model.
    outcome : AxisDiagnosis, DataError or None
        Of the diagnosis where the base model is not adequate, here or in another recording, or why
        there was none.
    extended : bool
        Whether the answer is that of the extended model.
    """
    if adequacy.adequate and outcome is None:
        return []
    if isinstance(outcome, DataError):
        return [
            Finding(
                "not_diagnosed",
                f"{adequacy.reason}; this could not be diagnosed: {outcome.cause}",
                f"{outcome.next_step}; the intervals include what parts of the motion change",
                blocks=False,
            )
        ]
    if outcome is None:
        return [
            Finding(
                "base_inadequate",
                adequacy.reason,
                f"have it diagnosed: {PAGE}",
                blocks=False,
            )
        ]
    said = extended or outcome.verdict is Verdict.UNEXPLAINED
    # what the base model alone hardly determines is no doubt about another model's parameters
    of_answer = [f for f in outcome.findings if not (extended and f.code == "undetermined")]
    chosen = _of_several_axes(outcome) if extended else []
    return [*(_verdict(outcome) if said else []), *chosen, *of_answer]


def _of_several_axes(diagnosed: "AxisDiagnosis") -> list[Finding]:
    """Whether several axes act on this one by the same effect. Deviations are those of the model
    that was chosen, and many sums and senses of joints were tried."""
    terms = [cause.term for cause in (*diagnosed.causes, *diagnosed.minor)]
    effects = [term.effect for term in terms if term.source_axis is not None]
    several = [name for name in dict.fromkeys(effects) if effects.count(name) > 1]
    if not several:
        return []
    return [
        Finding(
            "several_axes",
            f"several axes act on this one by {listed(map(spoken, several))}: which of them do was "
            "chosen among many, and the deviations do not know of that",
            "let another motion confirm it: edge-ident diagnose FILE --validate OTHER --output "
            "DIR, then edge-ident identify FILE --model DIR/model.json",
            blocks=False,
        )
    ]


def of_effort(signals: Signals, part: EstimationPart, *, extended: bool) -> list[Finding]:
    """Findings against the effort; what the base model explains of it is no doubt about another."""
    return [f for f in check_effort(signals, part) if not (extended and f.code == UNRELATED)]


def describe_scales(recording: Recording, name: str, inertia: float) -> list[Finding]:
    """Questions about units, from the recording and from the inertia that follows."""
    unit = recording.axes[name].parameter_units[0]
    asked = check_scale(recording, name)
    return [
        Finding(question.code, question.message, question.next_step, blocks=False)
        for question in asked + check_inertia(name, inertia, unit)
    ]


def _verdict(diagnosed: "AxisDiagnosis") -> list[Finding]:
    from edge_ident.diagnosis.present.wording import findings_sentence

    if diagnosed.verdict is Verdict.UNEXPLAINED:
        return [
            Finding(
                "unexplained",
                findings_sentence(diagnosed),
                f"see on its page what is left, and where: {PAGE}",
                blocks=False,
            )
        ]
    found = listed(
        dict.fromkeys(spoken(c.term.effect) for c in diagnosed.causes or diagnosed.minor)
    )
    if not found:
        return []
    return [
        Finding(
            "extended_model",
            f"the base model lacks {found}; with it the model leaves "
            f"{diagnosed.extended.fitted:.2%} of the effort",
            f"read its page before you adjust the machine: {PAGE}",
            blocks=False,
        )
    ]


def said_once(findings: list[Finding]) -> tuple[Finding, ...]:
    """Findings, each said once: identification and diagnosis make some of the same checks.

    Both may find a negative parameter or a late effort, on other samples and so with other numbers.
    The one that blocks has the numbers of the answer, and is kept.
    """
    kept: dict[tuple[str, str], Finding] = {}
    for finding in findings:
        numbers_differ = finding.code.startswith(("negative_", "effort_", OFF))
        same = (finding.code, "" if numbers_differ else finding.message)
        if same not in kept or finding.blocks:
            kept[same] = finding
    return tuple(kept.values())
