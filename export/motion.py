"""The motion that a network is trained for: the paper's, or that of a recording."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.errors import DataError, ModelError
from edge_ident.model.effects import named
from edge_ident.model.model import AxisModel, Model, regressor
from edge_ident.model.motion import Motion
from edge_ident.signals.conditioning import choose_cutoff, encoder_count, position_noise
from edge_ident.signals.filters import differentiate
from edge_ident.signals.metrics import POINTS, subsample
from edge_ident.signals.recording import AxisRecord, Recording
from edge_ident.signals.time_stamps import EvenGrid
from edge_ident.simulation.loop import Counting

Array = NDArray[np.float64]

AMPLITUDE_SPREAD: Final = 0.03
SHIFT_SPREAD_S: Final = 0.02
"""Largest difference between recordings of one motion, in amplitude and in time."""
RISE_TIME_S: Final = 0.2
"""Rise time of a soft controller."""
# Mean square change from lap to lap over that between unrelated times: below it, laps repeat.
_REPEATS: Final = 0.02
_FRESH: Final = 0.2  # the same between times that have nothing to do with each other, at least


@dataclass(frozen=True)
class TrainingMotion:
    """One period of a periodic motion, or the whole of another one.

    Attributes
    ----------
    name : str
        Of the network's files.
    position_unit, effort_unit : str
    period_s : float
        Between samples.
    position, velocity, acceleration : (N,) arrays
        Free of noise.
    count : float
        Resolution of the encoder.
    noise : float
        Standard deviation of the position's noise, quantization included.
    largest_lag : float
        Distance by which friction behind soft gains lets the axis fall behind, at most: it then
        stands still after each reversal. Zero for a motion that was measured.
    partner : (2, N) array or None
        Velocity and acceleration of the other axis, where its motion is known.
    known : AxisModel or None
        What is known of the machine, if that includes effects: every drive then has them.
    """

    name: str
    position_unit: str
    effort_unit: str
    period_s: float
    position: Array
    velocity: Array
    acceleration: Array
    count: float
    noise: float
    largest_lag: float
    partner: Array | None
    known: AxisModel | None = None

    @property
    def time_s(self) -> Array:
        """Time stamps (N,) from zero."""
        return np.asarray(self.period_s * np.arange(len(self.position)), dtype=np.float64)

    @property
    def column_scales(self) -> Array:
        """Peaks (4,) of acceleration, velocity, sign and one."""
        peaks = [np.max(np.abs(signal)) for signal in (self.acceleration, self.velocity)]
        return np.array([*peaks, 1.0, 1.0])

    def scaled_regressor(self, points: int) -> Array:
        """Subsampled regressor over `column_scales`, (points, 4)."""
        return subsample(regressor(self.velocity, self.acceleration), points) / self.column_scales


def paper_motion() -> TrainingMotion:
    """2π·sin(0.2875 t) sampled every 2.5 ms for one period, encoder of 8400 counts a turn.

    The other axis moves a quarter of a period ahead, as a cosine.
    """
    amplitude, rate, period_s, samples = 2.0 * np.pi, 0.2875, 0.0025, 8742
    angle = rate * period_s * np.arange(samples)
    sine, cosine = amplitude * np.sin(angle), amplitude * np.cos(angle)
    count = 2.0 * np.pi / 8400.0
    return TrainingMotion(
        name="feed_drive",
        position_unit="rad",
        effort_unit="N*m",
        period_s=period_s,
        position=sine,
        velocity=rate * cosine,
        acceleration=-(rate**2) * sine,
        count=count,
        noise=count / np.sqrt(12.0),
        largest_lag=0.08,
        partner=np.stack([-rate * sine, -(rate**2) * cosine]),
    )


def motion_from(recording: Recording, axis: str | None, name: str) -> TrainingMotion:
    """The motion of a recording's axis: one lap, averaged over all, if it repeats.

    Parameters
    ----------
    recording : Recording
    axis : str or None
        None where there is but one.
    name : str
        Of the network's files.

    Raises
    ------
    DataError
        The axis is not in the recording, it has to be named, or its laps have too few samples.
    """
    record, grid = _chosen(recording, axis), EvenGrid.of(recording.time_s)
    period_s, read = grid.period_s, grid.resampled(record.position)
    smooth = np.stack(differentiate(read, choose_cutoff(read, period_s), period_s))
    position, velocity, acceleration = _average_lap(smooth)
    if len(position) < POINTS:
        raise DataError(
            f"{recording.source}: a lap has {len(position)} samples, fewer than {POINTS}",
            "sample faster or move more slowly",
        )
    return TrainingMotion(
        name=name,
        position_unit=record.position_unit,
        effort_unit=record.effort_unit,
        period_s=period_s,
        position=position,
        velocity=velocity,
        acceleration=acceleration,
        count=encoder_count(record.position),
        noise=position_noise(read),
        largest_lag=0.0,
        partner=None,
    )


def _chosen(recording: Recording, axis: str | None) -> AxisRecord:
    if axis is None and len(recording.axes) == 1:
        axis = next(iter(recording.axes))
    if axis is None or axis not in recording.axes:
        raise DataError(
            f"{recording.source}: a network is trained for one axis; there are "
            + ", ".join(recording.axes),
            f"name one with --axis, such as --axis {next(iter(recording.axes))}",
        )
    return recording.axes[axis]


def with_effects(motion: TrainingMotion, model: Model, axis: str | None) -> TrainingMotion:
    """The same motion, of a machine whose effects are known.

    Parameters
    ----------
    motion : TrainingMotion
    model : Model
    axis : str or None
        Not looked at where the model has but one.

    Raises
    ------
    ModelError
        The axis is not in the model, has to be named, is in other units, has no effects, or is
        coupled to another one whose motion is not known.
    """
    if len(model.axes) == 1:  # whatever its name is
        axis = next(iter(model.axes))
    if axis is None or axis not in model.axes:
        raise ModelError(
            f"a network is trained for one axis; the model has {', '.join(model.axes)}",
            f"name one with --axis, such as --axis {next(iter(model.axes))}",
        )
    known = model.axes[axis]
    units = (known.position_unit, known.effort_unit)
    if units != (motion.position_unit, motion.effort_unit):
        raise ModelError(
            f"axis {axis} of the model is in {' and '.join(units)}, the motion in "
            f"{motion.position_unit} and {motion.effort_unit}",
            "give a model in the motion's units",
        )
    if len(known.terms) == 1:
        raise ModelError(f"axis {axis} of the model has no effects", "train without --model")
    coupled = [t.effect for t in known.terms if named(t.effect).has_source(t.source_axis)]
    if coupled and motion.partner is None:
        raise ModelError(
            f"{coupled[0]} needs the other axis, whose motion is not known here",
            "remove the effect from the model file, or train for the paper's motion",
        )
    return replace(motion, known=known)


def _average_lap(smooth: Array) -> Array:
    """Mean over whole laps of (3, N) position, velocity and acceleration, or all as it is."""
    samples = lap_samples(smooth[0])
    if samples is None:
        return smooth
    laps = smooth.shape[1] // samples
    return np.asarray(smooth[:, : laps * samples].reshape(3, laps, samples).mean(axis=1))


def lap_samples(position: Array) -> int | None:
    """Samples after which a motion repeats, at least twice in the record; None if it does not.

    The first minimum of the normalized difference function of the pitch detector YIN
    (de Cheveigné and Kawahara 2002) that is small enough, once the motion has left its start.
    """
    samples = len(position)
    lags = np.arange(samples // 2 + 1)
    length = samples - lags
    squares = np.concatenate([[0.0], np.cumsum(position**2)])
    spectrum = np.abs(np.fft.rfft(position, 2 * samples)) ** 2
    product = np.fft.irfft(spectrum)[lags]
    change = (squares[length] + squares[samples] - squares[lags] - 2.0 * product) / length
    change /= 2.0 * np.var(position)
    left = np.argmax(change > _FRESH)
    below = np.flatnonzero(change[left:] < _REPEATS)
    if change[left] <= _FRESH or not len(below):
        return None
    first = left + below[0]
    back = np.flatnonzero(change[first:] > _REPEATS)
    end = first + back[0] if len(back) else len(change)
    return int(first + np.argmin(change[first:end]))


def perturbed(motion: TrainingMotion, rng: np.random.Generator, count: int) -> Iterator[Motion]:
    """Motions near the nominal one: of other amplitude, and where friction may let the axis fall
    behind, of another start, half of them behind by a lag.

    Yields
    ------
    Motion
        Free of noise; with the other axis as its source, where that is known.
    """
    for _ in range(count):
        amplitude = 1.0 + rng.uniform(-AMPLITUDE_SPREAD, AMPLITUDE_SPREAD)
        shift = round(rng.uniform(-SHIFT_SPREAD_S, SHIFT_SPREAD_S) / motion.period_s)
        lag = max(0.0, rng.uniform(-motion.largest_lag, motion.largest_lag))
        signals = amplitude * np.stack([motion.position, motion.velocity, motion.acceleration])
        if motion.largest_lag:  # periodic, so that it can start elsewhere
            signals = np.roll(signals, -shift, axis=1)
        if lag:
            signals = _lagging(signals[0], lag, motion.period_s)
        yield _with_partner(motion, *signals)


def measured_position(motion: TrainingMotion, position: Array, rng: np.random.Generator) -> Array:
    """What the encoder reads of a true position (N,): noise, and whole counts."""
    quantization = motion.count / np.sqrt(12.0)
    noise = np.sqrt(max(motion.noise**2 - quantization**2, 0.0))
    read = position + noise * rng.normal(size=position.shape)
    return Counting(np.array(motion.count)).counted(read)


def _with_partner(
    motion: TrainingMotion, position: Array, velocity: Array, acceleration: Array
) -> Motion:
    own = Motion.known(motion.time_s, position, velocity, acceleration)
    if motion.partner is None:
        return own
    other = Motion.known(motion.time_s, np.zeros_like(position), *motion.partner)
    return Motion(**{**vars(own), "source": other})


def _lagging(reference: Array, lag: float, period_s: float) -> Array:
    """Follow a periodic reference as far behind as friction makes it: the play operator, smoothed.

    The mean over the rise time of a soft controller stands for the speed that it takes up.

    Returns
    -------
    (3, N) array
        Position, velocity and acceleration.
    """
    position, followed = float(reference[0]), []
    for wanted in np.tile(reference, 2).tolist():  # the first period settles
        position = min(max(position, wanted - lag), wanted + lag)
        followed.append(position)
    width = round(RISE_TIME_S / period_s)
    padded = np.pad(followed[len(reference) :], width // 2 + 1, mode="wrap")
    smooth = np.convolve(padded, np.full(width + 1, 1.0 / (width + 1)), mode="valid")
    step = np.diff(smooth) / period_s
    velocity = 0.5 * (step[1:] + step[:-1])
    velocity[np.abs(velocity) < 1e-9 * np.max(np.abs(velocity))] = 0.0  # rounding is no motion
    return np.stack([smooth[1:-1], velocity, np.diff(step) / period_s])
