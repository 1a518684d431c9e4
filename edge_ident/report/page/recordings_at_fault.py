"""The first screen of an axis where recordings are at fault, or differ."""

from dataclasses import replace
from typing import Final

from markupsafe import Markup, escape

from edge_ident.diagnosis.present.wording import only_elsewhere
from edge_ident.diagnosis.result import Diagnosis
from edge_ident.report.next_steps import blocking_steps
from edge_ident.report.page.card import Card
from edge_ident.report.page.wording import sentence

TOGETHER: Final = "FIRST SECOND"
"""Stands for the names of the recordings, which the page knows."""


def of_recordings(card: Card, diagnosis: Diagnosis) -> Card:
    """The card with what forbids to name a cause in place of advice on the machine, and with what
    tells in what two recordings differ.

    Parameters
    ----------
    card : Card
    diagnosis : Diagnosis

    Returns
    -------
    Card
        The same where nothing forbids it.
    """
    findings = diagnosis.axes[card.axis].findings
    if forbid := [finding.message for finding in findings if finding.blocks]:
        return replace(
            card,
            verdict=Markup("No cause is named: {}").format(sentence(forbid[0])),
            sure=[Markup("<b>Sure that this recording can tell none.</b>"), *card.sure[1:]],
            part=[Markup("The recording and its columns, before the machine.")],
            action=[escape(sentence(step)) for step in blocking_steps(findings)],
        )
    if only_elsewhere(card.axis, diagnosis):
        together = Markup("Diagnose both recordings together: <code>{}</code>.").format(
            f"edge-ident diagnose {TOGETHER}"
        )
        if diagnosis.axes[card.axis].causes:
            return replace(card, action=[*card.action, together])
        return replace(
            card,
            verdict=Markup(
                "Inertia and friction explain this recording, and not the other one: the machine "
                "changed, or what was recorded of it."
            ),
            sure=[Markup("<b>Sure that the recordings differ. Not sure how.</b>"), *card.sure[1:]],
            part=[Markup("What was changed between the recordings: load, scale, sign, warmth.")],
            action=[together],
        )
    return card
