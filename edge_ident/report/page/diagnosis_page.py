"""A diagnosis as one HTML page."""

import shlex
from dataclasses import replace
from pathlib import Path

from markupsafe import Markup, escape

from edge_ident.diagnosis.present.document import diagnosis_document
from edge_ident.diagnosis.result import Diagnosis
from edge_ident.report.page.axis_details import axis_details
from edge_ident.report.page.card import Card
from edge_ident.report.page.diagnosis_card import diagnosis_card
from edge_ident.report.page.provenance import Provenance
from edge_ident.report.page.recordings_at_fault import TOGETHER
from edge_ident.report.page.rendering import write_html
from edge_ident.report.page.wording import sentence
from edge_ident.support.words import listed


def write_page(
    diagnosis: Diagnosis, provenance: Provenance, folder: Path, model_file: Path | None = None
) -> Path:
    """Write the page.

    Parameters
    ----------
    diagnosis : Diagnosis
    provenance : Provenance
        With the recordings that it was made from.
    folder : Path
    model_file : Path or None
        Path of the extended model's file, if there is one.

    Returns
    -------
    Path
        The page.
    """
    names = listed(file for file, _ in provenance.files)
    says = "says" if len(provenance.files) == 1 else "say"
    content = {
        "title": f"What {names} {says} about the machine",
        "findings": _findings(diagnosis),
        "cards": [
            _named(diagnosis_card(f"c{n}", name, diagnosis), provenance)
            for n, name in enumerate(diagnosis.axes)
        ],
        "details": [
            axis_details(f"a{n}", name, diagnosis) for n, name in enumerate(diagnosis.axes)
        ],
        "provenance": provenance,
        "model_file": model_file,
    }
    document = diagnosis_document(diagnosis, model_file)
    return write_html("diagnosis.html.jinja", content, document, folder)


def _named(card: Card, provenance: Provenance) -> Card:
    """The card with the names of the recordings in its commands."""
    files = [*provenance.files, *([provenance.validation] if provenance.validation else [])]
    names = str(escape(shlex.join(name for name, _ in files)))
    action = [Markup(str(step).replace(TOGETHER, names)) for step in card.action]
    return replace(card, action=action)


def _findings(diagnosis: Diagnosis) -> list[tuple[str, list[str], str]]:
    """Message, axes and code of each defect of the data."""
    axes: dict[tuple[str, str], list[str]] = {}
    for finding in diagnosis.data_quality:
        axes.setdefault((finding.message, finding.code), []).append(finding.axis)
    return [(sentence(message), names, code) for (message, code), names in axes.items()]
