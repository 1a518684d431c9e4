"""Floors under what `identify` says of drives that nobody tuned to; the tool makes the figures."""

import numpy as np
import pytest

from edge_ident.identification.identify import identify
from edge_ident.signals.recording import AxisRecord, Recording
from firmware_interface.plant import Noise, draw, draw_drives, multisine, simulate
from tools.identification_accuracy import Answer, can_show, judge

HIDDEN = ("stribeck_friction", "torque_ripple", "position_dependent_friction", "gain_drift")
SEED = 61


@pytest.fixture(scope="module")
def answers() -> list[Answer]:
    """One drive for each effect, hidden in both axes, and a sound one."""
    found = []
    for row, name in enumerate((*HIDDEN, "")):
        drives, motion = draw_drives(1, SEED + row), multisine(4000, SEED + row)
        effects = draw([name] if name else [], drives, motion, SEED + row, strength=0.7)
        made = simulate(
            drives, motion, effects=effects, noise=Noise(0.02), seed=SEED, steps_per_sample=5
        )
        axes = {
            axis: AxisRecord(made.position[0, k], made.effort[0, k], "rad", "N*m")
            for k, axis in enumerate(("x", "z"))
        }
        # nothing is stated of when the effort acts: the shift has to be found
        identified = identify(Recording(made.time_s, axes, "simulated"), None)
        found += [
            judge(
                name, axis, name, identified.axes[axis], made.truth[0, k], np.inf, made.time_s[-1]
            )
            for k, axis in enumerate(axes)
        ]
    return found


def test_no_answer_is_trusted_and_wrong(answers: list[Answer]) -> None:
    assert [a for a in answers if a.trusted and a.wrong] == []


def test_trusted_parameters_are_right(answers: list[Answer]) -> None:
    worst = [a.worst for a in answers if a.trusted]
    assert len(worst) >= 8
    assert np.median(worst) < 0.01
    assert np.max(worst) < 0.05


def test_what_is_explained_is_trusted(answers: list[Answer]) -> None:
    explained = [a for a in answers if a.verdict == "explained"]
    assert len(explained) >= 5
    assert sum(a.trusted for a in explained) >= 0.85 * len(explained)


def test_a_parameter_that_takes_the_effect_in_cannot_show() -> None:
    """A dead band is Coulomb friction but for the moments at which the axis brakes."""
    truth, base = np.array([0.5, 0.9, 1.2, 0.0]), np.array([0.501, 0.9, 2.4, 0.0])
    assert can_show(base, truth, detectability=10.0).tolist() == [True, True, False]
    assert can_show(base, truth, detectability=100.0).tolist() == [True, True, True]
