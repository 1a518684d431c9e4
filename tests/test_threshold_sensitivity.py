"""The experiment on the thresholds: what it changes, it changes everywhere and for a while only."""

from edge_ident.diagnosis import axis_diagnosis
from edge_ident.diagnosis import diagnose as engine
from edge_ident.diagnosis.fit.fitting import fit
from edge_ident.diagnosis.select.thresholds import thresholds
from tests.edge_ident.diagnosis.select.test_search_parts import recorded, rigid, swing
from tools.diagnosis_benchmark.exchanging import changed_threshold, remembering
from tools.threshold_sensitivity import UNDECIDING, variants


def test_every_threshold_that_decides_is_lowered_and_raised() -> None:
    for name, threshold in thresholds().items():
        tried = [value for of, value in variants().values() if of == name]
        if name in UNDECIDING:
            assert not tried
        elif name == "BOOTSTRAP_SEED":
            assert threshold.value not in tried
        else:
            assert min(tried) < threshold.value < max(tried), name


def test_a_changed_threshold_decides_until_it_is_given_back() -> None:
    t, x, v, a = swing(seconds=10.0)
    recording = recorded(t, x, rigid(v, a) + 0.25 * abs(v), noise=0.05)

    def causes() -> list[str]:
        return [cause.term.effect for cause in engine.diagnose([recording]).axes["x"].causes]

    with remembering():
        assert causes() == ["asymmetric_friction"]
        with changed_threshold("MOST_TERMS", 0):
            assert causes() == []
        assert causes() == ["asymmetric_friction"]
    assert vars(axis_diagnosis)["fit"] is fit
