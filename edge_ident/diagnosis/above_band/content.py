"""What lies above the band of the comparison: orders over position, lines in time, and the rest.

The comparison ends where encoder noise spoils the acceleration. The effort is recorded at full
bandwidth. `sinusoid_search` finds its sinusoids, and this module measures them; `unsteady` finds
what is no sinusoid. The amplitude of an
order comes from least squares on effort, acceleration, velocity and direction together: the axis
and its controller answer a ripple, and the effort shows only what that leaves of it.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.diagnosis.above_band.held import may_hold_order
from edge_ident.diagnosis.above_band.sinusoid_search import (
    Half,
    Peak,
    Sinusoid,
    columns,
    crossed,
    merged,
    recorded_shares,
    same,
    search,
)
from edge_ident.diagnosis.above_band.spectrum import (
    FALSE_ALARM,
    WideSignals,
    accounts,
    inertia,
    least_squares,
    lines_over_time,
)
from edge_ident.diagnosis.above_band.unsteady import (
    Disturbance,
    Rest,
)
from edge_ident.diagnosis.prepare.axis_data import AxisData, Segment
from edge_ident.model.model import Model
from edge_ident.signals.filters import lowpass
from edge_ident.signals.metrics import rms
from edge_ident.signals.recording import Recording

Array = NDArray[np.float64]


_HELD: Final = 1.0 / np.sqrt(12.0)
"""Standard deviation of the timing, in samples: a command is held over one of them."""
_AGREES: Final = 0.5
"""Largest difference between halves, of the amplitude, beside three standard deviations."""
_LESS: Final = 2.0
"""Standard deviations by which one amplitude is certainly less than another."""
_BETTER: Final = 1.25
"""Energy that the square of the speed explains, over that of a constant amplitude, from which it is
the better law. On a sinusoidal motion it is 1.5 for an error of the encoder, 0.67 for a ripple."""
_TINY: Final = float(np.finfo(float).tiny)


@dataclass(frozen=True)
class BandContent:
    """What the effort holds beyond the comparison.

    Attributes
    ----------
    share_in_band : float
        Share of the effort's variance below the cut-off.
    orders : tuple of Sinusoid
        Loads that repeat with the position, the strongest first.
    unnamed_orders : tuple of Sinusoid
        Orders that are rather errors of the encoder, or of an uncertain amplitude.
    lines : tuple of Sinusoid
        Sinusoids in time.
    unsteady : tuple of Disturbance
        What lasts beside them, and keeps no frequency; one for each recording that holds it.
    missed : float
        Rms of the effort above the band that neither the base model nor noise accounts for.
    """

    share_in_band: float
    orders: tuple[Sinusoid, ...]
    unnamed_orders: tuple[Sinusoid, ...]
    lines: tuple[Sinusoid, ...]
    unsteady: tuple[Disturbance, ...] = ()
    missed: float = 0.0

    @property
    def without_cause(self) -> bool:
        """Whether it holds what no effect names."""
        return bool(self.unnamed_orders or self.lines or self.unsteady)


def above_band(
    recordings: Sequence[Recording], name: str, data: AxisData, known: Model | None = None
) -> BandContent:
    """Find what the effort of an axis holds above the band of the comparison.

    A sinusoid is reported where both halves of a recording, or two recordings, hold it; an order
    only where every recording may hold it.

    Parameters
    ----------
    data : AxisData
        The same, prepared.
    known : Model, optional
        Whose effects are subtracted from the effort.
    """
    orders: list[list[Sinusoid]] = []
    lines: list[list[Sinusoid]] = []
    rests: list[Rest] = []
    left: list[tuple[WideSignals, Array]] = []
    for recording, segment in zip(recordings, data.segments, strict=True):
        wide = WideSignals.of(recording, name, segment, known)
        peaks = search(wide)
        clear = [p for p in peaks if p.full_motion]
        waves = columns(wide, clear)
        mass = inertia(wide, waves)
        without_inertia = accounts(wide, mass, waves)
        hidden = [p for p in peaks if not p.full_motion]
        beside = _beside(wide, hidden, waves, mass, without_inertia)
        whole_motion = _orders(wide, clear, waves, mass, without_inertia[0])
        orders.append(whole_motion + [s for s, p in beside if p.order])
        lines.append([s for s, p in beside if not p.order and s.certain])
        steady = clear + [p for s, p in beside if p.order or (s.certain and s.found_again)]
        rests.append(Rest.of(wide, columns(wide, steady), mass, segment.effort_density))
        left.append((wide, without_inertia[0]))
    unsteady = (rest.disturbance() for rest in rests)
    samples = sum(rest.samples for rest in rests)
    found = [order for order in merged(orders) if _everywhere(order, orders, left)]
    return BandContent(
        share_in_band=_share_in_band(data.segments),
        orders=tuple(s for s in found if s.nameable),
        unnamed_orders=tuple(s for s in found if not s.nameable),
        lines=tuple(merged(lines)),
        unsteady=tuple(one for one in unsteady if one is not None),
        missed=math.sqrt(sum(rest.missed for rest in rests) / max(samples, 1)),
    )


def _everywhere(
    order: Sinusoid, found: Sequence[list[Sinusoid]], left: Sequence[tuple[WideSignals, Array]]
) -> bool:
    """Whether the recordings that do not show an order may hold it all the same."""
    return all(
        any(same(order, other) for other in there)
        or may_hold_order(wide, above, order.rate, order.amplitude)
        for there, (wide, above) in zip(found, left, strict=True)
    )


def _share_in_band(segments: Sequence[Segment]) -> float:
    """Share of the effort's variance below the cut-off."""
    inside = whole = 0.0
    for s in segments:
        effort = s.raw_effort - np.mean(s.raw_effort)
        smooth = lowpass(effort, s.cutoff_hz, s.raw_period_s)
        inside += float(smooth @ smooth)
        whole += float(effort @ effort)
    return min(inside / max(whole, _TINY), 1.0)


