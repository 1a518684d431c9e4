"""The answer of a diagnosis: what the model misses, and what to do next; then the parameters."""

from collections.abc import Iterator
from typing import Final

from rich.console import Group, RenderableType
from rich.text import Text

from edge_ident.diagnosis.error_budget import budget_lines
from edge_ident.diagnosis.present.tables import VERDICT_COLOUR, diagnosis_view
from edge_ident.diagnosis.present.wording import only_elsewhere, percent
from edge_ident.diagnosis.result import AxisDiagnosis, Diagnosis
from edge_ident.estimation.trust import off_reference
from edge_ident.report.answer import diagnosed_sentence, remarks
from edge_ident.report.answer_lines import labelled, next_lines
from edge_ident.report.next_steps import blocking_steps, distinct, look_at
from edge_ident.report.parameter_table import parameter_table
from edge_ident.support.next_step import NOTHING_DONE, PAGE, Done, whole_step
from edge_ident.support.words import spoken

_NOTHING: Final = "nothing to repair; keep this recording, to compare with later ones"
_ELSEWHERE: Final = (
    "diagnose both recordings together to see in what they differ: edge-ident diagnose FIRST SECOND"
)
_UNKNOWN: Final = (
    f"see where the error is largest: {PAGE}; check units and sign, and record "
    "several speeds, both ways, over the whole stroke"
)


def diagnosis_answer(
    found: Diagnosis, done: Done = NOTHING_DONE, *, details: bool = False
) -> Group:
    """Verdict of each axis and next steps in a few lines, a table of parameters, then remarks.

    Parameters
    ----------
    found : Diagnosis
    done : Done, optional
        By the command; next steps are whole then.
    details : bool
        Evidence, alternatives, both models and what could not be tested, below.
    """
    every = (step for name in found.axes for step in _steps(name, found))
    steps = distinct(whole_step(step, done) for step in every)
    parts: list[RenderableType] = []
    for name, axis in found.axes.items():
        off = off_reference(axis.findings)
        parts += [] if off is None else [labelled(f"axis {name}", off.message, "bold yellow")]
        parts += [_verdict(name, axis), *([] if details else budget_lines(axis.budget, "  "))]
    parts += [*_forbidden(found), *_validated(found)]
    lines = {name: axis.extended.effective for name, axis in found.axes.items()}
    parts += [*next_lines(steps or [_NOTHING]), parameter_table(found.model, lines)]
    return Group(*parts, *([diagnosis_view(found)] if details else _remarks(found)))


def _verdict(name: str, axis: AxisDiagnosis) -> Text:
    colour = VERDICT_COLOUR[axis.verdict]
    return Text.assemble((f"axis {name}", "bold"), " ", (diagnosed_sentence(axis), colour))


def _forbidden(found: Diagnosis) -> Iterator[Text]:
    for name, axis in found.axes.items():
        for finding in axis.findings:
            if finding.blocks:
                said = f"axis {name}, {finding.code}: {finding.message}"
                yield labelled("no cause is named", said, "bold red")


def _validated(found: Diagnosis) -> Iterator[Text]:
    for name, of_axis in found.validation.items():
        base, extended = percent(of_axis.base), percent(of_axis.extended)
        said = f"axis {name}, the base model leaves {base} and the extended one {extended}"
        yield labelled("on the recording for validation", said)


def _steps(name: str, found: Diagnosis) -> Iterator[str]:
    axis = found.axes[name]
    mends = blocking_steps(axis.findings)
    yield from mends
    if (off := off_reference(axis.findings)) is not None:
        yield off.next_step
    yield look_at(name, axis.causes)
    for cause in axis.causes[:1]:
        for other in cause.inseparable[:1]:
            pair = f"{spoken(cause.term.effect)} from {spoken(other.effect)}"
            yield f"to tell {pair}, record {other.experiment}"
    if not axis.verdict.complete and not mends:
        yield _ELSEWHERE if only_elsewhere(name, found) else _UNKNOWN


def _remarks(found: Diagnosis) -> Iterator[Text]:
    for finding in found.data_quality:
        yield labelled(finding.code, f"axis {finding.axis}: {finding.message}", "yellow")
    others = {
        name: tuple(f for f in axis.findings if f is not off_reference(axis.findings))
        for name, axis in found.axes.items()
    }
    yield from remarks(others)
