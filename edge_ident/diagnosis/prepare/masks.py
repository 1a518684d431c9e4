"""Samples that the diagnosis leaves out.

Three kinds of sample say nothing about the model: those at which the encoder does not resolve the
direction of motion, those at which encoder quantization aliases into the band, and the first ones,
at which friction and play remember the time before the record.
"""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.model.motion import Motion
from edge_ident.signals.conditioning import SAMPLED_PER_PERIOD, at_rest, crept, widened
from edge_ident.signals.filters import LONG

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

SMEAR_PERIODS: Final = 0.7
"""Cut-off periods to either side over which the filter spreads a single sample."""
TURN_NOISE: Final = 8.0
"""Distance from a turning point, in standard deviations of the encoder noise, below which the
direction is unknown. It is 2.3 counts of an encoder without other noise."""
LEAST_WEIGHT: Final = 0.5
"""Filtered direction weight, from 0 to 1, from which a sample is compared: most of what the filter
mixes into it is of known direction."""
_TAPER_PERIODS: Final = 0.4
"""Cut-off periods over which the direction weight falls to zero, and rises again. A sharper edge
would spread over the band."""
_RUN_IN: Final = 0.1
"""Part of the travel that the axis covers before friction and play have forgotten the time before
the record. What builds up over a longer distance is not searched for."""
_STILL_NOISE: Final = 6.0
"""Range of the position, in the same unit, of an axis at rest: less than two counts."""
_HARMONICS: Final = 2
"""Harmonics of the rounding error, a sawtooth, that are considered."""
_DITHER: Final = 0.5
"""Noise, in counts, that makes the rounding error white."""
_SLOW_SWEEP: Final = 8.0
"""Cut-off periods in which an aliased tone may cross the band and still look like motion."""


def longer_or_faster(sampling_hz: float) -> str:
    """What to do where hardly a sample is of known direction."""
    return (
        "record a longer motion, or one that is gentler and turns less often, or sample faster: "
        f"{sampling_hz:.4g} Hz shows reversals that are {SAMPLED_PER_PERIOD / sampling_hz:.2g} s "
        "apart, or more"
    )


def reversals(motion: Motion) -> NDArray[np.intp]:
    """Last samples before the velocity changes its sign."""
    return np.flatnonzero(np.diff(np.sign(motion.velocity)) != 0)


def direction_weight(unknown: Mask, cutoff_hz: float, period_s: float) -> Array:
    """Weight (N,) that falls smoothly from 1, far from unknown directions, to 0 at them."""
    return 1.0 - tapered(unknown, _TAPER_PERIODS / (cutoff_hz * period_s))


def run_in(position: Array) -> int:
    """First of N samples up to which the axis has covered a part of the travel.

    A play or a presliding of that width has forgotten the time before the record then, on whichever
    side of the start that part lies (wiping out, Mayergoyz, Phys. Rev. Lett. 56 (1986) 1518).
    """
    covered = np.maximum.accumulate(position) - np.minimum.accumulate(position)
    return int(np.argmax(covered > _RUN_IN * np.ptp(position)))


def tapered(mask: Mask, by: float) -> Array:
    """Weight (N,) that rises smoothly from 0, far from a mask, to 1 inside it.

    The rise begins twice `by` samples before the mask.
    """
    half = int(np.ceil(by))
    window = np.hanning(2 * half + 3)
    spread = np.convolve(widened(mask, half), window / np.sum(window), "same")
    return np.asarray(np.clip(spread, 0.0, 1.0))


def tone_count(count: float, noise: float) -> float:
    """Count of an encoder whose rounding error is a tone at a steady speed, 0 where it is none.

    Noise of more than half a count before the rounding makes its error white, whatever the speed
    (dither, Widrow and Kollar, Quantization Noise, 2008): its first harmonic is left with less than
    a hundredth. The noise floor holds white noise already.

    Parameters
    ----------
    count : float
        Encoder resolution.
    noise : float
        Standard deviation of the encoder noise, that of the rounding among it.
    """
    return count if noise**2 - count**2 / 12.0 < (_DITHER * count) ** 2 else 0.0


