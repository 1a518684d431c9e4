"""Numbers of the board's law that follow from the loop, not from the effect that they serve.

**Fade speeds.** Feed-forward over position arrives late by the time τ from the sample to the middle
of the period in which its effort acts. At the speed v a wave of period p is then late by the phase
φ = 2π·v·τ/p. Taken off in full, it leaves 2·sin(φ/2) of itself, which beyond 60° is more than there
was. So a wave acts whole up to 30°, and not at all from 60° on. A table is taken for a wave whose
slope is as large: rms slope over rms value about the mean, for 2π/p.

**Play** is crossed while the reference moves over a distance. The motor cannot cross the gap g
faster than the effort E that is left allows, in the time T = √(4·J·g/E). A reference that turns
back with the acceleration a moves a·T²/2 meanwhile. It is at most a third of the gap: after three
distances 95 % are made up for, and after the gap the motor would meet the load by itself. Measured
accelerations hold impacts, so the first bound alone would be too long. The loop smooths what is
faster than itself, and the motor without this meets the load at √(2·a·g), which is no softer.

**The inverse of a deadband** leaves the loop as it was designed, whatever the noise: the actuator
takes off again what it adds. Only a width that is wrong by δ acts, like a relay. Smoothed, it
raises the loop's gain at small efforts by 1 + δ/smoothing. That may take half of the gain margin,
in decibels.
"""

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_WHOLE_UP_TO_RAD: Final = math.pi / 6.0
"""Phase by which a wave may be late and still act whole; at twice that it no longer acts."""
_DISTANCES_IN_GAP: Final = 3.0


def wave_fade_speed(period_rad: float, late_s: float) -> float:
    """Speed up to which a wave over position is fed forward whole."""
    return _WHOLE_UP_TO_RAD * period_rad / (2.0 * math.pi * late_s)


def table_fade_speed(table: Array, step_rad: float, late_s: float) -> float:
    """Speed up to which a table (K,) is fed forward whole; infinite where it is level."""
    slope = np.diff(table) / step_rad
    swing = float(np.std(table))
    if not slope.any() or not swing:
        return math.inf
    return _WHOLE_UP_TO_RAD * swing / (float(np.sqrt(np.mean(slope**2))) * late_s)


def backlash_distance(
    gap_rad: float, inertia: float, acceleration_rad_s2: float, effort_nm: float
) -> float:
    """Distance of the reference over which play is made up for.

    Parameters
    ----------
    gap_rad : float
    inertia : float
        Of the axis.
    acceleration_rad_s2 : float
        Of the reference, where it turns back; the largest.
    effort_nm : float
        That is left for it.
    """
    needed = 2.0 * acceleration_rad_s2 * inertia * gap_rad / effort_nm
    return min(needed, gap_rad / _DISTANCES_IN_GAP)


def deadband_smoothing(width_doubt_nm: float, gain_margin: float) -> float:
    """Effort over which the inverse of a deadband changes its sign.

    Parameters
    ----------
    width_doubt_nm : float
        By which its width may be wrong.
    gain_margin : float
        Of the loop, as a factor.
    """
    return width_doubt_nm / (math.sqrt(gain_margin) - 1.0)
