"""Whether the base model is enough for an axis: asked of every recording, in milliseconds.

Two things tell that it is not: what the model leaves is more than noise, or its parameters depend
on the regime of the motion more than noise makes them. Both are judged on signals in which noise is
small (`edge_ident.identification.adequacy`). These leave out what is near a reversal, so a
third thing is asked of all samples: does the model leave more than gains may be designed from? A
wrong 'no' costs a diagnosis, a wrong 'yes' is a wrong answer, so the limits lean towards the
diagnosis.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Final, Self

import numpy as np
from numpy.typing import NDArray

from edge_ident.diagnosis.measures import OUTLIER, worth_naming
from edge_ident.diagnosis.prepare import bandwidth
from edge_ident.diagnosis.select.thresholds import STRUCTURE
from edge_ident.errors import DataError
from edge_ident.estimation import effort_checks, least_squares, trust
from edge_ident.estimation.compensated import CompensatedAxis
from edge_ident.model.model import PARAMETERS, Estimate, Term, regressor_rows
from edge_ident.model.motion import Array, Motion
from edge_ident.signals import conditioning, metrics, timing
from edge_ident.signals.filters import differentiate, lowpass

# Signals in which noise is small enough to see what the base model lacks.
#
# The signals of the identification keep every reversal, and what the controller answers to encoder
# noise is a few percent of their effort. This comparison has the filter and the masks of the
# diagnosis: its noise is nearly white, and no sample counts at which the encoder does not tell the
# direction. Its band is the narrower one of an estimate. It is computed at the rate that this band
# needs, because it precedes every answer.

_RATE: Final = 8.0  # samples per period of the motion's bandwidth
# Number of frequencies at which the noise through the filter is summed up.
_FREQUENCIES: Final = 512
_FEWEST: Final = 8  # samples, two for each parameter
_TINY: Final = float(np.finfo(float).tiny)


@dataclass(frozen=True)
class ComparedSignals:
    """One axis, filtered for the comparison, at n samples out of N at a rate that this band needs.

    Attributes
    ----------
    columns : Columns
        The regressor (n, 4), decomposed.
    effort : (n,) array
        Less what known effects account for.
    rates : (n, 3) array
        Time derivatives of acceleration, velocity and the slow part of the effort.
    position : (n,) array
    weight : (N,) array
        From 0, where the direction is unknown, to 1.
    samples : (n,) array of int
        Samples that are compared.
    band : Band
    period_s : float
        Of the N samples.
    noise : tuple of float
        Variance of the noise in the effort, and of that of the encoder in the acceleration.
    """

    columns: least_squares.Columns
    effort: Array
    rates: Array
    position: Array
    weight: Array
    samples: NDArray[np.intp]
    band: bandwidth.Band
    period_s: float
    noise: tuple[float, float]

    @classmethod
    def of(cls, axis: CompensatedAxis) -> "ComparedSignals":
        """Filter an axis."""
        signals, recorded_s = axis.signals, axis.signals.recorded_period_s
        count, noise = signals.encoder_count, signals.position_noise
        band, density = _band(axis, noise)
        motion_hz = band.motion_hz(recorded_s)
        stride = max(1, int(1.0 / (_RATE * motion_hz * signals.period_s)))
        period_s = stride * signals.period_s
        smooth_motion = differentiate(axis.position, motion_hz, signals.period_s)
        position, velocity, acceleration = (x[::stride] for x in smooth_motion)
        unknown = direction_unknown(axis, velocity, noise, stride)
        weight = bandwidth.direction_weight(unknown, band.cutoff_hz, period_s)
        time_s = np.arange(len(position), dtype=np.float64) * period_s
        motion = Motion.known(time_s, position, velocity, acceleration)
        aliased = _aliased(motion, bandwidth.tone_count(count, noise), band, recorded_s, period_s)
        samples, start = _samples(position, weight, aliased, band, period_s, recorded_s)
        effort, effort_rate = _effort(axis, band, weight, period_s, samples)
        jerk = np.gradient(acceleration, period_s)
        columns = np.stack([*regressor_rows(velocity, acceleration), jerk, acceleration])
        del smooth_motion, motion, jerk, velocity, acceleration  # they are large
        columns = band.lowpass(columns * weight, period_s)[:, samples]
        whole = cls(
            columns=least_squares.Columns(columns[:4].T.copy()),
            effort=effort,
            rates=np.column_stack([*columns[4:], effort_rate]),
            position=position[samples],
            weight=weight,
            samples=samples,
            band=band,
            period_s=period_s,
            noise=_noise(band, density, noise, recorded_s),
        )
        later = whole._after(start)
        return later if _remember(axis.effects) or not whole._differs(later) else whole

    def _after(self, start: int) -> Self:
        """The same without the first samples."""
        return replace(
            self,
            columns=least_squares.Columns(self.regressor[start:]),
            effort=self.effort[start:],
            rates=self.rates[start:],
            position=self.position[start:],
            samples=self.samples[start:],
        )

    def _differs(self, later: Self) -> bool:
        """Whether the base model of later samples leaves more at the start than noise can be."""
        begun = len(self.effort) - len(later.effort)
        left = (self.effort - self.regressor @ later.parameters)[:begun]
        far_off = np.abs(left) > OUTLIER * metrics.rms(later.residual)
        return worth_naming(left[far_off], self.effort)

    def with_effort(self, axis: CompensatedAxis) -> "ComparedSignals":
        """The same motion with the effort of an axis that was compensated or shifted otherwise."""
        effort, rate = _effort(axis, self.band, self.weight, self.period_s, self.samples)
        return replace(self, effort=effort, rates=np.column_stack([self.rates[:, :2], rate]))

    @property
    def regressor(self) -> Array:
        """Columns of the base model, (n, 4)."""
        return self.columns.values

    @cached_property
    def parameters(self) -> Array:
        """Plain least squares, (4,)."""
        return self.columns.solved(self.effort) / self.columns.length

    @cached_property
    def residual(self) -> Array:
        """What the base model leaves of the effort, (n,)."""
        return np.asarray(self.effort - self.regressor @ self.parameters)

    def fit(self) -> Estimate:
        """Least squares, with deviations by noise."""
        deviation = float(np.sqrt(self.noise[1]))
        return least_squares.solve(self.columns, self.effort, acceleration_noise=deviation)

    def model_error(self, std: Array) -> Array:
        """Deviation (4,) by model error of parameters whose noise has deviations std (4,)."""
        unnoticed = effort_checks.unnoticed_error(self.regressor, self.effort)
        return np.hypot(self.moves.beyond(std).model_error, unnoticed)

    @cached_property
    def moves(self) -> effort_checks.RegimeMoves:
        """Moves of the base model's parameters where parts of the motion are left out."""
        divided = effort_checks.regimes(self.regressor, self.position, self.samples)
        return effort_checks.regime_moves(self.regressor, self.effort, divided)

    def timing_error(self, std_s: float) -> Array:
        """Deviation (4,) of parameters by that of the shift, in s, which they follow."""
        return std_s * np.abs(self.columns.solved(self.rate)) / self.columns.length

    @cached_property
    def rate(self) -> Array:
        """What a shift of one second adds to the effort of the base model, negative, (n,)."""
        return np.asarray(self.rates[:, :2] @ self.parameters[:2])

    @property
    def fitted_shift_std(self) -> float:
        """Deviation in s of a shift that is fitted with the base model's parameters."""
        length = max(float(np.linalg.norm(self.rate)), _TINY)
        columns = np.column_stack([self.columns.unit, self.rate / length])
        return float(least_squares.coloured_std(columns, self.residual)[-1]) / length

    def shift(self, sampling_s: float) -> timing.Shift:
        """Time by which the effort is recorded late, to first order.

        Parameters
        ----------
        sampling_s : float
            Sampling period of the recording, which limits the shift.
        """
        rate = np.zeros_like(self.regressor)
        rate[:, :2] = self.rates[:, :2]
        return timing.solve_shift(self.regressor, rate, self.effort, -self.rates[:, 2], sampling_s)


