"""Signals in which noise is small enough to see what the base model lacks.

The signals of the identification keep every reversal, and what the controller answers to encoder
noise is a few percent of their effort. This comparison has the band and the masks of the diagnosis:
its noise is nearly white, and no sample counts at which the encoder does not tell the direction.
It is computed at the rate that the band needs, because it precedes every answer.
"""

from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.diagnosis.prepare.bandwidth import Band, balanced_band, white_noise
from edge_ident.diagnosis.prepare.masks import (
    LEAST_WEIGHT,
    SMEAR_PERIODS,
    TURN_NOISE,
    aliasing_mask,
    direction_weight,
    run_in,
)
from edge_ident.errors import DataError
from edge_ident.estimation.compensation import CompensatedAxis
from edge_ident.estimation.least_squares import solve
from edge_ident.estimation.model_error import regime_spread, regimes, unnoticed_error
from edge_ident.model.effect import Motion
from edge_ident.model.model import Estimate, regressor
from edge_ident.signals.conditioning import decimated, encoder_count, position_noise
from edge_ident.signals.filters import differentiate, lowpass
from edge_ident.signals.timing import Shift, slow, solve_shift

Array = NDArray[np.float64]

_RATE: Final = 8.0
"""Samples per period of the motion's bandwidth."""
_FREQUENCIES: Final = 512
"""At which the noise through the filter is summed up."""
_FEWEST: Final = 8
"""Samples, two for each parameter."""


@dataclass(frozen=True)
class Comparison:
    """One axis, filtered for the comparison, at a rate that this band needs.

    Attributes
    ----------
    regressor : (N, 4) array
    effort : (N,) array
        Less what known effects account for.
    rates : (N, 3) array
        Time derivatives of the slow parts of acceleration, velocity and effort.
    position : (N,) array
    weight : (N,) array
        From 0, where the direction is unknown, to 1.
    samples : array of int
        Rows that are compared.
    band : Band
    period_s : float
        From one row to the next.
    noise : tuple of float
        Variance of the noise in the effort, and of that of the encoder in the acceleration.
    """

    regressor: Array
    effort: Array
    rates: Array
    position: Array
    weight: Array
    samples: NDArray[np.intp]
    band: Band
    period_s: float
    noise: tuple[float, float]

    @classmethod
    def of(cls, axis: CompensatedAxis) -> "Comparison":
        """Filter an axis."""
        sampling_s = axis.signals.period_s
        count = encoder_count(axis.position)
        noise = position_noise(axis.position, count)
        band, density = _band(axis, noise)
        motion_hz = band.motion_hz(sampling_s)
        stride = max(1, int(1.0 / (_RATE * motion_hz * sampling_s)))
        period_s = stride * sampling_s
        position, velocity, acceleration = (
            x[::stride] for x in differentiate(axis.position, motion_hz, sampling_s)
        )
        unknown = _direction_unknown(axis, velocity, noise, stride)
        weight = direction_weight(unknown, band.cutoff_hz, period_s)
        smooth = slow(acceleration, axis.signals.cutoff_hz, period_s)
        rates = [np.gradient(smooth, period_s), smooth]
        columns = np.array([*regressor(velocity, acceleration).T, *rates])
        filtered = band.lowpass(columns * weight, period_s)
        motion = Motion.known(position, position, velocity, acceleration)
        aliased = _aliased(motion, count, band, sampling_s, stride)
        effort, effort_rate = _effort(axis, band, weight, stride)
        return cls(
            regressor=filtered[:4].T,
            effort=effort,
            rates=np.vstack([filtered[4:], effort_rate]).T,
            position=position,
            weight=weight,
            samples=_samples(position, weight, aliased, band, period_s),
            band=band,
            period_s=period_s,
            noise=_noise(band, density, noise, sampling_s),
        )

    def with_effort(self, axis: CompensatedAxis) -> "Comparison":
        """The same motion with the effort of an axis that was compensated or shifted otherwise."""
        stride = round(self.period_s / axis.signals.period_s)
        effort, rate = _effort(axis, self.band, self.weight, stride)
        return replace(self, effort=effort, rates=np.column_stack([self.rates[:, :2], rate]))

    def fit(self) -> Estimate:
        """Least squares, with deviations by noise."""
        at = self.samples
        deviation = float(np.sqrt(self.noise[1]))
        return solve(self.regressor[at], self.effort[at], acceleration_noise=deviation)

    def model_error(self, std: Array) -> Array:
        """Deviation (4,) by model error of parameters whose noise has deviations std (4,)."""
        at, rows, effort = self.samples, self.regressor[self.samples], self.effort[self.samples]
        divided = regimes(rows, self.position[at], at)
        noticed = regime_spread(rows, effort, divided, std).model_error
        return np.hypot(noticed, unnoticed_error(rows, effort))

    def shift(self, sampling_s: float) -> Shift:
        """By which the effort is recorded late, to first order.

        Parameters
        ----------
        sampling_s : float
            Sampling period of the recording, which limits the shift.
        """
        rate = np.zeros_like(self.regressor)
        rate[:, :2] = self.rates[:, :2]
        at = self.samples
        return solve_shift(
            self.regressor[at], rate[at], self.effort[at], -self.rates[at, 2], sampling_s
        )


