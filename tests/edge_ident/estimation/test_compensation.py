"""The effort is compensated for known effects: base parameters come out true."""

from dataclasses import replace

import numpy as np
import pytest

from edge_ident.errors import ModelError
from edge_ident.identification.identify import identify
from edge_ident.identification.result import AxisIdentification, Identification
from edge_ident.model.model import BASE, PARAMETERS, AxisModel, Model, Term
from edge_ident.signals.recording import AxisRecord, Recording
from edge_ident.simulation.loop import recorded_references
from edge_ident.simulation.simulate import Scenario, record

TRUTH = np.array([0.43, 0.9, 1.4, 0.1])
BASE_TERM = Term(BASE, dict(zip(PARAMETERS, TRUTH.tolist(), strict=True)))
EFFECTS = {
    "stribeck_friction": {"level": 0.8, "speed": 0.6},
    "asymmetric_friction": {"difference": 0.2},
    "torque_ripple": {"cosine": 0.4, "sine": 0.3, "period": 2 * np.pi / 3},
    "time_delay": {"delay": 0.010},
    "coupling_compliance": {
        "load_inertia": 0.2,
        "rate": 40.0,
        "damping_ratio": 0.05,
        "deceleration": 0.0,
        "damping_rate": 0.0,
        "weight": 0.0,
    },
    "actuator_saturation": {"limit": 5.0},
}
COUPLING = Term(
    "cross_axis_coupling",
    {"inertia": 0.1, "viscous_friction": 0.2, "coulomb_friction": 0.1},
    source_axis="time_delay",
)


def axis(*effects: Term) -> AxisModel:
    return AxisModel((BASE_TERM, *effects))


KNOWN = Model(
    {name: axis(Term(name, values)) for name, values in EFFECTS.items()}
    | {"cross_axis_coupling": axis(COUPLING)}
)
"""Axes that are called by the effect that they have; one of them couples to another's motion."""
UNKNOWING = Model({name: axis() for name in KNOWN.axes})


@pytest.fixture(scope="module")
def recording() -> Recording:
    time = 0.0025 * np.arange(2400)
    position = np.sin(1.7 * time) + 0.25 * np.sin(4.3 * time + 1.0)
    motion = AxisRecord(position, 0 * time, "rad", "N*m")
    references = recorded_references(
        Recording(time, dict.fromkeys(KNOWN.axes, motion), "motion"),
        dict.fromkeys(KNOWN.axes, "rad"),
    )
    return record(KNOWN, Scenario(references, noise=0.005), "test")


def bias(found: AxisIdentification) -> float:
    """Largest error of a parameter, as the effort that it causes: inertia's at the peak
    acceleration of 7 rad/s², viscous friction's at the top speed of 2.7 rad/s."""
    return float(np.max(np.abs(found.estimate.parameters - TRUTH) * [7.0, 2.7, 1.0, 1.0]))


@pytest.fixture(scope="module")
def found(recording: Recording) -> list[Identification]:
    """Without a model, and with the true one."""
    return [identify(recording, None, model=model, diagnose=False) for model in (None, KNOWN)]


@pytest.mark.parametrize("name", KNOWN.axes)
def test_with_the_effect_known_the_base_parameters_are_no_longer_biased(
    found: list[Identification], name: str
) -> None:
    ignorant, knowing = (of_all.axes[name] for of_all in found)
    assert bias(knowing) < 0.25 * bias(ignorant)
    assert bias(knowing) < 0.02
    assert np.all(np.abs(knowing.estimate.parameters - TRUTH) < 3.0 * knowing.estimate.std)
    # most of a delay is taken off as timing, whether it is known or not
    allowed = 1.05 if name == "time_delay" else 1.0
    assert knowing.metric.relative_residual < allowed * ignorant.metric.relative_residual


def only(recording: Recording, name: str) -> Recording:
    return replace(recording, axes={name: recording.axes[name]})


def test_the_effects_are_carried_along_and_named(recording: Recording) -> None:
    name = "stribeck_friction"
    known = Model({name: axis(Term(name, EFFECTS[name]), Term("time_delay", {"delay": 0.001}))})
    found = identify(only(recording, name), None, model=known).axes[name]
    assert found.compensated_effects == ("stribeck_friction", "time_delay")
    assert found.model.terms[1:] == known.axes[name].terms[1:]
    np.testing.assert_array_equal(found.model.parameters, found.estimate.parameters)


def test_a_model_without_effects_changes_nothing(recording: Recording) -> None:
    name = "torque_ripple"
    plain, based = (
        identify(only(recording, name), None, model=model, diagnose=False).axes[name]
        for model in (None, UNKNOWING)
    )
    assert based.compensated_effects == ()
    np.testing.assert_array_equal(plain.estimate.parameters, based.estimate.parameters)
    assert plain.metric == based.metric


def test_effects_that_belong_to_one_recordings_time_are_pointed_out(recording: Recording) -> None:
    name = "torque_ripple"
    push = Term("disturbance_event", {"level": 0.5, "time": 2.0, "duration": 0.5})
    drift = Term("offset_drift", {"rate": 0.01, "curvature": 0.0})
    known = Model({name: axis(Term(name, EFFECTS[name]), push, drift)})
    found = identify(only(recording, name), None, model=known).axes[name]
    tied = {f.code for f in found.findings if f.code.startswith("tied_to_time")}
    assert tied == {"tied_to_time_disturbance_event", "tied_to_time_offset_drift"}


def test_a_model_that_does_not_fit_the_recording_is_refused(recording: Recording) -> None:
    name = "cross_axis_coupling"
    alone = only(recording, name)
    with pytest.raises(ModelError, match="needs the motion of axis time_delay"):
        identify(alone, None, model=KNOWN)
    with pytest.raises(ModelError, match=f"has no axis {name}; it knows q") as caught:
        identify(alone, None, model=Model({"q": axis()}))
    assert caught.value.exit_code == 5
    metric = Model({name: replace(axis(), position_unit="m", effort_unit="N")})
    with pytest.raises(ModelError, match="in rad and N\\*m, that of the model in m and N"):
        identify(alone, None, model=metric)