def _remember(effects: tuple[Term, ...]) -> bool:
    """Whether known effects remember; their catalogue is loaded only where there are any."""
    if not effects:
        return False
    from edge_ident.model.inverse import remembers

    return remembers(effects)


def _band(axis: CompensatedAxis, noise: float) -> tuple[bandwidth.Band, float]:
    """The band in which noise is balanced, and the power density of the effort's own noise."""
    signals, sampling = axis.signals, axis.signals.sampling
    period_s, widest_hz = signals.recorded_period_s, signals.cutoff_hz
    if sampling is not None:
        white = sampling.effort_noise
    else:
        white = bandwidth.white_noise(axis.effort, axis.position, widest_hz, period_s)
    density = 2.0 * period_s * white**2
    part = conditioning.decimated(len(signals.effort), widest_hz, signals.period_s)
    found = np.linalg.lstsq(signals.regressor[part], signals.effort[part], rcond=None)[0]
    return bandwidth.balanced_band(
        abs(float(found[0])), noise, density, widest_hz, period_s
    ), density


def _effort(
    axis: CompensatedAxis,
    band: bandwidth.Band,
    weight: Array,
    period_s: float,
    at: NDArray[np.intp],
) -> tuple[Array, Array]:
    """Effort less what known effects account for, and the rate of its slow part, filtered."""
    signals = axis.signals
    motion_hz = band.motion_hz(signals.recorded_period_s)
    in_step = lowpass(axis.effort, motion_hz, signals.period_s, delay_s=axis.shift_s)
    in_step = (in_step - axis.effects_unfiltered)[:: round(period_s / signals.period_s)]
    rate = np.gradient(timing.slow(in_step, signals.cutoff_hz, period_s), period_s)
    filtered = band.lowpass(np.stack([in_step, rate]) * weight, period_s)[:, at]
    return filtered[0], filtered[1]


