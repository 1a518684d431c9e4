"""What effects leave of an axis's inertia and Coulomb friction.

Some effects take a part of the base term: the load behind a play, friction that is gone at speed.
They may take no more than there is, at any time and at any angle of another joint.
"""

from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from edge_ident.model.effect import Effect
from edge_ident.model.effects import named
from edge_ident.model.model import AxisModel, Term
from edge_ident.model.motion import Motion

_EVER: Final = (-1e12, 1e12)
"""Long before and long after any record, in s."""
ANGLES: Final = tuple(float(angle) for angle in np.linspace(0.0, 2.0 * np.pi, 16, endpoint=False))
"""All around another joint, in rad; what lies between them is 2 % of an amplitude at most."""
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
    inertia, friction = (
        min(
            sum(_at_once(named(t.effect), t, at, hook) for t in axis.terms)
            for at in (_fast_at(time_s, angle) for time_s in _EVER for angle in ANGLES)
        )
        for hook in ("inertia", "friction")
    )
    return Left(inertia, friction)


def made_physical(axis: AxisModel, least_inertia: float) -> AxisModel:
    """The axis with as much more inertia and Coulomb friction as a simulation needs.

    Parameters
    ----------
    axis : AxisModel
    least_inertia : float
        What must be left of the inertia; so little that the recording could not show it.
    """
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


def _fast_at(time_s: float, other_angle: float) -> Motion:
    """At position zero, too fast for the Stribeck effect; another joint rests at an angle."""
    time, zero = np.full(1, time_s), np.zeros(1)
    source = Motion.known(time, np.full(1, other_angle), zero, zero)
    return replace(Motion.known(time, zero, zero + 1e12, zero), source=source)


def _at_once(effect: Effect, term: Term, at: Motion, hook: str) -> float:
    values = {name: np.asarray(value) for name, value in effect.complete(term.values).items()}
    return float(np.sum(getattr(effect, hook)(at, values)))
