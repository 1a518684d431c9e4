"""Long recordings, at the rate that the bandwidth of their identification needs.

A recording of hours holds far more samples than its estimate needs. What only the samples as
recorded tell, which are noise, encoder and gaps, is kept beside the decimated ones.
"""

from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.diagnosis.prepare.bandwidth import white_noise
from edge_ident.signals.conditioning import choose_cutoff
from edge_ident.signals.decimation import LONG, any_of, decimate, kept, parts_of
from edge_ident.signals.encoder import count_and_noise
from edge_ident.signals.recording import AxisRecord, Recording, Sampling
from edge_ident.signals.resampling import EvenGrid

Array = NDArray[np.float64]

_RATE: Final = 5.0
"""Samples per period of the highest cut-off: at half this rate its filter passes 0.07 %."""
_ROUNDING: Final = 1e-9
"""Rounding error of a stride."""


def at_needed_rate(recording: Recording) -> Recording:
    """Decimate a recording that is long, after a low-pass filter without delay.

    Shorter ones are returned as they are.

    Parameters
    ----------
    recording : Recording

    Returns
    -------
    Recording
        Evenly sampled; its axes have a `Sampling`.
    """
    if len(recording.time_s) <= LONG:
        return recording
    grid = EvenGrid.of(recording.time_s)
    told = {name: _sampling(axis, grid) for name, axis in recording.axes.items()}
    highest_hz = max(sampling.cutoff_hz for sampling in told.values())
    stride = int(1.0 / (_RATE * highest_hz * grid.period_s) + _ROUNDING)
    if stride < 2:
        return recording
    axes = {
        name: _decimated(axis, grid, told[name], stride) for name, axis in recording.axes.items()
    }
    passive = {
        name: replace(axis, position=_slower(grid.resampled(axis.position), stride))
        for name, axis in recording.passive.items()
    }
    time_s = grid.time_s[kept(len(grid.time_s), stride)].copy()
    return replace(recording, time_s=time_s, axes=axes, passive=passive)


def _sampling(axis: AxisRecord, grid: EvenGrid) -> Sampling:
    """What the samples as recorded tell, before decimation."""
    position, effort = grid.resampled(axis.position), grid.resampled(axis.effort)
    count, noise = count_and_noise(position)
    cutoff_hz = choose_cutoff(position, grid.period_s, noise)
    effort_noises = [
        white_noise(*parts, cutoff_hz, grid.period_s)
        for parts in zip(parts_of(effort), parts_of(position), strict=True)
    ]
    return Sampling(
        period_s=grid.period_s,
        jitter=grid.jitter,
        count=count,
        position_noise=noise,
        effort_noise=float(np.median(effort_noises)),
        cutoff_hz=cutoff_hz,
        begin_s=0.0,
        unknown=grid.unknown(axis.effort),
    )


def _slower(signal: Array, stride: int) -> Array:
    return decimate(signal, signal, stride)[0]


def _decimated(axis: AxisRecord, grid: EvenGrid, sampling: Sampling, stride: int) -> AxisRecord:
    position, effort = decimate(grid.resampled(axis.position), grid.resampled(axis.effort), stride)
    rows = kept(len(axis.position), stride)
    others = (axis.reference, axis.velocity, axis.temperature_c)
    reference, velocity, temperature_c = (
        None if column is None else grid.resampled(column)[rows] for column in others
    )
    return replace(
        axis,
        position=position,
        effort=effort,
        reference=reference,
        velocity=velocity,
        temperature_c=temperature_c,
        sampling=replace(
            sampling,
            begin_s=rows.start * grid.period_s,
            unknown=any_of(sampling.unknown, stride),
        ),
    )
