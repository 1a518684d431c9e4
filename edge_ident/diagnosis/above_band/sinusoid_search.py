"""The search above the band: sinusoids of position and of time, the strongest first.

Each is taken out before the next is looked for, together with all before it (orthogonal matching
pursuit; Pati, Rezaiifar and Krishnaprasad, Asilomar 1993). The peak of a periodogram is pulled by
its neighbours and by how the axis answers. So the rates of all orders are fitted together, beside
the base model, before they are taken out: what a wrong rate leaves would look like more orders.
"""

import math
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.diagnosis.above_band.spectrum import (
    NONZERO,
    WIDEST,
    Periodogram,
    WideSignals,
    accounts,
    clipped,
    inertia,
    least_squares,
    left_beside,
    over_position,
    quietest_lines,
    refined,
)
from edge_ident.signals.metrics import rms

Array = NDArray[np.float64]


_Grid = tuple[Array, Array]

ABOVE: Final = 0.2
"""Least share of a sinusoid's energy above the band; the comparison sees the others."""
_FEWEST_WAVES: Final = 10.0
"""Fewest periods in the travel: a longer wave may be any load along it."""
_MOST: Final = 10
"""Orders that are looked for in a recording, and then other sinusoids."""
_STRONG: Final = 4
"""Orders that bias the inertia."""
_BESIDE: Final = 6.0
"""Resolution cells about a found sinusoid that its own unevenness fills."""
_UNEVEN: Final = 0.02
"""The same, relative to its rate."""
_LEAKED: Final = 0.05
"""Share of a found sinusoid's power that its unevenness may hold."""
_TOGETHER: Final = 0.25
"""Power, of the strongest, down to which sinusoids are taken out at once."""
_KNEES: Final = 4.0
"""Highest frequency, in knees, at which the acceleration says something about a wave."""
_STEPS: Final = 3
"""Of Gauss and Newton; a peak is near enough for the first to be nearly right."""
_FARTHEST: Final = 1.0
"""Resolution cells by which a fit may move a rate."""
_TINY: Final = float(np.finfo(float).tiny)


@dataclass(frozen=True)
class Peak:
    """A sinusoid that stands out of the noise.

    Attributes
    ----------
    order : bool
        Whether it repeats with the position; otherwise with time.
    rate : float
        rad per unit of position, or rad/s.
    power, level : float
        Energy that it explains, and that of the noise about it.
    rate_std : float
        Standard deviation of the rate.
    full_motion : bool
        Whether it was found beside the whole acceleration, or beside what encoder noise leaves.
    time_range : (float, float)
        Lowest and highest rate in time, rad/s.
    """

    order: bool
    rate: float
    power: float
    level: float
    rate_std: float
    full_motion: bool
    time_range: tuple[float, float]


def search(wide: WideSignals) -> list[Peak]:
    """Sinusoids above the band of one recording: orders first, then what else the effort holds.

    Strong orders bias the inertia that their search subtracts, so they are searched twice.
    """
    peaks: list[Peak] = []
    slow = np.concatenate([wide.friction_above, wide.white_loads_above])
    for most in (_STRONG, _MOST):
        mass = inertia(wide, columns(wide, peaks))
        left = left_beside(slow, wide.white_above(wide.effort - mass * wide.acceleration))
        peaks = _pursuit(wide, left[None], [], most, white=True)
        if not peaks:
            break
    weighted, _, none = accounts(wide, mass, columns(wide, peaks))
    signals = np.stack([weighted, none])
    return _pursuit(wide, signals, _with_halves(wide, peaks), _MOST, white=False)


def _pursuit(
    wide: WideSignals, signals: Array, known: list[Peak], most: int, *, white: bool
) -> list[Peak]:
    """Take sinusoids out of signals above the band; all of them, the known ones first.

    There is one white signal (1, N); of those that are not white (2, N) the second holds none of
    the acceleration.
    """
    peaks = new = list(known)
    grid = _order_grid(wide, white)
    left = signals
    while True:
        if new:
            peaks = _fitted_together(wide, peaks) if white else peaks
            waves = columns(wide, peaks)
            taken = wide.white_above(waves) if white else wide.above(waves)
            left = np.stack([one - least_squares(taken, one) @ taken for one in signals])
        calm = [clipped(wide, one) for one in left]
        new = _strongest(wide, calm, peaks, grid, white)
        new = new[: len(known) + most - len(peaks)]
        if not new:
            return peaks
        peaks = peaks + new


