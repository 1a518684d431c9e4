"""Whether a loop is livelier than noise explains: the first sign of one that will oscillate.

A loop that is well damped answers, above its bandwidth, the rounding of its encoder and little
else. The power of that follows from the law and the axis. One that is too stiff for what it moves
(a soft chain, play) has more. It is asked of the feedback's effort and of the speed, above the
frequency at which the opened loop has fallen to one. A motion is taken in stretches, and their
median counts: a reversal, which is no noise, lasts for a few.

Source: Welch, The use of fast Fourier transform for the estimation of power spectra, IEEE Trans.
Audio and Electroacoustics 15 (1967).
"""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.control.compensation import plant_of
from edge_ident.control.gain_design import QUANTIZATION_SHARE
from edge_ident.control.position_loop import LoopHardware, law_response, open_loop
from edge_ident.model.model import AxisModel
from edge_ident.signals.recording import AxisRecord
from firmware_interface.gains import AxisGains

Array = NDArray[np.float64]

_STRETCH: Final = 256
"""Samples of a stretch; neighbours overlap by half."""
_BEYOND_NOISE: Final = 3.0
"""Amplitude over that of the noise from which it is no noise: a sensitivity of up to 2 is sound."""
_LIVELY_COUNTS: Final = 2.0
"""Amplitude in encoder counts, rms, that is no oscillation worth the name."""


def liveliness(
    record: AxisRecord, gains: AxisGains, axis: AxisModel, hardware: LoopHardware
) -> float:
    """What an axis answers above its bandwidth, over the most that is harmless; above one, the loop
    is too lively.

    Parameters
    ----------
    record : AxisRecord
        Of a motion with these gains.
    gains : AxisGains
    axis : AxisModel
    hardware : LoopHardware
    """
    assert record.reference is not None
    error = record.reference - record.position
    if len(error) < 2 * _STRETCH:
        return 0.0
    window = np.hanning(_STRETCH)
    starts = range(0, len(error) - _STRETCH + 1, _STRETCH // 2)
    stretches = np.stack([window * error[at : at + _STRETCH] for at in starts])
    power = np.abs(np.fft.rfft(stretches)) ** 2 / (np.sum(window**2) * _STRETCH) * 2.0
    omega = np.asarray(
        2.0 * np.pi * np.fft.rfftfreq(_STRETCH, hardware.sample_period_s), dtype=np.float64
    )
    above = omega > _crossover(gains, axis, hardware)
    if not np.any(above):
        return 0.0
    law = np.abs(law_response(gains, omega[above], hardware.sample_period_s)) ** 2
    # position and reference are both rounded, to one twelfth of a count squared
    noise = hardware.encoder_resolution_rad**2 / 6.0 / (_STRETCH / 2)
    allowed_nm = QUANTIZATION_SHARE * hardware.effort_limit_nm
    found = []
    for weight, harmless in (
        (law, allowed_nm**2),
        (np.ones_like(law), (_LIVELY_COUNTS * hardware.encoder_resolution_rad) ** 2),
    ):
        # the median, of which numpy's own loads numpy.ma
        seen = float(np.sort(power[:, above] @ weight)[len(power) // 2])
        most = max(_BEYOND_NOISE**2 * noise * float(np.sum(weight)), harmless)
        found.append(np.sqrt(seen / most))
    return float(min(found))


def _crossover(gains: AxisGains, axis: AxisModel, hardware: LoopHardware) -> float:
    """Highest frequency at which the opened loop has a gain of one, rad/s."""
    omega, response = open_loop(gains, plant_of(axis), hardware)
    louder = omega[np.abs(response) >= 1.0]
    return float(louder[-1]) if len(louder) else 0.0
