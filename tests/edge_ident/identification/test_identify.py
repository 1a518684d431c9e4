"""The result of identification as a whole: which estimate, why, and the warnings."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.signal

from edge_ident.estimation.network import load_network
from edge_ident.identification.identify import identify
from edge_ident.identification.result import ParameterSource
from edge_ident.model.model import BASE, PARAMETERS, AxisModel, Model, Term
from edge_ident.report.documents import identification_document
from edge_ident.signals.recording import AxisRecord, Recording
from edge_ident.signals.recording_files import load_recording
from tests.edge_ident.stand_ins import START, StandIn, nothing, reader
from tests.measured import MeasuredData

PERIOD_S = 0.0025
COUNT_RAD = 2 * np.pi / 8400
TRUTH = {"inertia": 0.5, "viscous_friction": 0.8, "coulomb_friction": 1.2, "offset": -0.1}


@pytest.fixture
def network() -> StandIn:
    """Reads what least squares would, on the paper's motion."""
    return StandIn(reader(), START)


def recording(
    noise: float = 0.0, rate: float = 0.2875, phase: float = 0.0, amplitude: float = 1.0
) -> Recording:
    """An ideal drive on a sine, its encoder quantized, its effort noisy and coloured."""
    time = PERIOD_S * np.arange(8742)
    angle = rate * time + phase
    position = amplitude * 2 * np.pi * np.sin(angle)
    velocity, acceleration = np.gradient(position, time), -(rate**2) * position
    effort = (
        TRUTH["inertia"] * acceleration
        + TRUTH["viscous_friction"] * velocity
        + TRUTH["coulomb_friction"] * np.sign(velocity)
        + TRUTH["offset"]
    )
    colour = scipy.signal.lfilter([1], [1, -0.98], np.random.default_rng(4).normal(size=8742))
    effort += noise * np.std(effort) * colour / np.std(colour)
    axis = AxisRecord(COUNT_RAD * np.round(position / COUNT_RAD), effort, "rad", "N*m")
    return Recording(time, {"x": axis}, "test")


@pytest.mark.parametrize("phase", [0.0, np.pi / 2])
def test_both_estimators_find_a_clean_drive(phase: float) -> None:
    axis = identify(recording(phase=phase), load_network()).axes["x"]
    truth = np.array(list(TRUTH.values()))
    assert axis.trusted
    np.testing.assert_allclose(axis.estimate.parameters, truth, rtol=0.02)
    assert axis.network is not None, axis.network_reason
    assert np.all(np.abs(axis.network.parameters - truth) < 3 * axis.network.std)
    assert "the network agrees within" in axis.reason
    assert np.all(axis.network.std > axis.least_squares.std)  # noise moves both


@pytest.mark.parametrize("phase", [0.0, np.pi / 2])
@pytest.mark.parametrize("amplitude", [0.97, 1.0, 1.03])
def test_the_network_sees_any_phase_and_amplitude_near_its_own(
    network: StandIn, phase: float, amplitude: float
) -> None:
    axis = identify(recording(phase=phase, amplitude=amplitude), network).axes["x"]
    assert axis.network is not None, axis.network_reason
    truth = np.array(list(TRUTH.values()))
    np.testing.assert_allclose(axis.network.parameters, truth, rtol=0.01, atol=0.002)


@pytest.mark.parametrize("trained_with_it", [False, True])
def test_a_network_reads_the_effort_that_it_was_trained_on(trained_with_it: bool) -> None:
    """A known push of 0.2 N·m all along is offset to a network that has never seen it taken off."""
    known_network = StandIn(reader(), START)
    effects = ("position_dependent_load",) if trained_with_it else ()
    motion = replace(known_network.manifest.motion, effects=effects)
    known_network.manifest = replace(known_network.manifest, motion=motion)
    values = dict.fromkeys(("stiffness", "curvature", "sine"), 0.0) | {"cosine": 0.2, "period": 1e6}
    push = Term("position_dependent_load", values)
    base = Term(BASE, dict(zip(PARAMETERS, TRUTH.values(), strict=True)))
    known = Model({"x": AxisModel((base, push))})
    axis = identify(recording(), known_network, model=known).axes["x"]
    assert axis.network is not None, axis.network_reason
    offset = list(TRUTH.values())[3]
    assert axis.least_squares.parameters[3] == pytest.approx(offset - 0.2, abs=0.005)
    seen = offset if trained_with_it else offset - 0.2
    assert axis.network.parameters[3] == pytest.approx(seen, abs=0.005)


