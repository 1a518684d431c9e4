"""An effort of two levels: what a deadband withholds could be all of it."""

import numpy as np
import pytest
from numpy.typing import NDArray

from edge_ident.diagnosis.diagnose import diagnose
from edge_ident.diagnosis.measures import Verdict
from edge_ident.diagnosis.result import AxisDiagnosis
from edge_ident.signals.recording import AxisRecord, Recording

Array = NDArray[np.float64]

PERIOD_S = 2e-3
LEVEL = 3.0
"""Of the command, N·m, to and fro at random moments, for 30 s."""


def found(*, deadband: float = 0.0, rubbing: float = 0.0) -> AxisDiagnosis:
    """A disc that a motor turns; a hand may rub it for some seconds."""
    rng = np.random.default_rng(3)
    inner_s, samples = 1e-4, 15_000
    changes = np.repeat(rng.random(samples // 40 + 1) < 0.5, 40)[:samples]
    levels = LEVEL * np.where(changes, 1.0, -1.0)
    if deadband:  # and in between by less, which a deadband of this width does not pass as well
        levels = levels * np.repeat(rng.choice([0.3, 0.6, 1.0], samples // 40 + 1), 40)[:samples]
    angle = speed = 0.0
    angles = np.empty(samples)
    for row, level in enumerate(levels):
        angles[row] = angle
        torque = level - np.clip(level, -deadband, deadband)
        friction = 0.5 + rubbing * (3.0 < row * PERIOD_S % 9.0 < 6.0)
        for _ in range(round(PERIOD_S / inner_s)):
            speed += inner_s * (torque - 0.1 * speed - friction * np.tanh(speed / 0.01)) / 0.05
            angle += inner_s * speed
    count = 2.0 * np.pi / 8192
    axis = AxisRecord(count * np.round(angles / count), levels, "rad", "N*m")
    recording = Recording(PERIOD_S * np.arange(samples), {"x": axis}, "disc")
    return diagnose([recording]).axes["x"]


def test_no_deadband_explains_an_effort_by_itself() -> None:
    axis = found(rubbing=0.6)
    assert "actuator_deadband" not in [cause.term.effect for cause in axis.causes]
    assert axis.verdict is Verdict.UNEXPLAINED


@pytest.mark.thorough
def test_a_deadband_among_several_levels_is_named() -> None:
    axis = found(deadband=0.4)
    assert [cause.term.effect for cause in axis.causes] == ["actuator_deadband"]
    assert axis.causes[0].term.values["width"] == pytest.approx(0.4, rel=0.1)
