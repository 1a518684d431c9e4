"""Encoder, sampling and measurement: what a board adds to a drive, one for all or drawn for each.

A command is held over a sampling period. It begins to act some periods after the encoder was
read: a board computes for so long. In the record it stands at the stamp of that reading.
"""

from dataclasses import dataclass

import numpy as np

from firmware_interface.plant.drives import COUNT_RAD, Array, log_uniform
from firmware_interface.plant.motions import LEAD, SAMPLE_S
from firmware_interface.plant.timed_effects import lagged

_DELAYS = np.arange(11) / 10
"""Periods until a command acts; half a period more is its middle."""
_GEAR_RATIOS = (5.0, 50.0)
_NOISE = (0.005, 0.04)
"""Noise over the rms effort."""


@dataclass(frozen=True)
class Electronics:
    """Resolution of encoder (rad) and effort (N·m), 0 for ideal, the largest command, the delay.

    Attributes
    ----------
    count_rad : float or (B, A) array
    effort_step_nm, effort_limit_nm : float
    delay_periods : float or (B, 1) array
        Sampling periods from a stamp until its command acts, 0 to 2: 0.5 ms where not given.
    """

    count_rad: float | Array = COUNT_RAD
    effort_step_nm: float = 0.004
    effort_limit_nm: float = 25.0
    delay_periods: float | Array = 0.2

    @property
    def effort_shift_s(self) -> float | Array:
        """Time from a stamp to the middle of the period in which its command acts."""
        return (0.5 + self.delay_periods) * SAMPLE_S


@dataclass(frozen=True)
class Noise:
    """Noise of the recorded effort, in shares of its rms; white, or a first-order lag's.

    Attributes
    ----------
    share : float or (B, 1) array
    correlation_s : float
    """

    share: float | Array = 0.02
    correlation_s: float = 0.0

    def added_to(self, effort: Array, seed: int) -> Array:
        """Noise for efforts (LEAD + N + TAIL, B, A), each axis on its own rms."""
        values = np.random.default_rng([seed, 4]).standard_normal(effort.shape)
        if self.correlation_s:
            keep = np.exp(-SAMPLE_S / self.correlation_s)
            values = lagged(values, keep) * np.sqrt((1 + keep) / (1 - keep))
        recorded = effort[LEAD:]
        return np.asarray(self.share * np.sqrt((recorded**2).mean(axis=0)) * values)


def draw_electronics(shape: tuple[int, int], seed: int) -> Electronics:
    """Boards of B drives of A axes.

    A command begins to act 0 to 1 period after its stamp, so the middle of its action is 0.5 to 1.5
    periods after the stamp. Half of the encoders sit at the gearbox output, half at the motor; all
    have 8400 counts a turn.
    """
    rng = np.random.default_rng([seed, 8])
    count = shape[0]
    ratio = np.where(rng.random(count) < 0.5, 1.0, log_uniform(rng, *_GEAR_RATIOS, (count,)))
    delay = rng.choice(_DELAYS, count)
    return Electronics(
        count_rad=np.ones(shape) * COUNT_RAD / ratio[:, None], delay_periods=delay[:, None]
    )


def draw_noise(count: int, seed: int) -> Noise:
    """White effort noise of B drives, 0.5 to 4 % of the rms effort, even in the logarithm."""
    rng = np.random.default_rng([seed, 9])
    return Noise(log_uniform(rng, *_NOISE, (count, 1)))