def _fitted_together(wide: WideSignals, orders: list[Peak]) -> list[Peak]:
    """Orders at the rates that explain the effort best, all together and beside the base model."""
    base, effort = wide.white_above(wide.base), wide.white_above(wide.effort)
    most = _FARTHEST * 2.0 * np.pi / max(float(np.ptp(wide.position)), _TINY)
    found = orders
    for _ in range(_STEPS):
        moves = least_squares(_with_moves(wide, found, base, effort), effort)[-len(found) :]
        found = [replace(p, rate=p.rate + float(m)) for p, m in zip(found, moves, strict=True)]
        if any(abs(p.rate - was.rate) > most for p, was in zip(found, orders, strict=True)):
            return orders
    return found


def _with_halves(wide: WideSignals, orders: list[Peak]) -> list[Peak]:
    """Orders whose deviations hold what lies between the halves of the recording, too."""
    if not orders:
        return []
    effort = wide.white_above(wide.effort)
    rows = _with_moves(wide, orders, wide.white_above(wide.base), effort)
    early, late = (least_squares(rows[:, p], effort[p])[-len(orders) :] for p in wide.halves)
    return [
        replace(p, rate_std=math.hypot(p.rate_std, 0.5 * float(apart) / math.sqrt(2.0)))
        for p, apart in zip(orders, early - late, strict=True)
    ]


def _with_moves(wide: WideSignals, orders: list[Peak], base: Array, effort: Array) -> Array:
    """Rows (4 + 3·P, N): the base model, the waves of the orders, and what a move of each rate
    adds to its wave, as large as the wave is in the effort (N,)."""
    waves = columns(wide, orders)
    rows = np.concatenate([base, wide.white_above(waves)])
    amplitudes = least_squares(rows, effort)[len(base) :]
    cosines, sines = (part[:, None] for part in (amplitudes[::2], amplitudes[1::2]))
    along = wide.position - np.mean(wide.position)
    turned = along * (sines * waves[::2] - cosines * waves[1::2])
    return np.concatenate([rows, wide.white_above(turned)])


def columns(wide: WideSignals, peaks: list[Peak]) -> Array:
    """Cosines and sines of peaks, (2·P, N)."""
    parts = [wide.waves(wide.position if p.order else wide.time_s, p.rate) for p in peaks]
    return np.concatenate([np.empty((0, len(wide.time_s))), *parts])


def _strongest(
    wide: WideSignals, residuals: list[Array], peaks: list[Peak], grid: _Grid, white: bool
) -> list[Peak]:
    """The strongest sinusoids that noise does not make: those within a quarter of the first."""
    residual = residuals[0]
    seen = wide.white_above(residual) if white else wide.above(residual)
    weighted = wide.weight * residual
    orders = over_position(seen, wide.position, grid)
    lines = orders if white else quietest_lines(wide, *residuals)
    speeds = wide.usual_speeds
    found: list[Peak] = []
    candidates = [(True, k) for k in _outstanding(orders)]
    candidates += [(False, k) for k in _outstanding(lines) if not white]
    candidates.sort(key=lambda c: -(orders if c[0] else lines).power[c[1]])
    for order, k in candidates:
        one = orders if order else lines
        power, rate = float(one.power[k]), float(one.rate[k])
        if found and power < _TOGETHER * found[0].power:
            break
        swept = (rate * speeds[0], rate * speeds[1]) if order else (rate, rate)
        beside = [p for p in peaks + found if _near(p, rate, swept, one.cell, order)]
        taken = any(p.order == order and abs(rate - p.rate) < one.cell for p in peaks)
        if taken or any(p in found for p in beside):
            continue
        if any(power < _LEAKED * p.power for p in beside):
            continue
        along = wide.position if order else wide.time_s
        rate = refined(seen if order else weighted, along, rate, one.cell)
        level = float(one.level[k])
        found.append(Peak(order, rate, power, level, one.rate_std(power, level), white, swept))
    return found


def _outstanding(one: Periodogram) -> list[int]:
    """The highest ordinates that noise does not reach."""
    above = np.flatnonzero(one.prominence > 1.0)
    return [int(k) for k in above[np.argsort(one.power[above])[::-1]][:50]]


