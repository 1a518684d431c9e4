"""The response in the frequency domain is that of the stepped simulation."""

from dataclasses import replace

import numpy as np
import pytest

from edge_ident.control.gain_design import design
from edge_ident.control.position_loop import LoopHardware
from edge_ident.drive.description import load_drive
from edge_ident.drive.motions import named_trajectory
from edge_ident.model.model import Estimate, Term, base_axis
from edge_ident.simulation.loop import References, Sampling, closed_loop
from edge_ident.simulation.loop_response import Loads, Path, tracking_errors
from edge_ident.simulation.machine import Machine
from firmware_interface.gains import CONSERVATIVE_GAINS, AxisGains
from firmware_interface.motion import Reference, reference

COUNT_RAD = 2 * np.pi / 8400
HARDWARE = LoopHardware(0.0025, 0.0005, COUNT_RAD, 12.0)
BASE = np.array([0.43, 0.9, 1.4, 0.03])
AXIS = base_axis(Estimate(BASE, 0.01 * BASE))


DESIGNED = design(AXIS, HARDWARE).gains
WHOLE_LAW = replace(
    DESIGNED,
    load_table=tuple(0.3 * np.sin(np.arange(24.0))),
    table_start_rad=-6.0,
    table_step_rad=0.5,
    friction_forward=(0.2,) * 12,
    presliding_feedforward=0.3,
    presliding_distance_rad=0.02,
    backlash_offset_rad=0.003,
    backlash_distance_rad=0.01,
    deadband_inverse=0.2,
    deadband_smoothing=0.1,
)


@pytest.mark.parametrize(
    "gains",
    [CONSERVATIVE_GAINS, replace(CONSERVATIVE_GAINS, integral=40.0), DESIGNED, WHOLE_LAW],
    ids=["soft", "integral", "designed", "whole law"],
)
def test_an_axis_with_dry_friction_that_turns_and_sticks(gains: AxisGains) -> None:
    """4 s of the multisine, its way in included; with soft gains the axis sticks at reversals.

    Designed gains leave half an encoder count; both ways agree to less than a count then."""
    trajectory, period_s = named_trajectory(load_drive(), "multisine", 1), HARDWARE.sample_period_s
    begin, lead_in_s = 800, 2.0
    time_s = period_s * np.arange(-begin, 1600)
    way = reference(trajectory.axes["x"], time_s, lead_in_s, 0.0)
    rows = (way.position_rad, way.velocity_rad_s, way.acceleration_rad_s2)
    references = References(time_s, *(row[None] for row in rows))
    plant = Machine({"x": AXIS}, np.zeros((1, 1)), np.array([2.0]), period_s, 0.0005)
    sampling = Sampling(np.zeros(1), np.zeros(1))
    found = closed_loop(plant, references, {"x": [gains]}, sampling)
    stepped = references.recorded[0] - found.true_position[0, 0]
    nothing = np.zeros((1, len(time_s)))
    loads = Loads(BASE[None], nothing, np.array([1e-6]), nothing)
    error = tracking_errors(Path(way, period_s, begin), loads, gains, HARDWARE)[0]
    apart, own = (np.sqrt(np.mean(x**2)) for x in (error - stepped, stepped))
    assert apart < max(0.05 * own, HARDWARE.encoder_resolution_rad)


@pytest.mark.parametrize("limit_nm", [12.0, 1.5], ids=["free", "clipped"])
def test_a_drive_among_many_is_the_drive_alone(limit_nm: float) -> None:
    """Seven drives; where effort lacks, some are asked until the last of them has settled."""
    time_s = HARDWARE.sample_period_s * np.arange(800)
    trajectory = named_trajectory(load_drive(), "multisine", 1)
    way = reference(trajectory.axes["x"], time_s, 1.0, 0.0)
    base = BASE * np.linspace(0.8, 1.2, 7)[:, None]
    noise = 0.01 * np.random.default_rng(0).normal(size=(2, 7, len(time_s)))
    loads = Loads(base, noise[0], np.full(7, 1e-3), COUNT_RAD * noise[1])
    path = Path(way, HARDWARE.sample_period_s)
    hardware = replace(HARDWARE, effort_limit_nm=limit_nm)
    together = tracking_errors(path, loads, DESIGNED, hardware)
    for n in range(7):
        parts = (of[n : n + 1] for of in (loads.base, loads.beside, loads.turning, loads.noise))
        alone = tracking_errors(path, Loads(*parts), DESIGNED, hardware)
        apart = (1e-9 if limit_nm > 10.0 else 1e-2) * np.max(np.abs(alone))
        np.testing.assert_allclose(together[n : n + 1], alone, rtol=0.0, atol=apart)


def test_a_lag_by_friction_is_friction_over_stiffness() -> None:
    """At constant speed, without feed-forward."""
    samples = 4000
    time_s = 0.0025 * np.arange(samples)
    way = Reference(time_s.copy(), np.ones(samples), np.zeros(samples))
    nothing = np.zeros((1, samples))
    loads = Loads(BASE[None], nothing, np.array([1e-6]), nothing)
    error = tracking_errors(Path(way, 0.0025), loads, CONSERVATIVE_GAINS, HARDWARE)[0]
    assert np.median(error) == pytest.approx((0.9 + 1.4 + 0.03) / 30.0, rel=0.01)


def test_effort_beyond_the_limit_is_lacking_and_winds_the_loop_up() -> None:
    """Half of the peak effort that the multisine asks for: the axis falls behind by many counts,
    and as far as in the stepped simulation of an actuator that saturates there."""
    limit_nm = 2.8
    time_s = HARDWARE.sample_period_s * np.arange(-800, 1600)
    trajectory = named_trajectory(load_drive(), "multisine", 1)
    way = reference(trajectory.axes["x"], time_s, 2.0, 0.0)
    rows = (way.position_rad, way.velocity_rad_s, way.acceleration_rad_s2)
    references = References(time_s, *(row[None] for row in rows))
    weak = replace(AXIS, terms=(*AXIS.terms, Term("actuator_saturation", {"limit": limit_nm})))
    plant = Machine({"x": weak}, np.zeros((1, 1)), np.array([2.0]), 0.0025, 0.0005)
    found = closed_loop(plant, references, {"x": [DESIGNED]}, Sampling(np.zeros(1), np.zeros(1)))
    stepped = references.recorded[0] - found.true_position[0, 0]
    nothing = np.zeros((1, len(time_s)))
    loads = Loads(BASE[None], nothing, np.array([1e-6]), nothing)
    path, limited = Path(way, 0.0025, 800), replace(HARDWARE, effort_limit_nm=limit_nm)
    error = tracking_errors(path, loads, DESIGNED, limited)[0]
    strong = tracking_errors(path, loads, DESIGNED, HARDWARE)[0]
    assert np.max(np.abs(stepped)) > 20 * COUNT_RAD > 10 * np.max(np.abs(strong))
    assert np.sqrt(np.mean((error - stepped) ** 2)) < 0.1 * np.sqrt(np.mean(stepped**2))
