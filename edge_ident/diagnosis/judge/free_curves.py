"""Free curves in the place of laws: a law is named where it beats what assumes none.

The next best formula takes what the right one would have, and laws that add up imitate almost
anything: a few waves any course along the stroke, two laws of friction any curve over the speed. So
each curve of the error budget takes the place of each law, and of all the laws that it imitates. It
has as many parameters as the data set of its coefficients (effective degrees of freedom: Wood,
Generalized Additive Models (2017), 6.1), and they are charged like those of a law. Where a curve is
decisively better then, the laws are only suspected. But no formula is exactly the machine's, so a
curve may be the law: friction along the stroke is that in any shape, and a curve of the friction
over speed is Stribeck friction where that law alone explains most of what the curve does.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from edge_ident.diagnosis.budget.account import ALIKE, Missed, imitation, products_of
from edge_ident.diagnosis.budget.curves import Curve
from edge_ident.diagnosis.budget.smoothing import charge, fitted
from edge_ident.diagnosis.fit.external_vibrations import VIBRATION
from edge_ident.diagnosis.fit.fitting import FittedModel, FittedTerm, term_effort
from edge_ident.diagnosis.fit.noise_floor import NoiseFloor
from edge_ident.diagnosis.select.acceptance import separable
from edge_ident.diagnosis.select.search import Search
from edge_ident.diagnosis.select.selection import polished
from edge_ident.model.effects import catalogue, named

Array = NDArray[np.float64]


def curves_instead(search: Search, model: FittedModel, floor: NoiseFloor) -> dict[int, str]:
    """Reasons against terms in whose place a curve of no assumed law is decisively better.

    Returns
    -------
    mapping of place to str
        Places are those of `model.terms`.
    """
    own = [k for k, t in enumerate(model.terms) if t.candidate != VIBRATION]
    doubts: dict[int, str] = {}
    for laws, curves in _contests(search, model, own, floor).items():
        found = _fitted(search, model, laws, curves, floor)
        best = max(found, key=lambda one: one.gain, default=None)
        if best is not None and separable(best.gain):
            doubts |= {k: best.reason for k in laws if not _is(search, model, laws, k, best)}
    return doubts


def _contests(
    search: Search, model: FittedModel, own: Sequence[int], floor: NoiseFloor
) -> dict[tuple[int, ...], dict[int, Curve]]:
    """The curves, by number, that take the place of all the laws that one imitates, and of each
    other."""
    if not own:
        return {}
    data = search.data
    base = Missed(data, search.start, floor.rms)
    products = products_of(base, base.curves)
    imitates = {k: imitation(products, term_effort(data, model, k)[data.valid]) for k in own}
    found: dict[tuple[int, ...], dict[int, Curve]] = {}
    for number, curve in enumerate(base.curves):
        alike = tuple(k for k in own if imitates[k](number))
        for laws in {alike, *((k,) for k in own if k not in alike)} - {()}:
            found.setdefault(laws, {})[number] = curve
    return found


@dataclass(frozen=True)
class _Instead:
    """A curve in the place of laws: the units that it gains, the sum of squares that it leaves, and
    that without either."""

    curve: Curve
    gain: float
    left: float
    without: float

    @property
    def reason(self) -> str:
        kind = self.curve.kind
        return (
            f"a curve of the {kind.what} over {kind.over_what}, of which no law is assumed, "
            "describes the effort better"
        )


def _fitted(
    search: Search,
    model: FittedModel,
    laws: Sequence[int],
    curves: Iterable[int],
    floor: NoiseFloor,
) -> Iterator[_Instead]:
    """Each curve in the place of laws."""
    data = search.data
    others = search.fit(model.base, _beside(model, laws))
    rest = Missed(data, others, floor.rms)
    products, off = products_of(rest, rest.curves), search.discrepancy(model)
    of_laws = sum(search.penalty(model.terms[k].candidate) for k in laws)
    # with a law there may be more inertia, and more of the encoder's noise: that is no fault of it
    most = search.noise_in(model, others)
    of_laws += search.misfit(model.error + search.noise_below(most, model) + off)
    off += search.noise_below(most, others)
    for number in curves:
        fit = fitted(products, (number,))
        left = rest.scale**2 * float(np.sum((products.signal - fit.predicted) ** 2))
        charged = charge(fit.freedom(number), len(rest.curves), search.samples)
        gain = of_laws - search.misfit(left + off) - charged
        yield _Instead(rest.curves[number], gain, left, others.error)


def _beside(model: FittedModel, laws: Sequence[int]) -> tuple[FittedTerm, ...]:
    return tuple(t for k, t in enumerate(model.terms) if k not in laws)


def _is(
    search: Search, model: FittedModel, laws: Sequence[int], law: int, instead: _Instead
) -> bool:
    """Whether a curve is one of the laws in whose place it is: it says what no other effect does,
    or the law alone takes off most of what the curve does."""
    kind, term = instead.curve.kind, model.terms[law]
    curve, effect = (kind.what, kind.over_what), term.candidate.effect
    if named(effect).search.curve != curve:
        return False
    rivals = {name for name, other in catalogue().items() if other.search.curve == curve}
    if rivals == {effect} == {model.terms[k].candidate.effect for k in laws}:
        return True
    alone = polished(search, search.fit(model.base, (*_beside(model, laws), term)))
    return instead.without - alone.error > ALIKE * (instead.without - instead.left)