def _orders(
    wide: WideSignals, peaks: list[Peak], waves: Array, mass: float, without_inertia: Array
) -> list[Sinusoid]:
    """Amplitudes of orders, whose waves are (2·P, N)."""
    if not peaks:
        return []
    base = wide.white_above(wide.base)
    filtered = wide.white_above(waves)
    effort = wide.white_above(wide.effort) - mass * base[0]
    rows = np.concatenate([base[1:], wide.white_loads_above, filtered])
    moved = least_squares(filtered, base[0]).reshape(-1, 2)
    speed = rms(wide.velocity[wide.weight > 0.5])
    law = _laws_of_speed(wide, rows, effort, waves)
    halves = crossed(wide, rows, effort, first=len(rows) - len(waves))
    measured = _measured(wide, peaks, least_squares(rows, effort)[-len(waves) :], halves)
    recorded = recorded_shares(wide, crossed(wide, wide.above(waves), without_inertia, first=0))
    found = []
    for k, one in enumerate(measured):
        if not one.found_again:
            found.append(replace(one, recorded=recorded[k]))
            continue
        moving = float(np.hypot(*moved[k]))
        late = one.rate * speed * _HELD * wide.period_s * mass * moving
        error = moving / (one.rate * speed) ** 2
        doubtful = mass * moving > _AGREES * one.amplitude and error < wide.resolution
        std = float(np.hypot(one.std, late))
        found.append(
            replace(
                one,
                recorded=recorded[k],
                std=std,
                of_encoder=doubtful or law[k] > _BETTER,
                at_one_speed=law[k] > 1.0 / _BETTER,
            )
        )
    return found


def _laws_of_speed(wide: WideSignals, rows: Array, effort: Array, waves: Array) -> list[float]:
    """Energy that each order explains if it grows with the square of the speed, as an error of the
    encoder does, over that of a constant amplitude."""
    squared = wide.white_above(wide.velocity**2 * waves)
    whole = np.concatenate([rows, squared])
    gram = whole @ whole.T
    length = np.sqrt(np.maximum(np.diag(gram), _TINY))
    gram = gram / np.outer(length, length)
    moment = whole @ effort / length

    def explained(kept: NDArray[np.intp]) -> float:
        part = gram[np.ix_(kept, kept)]
        return float(moment[kept] @ np.linalg.lstsq(part, moment[kept], rcond=1e-12)[0])

    known = np.arange(len(rows))
    ratios = []
    for first in range(0, len(waves), 2):
        pair = np.arange(first, first + 2)
        others = np.delete(known, len(rows) - len(waves) + pair)
        without = explained(others)
        growing = explained(np.concatenate([others, len(rows) + pair])) - without
        ratios.append(growing / max(explained(known) - without, _TINY))
    return ratios