def test_a_network_that_misses_the_effort_gives_no_estimate() -> None:
    axis = identify(recording(), StandIn(nothing, START)).axes["x"]
    assert axis.network is None
    assert "unexplained" in axis.network_reason
    assert axis.reason.endswith("no network result is available for this axis")


def test_weak_inertia_is_warned_of_with_number_and_motion(network: StandIn) -> None:
    axis = identify(recording(noise=0.3), network).axes["x"]
    [weak] = [finding for finding in axis.findings if finding.code.endswith("_inertia")]
    assert "±" in weak.message
    assert "accelerates" in weak.next_step


def test_another_motion_has_no_network_and_says_so(network: StandIn) -> None:
    axis = identify(recording(rate=0.8), network).axes["x"]
    assert axis.network is None
    assert "the axis moved otherwise than the network was trained for" in axis.network_reason
    assert axis.reason.endswith("no network result is available for this axis")
    assert axis.trusted


def test_less_than_a_period_has_no_network(network: StandIn) -> None:
    whole = recording()
    half = Recording(
        whole.time_s[:4000],
        {
            "x": AxisRecord(
                whole.axes["x"].position[:4000], whole.axes["x"].effort[:4000], "rad", "N*m"
            )
        },
        "test",
    )
    assert "shorter than" in identify(half, network).axes["x"].network_reason


def test_a_carriage_in_metres_and_newtons_has_no_network_for_radians(
    network: StandIn, measured_data: MeasuredData
) -> None:
    recording = load_recording(measured_data / "emps_train.csv")
    found = identify(recording, network, diagnose=False)
    document = identification_document(found)["axes"]["q"]
    assert document["estimators"]["cnn"] is None
    assert document["cnn_reason"] == "the network was trained for rad and N*m, not m and N"
    assert document["estimators"]["least_squares"]["inertia"] == {
        "value": pytest.approx(95.1089, rel=0.01),  # Janot, Gautier, Brunot 2019
        "std": pytest.approx(document["model_error"]["inertia"], rel=0.05),
        "unit": "kg",
    }
    assert document["model_error"]["coulomb_friction"] == pytest.approx(0.8, rel=0.3)
    assert document["trusted"], "its friction bends, and the intervals hold that"
    assert "base_inadequate" in {warning["code"] for warning in document["warnings"]}


@pytest.mark.parametrize(
    ("file", "codes"),
    [
        ("laas_motor_speed.csv", {"inseparable"}),
        ("double_pendulum_154220.csv", {"poor_fit"}),
    ],
)
def test_drives_that_the_model_cannot_describe_are_not_trusted(
    network: StandIn, measured_data: MeasuredData, file: str, codes: set[str]
) -> None:
    found = identify(load_recording(measured_data / file), network, diagnose=False)
    assert not found.trusted
    for axis in found.axes.values():
        assert codes <= {finding.code for finding in axis.findings if finding.blocks}


def test_an_extended_model_that_fits_worse_is_no_answer(measured_data: MeasuredData) -> None:
    """A proportional loop's law fits better with signs that no machine has."""
    whole = load_recording(measured_data / "laas_uncompensated.csv")
    motor = whole.axes["m"]
    fewer = replace(motor, position=motor.position[::4], effort=motor.effort[::4], reference=None)
    measured = replace(whole, time_s=whole.time_s[::4], axes={"m": fewer})
    axis = identify(measured).axes["m"]
    assert axis.diagnosis is not None
    assert axis.diagnosis.causes
    assert axis.source is ParameterSource.LEAST_SQUARES
    alone = identify(measured, diagnose=False).axes["m"]
    assert axis.metric.relative_residual == alone.metric.relative_residual
    assert not axis.trusted


