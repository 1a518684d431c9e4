"""What scripts read of a diagnosis: the contract's fields, finite numbers, the same bytes."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from edge_ident.diagnosis.measures import Verdict
from edge_ident.diagnosis.result import Refused
from edge_ident.diagnosis.wording import facts, verdict_sentence
from edge_ident.report.diagnosis import diagnosis_document
from edge_ident.support.documents import to_json
from tests.edge_ident.diagnosis import hand_made


def read(**options: bool) -> dict:
    return json.loads(to_json(diagnosis_document(hand_made.diagnosis(**options), Path("m.json"))))


def test_every_field_of_the_contract_is_there() -> None:
    document = read(doubtful=True)
    assert document["schema"] == "edge-ident/diagnosis/2"
    assert document["model"] == "m.json"
    assert document["data_quality"] == [
        {
            "code": "uneven_sampling",
            "axis": "x",
            "message": "stamps stray by 0.3 sampling periods",
        }
    ]
    axis = document["axes"]["x"]
    assert axis["verdict"] == "explained"
    assert axis["not_testable"][0].keys() == {"effect", "reason", "experiment"}
    for model in (axis["base"], axis["extended"]):
        assert model["relative_residual"].keys() == {"fitted", "held_out"}
        assert model["metric"].keys() == {"time_spectral", "fit", "relative_residual"}
        assert model["parameters"]["inertia"].keys() == {"value", "std", "unit"}
        assert model["motion_error"] == {"rms": None, "unit": "rad"}
    assert axis["residual_whereabouts"]["base"].keys() == {
        "position", "velocity", "distance_since_reversal", "acceleration_of_z", "time",
    }  # fmt: skip
    assert isinstance(axis["noise_floor"], float)
    assert axis["parameters_shift"]["inertia"] == {"base": 0.42, "extended": 0.5}


def test_a_cause_names_its_effect_with_values_units_gain_and_rivals() -> None:
    first, second = read()["axes"]["x"]["causes"]
    assert (first["effect"], second["effect"]) == ("torque_ripple", "asymmetric_friction")
    assert first["parameters"]["period"] == {"value": 0.9, "std": 0.0005, "unit": "rad"}
    assert first["held_out_gain"] == 0.31
    assert first["held_out_gain_interval"] == [0.27, 0.35]
    assert first["evidence"].startswith("effort rises and falls")
    alternative = second["rivals"][0]
    assert (alternative["effect"], alternative["separable"]) == ("nonlinear_viscous", False)
    assert alternative["evidence"] == "0.97 alike [so far]"


def test_units_follow_from_those_of_the_axis() -> None:
    diagnosis = hand_made.diagnosis()
    axis = diagnosis.axes["x"]
    linear = replace(axis, model=replace(axis.model, position_unit="m", effort_unit="A"))
    document = diagnosis_document(replace(diagnosis, axes={"q": linear}), None)
    found = document["axes"]["q"]
    assert found["base"]["parameters"]["inertia"]["unit"] == "A*s^2/m"
    assert found["causes"][0]["parameters"]["cosine"]["unit"] == "A"
    assert document["model"] is None


def _seen_there(residual: float, friction_anew: float) -> dict[str, float]:
    return {
        "relative_residual": residual,
        "relative_residual_with_friction_anew": friction_anew,
    }


def test_validation_is_null_without_a_recording_for_it() -> None:
    diagnosis = hand_made.diagnosis()
    validated = diagnosis_document(diagnosis, None)["validation"]
    assert validated["x"]["base"] == _seen_there(0.12, 0.11)
    assert validated["x"]["extended"] == _seen_there(0.04, 0.03)
    assert diagnosis_document(replace(diagnosis, validation={}), None)["validation"] is None


def test_what_could_not_be_determined_is_null_for_json_has_no_infinity() -> None:
    diagnosis = hand_made.diagnosis()
    axis = diagnosis.axes["x"]
    cause = replace(axis.causes[0], held_out_gain_interval=(np.nan, np.inf))
    unsure = replace(axis.base.estimate, std=np.array([np.inf, 0.1, 0.1, 0.1]))
    changed = replace(axis, causes=(cause,), base=replace(axis.base, estimate=unsure))
    document = json.loads(
        to_json(diagnosis_document(replace(diagnosis, axes={"x": changed}), None))
    )
    found = document["axes"]["x"]
    assert found["causes"][0]["held_out_gain_interval"] == [None, None]
    assert found["base"]["parameters"]["inertia"]["std"] is None


@pytest.mark.parametrize(
    ("verdict", "word"),
    [
        (Verdict.ADEQUATE, "adequate"),
        (Verdict.EXPLAINED, "explained"),
        (Verdict.PARTLY_EXPLAINED, "partly_explained"),
        (Verdict.UNEXPLAINED, "unexplained"),
    ],
)
def test_each_verdict_has_its_word_of_the_contract(verdict: Verdict, word: str) -> None:
    diagnosis = hand_made.diagnosis()
    axes = {"x": replace(diagnosis.axes["x"], verdict=verdict)}
    document = json.loads(to_json(diagnosis_document(replace(diagnosis, axes=axes), None)))
    assert document["axes"]["x"]["verdict"] == word
    assert len(Verdict) == 4, "a new verdict needs a word in the contract"


def test_a_selection_that_did_not_converge_says_so() -> None:
    diagnosis = hand_made.diagnosis()
    axis = replace(diagnosis.axes["x"], converged=False)
    assert read()["axes"]["x"]["converged"] is True
    document = diagnosis_document(replace(diagnosis, axes={"x": axis}), None)
    assert document["axes"]["x"]["converged"] is False
    assert "did not converge" in " ".join(facts(axis))
    assert "did not converge" not in " ".join(facts(diagnosis.axes["x"]))


def test_a_cause_says_why_it_is_accepted_and_a_refused_effect_why_not() -> None:
    diagnosis = hand_made.diagnosis()
    refused = Refused("warm_up", "without it the criterion is 7 units better")
    axis = replace(diagnosis.axes["x"], refused=(refused,))
    found = diagnosis_document(replace(diagnosis, axes={"x": axis}), None)["axes"]["x"]
    assert found["causes"][0]["decision"].startswith("without it the criterion is 412 units worse")
    assert found["refused"] == [{"effect": "warm_up", "reason": refused.reason}]


def test_the_same_diagnosis_gives_the_same_bytes() -> None:
    assert read() == read()
    texts = {to_json(diagnosis_document(hand_made.diagnosis(), None)) for _ in range(2)}
    assert len(texts) == 1


def test_an_adequate_axis_says_what_minor_causes_in_its_model_take_off() -> None:
    """As a file keeps them, with the range in which they were seen."""
    axis = hand_made.diagnosis().axes["x"]
    ripple = axis.causes[0]
    of_base = replace(axis.model, terms=axis.model.terms[:1])
    bare = replace(axis, verdict=Verdict.ADEQUATE, causes=(), minor=(ripple,), model=of_base)
    assert verdict_sentence(bare) == "the base model is adequate"
    assert facts(bare)[0].startswith("the residual is")
    kept = replace(ripple.term, supported=axis.model.terms[0].supported)
    extended = replace(bare, model=replace(of_base, terms=(*of_base.terms, kept)))
    assert verdict_sentence(extended) == "adequate but for torque ripple"
    assert facts(extended)[0].startswith("the residual falls from")
    assert (bare.in_model, extended.in_model) == ((), (ripple,))


@pytest.mark.parametrize(("share", "said"), [(0.8, True), (0.99, False)])
def test_the_share_of_the_effort_that_was_not_compared_is_said(share: float, said: bool) -> None:
    axis = replace(hand_made.diagnosis().axes["x"], share_in_band=share, cutoff_hz=12.5)
    sentence = "above 12.5 Hz, where 20.0 % of the effort's variance lies, nothing but sinusoids"
    assert any(fact.startswith(sentence) for fact in facts(axis)) is said