def _beside(
    wide: WideSignals, peaks: list[Peak], orders: Array, mass: float, efforts: Array
) -> list[tuple[Sinusoid, Peak]]:
    """Amplitudes of peaks at frequencies where encoder noise hides the motion, beside the waves of
    orders (W, N).

    A line counts in that account of the motion, of efforts (3, N), which leaves the least noise
    about it. What the account with the whole motion has certainly less of is of the motion.
    """
    if not peaks:
        return []
    waves = wide.above(columns(wide, peaks))
    rows = np.concatenate([wide.above(orders), waves])
    moved = mass * least_squares(waves, wide.above(wide.acceleration)).reshape(-1, 2)
    part = np.hypot(moved[:, 0], moved[:, 1])
    by_account = []
    for left in efforts:
        halves = crossed(wide, rows, left, first=len(orders))
        seen = _with_level(wide, peaks, left)
        found = _measured(wide, seen, least_squares(rows, left)[len(orders) :], halves)
        shares = recorded_shares(wide, halves)
        taken = [replace(one, recorded=share) for one, share in zip(found, shares, strict=True)]
        by_account.append(list(zip(taken, seen, strict=True)))
    pairs = []
    for moving, first, whole, none in zip(part, *by_account, strict=True):
        quietest = min((first, whole, none), key=lambda account: account[1].level)
        one, peak = first if first[1].order else quietest
        if whole[0].amplitude + _LESS * whole[0].std < one.amplitude:
            one = replace(one, found_again=False)
        pairs.append((replace(one, of_encoder=bool(moving > _AGREES * one.amplitude)), peak))
    return pairs


def _with_level(wide: WideSignals, peaks: list[Peak], left: Array) -> list[Peak]:
    """Peaks with the noise that a residual (N,) has about each line in time."""
    seen = lines_over_time(wide, left)
    levels = np.interp([peak.rate for peak in peaks], seen.rate, seen.level)
    return [
        peak if peak.order else replace(peak, level=float(level))
        for peak, level in zip(peaks, levels, strict=True)
    ]


def _measured(
    wide: WideSignals, peaks: list[Peak], amplitudes: Array, by_half: list[Half]
) -> list[Sinusoid]:
    """Sinusoids of peaks, from their amplitudes (2·P,) in the whole recording and in its halves."""
    whole = amplitudes.reshape(-1, 2)
    scale = max(rms(wide.effort), _TINY)
    found = []
    for k, peak in enumerate(peaks):
        halves = [half.amplitudes[k] for half in by_half]
        variance = [2.0 * peak.level / max(half.energy[k], _TINY) for half in by_half]
        apart = float(np.hypot(*(halves[0] - halves[1])))
        amplitude = float(np.hypot(*whole[k]))
        stands_out = all(
            float(half @ half) > -2.0 * np.log(FALSE_ALARM) * v
            for half, v in zip(halves, variance, strict=True)
        )
        agree = apart < max(_AGREES * amplitude, 3.0 * float(np.sqrt(sum(variance))))
        gain = [1.0 - math.sqrt(half.after[k] / max(half.before[k], _TINY)) for half in by_half]
        found.append(
            Sinusoid(
                rate=peak.rate,
                cosine=float(whole[k, 0]),
                sine=float(whole[k, 1]),
                std=float(np.hypot(np.sqrt(0.25 * sum(variance)), 0.5 * apart / np.sqrt(2.0))),
                rate_std=peak.rate_std,
                share=amplitude / math.sqrt(2.0) / scale,
                found_again=stands_out and agree,
                gain=(min(gain), max(gain)),
            )
        )
    return found
