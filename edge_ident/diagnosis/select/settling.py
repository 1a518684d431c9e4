"""From what was peeled to what holds: what pays nowhere else leaves, better rivals take over."""

import math
from typing import Final, NamedTuple, Self

import numpy as np

from edge_ident.diagnosis.fit.fitting import Fitted, build
from edge_ident.diagnosis.fit.vibrations import VIBRATION
from edge_ident.diagnosis.prepare.view import View
from edge_ident.diagnosis.result import Rival
from edge_ident.diagnosis.select.judging import Gain, contest, gains, unclear
from edge_ident.diagnosis.select.search import Search
from edge_ident.model.model import PARAMETERS, Term

_ROUNDS: Final = 6


class Settled(NamedTuple):
    """A model that holds.

    Attributes
    ----------
    model : Fitted
    rivals, gained : lists
        Of each cause.
    """

    model: Fitted
    rivals: list[tuple[Rival, ...]]
    gained: list[Gain]

    @property
    def vibrations(self) -> tuple[Term, ...]:
        """What shakes the axis from outside, the strongest first."""
        found = [f for f in self.model.found if f.candidate == VIBRATION]
        found.sort(key=lambda f: -math.hypot(*f.amplitudes.values()))
        return tuple(f.term for f in found)

    def inside(self, view: View) -> Self:
        """What it says of the axis itself, without the vibrations that were fitted beside."""
        model = self.model
        own = [f.candidate != VIBRATION for f in model.found]
        if all(own):
            return self
        places = np.flatnonzero(own).tolist()
        found = tuple(model.found[k] for k in places)
        axis = build(model.template, model.base, found)
        predicted = view.predicted(axis)
        residual = (view.effort - predicted)[view.clear]
        sizes = [len(PARAMETERS), *(len(f.amplitudes) for f in model.found)]
        jacobian = model.jacobian[:, np.repeat([True, *own], sizes)]
        inside = Fitted(axis, model.base, found, predicted, jacobian, float(residual @ residual))
        return type(self)(
            inside, [self.rivals[k] for k in places], [self.gained[k] for k in places]
        )


def settle(search: Search, model: Fitted) -> Settled:
    """Leave out what does not hold where it was not fitted; let better rivals take over."""
    for _ in range(_ROUNDS):
        gained = gains(search, model)
        doubtful = [k for k, g in enumerate(gained) if not g.certain]
        contests = [] if doubtful else [contest(search, model, k) for k in range(len(model.found))]
        better = [c.better for c in contests if c.better is not None]
        if not better:
            doubtful = doubtful or unclear(search.view, model)
            if not doubtful:
                break
            weakest = min(doubtful, key=lambda k: gained[k].interval[0])
            better = [search.fit(model.base, model.without(weakest))]
        model = search.polished(min(better, key=search.criterion))
    else:
        gained = gains(search, model)
        contests = [contest(search, model, k) for k in range(len(model.found))]
    return Settled(model, [c.rivals for c in contests], gained)