def _samples(
    position: Array,
    weight: Array,
    aliased: NDArray[np.bool_],
    band: bandwidth.Band,
    period_s: float,
    recorded_s: float,
) -> tuple[NDArray[np.intp], int]:
    """Samples of known direction, decimated; and how many of them lie before the run-in's end."""
    samples = conditioning.decimated(len(weight), band.cutoff_hz, period_s)
    samples = samples[lowpass(weight, band.cutoff_hz, period_s)[samples] > bandwidth.LEAST_WEIGHT]
    samples = samples[~aliased[samples]]
    start = int(np.searchsorted(samples, bandwidth.run_in(position)))
    if len(samples) - start < _FEWEST:
        raise DataError(
            f"only {len(samples) - start} independent samples lie away from standstill, reversals, "
            "gaps and clipped efforts",
            bandwidth.longer_or_faster(1.0 / recorded_s),
        )
    return samples, start


def _aliased(
    motion: Motion, count: float, band: bandwidth.Band, recorded_s: float, period_s: float
) -> NDArray[np.bool_]:
    """Samples at which encoder quantization aliases into the band."""
    smear = int(np.ceil(bandwidth.SMEAR_PERIODS / (band.cutoff_hz * period_s)))
    return bandwidth.aliasing_mask(motion, count, band.cutoff_hz, recorded_s, smear)


def _noise(
    band: bandwidth.Band, density: float, noise: float, period_s: float
) -> tuple[float, float]:
    """Variance of the noise that passes the filter: in the effort, and in the acceleration."""
    frequency = np.linspace(0.0, 2.0 * band.cutoff_hz, _FREQUENCIES)
    power = band.power(frequency) * frequency[1]
    encoder = 2.0 * noise**2 * period_s * (2.0 * np.pi * frequency) ** 4
    return density * float(power.sum()), float(power @ encoder)


# Samples at which the encoder does not tell the direction, found in few calls.

_NEARBY: Final = 128  # samples beside a reversal that are looked at first, before twice as many


def direction_unknown(
    axis: CompensatedAxis, velocity: Array, noise: float, stride: int
) -> NDArray[np.bool_]:
    """Samples, every stride-th, in standstills or within the encoder noise of a reversal."""
    position = np.ascontiguousarray(axis.position[::stride])
    unknown = ~axis.signals.moving[::stride]
    turns = np.flatnonzero(velocity[1:] * velocity[:-1] <= 0.0)
    first = turns - _first_away(
        position[::-1], len(position) - 1 - turns, bandwidth.TURN_NOISE * noise
    )
    last = turns + _first_away(position, turns, bandwidth.TURN_NOISE * noise)
    for begin, end in zip(np.maximum(first, 0).tolist(), (last + 1).tolist(), strict=True):
        unknown[begin:end] = True
    return unknown


