"""Which of several units differs from the others by more than units differ and recordings err.

A random-effects model of one quantity. Unit i has its own true value, the units' values scatter
around a centre with the between-unit deviation, and the recording of a unit shows its value with
the deviation of that unit's own interval::

    value_i ~ N(centre, between² + std_i²)

Centre and between-unit deviation follow from the other units (Paule and Mandel 1982, DerSimonian
and Kacker 2007), so a unit does not hide behind the spread that it makes itself. Several may stand
out and hide each other: the most distant unit is taken out, again and again, and all up to the
last one whose distance is significant stand out (generalized extreme Studentized deviate test,
Rosner 1983). A distance is compared with Student's t of as many degrees of freedom as the spread of
the other units has: units of wide intervals tell little of it (Kish's effective number).
"""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy import stats

Array = NDArray[np.float64]

FEWEST_UNITS: Final = 6
"""Units below which nothing is said. With five, one would have to lie twelve deviations away."""
FALSE_ALARM: Final = 0.05
"""Probability that a survey of equal units names any unit, over all quantities together."""
LARGEST_SHARE: Final = 0.25
"""Largest share of the units that may stand out; the others are what units are like."""
# Where one unit has all the weight, its scatter is unknown, and Student's t needs a number.
_LEAST_FREEDOM: Final = 0.5
_STEPS: Final = 100
_CLOSE: Final = 1e-6  # relative step at which a variance is found


@dataclass(frozen=True)
class Spread:
    """How the values of units scatter.

    Attributes
    ----------
    centre, std : (M,) arrays or float
        Of the units, with its standard deviation.
    between : (M,) array or float
        Standard deviation of the units' true values.
    freedom : (M,) array or float
        Degrees of freedom of that deviation.
    """

    centre: Array
    std: Array
    between: Array
    freedom: Array


@dataclass(frozen=True)
class Distances:
    """How far each of N units is from the others.

    Attributes
    ----------
    centre, between : float
        Of the units that do not stand out.
    distance : (N,) array
        From the centre of those others, in standard deviations of the difference.
    stands_out : (N,) array of bool
    """

    centre: float
    between: float
    distance: Array
    stands_out: NDArray[np.bool_]


def distances(values: Array, std: Array, quantities: int) -> Distances | None:
    """Find the units that stand out in one of several quantities.

    Parameters
    ----------
    values, std : (N,) arrays
        Positive deviations.
    quantities : int
        Number of quantities that are looked at; they share the probability of a false alarm.

    Returns
    -------
    Distances or None
        None where there are fewer than `FEWEST_UNITS`.
    """
    count = len(values)
    if count < FEWEST_UNITS:
        return None
    steps = max(1, int(LARGEST_SHARE * count))
    levels = _levels(FALSE_ALARM / quantities, steps)
    left, taken, out = np.ones(count, dtype=np.bool_), [], 0
    for step, level in enumerate(levels, start=1):
        units = np.flatnonzero(left)
        distance, freedom = _from_others(values[units], std[units], ~np.eye(len(units), dtype=bool))
        chance = 2.0 * stats.t.sf(np.abs(distance), np.maximum(freedom, _LEAST_FREEDOM))
        least = int(np.argmin(chance))
        taken.append(units[least])
        left[units[least]] = False
        if len(units) * chance[least] <= level:
            out = step
    stands_out = np.zeros(count, dtype=np.bool_)
    stands_out[taken[:out]] = True
    inside = spread_of(values, std, ~stands_out[None])
    others = ~(np.eye(count, dtype=np.bool_) | stands_out)
    distance, _ = _from_others(values, std, others)
    return Distances(float(inside.centre[0]), float(inside.between[0]), distance, stands_out)


def spread_of(values: Array, std: Array, used: NDArray[np.bool_]) -> Spread:
    """Centre and between-unit deviation of several choices of units, of two units or more each.

    Parameters
    ----------
    values, std : (N,) arrays
    used : (M, N) array of bool
        Which units each choice has.

    Returns
    -------
    Spread
        Arrays (M,).
    """
    freedom = np.sum(used, axis=1) - 1
    variance = np.zeros(len(used))
    for _ in range(_STEPS):
        # Newton's method: the scatter falls with the variance and is convex, so from zero on each
        # step comes closer and none goes too far
        weight = used / (std**2 + variance[:, None])
        centre = np.sum(weight * values, axis=1) / np.sum(weight, axis=1)
        off = weight * (values - centre[:, None]) ** 2
        excess, slope = np.sum(off, axis=1) - freedom, np.sum(weight * off, axis=1)
        step = np.divide(excess, slope, out=np.zeros_like(slope), where=excess > 0.0)
        variance += step
        if np.all(step <= _CLOSE * variance):
            break
    weight = used / (std**2 + variance[:, None])
    total = np.sum(weight, axis=1)
    return Spread(
        np.sum(weight * values, axis=1) / total,
        total**-0.5,
        np.sqrt(variance),
        total**2 / np.sum(weight**2, axis=1) - 1.0,
    )


def _levels(level: float, steps: int) -> list[float]:
    """Level of each step: a single unit is what a survey mostly looks for."""
    if steps == 1:
        return [level]
    return [0.5 * level, *[0.5 * level / (steps - 1)] * (steps - 1)]


def _from_others(values: Array, std: Array, others: NDArray[np.bool_]) -> tuple[Array, Array]:
    """Distance of each unit from its others, in deviations of the difference, and its freedom."""
    found = spread_of(values, std, others)
    deviation = np.sqrt(found.between**2 + std**2 + found.std**2)
    return (values - found.centre) / deviation, found.freedom
