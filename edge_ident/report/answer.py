"""The answer of an identification: may it be trusted, what the model misses, what to do next.

These few lines come first; one table of parameters and the remarks follow.
"""

from collections.abc import Iterable, Iterator, Mapping
from typing import TYPE_CHECKING

from rich.console import Group, RenderableType
from rich.text import Text

from edge_ident.diagnosis.error_budget import budget_lines
from edge_ident.diagnosis.present.wording import verdict_sentence
from edge_ident.estimation.trust import Finding
from edge_ident.identification.result import AxisIdentification, Identification, known_sentence
from edge_ident.model.model import PARAMETERS
from edge_ident.report.answer_lines import labelled, next_lines
from edge_ident.report.identification_tables import identification_view
from edge_ident.report.next_steps import DESIGN_GAINS, OF_MODEL, identification_steps
from edge_ident.report.parameter_table import parameter_table
from edge_ident.support.next_step import NOTHING_DONE, Done, whole_step
from edge_ident.support.words import listed, spoken

if TYPE_CHECKING:
    from edge_ident.diagnosis.result import AxisDiagnosis


def identification_answer(
    found: Identification,
    done: Done = NOTHING_DONE,
    *,
    details: bool = False,
    without_findings: str = DESIGN_GAINS,
) -> Group:
    """Trust, model and next step in a few lines, then one table of parameters, then remarks.

    Parameters
    ----------
    found : Identification
    done : Done, optional
        By the command; next steps are whole then.
    details : bool
        Every estimator beside the others, with measures, timing and all findings, below.
    without_findings : str
        What to do next where no finding asks for anything.
    """
    steps = identification_steps(found) or [without_findings]
    parts: list[RenderableType] = [
        *trust_lines(found),
        *model_lines(found),
        *_budgets(found),
        *next_lines(whole_step(step, done) for step in steps),
        parameter_table(found.model, {name: axis.line for name, axis in found.axes.items()}),
    ]
    rest = [identification_view(found)] if details else identification_remarks(found)
    return Group(*parts, *rest)


def _budgets(found: Identification) -> Iterator["RenderableType"]:
    """Where the effort lies that the base model misses, of axes that were diagnosed."""
    for name, axis in found.axes.items():
        if axis.budget is not None:
            yield from budget_lines(axis.budget, f"axis {name}: ")


def identification_remarks(found: Identification) -> Iterator[Text]:
    """What else there is to know of a recording."""
    return remarks({name: axis.findings for name, axis in found.axes.items()})


def trusted_line(names: Iterable[str]) -> Text:
    """Axes whose parameters may be used."""
    return labelled("trusted", f"the parameters of {listed(names)}", "bold green")


def distrusted_line(said: str) -> Text:
    """What may not be used, and why."""
    return labelled("not trusted", said, "bold red")


def trust_lines(found: Identification) -> Iterator[Text]:
    """What speaks against an axis, a line for each, and what of it is known nevertheless; then the
    axes that are trusted."""
    for name, axis in found.axes.items():
        for finding in axis.findings:
            if finding.blocks:
                yield distrusted_line(f"axis {name}, {finding.code}: {finding.message}")
        known = dict(zip(PARAMETERS, axis.effective_known, strict=True))
        if not axis.trusted and any(known.values()):
            unknown = [parameter for parameter, sure in known.items() if not sure]
            sentence = known_sentence([one for one in known if known[one]], unknown)
            yield labelled("axis " + name, sentence)
    if trusted := [name for name, axis in found.axes.items() if axis.trusted]:
        yield trusted_line(trusted)


def model_lines(found: Identification) -> Iterator[Text]:
    """What the model misses, a line for each axis; where it is enough, one line for all."""
    enough: dict[str, list[str]] = {}
    for name, axis in found.axes.items():
        if axis.diagnosis is None and axis.adequacy.adequate:
            enough.setdefault(_enough(axis), []).append(name)
        else:
            yield labelled("model", f"axis {name} {model_sentence(axis)}")
    for said, names in enough.items():
        lowest_hz = min(found.axes[name].adequacy.cutoff_hz for name in names)
        axes = "axis" if len(names) == 1 else "axes"
        where = f"on {axes} {listed(names)}, compared up to {lowest_hz:.3g} Hz"
        yield labelled("model", f"{said} {where}")


def _enough(axis: AxisIdentification) -> str:
    model = ["rigid body", "friction", *map(spoken, axis.compensated_effects)]
    return f"{listed(model)} are enough"


def model_sentence(axis: AxisIdentification) -> str:
    """What the model of an axis misses; the axis is named before."""
    if axis.diagnosis is not None:
        return diagnosed_sentence(axis.diagnosis)
    if axis.adequacy.adequate:
        return ""
    return f"is not diagnosed: {axis.adequacy.reason}"


def diagnosed_sentence(axis: "AxisDiagnosis") -> str:
    """The verdict, what the recordings do not tell from its causes, and what is suspected."""
    said = [verdict_sentence(axis)]
    for cause in axis.causes:
        if others := [spoken(other.effect) for other in cause.inseparable]:
            this = spoken(cause.term.effect)
            said.append(f"the recordings do not tell {this} from {listed(others)}")
    if suspected := [spoken(cause.term.effect) for cause in axis.suspected]:
        said.append(f"suspected only: {listed(dict.fromkeys(suspected))}")
    return "; ".join(dict.fromkeys(said))  # two orders of ripple may have the same rivals


def remarks(findings: Mapping[str, Iterable[Finding]]) -> Iterator[Text]:
    """Findings by axis that block nothing and were not said yet, each code once.

    Parameters
    ----------
    findings : mapping of axis name to iterable of Finding
    """
    seen: dict[str, tuple[Finding, list[str]]] = {}
    for name, of_axis in findings.items():
        for finding in of_axis:
            if not finding.blocks and finding.code not in OF_MODEL:
                seen.setdefault(finding.code, (finding, []))[1].append(name)
    for code, (finding, (first, *others)) in seen.items():
        alike = f"; likewise on {listed(others)}" if others else ""
        said = f"axis {first}: {finding.message}{alike}. Next: {finding.next_step}"
        yield labelled(code, said, "yellow")
