"""Gains for what is known: margins anywhere inside the intervals, and feedback that may stay."""

from dataclasses import replace

import numpy as np
import pytest

from edge_ident.control.compensation import plant_of
from edge_ident.control.gain_design import GAIN_MARGIN, PHASE_MARGIN_RAD, Ground, design
from edge_ident.control.position_loop import LoopHardware, margins_of
from edge_ident.errors import GainError
from edge_ident.model.model import AxisModel, Estimate, base_axis
from edge_ident.model.repeating import OVER_POSITION, OVER_SPEED, Grid, Repeating
from firmware_interface.control_law import feedforward_nm
from firmware_interface.motion import Reference
from firmware_interface.virtual.settings import CONSERVATIVE_GAINS, DEFAULT_LIMITS

HARDWARE = LoopHardware(
    0.0025, 0.0005, 2.0 * np.pi / 8400, 12.0, gain_maximum=DEFAULT_LIMITS.gain_maximum
)


def axis(inertia_std: float, viscous_std: float = 0.0) -> AxisModel:
    std = np.array([inertia_std, viscous_std, 0.0, 0.0])
    return base_axis(Estimate(np.array([0.4, 0.9, 1.4, 0.03]), std))


@pytest.mark.parametrize("share", [0.02, 0.15, 0.3, 0.45])
def test_margins_hold_anywhere_inside_the_intervals_not_at_the_corners_alone(share: float) -> None:
    known, late_s = axis(share * 0.4, 0.4), 0.002
    found = design(known, HARDWARE, ground=Ground(late_s=late_s))
    rng = np.random.default_rng(1)
    plant = plant_of(known)
    for _ in range(200):
        inertia, viscous, late = rng.uniform(-2.0, 2.0), rng.uniform(-2.0, 2.0), rng.uniform()
        one = replace(
            plant.with_inertia(0.4 * (1.0 + share * inertia)),
            viscous_friction=max(0.9 + 0.4 * viscous, 0.05 * 1.7),
        )
        delayed = replace(HARDWARE, control_delay_s=0.0005 + late_s * late)
        phase, gain = margins_of(found.gains, (one,), delayed)
        assert phase >= PHASE_MARGIN_RAD - 1e-9
        assert gain >= GAIN_MARGIN - 1e-9


def test_the_wider_the_interval_the_lower_the_bandwidth() -> None:
    found = [design(axis(share * 0.4), HARDWARE).bandwidth_rad_s for share in (0.01, 0.2, 0.4)]
    assert found[0] > found[1] > found[2] > 0.0


def test_an_inertia_that_nobody_knows_leaves_the_feedback_and_feeds_friction_forward() -> None:
    unknown = axis(0.5)
    with pytest.raises(GainError, match="no gains follow"):
        design(unknown, HARDWARE)
    found = design(unknown, HARDWARE, ground=Ground(in_force=CONSERVATIVE_GAINS))
    assert "known too poorly" in found.kept
    assert found.gains.proportional == CONSERVATIVE_GAINS.proportional
    assert found.gains.derivative == CONSERVATIVE_GAINS.derivative
    assert found.gains.coulomb_feedforward == 1.4
    assert found.gains.viscous_feedforward == 0.9


def test_a_step_that_the_board_does_not_take_leaves_the_feedback() -> None:
    small = Ground(in_force=CONSERVATIVE_GAINS, gain_step=1e-3)
    assert design(axis(0.01), HARDWARE, ground=small).gains.proportional == 30.0
    large = Ground(in_force=CONSERVATIVE_GAINS, gain_step=0.6)
    assert design(axis(0.01), HARDWARE, ground=large).gains.proportional > 60.0


def test_what_repeats_is_fed_forward_as_it_is_along_the_motion() -> None:
    """Slow enough for tables over position to act whole."""
    position, velocity = np.linspace(-2.0, 2.0, 400), np.full(400, 0.3)
    grid = Grid.over(position, np.array([-0.6, 0.6]))
    entries = np.zeros(OVER_SPEED + OVER_POSITION)
    entries[:12], entries[OVER_SPEED:] = 0.2, np.sin(np.arange(OVER_POSITION) / 8.0)
    repeating = Repeating(grid, entries)
    plain = design(axis(0.01), HARDWARE)
    found = design(axis(0.01), HARDWARE, ground=Ground(repeating=repeating))
    way = Reference(position, velocity, np.zeros(400))
    more = feedforward_nm(found.gains, way, np) - feedforward_nm(plain.gains, way, np)
    np.testing.assert_allclose(more, repeating.effort(position, velocity, np.ones(400)), atol=1e-6)
    assert {used.effect for used in found.used} == {"repeating"}
