"""When the base model is enough, what is the answer where it is not, and who is asked."""

from dataclasses import replace

import numpy as np
import pytest

from edge_ident.diagnosis.measures import Verdict
from edge_ident.errors import DataError
from edge_ident.estimation.trust import negative
from edge_ident.identification.adequacy import Adequacy
from edge_ident.identification.answer import describe_model, said_once
from edge_ident.identification.identify import identify
from edge_ident.identification.result import AxisIdentification, ParameterSource
from edge_ident.model.motion import LARGEST_SHIFT
from edge_ident.report.documents import identification_document
from edge_ident.signals.recording import AxisRecord, Recording
from edge_ident.simulation.simulate import reduced_model, simulate
from tests.edge_ident.diagnosis.hand_made import RIPPLE, ripple
from tests.edge_ident.diagnosis.hand_made import axis as by_hand
from tests.edge_ident.stand_ins import START, StandIn, reader

PERIOD_S = 0.0025
COUNT_RAD = 2 * np.pi / 8400
TRUTH = np.array([0.5, 0.8, 1.2, -0.1])


def recording(
    stribeck: float = 0.0,
    event: float = 0.0,
    late_s: float = 0.0,
    paper: bool = False,
) -> Recording:
    """A drive that lacks nothing, or has Stribeck friction, or is shaken in an unknown way."""
    time = PERIOD_S * np.arange(8742)
    parts = [(2 * np.pi, 0.2875)] if paper else [(1.0, 1.7), (0.25, 4.3), (0.08, 9.1)]

    def motion(at: np.ndarray, order: int) -> np.ndarray:
        return sum(a * w**order * np.sin(w * at + 0.4 + order * np.pi / 2) for a, w in parts)

    at = time - late_s
    velocity = motion(at, 1)
    effort = np.column_stack([motion(at, 2), velocity, np.sign(velocity), np.ones(8742)]) @ TRUTH
    effort += stribeck * np.exp(-((velocity / 0.3) ** 2)) * np.sign(velocity)
    effort += event * np.sin(40.0 * np.sin(3.1 * at)) * np.cos(5.7 * at)
    effort += 0.01 * np.random.default_rng(2).standard_normal(8742)
    position = COUNT_RAD * np.round(motion(time, 0) / COUNT_RAD)
    return Recording(time, {"x": AxisRecord(position, effort, "rad", "N*m")}, "test")


def identified(made: Recording, **wanted: object) -> AxisIdentification:
    return identify(made, None, **wanted).axes["x"]  # type: ignore[arg-type]


def worst(axis: AxisIdentification) -> float:
    return float(np.max(np.abs(axis.estimate.parameters - TRUTH)[:3] / TRUTH[:3]))


def test_an_adequate_base_model_is_not_diagnosed() -> None:
    axis = identified(recording())
    assert axis.adequacy.adequate, axis.adequacy.reason
    assert axis.diagnosis is None
    assert axis.source in (ParameterSource.LEAST_SQUARES, ParameterSource.WHITENED)
    assert axis.trusted
    assert worst(axis) < 0.01


def test_the_answer_is_the_estimate_that_expects_the_smaller_error() -> None:
    """In closed loop the controller answers the rounding of the encoder. Away from reversals, and
    in a band in which this answer does not dominate, it does less than half the harm."""
    truth = reduced_model().axes["x"].parameters
    found = identify(simulate(motion="multisine"), None)
    axis = found.axes["x"]
    assert axis.source is ParameterSource.WHITENED
    assert axis.estimate is axis.whitened
    whitened = np.abs(axis.whitened.parameters - truth)[:3] / truth[:3]
    plain = np.abs(axis.least_squares.parameters - truth)[:3] / truth[:3]
    assert np.max(whitened) < 0.5 * np.max(plain)
    document = identification_document(found)["axes"]["x"]
    assert document["parameters_from"] == "whitened_least_squares"
    estimated = document["estimators"]["whitened_least_squares"]
    known = {"known": True, "kind": "physical"}
    assert document["parameters"] == {name: of | known for name, of in estimated.items()}


def test_what_the_base_model_lacks_is_found_and_the_answer_is_right() -> None:
    made = recording(stribeck=0.4)
    seen: list[str] = []
    axis = identified(made, on_progress=lambda stage, done, of: seen.append(stage))
    assert not axis.adequacy.adequate
    assert seen[0] == "diagnosis"
    assert axis.source is ParameterSource.EXTENDED_MODEL
    assert axis.trusted
    assert worst(axis) < 0.02
    off = np.abs(axis.least_squares.parameters - TRUTH)[:3] / TRUTH[:3]
    assert np.max(off) > 0.05
    document = identification_document(identify(made, None))["axes"]["x"]
    assert document["parameters_from"] == "extended_model"
    assert document["diagnosis"]["verdict"] == "explained"
    assert document["diagnosis"]["causes"][0]["effect"] == "stribeck_friction"
    base = document["base"]["parameters"]["coulomb_friction"]
    assert base["value"] == axis.least_squares.parameters[2]
    for i, values in enumerate(document["parameters"].values()):
        assert values["std"] >= list(document["model_error"].values())[i]


