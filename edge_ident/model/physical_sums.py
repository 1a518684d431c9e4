"""What effects leave of an axis's inertia and Coulomb friction.

Some effects take a part of the base term: the load behind a play, friction that is gone at speed.
They may take no more than there is: at any time, at any angle of another joint, and at any position
that the model was seen at.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from edge_ident.model.effects import named
from edge_ident.model.inverse import along_motion
from edge_ident.model.model import AxisModel, Term
from edge_ident.model.motion import Motion

_EVER: Final = (-1e12, 1e12)
"""Long before and long after any record, in s."""
_ANGLES: Final = np.linspace(0.0, 2.0 * np.pi, 16, endpoint=False)
"""All around another joint, in rad; what lies between them is 2 % of an amplitude at most."""
_PLACES: Final = 16
"""Positions along the travel."""
_TOO_FAST: Final = 1e12
"""Velocity at which no Stribeck friction is left."""
_ROUNDING: Final = 1e-9


@dataclass(frozen=True)
class Left:
    """The least that terms ever leave of inertia and of Coulomb friction."""

    inertia: float
    coulomb_friction: float

    @property
    def physical(self) -> bool:
        """Whether inertia is left, and no friction drives the axis."""
        return self.inertia > 0.0 and self.coulomb_friction > -_ROUNDING


def left_by_terms(axis: AxisModel) -> Left:
    """What the terms of an axis leave.

    Parameters
    ----------
    axis : AxisModel
        Of one drive.
    """
    at = everywhere(_TOO_FAST, axis)
    inertia, friction = (
        float(np.min(sum(getattr(named(t.effect), hook)(at, along_motion(t)) for t in axis.terms)))
        for hook in ("inertia", "friction")
    )
    return Left(inertia, friction)


def everywhere(velocity: float, axis: AxisModel) -> Motion:
    """Instants (N, 1) at a velocity: along the travel that the axis was seen at, or at position
    zero; long before and long after any record; with another joint at rest at angles all around."""
    seen = axis.terms[0].supported
    lowest, highest = (0.0, 0.0) if seen is None else seen.position
    grids = np.meshgrid(_EVER, _ANGLES, np.linspace(lowest, highest, _PLACES))
    time_s, angle, position = (x.reshape(-1, 1) for x in grids)
    zero = np.zeros(time_s.shape)
    source = Motion.known(time_s, angle, zero, zero)
    return replace(Motion.known(time_s, position, zero + velocity, zero), source=source)


def made_physical(axis: AxisModel, least_inertia: float) -> AxisModel:
    """The axis with as much more inertia and Coulomb friction as a simulation needs.

    A part of the friction that is larger than the whole becomes the whole. Such a part shows at
    reversals, where the direction is hardly known, and the whole wherever the axis slides.

    Parameters
    ----------
    axis : AxisModel
    least_inertia : float
        What must be left of the inertia; so little that the recording could not show it.
    """
    axis = replace(axis, terms=tuple(_no_more_than_all(axis)))
    left, base = left_by_terms(axis), axis.terms[0]
    values, std = dict(base.values), dict(base.std)
    for name, more in (
        ("inertia", least_inertia - left.inertia),
        ("coulomb_friction", -left.coulomb_friction),
    ):
        if more > 0.0:
            values[name] = float(values[name]) + more
            # it is not known better than by what had to be added
            std[name] = max(std.get(name, 0.0), more)
    return replace(axis, terms=(replace(base, values=values, std=std), *axis.terms[1:]))


def _no_more_than_all(axis: AxisModel) -> Iterator[Term]:
    """The terms; those that are a part of the friction have no more than others leave of it."""
    missing = max(0.0, -left_by_terms(axis).coulomb_friction)
    for term in axis.terms:
        part = named(term.effect).part_of_friction
        if not part or not missing:
            yield term
            continue
        value = float(term.values[part])
        less = min(missing, value)
        missing -= less
        # it is not known better than by what had to be taken
        std = {**term.std, part: max(term.std.get(part) or 0.0, less)}
        yield replace(term, values={**term.values, part: value - less}, std=std)