def test_a_shift_that_does_not_show_is_named_before_the_friction_that_follows_it() -> None:
    """At 100 Hz the filter leaves hardly a sample between the reversals of quick sines."""
    time_s, rng = 0.01 * np.arange(2000), np.random.default_rng(5)
    sines = [(1.0, 1.885, 0.0), (0.5, 5.655, 1.0), (0.2, 14.451, 2.0)]
    position, velocity, acceleration = (
        sum(a * w**n * np.sin(w * time_s + p + 0.5 * np.pi * n) for a, w, p in sines)
        for n in range(3)
    )
    effort = 0.5 * acceleration + 0.9 * velocity + 1.4 * np.sign(velocity) + 0.1
    effort += 0.01 * np.std(effort) * rng.standard_normal(len(time_s))
    counts = COUNT_RAD * np.round(position / COUNT_RAD)
    recorded = Recording(time_s, {"x": AxisRecord(counts, effort, "rad", "N*m")}, "quick sines")
    axis = identify(recorded, diagnose=False).axes["x"]
    codes = [finding.code for finding in axis.findings]
    assert axis.timing.unknown
    assert codes.index("timing_unknown") < codes.index("undetermined_coulomb_friction")
    truth = (0.5, 0.9, 1.4, 0.1)
    apart = np.abs(axis.estimate.parameters - truth)
    assert np.all(apart < 3.0 * axis.estimate.std)


def chain_recording(resonance_hz: float) -> Recording:
    """A motor that carries two thirds of its inertia on a spring, in N*m and rad.

    The effort is a multisine and is followed exactly: a linear drive with Coulomb friction at the
    motor only.
    """
    period_s, rng = 0.001, np.random.default_rng(11)
    time = period_s * np.arange(24_000)
    rates = 2 * np.pi * np.arange(1, 160) / 12.0
    phases = rng.uniform(0, 2 * np.pi, len(rates))
    motor, load = 0.1, 0.2
    spring = (2 * np.pi * resonance_hz) ** 2 * load
    damping = 0.06 * np.sqrt(spring * load)
    position, effort = np.zeros(len(time)), np.zeros(len(time))
    for rate, phase in zip(rates, phases, strict=True):
        s = 1j * rate
        wound = (damping * s + spring) / (load * s**2 + damping * s + spring)
        amplitude = np.exp(1j * (rate * time + phase)) / (1.0 + (rate / 25.0) ** 2)
        position += np.imag(0.02 * amplitude)
        effort += np.imag(0.02 * amplitude * ((motor + load * wound) * s**2 + 0.4 * s))
    velocity = np.gradient(position, period_s)
    effort = effort + 0.3 * np.sign(velocity) + 0.02
    effort = effort + 0.01 * np.std(effort) * rng.standard_normal(len(time))
    position = 1e-5 * np.round(position / 1e-5)
    return Recording(time, {"x": AxisRecord(position, effort, "rad", "N*m")}, "a test")


def test_a_stiff_chain_that_shows_gives_the_answer_with_its_own_intervals() -> None:
    """A chain above 15 Hz is no fault, but the base model is not enough without it."""
    found = identify(chain_recording(60.0)).axes["x"]
    assert found.diagnosis.minor_in_model, "the chain is no cause"
    assert not found.diagnosis.causes
    assert found.source is ParameterSource.EXTENDED_MODEL
    truth = np.array([0.3, 0.4, 0.3, 0.02])
    far = np.abs(found.estimate.parameters - truth)
    assert np.all(far < np.maximum(3 * found.estimate.std, 0.05 * truth))
    assert np.all(found.estimate.std[:3] < 0.05 * truth[:3])
