"""Which curves go into a model: those by which every part of a recording is predicted better.

A curve of an error budget describes its recording. A model has to hold elsewhere. So each half and
each quarter of the time is predicted from the rest, which is as near to another recording as one
recording comes: on real machines, curves that failed this made other recordings worse.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.diagnosis.budget.account import Account, Missed, fitted_curves
from edge_ident.diagnosis.budget.curves import HISTORY, LOAD, TIME, Curve
from edge_ident.diagnosis.budget.smoothing import Products, charge, fitted
from edge_ident.diagnosis.error_budget import AgreeingCurve
from edge_ident.diagnosis.fit.fitting import FittedModel, fit
from edge_ident.diagnosis.fit.noise_floor import NoiseFloor
from edge_ident.diagnosis.prepare.axis_data import AxisData
from edge_ident.diagnosis.select.search import many_other_laws, samples_of_unknown
from edge_ident.model.inverse import left_by_terms
from edge_ident.model.model import AxisModel

Array = NDArray[np.float64]

_PARTS: Final = (2, 4)
_TESTED: Final = 2
"""Parts that have to go where the others went: with one, nothing says that they agree."""


def curves_beside(
    data: AxisData, model: FittedModel, floor: NoiseFloor
) -> tuple[AgreeingCurve, ...]:
    """Curves of what a model misses of prepared recordings that hold in every part of them, leave a
    physical axis, and say more than something unknown; found once.

    Parameters
    ----------
    model : FittedModel
        Fitted to the data.
    """

    def found() -> tuple[AgreeingCurve, ...]:
        what = Missed(data, model, floor.rms)
        agree = [
            replace(curve, term=replace(curve.term, supported=data.supported))
            for curve in agreeing_curves(what)
        ]
        while agree and not _fits(data, model, agree, len(what.curves)):
            agree = agree[:-1]
        return tuple(agree)

    return data.once((curves_beside, model.key), found)


def fitted_beside(
    data: AxisData, model: FittedModel, curves: Sequence[AgreeingCurve]
) -> FittedModel:
    """The model fitted beside curves."""
    return fit(data, with_curves_known(model.template, curves), model.base, model.terms)


def with_curves_known(template: AxisModel, curves: Sequence[AgreeingCurve]) -> AxisModel:
    """An axis that is known to have curves as well."""
    return replace(template, terms=(*template.terms, *(curve.term for curve in curves)))


def _fits(data: AxisData, model: FittedModel, curves: Sequence[AgreeingCurve], tried: int) -> bool:
    """Whether curves leave a physical axis, its bounds do not undo what they gain, and that is more
    than something unknown would.

    Along one path, curves over the positions of several other axes describe any effort. So what
    they gain counts as often as what the model misses has independent samples.
    """
    extended = fitted_beside(data, model, curves)
    if not left_by_terms(extended.axis).physical or extended.error >= model.error:
        return False
    coupled = any(curve.term.source_axis is not None for curve in curves)
    if not coupled or not many_other_laws(data):
        return True
    samples = samples_of_unknown(data, model)
    charged = sum(charge(curve.freedom, tried, samples) for curve in curves)
    return samples * math.log(model.error / extended.error) > charged


def agreeing_curves(what: Missed) -> tuple[AgreeingCurve, ...]:
    """Curves of what a model misses that hold in every part of its recordings, the largest first.

    Parameters
    ----------
    what : Missed
        By the model to which the curves are added.
    """
    found = fitted_curves(what)
    ways = [_in_time(what.block, parts) for parts in _PARTS]
    parts = _Parts(found.curves, found.model.products.held_out_by(ways))
    chosen = [k for k in found.model.curves if found.curves[k].kind.effect and _lasts(found, k)]
    while chosen and (worst := parts.worst(chosen)) is not None:
        chosen.remove(worst)
    return replace(found, model=fitted(parts.products, chosen)).terms


def _lasts(found: Account, curve: int) -> bool:
    """Whether the motion tells a curve from all that no model holds: what is tied to the time of
    its recording, and what is history."""
    return not {TIME, HISTORY, LOAD}.intersection(found.alike(curve))


def _in_time(block: NDArray[np.intp], parts: int) -> NDArray[np.intp]:
    """Number of the part of each sample; parts hold equally many blocks, one after the other."""
    here, number = np.unique(block, return_inverse=True)
    return np.asarray(number * parts // len(here))


@dataclass(frozen=True)
class _Parts:
    """Curves, and products of which parts are held out."""

    curves: Sequence[Curve]
    products: Products

    def worst(self, chosen: Sequence[int]) -> int | None:
        """The curve to leave out next; None where each part is predicted better with each of them,
        and with all."""
        seen = [self._seen(chosen, part) for part in self.products.parts]
        nothing = self._errors((), seen)
        tested = nothing > 0.0
        every = self._errors(chosen, seen)
        without = {k: self._errors([j for j in chosen if j != k], seen) for k in chosen}
        doubtful = [k for k in chosen if np.any((without[k] <= every)[tested])]
        if np.sum(tested) >= _TESTED and not doubtful and np.all((every < nothing)[tested]):
            return None
        return min(doubtful or chosen, key=lambda k: float(np.sum(without[k])))

    def _errors(self, chosen: Sequence[int], seen: Sequence[NDArray[np.bool_]]) -> Array:
        """Sum of squares of each part, predicted from the others."""
        left = fitted(self.products, chosen).held_out()
        each = zip(self.products.parts, left, seen, strict=True)
        return np.concatenate([np.bincount(part, e**2 * s) for part, e, s in each])

    def _seen(self, chosen: Sequence[int], part: NDArray[np.intp]) -> NDArray[np.bool_]:
        """Samples (n,) whose coordinates the other parts visit: beyond, no curve is known."""
        seen = np.ones(len(part), dtype=np.bool_)
        for at in (self.curves[k].at for k in chosen):
            for k in range(int(part.max()) + 1):
                others = at[part != k]
                here = part == k
                seen[here] &= (at[here] >= others.min()) & (at[here] <= others.max())
        return seen
