"""Which quantities of the units are compared, and with what values.

- Every parameter of every axis.
- Every effect that is a supported cause anywhere, by its share of the rms effort. Effects that a
  recording does not separate are one quantity. Where an effect was not found, its share is zero
  within the tolerance; where it is only suspected, or the motion could not show it, the unit is
  left out. An effect tied to time belongs to a recording and not to a unit: it is not compared.

An axis that is not trusted is not compared. Several recordings of a unit become one value.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.diagnosis.tolerance import TOLERANCE
from edge_ident.fleet.between_units import FEWEST_UNITS, distances, spread_of
from edge_ident.fleet.result import (
    Comparison,
    SurveyedAxis,
    SurveyedRecording,
    UnitValue,
)
from edge_ident.model.effects import named
from edge_ident.model.model import NORMAL_95, PARAMETERS

Array = NDArray[np.float64]
Axes = Sequence[tuple[str, SurveyedAxis]]
"""One axis of several recordings, each with its unit."""
Measured = Mapping[str, list[tuple[float, float]]]
"""Values with their deviations, by unit."""

_NOT_FOUND_STD: Final = TOLERANCE / NORMAL_95
"""Deviation of the share of an effect not found: 95 % sure to be below what is worth naming."""


def compare_units(recordings: Iterable[SurveyedRecording]) -> tuple[Comparison, ...]:
    """Compare the units in every quantity.

    Parameters
    ----------
    recordings : iterable of SurveyedRecording
    """
    axes: dict[tuple[str, str], list[tuple[str, SurveyedAxis]]] = {}
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


def effect_groups(axes: Iterable[SurveyedAxis]) -> list[frozenset[str]]:
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


def _share(axis: SurveyedAxis, group: frozenset[str]) -> tuple[float, float] | None:
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
) -> Comparison:
    value, std = np.array([*values.values()]).reshape(-1, 2).T
    found = distances(value, std if unit else _if_alike(value, std), judged)
    return Comparison(
        axis=axis,
        quantity=quantity,
        of_effect=not unit,
        unit=unit,
        centre=found.centre if found else None,
        between=found.between if found else None,
        units={
            name: UnitValue(
                *values[name],
                float(found.distance[i]) if found else None,
                bool(found.stands_out[i]) if found else False,
            )
            for i, name in enumerate(values)
        },
    )