def aliasing_mask(
    motion: Motion, count: float, cutoff_hz: float, period_s: float, smear: int
) -> Mask:
    """Samples (N,) at which encoder quantization aliases into the band.

    The rounding error of the encoder is a tone whose frequency is the speed in counts per second.
    At a whole number of counts per sample, sampling folds this tone to low frequencies. Where the
    speed stays there for a while, the aliased tone looks like motion, and the controller answers
    it.

    Parameters
    ----------
    motion : Motion
        (N,), filtered at the cut-off.
    count : float
        `tone_count` of the encoder.
    smear : int
        Samples by which the mask is widened.
    """
    tones = np.zeros(len(motion.velocity), dtype=np.bool_)
    harmonics = range(1, _HARMONICS + 1) if count > 0.0 else ()
    for begin in range(0, len(tones), LONG):  # in blocks: a long recording leaves little memory
        block = slice(begin, begin + LONG)
        for harmonic in harmonics:
            per_sample = harmonic * np.abs(motion.velocity[block]) * period_s / count
            folded_hz = np.abs(per_sample - np.round(per_sample)) / period_s
            sweep = harmonic * np.abs(motion.acceleration[block]) / count
            tones[block] |= (
                (per_sample > 0.5) & (folded_hz < cutoff_hz) & (sweep < cutoff_hz**2 * _SLOW_SWEEP)
            )
    return widened(tones, smear)


def unknown_directions(
    position: Array,
    turns: NDArray[np.intp],
    noise: float,
    speed: float,
    cutoff_hz: float,
    period_s: float,
) -> tuple[Mask, Mask]:
    """Samples (N,) at which the encoder does not resolve the direction of motion, in two parts.

    Reversing: samples within the encoder noise of a turning point, and standstills of at least
    half a cut-off period, in which the axis rests or creeps. Until it has moved on, its friction
    may be anything between the friction of both directions.

    Short rests, from which the axis moves on as before: the position has no turning point beyond
    the noise there. They show in the smooth velocity, which changes its sign.

    Parameters
    ----------
    position : (N,) array
        As measured.
    turns : array of int
        Samples at which the smooth velocity changes its sign.
    noise : float
        Standard deviation of the encoder noise.
    speed : float
        Typical speed.
    """
    found, width = turning_points(position, TURN_NOISE * noise), _half_period(cutoff_hz, period_s)
    near = np.zeros(len(position), dtype=np.bool_)
    near[found] = True
    # the smooth velocity shows the turning points too, a few samples aside
    near = widened(near, width)
    most = max(_STILL_NOISE * noise, crept(speed, width * period_s))
    still = at_rest(position, most, width)
    reversing = _not_away(position, found, noise) | still
    return reversing, _not_away(position, turns[~near[turns]].tolist(), noise)


def _half_period(cutoff_hz: float, period_s: float) -> int:
    """Samples in half a period of the cut-off."""
    return max(2, int(np.ceil(0.5 / (cutoff_hz * period_s))))


def _not_away(position: Array, turns: list[int], noise: float) -> Mask:
    """Samples (N,) around each turn, until the axis is beyond the noise of it."""
    found = np.zeros(len(position), dtype=np.bool_)
    for turn in turns:
        away = np.abs(position - position[turn]) > TURN_NOISE * noise
        before, after = np.flatnonzero(away[:turn]), np.flatnonzero(away[turn:])
        first = before[-1] + 1 if len(before) else 0
        found[first : turn + (after[0] if len(after) else len(away))] = True
    return found


def turning_points(position: Array, least: float) -> list[int]:
    """Extremes from which the position returns by more than `least`."""
    turns: list[int] = []
    highest = lowest = 0
    direction = 0
    for k, here in enumerate(position.tolist()):
        if here > position[highest]:
            highest = k
        if here < position[lowest]:
            lowest = k
        if direction >= 0 and position[highest] - here > least:
            turns += [highest] if direction > 0 else []
            direction, lowest = -1, k
        elif direction <= 0 and here - position[lowest] > least:
            turns += [lowest] if direction < 0 else []
            direction, highest = 1, k
    return turns
