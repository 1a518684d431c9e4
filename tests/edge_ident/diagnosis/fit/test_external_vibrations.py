"""What shakes a machine from outside has a frequency that the motion does not have."""

import numpy as np
import pytest

from edge_ident.diagnosis.fit.external_vibrations import Spectrum
from edge_ident.diagnosis.prepare.preparation import prepare_axis
from edge_ident.signals.recording import AxisRecord, Recording

PERIOD_S = 0.005


@pytest.mark.parametrize(("shaken_hz", "found"), [(1.6, False), (3.2, False), (2.3, True)])
def test_a_frequency_of_the_motion_is_no_external_vibration(shaken_hz: float, found: bool) -> None:
    time_s = PERIOD_S * np.arange(4000)
    rate = 2.0 * np.pi * 1.6
    noise = np.random.default_rng(6).standard_normal((2, len(time_s)))
    position = np.sin(rate * time_s) + 1e-4 * noise[0]
    effort = np.cos(rate * time_s) + np.sin(2.0 * np.pi * shaken_hz * time_s) + 0.02 * noise[1]
    recording = Recording(time_s, {"x": AxisRecord(position, effort, "rad", "N*m")}, "shaken")
    data = prepare_axis([recording], "x")
    compared_s = data.of_motion("time_s")[data.valid]
    residual = np.sin(2.0 * np.pi * shaken_hz * compared_s)
    frequency_hz = Spectrum.of(data).strongest(residual)["frequency"]
    assert bool(np.any(np.abs(frequency_hz - shaken_hz) < 0.06)) == found
