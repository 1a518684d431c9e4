"""Sinusoids above the band in the halves of a recording: what each half says on the other one."""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.diagnosis.above_band.accounts import least_squares
from edge_ident.diagnosis.above_band.full_bandwidth import WideSignals
from edge_ident.signals.metrics import rms

Array = NDArray[np.float64]

_TINY: Final = float(np.finfo(float).tiny)


@dataclass(frozen=True)
class Half:
    """One half of a recording: amplitudes (P, 2) there, and energies (P,): of a sinusoid's rows,
    and what is left without it and with the amplitudes of the other half."""

    amplitudes: Array
    energy: Array
    before: Array
    after: Array


def crossed(wide: WideSignals, rows: Array, effort: Array, first: int) -> list[Half]:
    """Fit each half, and try what it gives on the other one; sinusoids begin at row `first`."""
    parts = [(rows[:, half], effort[half]) for half in wide.halves]
    fits = [least_squares(*part) for part in parts]
    halves = []
    for (part, signal), fit, other in zip(parts, fits, fits[::-1], strict=True):
        left = signal - fit @ part
        pairs = part[first:].reshape(-1, 2, part.shape[1])
        own, tried = fit[first:].reshape(-1, 2), other[first:].reshape(-1, 2)
        without = [left + one @ pair for one, pair in zip(own, pairs, strict=True)]
        after = [r - one @ pair for r, one, pair in zip(without, tried, pairs, strict=True)]
        halves.append(
            Half(
                amplitudes=own,
                energy=np.array([float(np.sum(pair**2)) for pair in pairs]),
                before=np.array([float(r @ r) for r in without]),
                after=np.array([float(r @ r) for r in after]),
            )
        )
    return halves


def recorded_shares(wide: WideSignals, halves: list[Half]) -> list[float]:
    """Rms of what each sinusoid removes from the effort, over the rms of the recorded effort."""
    taken = np.sum([half.before - half.after for half in halves], axis=0)
    scale = max(float(np.sum(wide.weight)) * rms(wide.effort) ** 2, _TINY)
    return [math.sqrt(max(energy, 0.0) / scale) for energy in taken.tolist()]