def _band(axis: CompensatedAxis, noise: float) -> tuple[Band, float]:
    """The band in which noise is balanced, and the power density of the effort's own noise."""
    signals = axis.signals
    period_s, widest_hz = signals.period_s, signals.cutoff_hz
    density = 2.0 * period_s * white_noise(axis.effort, axis.position, widest_hz, period_s) ** 2
    part = decimated(len(signals.effort), widest_hz, period_s)
    found = np.linalg.lstsq(signals.regressor[part], signals.effort[part], rcond=None)[0]
    return balanced_band(abs(float(found[0])), noise, density, widest_hz, period_s), density


def _effort(axis: CompensatedAxis, band: Band, weight: Array, stride: int) -> tuple[Array, Array]:
    """Effort less what known effects account for, and the rate of its slow part, filtered."""
    sampling_s = axis.signals.period_s
    in_step = lowpass(axis.effort, band.motion_hz(sampling_s), sampling_s, delay_s=axis.shift_s)
    in_step = (in_step - axis.effects_unfiltered)[::stride]
    period_s = stride * sampling_s
    rate = np.gradient(slow(in_step, axis.signals.cutoff_hz, period_s), period_s)
    filtered = band.lowpass(np.array([in_step, rate]) * weight, period_s)
    return filtered[0], filtered[1]


def _direction_unknown(
    axis: CompensatedAxis, velocity: Array, noise: float, stride: int
) -> NDArray[np.bool_]:
    """Samples, every stride-th, in standstills or within the encoder noise of a reversal."""
    position = axis.position[::stride]
    unknown = ~axis.signals.moving[::stride]
    for turn in np.flatnonzero(velocity[1:] * velocity[:-1] <= 0.0):
        away = np.abs(position - position[turn]) > TURN_NOISE * noise
        first = turn - int(np.argmax(away[turn::-1])) if away[:turn].any() else 0
        last = turn + int(np.argmax(away[turn:])) if away[turn:].any() else len(away)
        unknown[first : last + 1] = True
    return unknown


def _samples(
    position: Array, weight: Array, aliased: NDArray[np.bool_], band: Band, period_s: float
) -> NDArray[np.intp]:
    """Samples that are compared: decimated, of known direction, after the run-in."""
    samples = decimated(len(weight), band.cutoff_hz, period_s)
    samples = samples[lowpass(weight, band.cutoff_hz, period_s)[samples] > LEAST_WEIGHT]
    samples = samples[(samples >= run_in(position)) & ~aliased[samples]]
    if len(samples) < _FEWEST:
        raise DataError(
            f"only {len(samples)} independent samples lie away from standstill, reversals, "
            "gaps and clipped efforts",
            "record a longer motion, or one that is gentler and turns less often",
        )
    return samples


def _aliased(
    motion: Motion, count: float, band: Band, sampling_s: float, stride: int
) -> NDArray[np.bool_]:
    """Samples at which encoder quantization aliases into the band."""
    smear = int(np.ceil(SMEAR_PERIODS / (band.cutoff_hz * stride * sampling_s)))
    return aliasing_mask(motion, count, band.cutoff_hz, sampling_s, smear)


def _noise(band: Band, density: float, noise: float, period_s: float) -> tuple[float, float]:
    """Variance of the noise that passes the filter: in the effort, and in the acceleration."""
    frequency = np.linspace(0.0, 2.0 * band.cutoff_hz, _FREQUENCIES)
    power = band.power(frequency) * frequency[1]
    encoder = 2.0 * noise**2 * period_s * (2.0 * np.pi * frequency) ** 4
    return density * float(power.sum()), float(power @ encoder)
