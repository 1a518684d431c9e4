"""Terminal, JSON, page and survey of a diagnosis say the same, whatever it found."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Final

import numpy as np
import pytest
from rich.console import Console

from edge_ident.diagnosis.error_budget import AgreeingCurve, BudgetCurve
from edge_ident.diagnosis.measures import Verdict
from edge_ident.diagnosis.result import AxisDiagnosis, Cause, Diagnosis
from edge_ident.estimation.trust import Finding
from edge_ident.model.measured_curves import entries
from edge_ident.model.model import Term
from edge_ident.report.diagnosis import diagnosis_answer, diagnosis_document
from edge_ident.report.numbers import digits
from edge_ident.report.page.diagnosis_page import write_page
from edge_ident.report.page.rendering import Provenance
from edge_ident.support.words import spoken
from tests.edge_ident.diagnosis import hand_made
from tests.edge_ident.report.page.pages import read

RIPPLE, DIRECTION = hand_made.ripple(), hand_made.friction_by_direction()
LATE: Final = Finding("effort_late", "recorded by another clock", "record both", blocks=True)

CURVE: Final = AgreeingCurve(
    Term("friction_over_speed", {"first": 0.0, "last": 2.0, **entries(np.linspace(0.0, 0.3, 33))}),
    BudgetCurve(
        "friction", "speed", *(np.linspace(low, low + 0.2, 5) for low in (0.0, 0.1, 0.05, 0.15)),
        unit="N*m", coordinate_unit="rad/s",
    ),
    share=0.02,
    freedom=4.0,
)  # fmt: skip


def axis(verdict: Verdict, *causes: Cause, suspected: Sequence[Cause] = ()) -> AxisDiagnosis:
    return replace(hand_made.axis(verdict, *causes), suspected=tuple(suspected))


FOUND: Final[dict[str, AxisDiagnosis]] = {
    "sound": axis(Verdict.ADEQUATE),
    "sound, one suspected": axis(Verdict.ADEQUATE, suspected=[RIPPLE]),
    "one cause": axis(Verdict.EXPLAINED, RIPPLE),
    "another cause": axis(Verdict.EXPLAINED, DIRECTION),
    "two causes": axis(Verdict.EXPLAINED, RIPPLE, DIRECTION),
    "a cause and a suspicion": axis(Verdict.EXPLAINED, RIPPLE, suspected=[DIRECTION]),
    "nothing is known": axis(Verdict.UNEXPLAINED),
    "suspected only": axis(Verdict.UNEXPLAINED, suspected=[DIRECTION]),
    "a cause, and something else": axis(Verdict.PARTLY_EXPLAINED, RIPPLE),
    "a curve without a name": replace(axis(Verdict.PARTLY_EXPLAINED), curves=(CURVE,)),
    "a cause and a curve": replace(axis(Verdict.PARTLY_EXPLAINED, RIPPLE), curves=(CURVE,)),
    "contradictory data": replace(axis(Verdict.UNEXPLAINED), findings=(LATE,)),
}


@pytest.mark.parametrize("name", FOUND)
def test_all_say_the_same(name: str, tmp_path: Path) -> None:
    of_axis = FOUND[name]
    found = Diagnosis({"x": of_axis}, (), {})
    in_json = diagnosis_document(found, None)["axes"]["x"]
    said = terminal(found)
    page = read(
        write_page(
            found, Provenance((("a.csv", "0" * 64),), "edge-ident diagnose a.csv", "1"), tmp_path
        )
    ).text()

    assert in_json["verdict"] == of_axis.verdict.value
    assert ("unexplained" in said) is (of_axis.verdict is Verdict.UNEXPLAINED)
    nothing = "Nothing is wrong that this recording can show."
    assert (nothing in page) is (of_axis.verdict is Verdict.ADEQUATE)
    partly = f"{digits(100 * in_json['explained_share'], 2)}\u00a0% of what the simple model gets"
    assert (partly in page) is (of_axis.verdict is Verdict.PARTLY_EXPLAINED)
    assert ("partly explained" in said) is (of_axis.verdict is Verdict.PARTLY_EXPLAINED)
    for curve, document in zip(of_axis.curves, in_json["curves"], strict=True):
        assert document["values"] == curve.curve.values.tolist()
        assert str(curve) in said
        assert f"over {curve.curve.over}" in page
    explains = "This explains what the simple model gets wrong."
    assert (explains in page) is (of_axis.verdict is Verdict.EXPLAINED)

    confirm = RIPPLE in of_axis.causes
    assert ("edge-ident diagnose a.csv --validate OTHER" in page) is confirm

    for kind in ("causes", "suspected"):
        effects = [cause.term.effect for cause in getattr(of_axis, kind)]
        assert [cause["effect"] for cause in in_json[kind]] == effects
        for effect in effects:
            assert spoken(effect) in said
            assert spoken(effect) in page
    assert found.conclusive is not any(warning["blocks"] for warning in in_json["findings"])
    assert (LATE.message in said) is (LATE in of_axis.findings)


def terminal(found: Diagnosis) -> str:
    console = Console(width=400, highlight=False)
    with console.capture() as captured:
        console.print(diagnosis_answer(found), soft_wrap=True)
    return captured.get()
