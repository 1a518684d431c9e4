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

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from edge_ident.diagnosis.measures import TOLERANCE
from edge_ident.fleet import result
from edge_ident.model.effects import named
from edge_ident.model.model import NORMAL_95, PARAMETERS, Array

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


# Which quantities of the units are compared, and with what values.
#
# - Every parameter of every axis.
# - Every effect that is a supported cause anywhere, by its share of the rms effort. Effects that a
#   recording does not separate are one quantity. Where an effect was not found, its share is zero
#   within the tolerance; where it is only suspected, or the motion could not show it, the unit is
#   left out. An effect tied to time belongs to a recording and not to a unit: it is not compared.
#
# An axis that is not trusted is not compared. Several recordings of a unit become one value.

Axes = Sequence[tuple[str, result.SurveyedAxis]]
"""One axis of several recordings, each with its unit."""
Measured = Mapping[str, list[tuple[float, float]]]
"""Values with their deviations, by unit."""

# Deviation of the share of an effect not found: 95 % sure to be below what is worth naming.
_NOT_FOUND_STD: Final = TOLERANCE / NORMAL_95


def compare_units(recordings: Iterable[result.SurveyedRecording]) -> tuple[result.Comparison, ...]:
    """Compare the units in every quantity.

    Parameters
    ----------
    recordings : iterable of SurveyedRecording
    """
    axes: dict[tuple[str, str], list[tuple[str, result.SurveyedAxis]]] = {}
    for recording in recordings:
        for name, axis in recording.axes.items():
            if axis.trusted:
                kind = (name, axis.parameters[PARAMETERS[0]].unit)
                axes.setdefault(kind, []).append((recording.unit, axis))
    found = [
        (name, *quantity)
        for (name, _), of_axis in axes.items()
        for quantity in (*_parameters(of_axis), *_effects(of_axis))
    ]
    values = [_unit_values(measured) for *_, measured in found]
    judged = sum(len(of) >= FEWEST_UNITS for of in values)
    return tuple(
        _comparison(axis, quantity, unit, of, judged)
        for (axis, quantity, unit, _), of in zip(found, values, strict=True)
    )


def _parameters(axes: Axes) -> Iterator[tuple[str, str, Measured]]:
    for name in PARAMETERS:
        measured: dict[str, list[tuple[float, float]]] = {}
        for unit, axis in axes:
            found = axis.parameters[name]
            if found.std:
                measured.setdefault(unit, []).append((found.value, found.std))
        yield name, axes[0][1].parameters[name].unit, measured


def _effects(axes: Axes) -> Iterator[tuple[str, str, Measured]]:
    for group in effect_groups(axis for _, axis in axes):
        measured: dict[str, list[tuple[float, float]]] = {}
        for unit, axis in axes:
            share = _share(axis, group)
            if share is not None:
                measured.setdefault(unit, []).append(share)
        yield "/".join(sorted(group)), "", measured


def effect_groups(axes: Iterable[result.SurveyedAxis]) -> list[frozenset[str]]:
    """Effects that are a supported cause anywhere, together where a recording does not separate
    them."""
    found = [cause for axis in axes for cause in axis.causes if cause.kind != "suspected"]
    names = {cause.effect for cause in found}
    groups: list[frozenset[str]] = []
    for linked in ({cause.effect, *(names & {*cause.alternatives})} for cause in found):
        touched = [group for group in groups if group & linked]
        groups = [group for group in groups if group not in touched]
        groups.append(frozenset(linked).union(*touched))
    supported = {cause.effect for cause in found if cause.kind == "supported"}
    lasting = (group for group in groups if not any(named(one).tied_to_time for one in group))
    return sorted((group for group in lasting if group & supported), key=sorted)


def _share(axis: result.SurveyedAxis, group: frozenset[str]) -> tuple[float, float] | None:
    """Share of the effort with its deviation; None where the recording does not say."""
    of_group = [cause for cause in axis.causes if cause.effect in group]
    certain = [cause for cause in of_group if cause.kind != "suspected"]
    if certain:
        share = float(np.hypot.reduce([cause.share for cause in certain]))
        return share, float(np.hypot.reduce([cause.share_std for cause in certain]))
    if of_group or axis.verdict is None or group & {*axis.not_testable}:
        return None
    return 0.0, _NOT_FOUND_STD


def _unit_values(measured: Measured) -> dict[str, tuple[float, float]]:
    """One value a unit: that of its recording, or the centre of those of several."""
    values = {}
    for unit, of in measured.items():
        value, std = np.array(of).T
        if len(of) > 1:
            pooled = spread_of(value, std, np.ones((1, len(of)), dtype=np.bool_))
            value, std = pooled.centre, pooled.std
        values[unit] = (float(value[0]), float(std[0]))
    return values


def _if_alike(share: Array, std: Array) -> Array:
    """Deviations that shares of an effect have in units that are all alike.

    They grow with the share. Whether a unit differs from others that do not have the effect is a
    question of what they may hide, and not of how well the size of its own is known.
    """
    relative = np.divide(std, share, out=np.zeros_like(std), where=share > 0.0)
    return np.minimum(std, np.maximum(_NOT_FOUND_STD, relative * np.median(share)))


def _comparison(
    axis: str, quantity: str, unit: str, values: Mapping[str, tuple[float, float]], judged: int
) -> result.Comparison:
    value, std = np.array([*values.values()]).reshape(-1, 2).T
    found = distances(value, std if unit else _if_alike(value, std), judged)
    return result.Comparison(
        axis=axis,
        quantity=quantity,
        of_effect=not unit,
        unit=unit,
        centre=found.centre if found else None,
        between=found.between if found else None,
        units={
            name: result.UnitValue(
                *values[name],
                float(found.distance[i]) if found else None,
                bool(found.stands_out[i]) if found else False,
            )
            for i, name in enumerate(values)
        },
    )
