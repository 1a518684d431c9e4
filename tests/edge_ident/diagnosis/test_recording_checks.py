"""What a recording cannot show, and when it shows the controller in the place of the machine."""

from dataclasses import replace

import numpy as np
import pytest

from edge_ident.diagnosis.diagnose import diagnose
from edge_ident.diagnosis.fit.fitting import fit
from edge_ident.diagnosis.fit.noise_floor import noise_floor
from edge_ident.diagnosis.prepare.preparation import prepare_axis
from edge_ident.diagnosis.recording_checks import (
    controllers_laws,
    effort_findings,
    findings,
    with_other_axes,
)
from edge_ident.estimation.trust import Finding
from edge_ident.model.model import BASE, PARAMETERS, AxisModel, Term
from edge_ident.signals.filters import Line, driven, motion_lines, strongest_line
from edge_ident.signals.recording import AxisRecord, Recording
from edge_ident.signals.recording_files import load_recording
from firmware_interface.plant import (
    EFFECTS,
    Motion,
    Noise,
    draw,
    draw_drives,
    multisine,
    paper,
    simulate,
)
from firmware_interface.plant import staircase as stairs
from tests.measured import MeasuredData
from tests.repetitions import a_few

GAIN = 0.09
"""Of the speed loop, A·s/rad."""


def found(recording: Recording, name: str) -> dict[str, Finding]:
    """Findings on one axis, beside the base model alone."""
    data = prepare_axis([recording], name)
    axis = recording.axes[name]
    base = Term(BASE, dict.fromkeys(PARAMETERS, 0.0))
    start = fit(
        data, AxisModel((base,), axis.position_unit, axis.effort_unit), np.array([1.0, 0, 0, 0]), ()
    )
    (said,) = effort_findings([recording], name)
    said = [*said, *controllers_laws([recording], name, data)]
    checks = findings([recording], name, data, start, said)
    checks = with_other_axes(checks, [recording], data, start, noise_floor(data, start))
    return {finding.code: finding for finding in checks}


def speed_loop(swing: float, *, gain: float = GAIN, seed: int = 1) -> Recording:
    """A motor with cogging that a proportional loop turns at 2π·(1 + swing·multisine) rad/s."""
    rng = np.random.default_rng(seed)
    period_s, samples = 1e-3, 8000
    angle, speed = 0.0, 2.0 * np.pi
    angles, efforts, references = np.empty((3, samples))
    reference = 0.0
    rates, phases = 2.0 * np.pi * np.arange(1.0, 6.0), rng.uniform(0.0, 2.0 * np.pi, 5)
    for row in range(samples):
        wanted = 2.0 * np.pi * (1.0 + swing * np.sum(np.sin(rates * row * period_s + phases)))
        cogging = 0.05 * np.sin(12.0 * angle) + 0.08 * np.cos(18.0 * angle)
        effort = gain * (wanted - speed)
        angles[row], efforts[row], references[row] = angle, effort, reference
        reference += period_s * wanted
        speed += period_s * (effort - 0.002 * speed - 0.01 * np.sign(speed) - cogging) / 2e-4
        angle += period_s * speed
    count = 2.0 * np.pi / 2**16
    axis = AxisRecord(
        count * np.round(angles / count),
        efforts + 0.002 * rng.standard_normal(samples),
        "rad",
        "A",
        reference=references,
    )
    return Recording(period_s * np.arange(samples), {"m": axis}, "motor", 0.5 * period_s)


def plant(name: str | None, motion: Motion, seed: int) -> Recording:
    drives = draw_drives(1, seed)
    effects = draw([name] if name else [], drives, motion, seed)
    made = simulate(
        drives, motion, effects=effects, noise=Noise(0.02), seed=seed, steps_per_sample=5
    )
    axes = {
        axis: AxisRecord(made.position[0, k], made.effort[0, k], "rad", "N*m")
        for k, axis in enumerate(("x", "z"))
    }
    return Recording(made.time_s, axes, "drive", float(made.effort_shift_s[0]))


@pytest.mark.parametrize("seed", a_few([1, 2, 3], [1]))
def test_a_speed_loop_without_a_moving_reference_is_not_taken_for_a_machine(seed: int) -> None:
    finding = found(speed_loop(0.0, seed=seed), "m")["feedback_law"]
    assert finding.blocks
    assert "A per rad/s of speed" in finding.message
    assert float(finding.message.split("(")[1].split()[0]) == pytest.approx(GAIN, rel=0.1)
    assert "a reference that moves" in finding.next_step


@pytest.mark.thorough
def test_of_two_recordings_the_loop_names_its_own_and_no_other_scale() -> None:
    held, moved = speed_loop(0.0), replace(speed_loop(0.3, seed=2), source="moved")
    axis = diagnose([held, moved]).axes["m"]
    findings = {finding.code: finding for finding in axis.findings}
    assert findings["feedback_law"].message.startswith(f"in {held.source}, a controller's law")
    assert "scale_differs" not in findings


def test_the_same_loop_with_a_reference_that_moves_shows_the_machine() -> None:
    assert "feedback_law" not in found(speed_loop(0.3), "m")