def test_what_lies_between_two_adequate_models_is_model_error() -> None:
    """Stribeck friction too small to be named: both models leave little."""
    axis = identified(recording(stribeck=0.1))
    assert axis.diagnosis is not None
    assert axis.diagnosis.verdict is Verdict.ADEQUATE
    assert axis.source is ParameterSource.EXTENDED_MODEL
    apart = np.abs(axis.estimate.parameters - axis.whitened.parameters)
    assert apart[2] > 0.01
    assert np.all(axis.model_error >= apart)


def off(axis: AxisIdentification) -> np.ndarray:
    """How far the answer is off, in its standard deviations."""
    return np.abs(axis.estimate.parameters - TRUTH) / axis.estimate.std


def test_without_a_diagnosis_the_intervals_hold_what_the_model_misses() -> None:
    axis = identified(recording(stribeck=0.4), diagnose=False)
    assert axis.source is ParameterSource.LEAST_SQUARES
    [finding] = [finding for finding in axis.findings if finding.code == "base_inadequate"]
    assert not finding.blocks
    assert "times the noise" in finding.message
    assert np.all(off(axis) < 3.0)


def test_without_a_diagnosis_the_network_answers_where_it_applies() -> None:
    """The interval reaches as far as least squares."""
    network = StandIn(reader(rows=slice(0, 60)), START)
    axis = identify(recording(stribeck=0.4, paper=True), network, diagnose=False).axes["x"]
    assert axis.source is ParameterSource.NETWORK
    assert axis.network is not None
    apart = np.abs(axis.network.parameters - axis.least_squares.parameters)
    assert np.all(axis.estimate.std >= apart)
    assert np.all(axis.model_error >= apart)
    assert not axis.trusted


def test_what_nothing_explains_is_said_and_widens_the_intervals() -> None:
    axis = identified(recording(event=0.5))
    assert axis.diagnosis is not None
    assert "unexplained" in {finding.code for finding in axis.findings}
    assert np.all(axis.estimate.std > 2.0 * identified(recording()).estimate.std)
    assert np.all(off(axis) < 3.0)
    assert axis.trusted


@pytest.mark.parametrize("late_samples", [-1.0, 0.5, 1.0])
def test_a_late_effort_is_data_and_no_fault(late_samples: float) -> None:
    axis = identified(recording(late_s=late_samples * PERIOD_S))
    assert axis.adequacy.adequate, axis.adequacy.reason
    assert axis.timing.shift_samples == pytest.approx(late_samples, abs=0.1)
    assert worst(axis) < 0.01


@pytest.mark.parametrize("late_samples", [-1.5, 1.55])
def test_at_the_limit_of_timing_the_shift_is_the_limit(late_samples: float) -> None:
    axis = identified(recording(late_s=late_samples * PERIOD_S))
    assert axis.adequacy.adequate, axis.adequacy.reason
    assert abs(axis.timing.shift_samples) == pytest.approx(LARGEST_SHIFT, abs=0.05)
    assert worst(axis) < 0.01


def test_an_axis_at_rest_is_refused() -> None:
    time = PERIOD_S * np.arange(4000)
    rest = AxisRecord(np.zeros(4000), np.ones(4000), "rad", "N*m")
    with pytest.raises(DataError):
        identify(Recording(time, {"x": rest}, "test"), None)


def test_a_recording_too_short_for_a_diagnosis_says_so() -> None:
    """It forbids nothing: the intervals hold model error."""
    adequacy = Adequacy(0.02, 5.0, ("viscous_friction",), 0.03, 8.0)
    refused = DataError("only 17 independent samples", "record a longer motion")
    (finding,) = describe_model(adequacy, refused, extended=False)
    assert finding.code == "not_diagnosed"
    assert "17 independent samples" in finding.message
    assert "record a longer motion" in finding.next_step
    assert not finding.blocks


def test_a_negative_parameter_is_said_once_with_the_numbers_of_the_answer() -> None:
    """Identification and diagnosis both look for one, on other samples."""
    of_diagnosis = negative("viscous_friction", -0.0497, 0.0071, blocks=False)
    of_answer = negative("viscous_friction", -0.0628, 0.011, blocks=True)
    assert said_once([of_diagnosis, of_answer]) == (of_answer,)


@pytest.mark.parametrize(("second", "said"), [("-y", True), (None, False)])
def test_an_answer_of_several_axes_that_act_alike_has_to_be_confirmed(
    second: str | None, said: bool
) -> None:
    """Which of them act was chosen among many; the deviations are those of the choice."""
    adequacy = Adequacy(0.1, 50.0, ("inertia",), 0.1, 8.0)
    sources = filter(None, ("z", second))
    causes = [replace(ripple(), term=replace(RIPPLE, source_axis=source)) for source in sources]
    diagnosed = by_hand(Verdict.EXPLAINED, *causes)
    found = describe_model(adequacy, diagnosed, extended=True)
    assert ("several_axes" in {finding.code for finding in found}) is said
    assert describe_model(adequacy, diagnosed, extended=False) == []