def _order_grid(wide: WideSignals, white: bool) -> _Grid:
    """Rates of the orders that are searched, and the energy of each above the band."""
    travel = float(np.ptp(wide.position))
    speed = rms(wide.velocity[wide.weight > 0.5])
    lowest = 2.0 * np.pi * _FEWEST_WAVES / travel
    highest_hz = min(WIDEST / wide.period_s, _KNEES * wide.knee_hz if white else np.inf)
    highest = 2.0 * np.pi * highest_hz / speed
    rates = np.geomspace(lowest, max(highest, 1.01 * lowest), 200)
    share = wide.energy_above(rates, white=False)
    seen = wide.energy_above(rates, white=white)
    return rates, np.where(share >= ABOVE, seen, 0.0) * float(wide.weight @ wide.weight)


def _near(peak: Peak, rate: float, swept: tuple[float, float], cell: float, order: bool) -> bool:
    if peak.order == order:
        return abs(rate - peak.rate) < max(_BESIDE * cell, _UNEVEN * peak.rate)
    low, high = peak.time_range
    return swept[0] < high * (1 + _UNEVEN) and swept[1] > low * (1 - _UNEVEN)


# A sinusoid above the band of the comparison, and which of several recordings show the same.

SAME_RATE: Final = 0.02
"""Relative difference of two rates up to which two recordings show one sinusoid."""


@dataclass(frozen=True)
class Sinusoid:
    """A sinusoid above the band.

    Attributes
    ----------
    rate : float
        rad per unit of position for an order, rad/s for a line.
    cosine, sine : float
        In the unit of the effort, about position or time zero.
    std : float
        Standard deviation of either, and of the amplitude: noise, timing, and the difference
        between the halves of the recording.
    rate_std : float
        Standard deviation of the rate.
    share : float
        Rms over the rms of the recorded effort.
    found_again : bool
        Whether both halves of the recording hold it.
    gain : (float, float)
        Relative reduction of the residual of each half, by the amplitude of the other half.
    recorded : float
        Rms of what it removes from the effort above the band, less inertia where encoder noise does
        not hide the motion, over the rms of the recorded effort. The amplitude of either half is
        tried on the other half, so noise removes nothing. Of an order that is worth naming, with
        what it removes inside the band.
    of_encoder : bool
        Whether an order is rather an error of the encoder: it grows with the square of the speed,
        or is mostly inertia times a motion below the encoder's resolution.
    at_one_speed : bool
        Whether the motion has too few speeds to tell a ripple from an error of the encoder.
    """

    rate: float
    cosine: float
    sine: float
    std: float
    rate_std: float
    share: float
    found_again: bool
    gain: tuple[float, float]
    recorded: float = 0.0
    of_encoder: bool = False
    at_one_speed: bool = False

    @property
    def amplitude(self) -> float:
        """In the unit of the effort."""
        return float(np.hypot(self.cosine, self.sine))

    @property
    def certain(self) -> bool:
        """Whether its amplitude is."""
        return self.amplitude > NONZERO * self.std

    @property
    def nameable(self) -> bool:
        """Whether a load of the axis, of a certain amplitude, is what explains it."""
        return self.certain and not self.of_encoder


def merged(found: list[list[Sinusoid]]) -> list[Sinusoid]:
    """Sinusoids of all recordings that were found again, the strongest first.

    Each counts once, from the recording that knows best what it is.
    """
    kept: list[Sinusoid] = []
    every = [(k, one) for k, sinusoids in enumerate(found) for one in sinusoids]
    for k, one in sorted(every, key=lambda pair: (not pair[1].nameable, pair[1].std)):
        again = one.found_again or any(same(one, other) for n, other in every if n != k)
        if again and not any(same(one, other) for other in kept):
            kept.append(one)
    return sorted(kept, key=lambda s: -s.share)


def same(one: Sinusoid, other: Sinusoid) -> bool:
    """Whether two sinusoids have the same rate, as far as it is known."""
    apart = abs(one.rate - other.rate)
    return apart < max(3.0 * math.hypot(one.rate_std, other.rate_std), SAME_RATE * one.rate)


# Sinusoids above the band in the halves of a recording: what each half says on the other one.


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