def upright(seed: int) -> Recording:
    """A shoulder that carries weights above it; the elbow between them is not recorded."""
    rng = np.random.default_rng(seed)
    time_s = 5e-3 * np.arange(4000)
    rates = 2.0 * np.pi * np.array([[0.11, 0.23, 0.31], [0.13, 0.27, 0.36]])
    phases = rng.uniform(0.0, 6.3, rates.shape)
    angle, elbow = 0.3 * np.sin(rates[..., None] * time_s + phases[..., None]).sum(axis=1)
    speed = np.gradient(angle, time_s)
    effort = 1.5 * np.gradient(speed, time_s) + 4.0 * speed + 3.0 * np.sign(speed)
    effort -= 39.0 * np.sin(angle) + 19.0 * np.sin(angle + elbow)
    effort += 0.1 * rng.standard_normal(len(time_s))
    axis = AxisRecord(1e-5 * np.round(angle / 1e-5), effort, "rad", "N*m")
    return Recording(time_s, {"shoulder": axis}, "arm")


@pytest.mark.parametrize("seed", a_few([0, 1, 2], [0]))
def test_an_arm_that_stands_on_its_joint_is_not_taken_for_a_loop(seed: int) -> None:
    """It falls where its angle grows, as a controller pulls back."""
    assert "feedback_law" not in found(upright(seed), "shoulder")


@pytest.mark.parametrize("seed", a_few([1, 2], [1]))
@pytest.mark.parametrize(
    "motion",
    [
        paper(3000),
        pytest.param(multisine(4000), marks=pytest.mark.thorough),
        stairs(4000),
    ],
    ids=lambda m: m.name,
)
def test_drives_in_closed_loop_that_follow_a_reference_show_the_machine(
    motion: Motion, seed: int
) -> None:
    for recording in (plant(name, motion, seed) for name in (None, EFFECTS[seed])):
        for axis in ("x", "z"):
            assert "feedback_law" not in found(recording, axis)


@pytest.mark.parametrize(
    ("file", "axis", "caught"),
    [
        ("laas_uncompensated.csv", "m", True),
        ("laas_uncompensated_second.csv", "m", True),
        ("emps_train.csv", "q", False),
        ("laas_current_sine.csv", "m", False),
        ("double_pendulum_154220.csv", "j1", False),
        ("double_pendulum_154220.csv", "j2", False),
        ("pendulum_c0.csv", "j1", False),
        ("pendulum_c0.csv", "j2", False),
        ("pendulum_c0_second.csv", "j1", False),
        ("pendulum_c0_second.csv", "j2", False),
        ("lift_torso.csv", "torso", False),
        ("arm_joint1_first.csv", "j1", False),
    ],
)
def test_real_machines(measured_data: MeasuredData, file: str, axis: str, caught: bool) -> None:
    assert ("feedback_law" in found(load_recording(measured_data / file), axis)) == caught


def test_one_frequency_and_one_speed_limit_what_a_recording_shows() -> None:
    assert not found(plant(None, paper(), 1), "x")["one_frequency"].blocks
    assert "one_frequency" not in found(plant(None, multisine(4000), 1), "x")
    time_s = 0.002 * np.arange(4000)
    for swing, caught in ((0.03, True), (0.3, False)):
        rng = np.random.default_rng(5)
        angle = 6.0 * (time_s - swing / 9.0 * np.cos(9.0 * time_s))
        effort = 0.2 + 0.3 * 6.0 * (1.0 + swing * np.sin(9.0 * time_s))
        noise = rng.standard_normal(len(time_s))
        angle = 1e-4 * np.round(angle / 1e-4)
        axis = AxisRecord(angle, effort + 0.01 * noise, "rad", "A")
        codes = found(Recording(time_s, {"m": axis}, "motor"), "m")
        assert ("one_speed" in codes) == caught
    assert "one_speed" not in found(plant(None, stairs(4000), 1), "x")


def test_lines_of_a_motion_their_harmonics_and_combinations() -> None:
    period_s = 0.01
    time_s = period_s * np.arange(2000)
    noise = 0.02 * np.random.default_rng(4).standard_normal(2000)
    signal = 2.0 * np.sin(2.0 * np.pi * 1.6 * time_s) + 0.5 * np.cos(2.0 * np.pi * 0.7 * time_s)
    strongest = strongest_line(signal + noise, period_s, 10.0)
    assert strongest.frequency_hz == pytest.approx(1.6, abs=0.02)
    assert strongest.share == pytest.approx(16.0 / 17.0, abs=0.01)
    lines = motion_lines(signal + noise, period_s, 10.0)
    assert [line.frequency_hz for line in lines] == pytest.approx([1.6, 0.7], abs=0.02)
    frequency_hz = np.array([0.7, 0.9, 1.4, 1.6, 2.3, 3.2, 4.8, 4.0, 1.15])
    belongs = driven(frequency_hz, motion_lines(signal, period_s, 10.0), 0.05)
    assert belongs.tolist() == [True, False, False, True, False, True, True, False, False]
    both = (Line(1.6, 0.6), Line(0.7, 0.4))
    belongs = driven(frequency_hz, both, 0.05)
    assert belongs.tolist() == [True, True, True, True, True, True, True, False, False]
    assert strongest_line(signal, period_s, 1.0).frequency_hz == pytest.approx(0.7, abs=0.02)


@pytest.mark.parametrize("blocks", [(False, True), (True, False)])
def test_what_forbids_a_cause_in_one_recording_does_so_in_any_order(
    blocks: tuple[bool, bool],
) -> None:
    pair = [speed_loop(0.3), speed_loop(0.3, seed=2)]
    (name,) = pair[0].axes
    data = prepare_axis(pair, name)
    base = Term(BASE, dict.fromkeys(PARAMETERS, 0.0))
    start = fit(data, AxisModel((base,), "rad", "A"), np.array([1.0, 0, 0, 0]), ())
    late = [Finding("effort_late", f"it blocks: {b}", "look", blocks=b) for b in blocks]
    (found,) = (f for f in findings(pair, name, data, start, late) if f.code == "effort_late")
    assert found.message == "it blocks: True"
