"""Free curves in the place of laws: a law is named where it beats what assumes none.

The next best formula takes what the right one would have, and laws that add up imitate almost
anything: a few waves any course along the stroke, two laws of friction any curve over the speed. So
each curve of the error budget takes the place of each law, and of all the laws that it imitates. It
has as many parameters as the data set of its coefficients (effective degrees of freedom: Wood,
Generalized Additive Models (2017), 6.1), and they are charged like those of a law. Where a curve is
decisively better then, the laws are only suspected, unless their name says no more than the curve
does: friction along the stroke is that in any shape.
"""

import math
from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from edge_ident.diagnosis.budget.account import imitation, missed, products_of
from edge_ident.diagnosis.budget.curves import Curve
from edge_ident.diagnosis.budget.smoothing import fitted
from edge_ident.diagnosis.fit.external_vibrations import VIBRATION
from edge_ident.diagnosis.fit.fitting import FittedModel, term_effort
from edge_ident.diagnosis.fit.noise_floor import NoiseFloor
from edge_ident.diagnosis.select.acceptance import separable
from edge_ident.diagnosis.select.search import Search
from edge_ident.model.effects import named

Array = NDArray[np.float64]


def curves_instead(search: Search, model: FittedModel, floor: NoiseFloor) -> dict[int, str]:
    """Reasons against terms in whose place a curve of no assumed law is decisively better.

    Parameters
    ----------
    search : Search
    model : FittedModel
    floor : NoiseFloor

    Returns
    -------
    mapping of place to str
        Places are those of `model.terms`.
    """
    own = [k for k, t in enumerate(model.terms) if t.candidate != VIBRATION]
    doubts: dict[int, str] = {}
    for laws, curves in _contests(search, model, own, floor).items():
        gains = _gains(search, model, laws, curves, floor)
        best = max(gains, key=lambda number: gains[number], default=None)
        if best is not None and separable(gains[best]):
            doubts |= dict.fromkeys(laws, _reason(curves[best]))
    return doubts


def _contests(
    search: Search, model: FittedModel, own: Sequence[int], floor: NoiseFloor
) -> dict[tuple[int, ...], dict[int, Curve]]:
    """The curves, by number, that take the place of each law, and of all that one imitates; but for
    those that say no more than the laws' name."""
    if not own:
        return {}
    data = search.data
    base = missed(data, search.criterion.start, floor, model.axis.units, {})
    products = products_of(base, base.curves)
    imitates = {k: imitation(products, term_effort(data, model, k)[data.valid]) for k in own}
    found: dict[tuple[int, ...], dict[int, Curve]] = {}
    for number, curve in enumerate(base.curves):
        alike = tuple(k for k in own if imitates[k](number))
        for laws in {alike, *((k,) for k in own)} - {()}:
            names = {named(model.terms[k].candidate.effect).search.curve for k in laws}
            if names != {(curve.kind.what, curve.kind.over_what)}:
                found.setdefault(laws, {})[number] = curve
    return found


def _gains(
    search: Search,
    model: FittedModel,
    laws: Sequence[int],
    curves: Iterable[int],
    floor: NoiseFloor,
) -> dict[int, float]:
    """Units of the criterion that each curve gains over the laws in whose place it is."""
    data, criterion = search.data, search.criterion
    others = tuple(t for k, t in enumerate(model.terms) if k not in laws)
    rest = missed(data, search.fit(model.base, others), floor, model.axis.units, {})
    products, off = products_of(rest, rest.curves), criterion.discrepancy(model)
    of_laws = sum(criterion.penalty(model.terms[k].candidate) for k in laws)
    of_laws += criterion.misfit(model.error + off)
    gains = {}
    for number in curves:
        fit = fitted(products, (number,))
        left = rest.scale**2 * float(np.sum((products.signal - fit.predicted) ** 2))
        charged = fit.freedom(number) * math.log(criterion.samples)
        charged += 2.0 * math.log(len(rest.curves))
        gains[number] = of_laws - criterion.misfit(left + off) - charged
    return gains


def _reason(curve: Curve) -> str:
    kind = curve.kind
    return (
        f"a curve of the {kind.what} over {kind.over_what}, of which no law is assumed, describes "
        "the effort better"
    )
