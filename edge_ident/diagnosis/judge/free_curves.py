"""Free curves in the place of laws: a law is named where it beats what assumes none.

Laws that add up imitate almost anything: a few waves any course along the stroke, two laws of
friction any curve over the speed. So each curve of the error budget takes the place of the laws
that it imitates. It has as many parameters as the data set of its coefficients (effective degrees
of freedom: Wood, Generalized Additive Models (2017), 6.1), and they are charged like those of a
law. Where the curve is decisively better then, the laws are only suspected, unless their name says
no more than the curve does: friction along the stroke is that in any shape.
"""

import math

import numpy as np
from numpy.typing import NDArray

from edge_ident.diagnosis.budget.account import ALIKE, imitated, missed, products_of
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
    data = search.data
    own = [k for k, t in enumerate(model.terms) if t.candidate != VIBRATION]
    if not own:
        return {}
    base = missed(data, search.criterion.start, floor, model.axis.units, {})
    products = products_of(base, base.curves)
    efforts = {k: term_effort(data, model, k)[data.valid] for k in own}
    doubts: dict[int, str] = {}
    for number, curve in enumerate(base.curves):
        laws = [k for k in own if imitated(products, efforts[k], number) > ALIKE]
        said = {named(model.terms[k].candidate.effect).search.curve for k in laws}
        if said - {(curve.kind.what, curve.kind.over_what)} and separable(
            _gain(search, model, laws, number, floor)
        ):
            doubts |= dict.fromkeys(laws, _reason(curve))
    return doubts


def _gain(
    search: Search, model: FittedModel, laws: list[int], number: int, floor: NoiseFloor
) -> float:
    """Units of the criterion that a curve gains over the laws in whose place it is."""
    data, criterion = search.data, search.criterion
    others = tuple(t for k, t in enumerate(model.terms) if k not in laws)
    rest = missed(data, search.fit(model.base, others), floor, model.axis.units, {})
    fit = fitted(products_of(rest, rest.curves), (number,))
    left = rest.scale**2 * float(np.sum((fit.products.signal - fit.predicted) ** 2))
    tried = 2.0 * math.log(len(rest.curves))
    charged = fit.freedom(number) * math.log(criterion.samples) + tried
    of_laws = sum(criterion.penalty(model.terms[k].candidate) for k in laws)
    off = criterion.discrepancy(model)
    return criterion.misfit(model.error + off) + of_laws - criterion.misfit(left + off) - charged


def _reason(curve: Curve) -> str:
    kind = curve.kind
    return (
        f"a curve of the {kind.what} over {kind.over_what}, of which no law is assumed, describes "
        "the effort better"
    )
