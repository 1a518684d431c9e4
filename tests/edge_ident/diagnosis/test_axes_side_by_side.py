"""Axes side by side: the answers are those of one after the other, bit by bit."""

import pytest

import edge_ident
from edge_ident import report
from edge_ident.diagnosis import diagnose as module
from edge_ident.identification.result import Identification
from edge_ident.model.model import BASE, AxisModel, Model, Term

Shown = list[tuple[str, int, int]]
STIFF = {"inertia": 0.4, "viscous_friction": 1.0, "coulomb_friction": 0.5, "offset": 0.1}


@pytest.fixture(scope="module")
def recording() -> edge_ident.Recording:
    """Both axes have a ripple that the base model lacks."""
    ripple = {"cosine": 0.4, "sine": 0.1, "period": 0.3}
    axis = AxisModel((Term(BASE, STIFF), Term("torque_ripple", ripple)))
    return edge_ident.simulate(Model({"x": axis, "z": axis}), seed=3)


@pytest.fixture(autouse=True)
def worth_it(monkeypatch: pytest.MonkeyPatch) -> None:
    """Short recordings are enough here."""
    monkeypatch.setattr(module, "WORTH_HELPERS", 0)


def test_a_diagnosis_in_two_processes_is_the_same(recording: edge_ident.Recording) -> None:
    shown: Shown = []
    alone, together = (
        edge_ident.diagnose(
            [recording], processes=processes, on_progress=lambda *values: shown.append(values)
        )
        for processes in (1, 2)
    )
    assert [cause.term.effect for cause in alone.axes["z"].causes] == ["torque_ripple"]
    documents = [report.diagnosis_document(found, None) for found in (alone, together)]
    assert documents[0] == documents[1]
    last = [values for values in shown if values[0] == "diagnosis"][-1]
    assert last == ("diagnosis", 2 * module.PARTS, 2 * module.PARTS)


def test_an_identification_in_two_processes_is_the_same(recording: edge_ident.Recording) -> None:
    shown: Shown = []
    alone, together = (
        edge_ident.identify(
            recording, processes=processes, on_progress=lambda *values: shown.append(values)
        )
        for processes in (1, 2)
    )
    assert all(axis.diagnosis is not None for axis in alone.axes.values())
    assert told(alone) == told(together)
    assert shown[-1] == ("diagnosis", 2 * module.PARTS, 2 * module.PARTS)


def told(found: Identification) -> object:
    """All but how long it took."""
    document = report.identification_document(found)
    return {key: value for key, value in document.items() if not key.startswith("timing")}


def test_short_recordings_stay_in_one_process(
    recording: edge_ident.Recording, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, "WORTH_HELPERS", 1_000_000)
    monkeypatch.setattr(module, "side_by_side", None)
    assert set(edge_ident.diagnose([recording], processes=2, stability=False).axes) == {"x", "z"}