def _first_away(position: Array, turns: NDArray[np.intp], least: float) -> NDArray[np.intp]:
    """Samples (T,) from each turn to the first after it that is farther from it than `least`.

    One beyond the end where none is.
    """
    nearby = np.minimum(turns[:, None] + np.arange(_NEARBY), len(position) - 1)
    away = np.abs(position[nearby] - position[turns, None]) > least
    after: NDArray[np.intp] = np.argmax(away, axis=1)
    for number in np.flatnonzero(~away.any(axis=1)):
        after[number] = _first_beyond(position[turns[number] :], least)
    return after


def _first_beyond(position: Array, least: float) -> int:
    """First sample after the nearby ones that is farther from sample 0; their number where none."""
    begin, end = _NEARBY, 2 * _NEARBY
    while begin < len(position):
        away = np.abs(position[begin:end] - position[0]) > least
        if away.any():
            return begin + int(np.argmax(away))
        begin, end = end, 2 * end
    return len(position)


LARGEST_MOVE: Final = 0.026
"""Relative move between regimes from which parameters were found to be off by 5 %."""
SIGNIFICANT: Final = 5.0
"""Deviations by noise from which a move counts: quantization makes tails."""


@dataclass(frozen=True)
class Adequacy:
    """How the base model does on an axis.

    Attributes
    ----------
    relative_residual : float
        In the band of the comparison.
    noise_ratio : float
        Residual over noise.
    spread : tuple of str
        Parameters that depend on the regime of the motion.
    largest_move : float
        Largest relative move of one of them.
    cutoff_hz : float
        Of the comparison. Nothing is said about what lies above it.
    everywhere : float
        Relative residual of least squares on all samples of the identification.
    """

    relative_residual: float
    noise_ratio: float
    spread: tuple[str, ...]
    largest_move: float
    cutoff_hz: float
    everywhere: float = 0.0

    @property
    def leaves_structure(self) -> bool:
        """Whether the residual is more than noise."""
        beyond = 1.0 - min(1.0, self.noise_ratio**-2)
        excess = self.relative_residual * float(np.sqrt(beyond))
        return self.noise_ratio > STRUCTURE and excess > effort_checks.SMALLEST_EXCESS

    @property
    def adequate(self) -> bool:
        """Whether nothing speaks against the base model."""
        return not (self.leaves_structure or self.spread or self._poor_fit)

    @property
    def _poor_fit(self) -> bool:
        return self.everywhere > trust.RESIDUAL_LIMIT

    @property
    def reason(self) -> str:
        """What speaks against it, or for it, in words."""
        parts = []
        if self.leaves_structure:
            parts.append(
                f"the base model leaves {self.relative_residual:.2%} of the effort, "
                f"{self.noise_ratio:.1f} times the noise"
            )
        if self.spread:
            names = ", ".join(name.replace("_", " ") for name in self.spread)
            parts.append(
                f"without a part of the motion, the estimates of {names} move by up to "
                f"{self.largest_move:.1%}"
            )
        if self._poor_fit:
            parts.append(
                f"with the samples near reversals, the base model leaves {self.everywhere:.1%} of "
                "the effort"
            )
        noise = f"up to {self.cutoff_hz:.3g} Hz, what the base model leaves is noise"
        return "; ".join(parts) or noise


def judge(compared: ComparedSignals) -> Adequacy:
    """Judge the base model."""
    unit, length, found = compared.columns.unit, compared.columns.length, compared.parameters
    left, scale = metrics.rms(compared.residual), max(metrics.rms(compared.effort), _TINY)
    noise = float(np.sqrt(compared.noise[0] + found[0] ** 2 * compared.noise[1]))
    normal = unit.T @ unit + 1e-10 * np.eye(len(PARAMETERS))
    std = noise * np.sqrt(np.diag(np.linalg.inv(normal))) / length
    spread = compared.moves.beyond(std)
    relative = spread.largest_move / np.maximum(np.abs(found), _TINY)
    moved = (relative > LARGEST_MOVE) & (spread.significance > SIGNIFICANT)
    names = tuple(name for name, far in zip(PARAMETERS[:3], moved[:3], strict=True) if far)
    return Adequacy(
        left / scale,
        left / max(noise, _TINY),
        names,
        float(np.max(relative[:3], initial=0.0, where=moved[:3])),
        compared.band.cutoff_hz,
    )
