"""Findings, and what to do next.

Each step is one line, without a capital letter and without a full stop, as in a finding.
"""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Final, TypeVar

from edge_ident.estimation.trust import Finding
from edge_ident.identification.result import Identification
from edge_ident.report.view import Line
from edge_ident.support.next_step import Done, whole_step
from edge_ident.support.words import listed

if TYPE_CHECKING:
    from edge_ident.diagnosis.result import Cause, Diagnosis


_Found = TypeVar("_Found", "Identification", "Diagnosis")
MOST: Final = 3
"""Steps for one axis; more would hide the first."""
OF_MODEL: Final = (
    "base_inadequate", "not_diagnosed", "unexplained", "partly_explained", "extended_model",
)  # fmt: skip
"""Codes of findings that the line about the model says."""
DESIGN_GAINS: Final = "design gains from this recording: edge-ident gains FILE"


def with_next_steps(found: _Found, done: Done) -> _Found:
    """The same result, its next steps whole commands without what was done already.

    Terminal, page and document then say the same.

    Parameters
    ----------
    found : Identification or Diagnosis
    done : Done
    """
    axes: dict[str, Any] = {}
    for name, axis in found.axes.items():
        axes[name] = replace(axis, findings=_whole(axis.findings, done))
        diagnosed = getattr(axis, "diagnosis", None)
        if diagnosed is not None:
            findings = _whole(diagnosed.findings, done)
            axes[name] = replace(axes[name], diagnosis=replace(diagnosed, findings=findings))
    return replace(found, axes=axes)


def _whole(findings: Iterable[Finding], done: Done) -> tuple[Finding, ...]:
    return tuple(replace(f, next_step=whole_step(f.next_step, done)) for f in findings)


def blocking_steps(findings: Iterable[Finding]) -> list[str]:
    """What makes an axis trusted that is not, by its findings."""
    return [finding.next_step for finding in findings if finding.blocks][:MOST]


def look_at(name: str, causes: "Iterable[Cause]") -> str:
    """Where to look at the machine for what was found on an axis; empty without causes."""
    from edge_ident.diagnosis.wording import parts_of  # a sound axis does without

    parts = parts_of(causes)
    return f"on axis {name}, look at: {'; '.join(parts[:MOST])}" if parts else ""


def identification_steps(found: Identification) -> list[str]:
    """After an identification: what the findings of its axes ask for; none where all is well."""
    steps = [step for axis in found.axes.values() for step in blocking_steps(axis.findings)]
    steps += [
        finding.next_step
        for axis in found.axes.values()
        for finding in axis.findings
        if finding.code in OF_MODEL and axis.trusted
    ]
    return distinct(steps)


def distinct(steps: Iterable[str]) -> list[str]:
    """Each step once, in their order; empty ones are none."""
    return list(dict.fromkeys(filter(None, steps)))


# Findings as lines.


def finding_lines(findings: Iterable[Finding]) -> Iterator[Line]:
    """Each finding with its next step."""
    for finding in findings:
        yield Line(finding.message, f"  {finding.code}", "bad" if finding.blocks else "doubt")
        yield Line(f"    next: {finding.next_step}")


def blocking_lines(name: str, findings: Iterable[Finding], forbids: str) -> Iterator[Line]:
    """Findings of an axis that block, each with what it forbids."""
    for finding in findings:
        if finding.blocks:
            yield Line(f"axis {name}, {finding.code}: {finding.message}", forbids, "bad")


def remarks(findings: Mapping[str, Iterable[Finding]]) -> Iterator[Line]:
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
        yield Line(said, code, "doubt")
