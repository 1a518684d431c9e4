"""Penalized curves beside a base model: sizes by restricted likelihood, errors of what is held out.

    u = X0 θ + Σ_k C_k b_k + e,    b_k ~ N(0, τ_k S_k⁻¹),    θ free

Everything is computed from the products of the columns, which are formed once for every curve and
for every part of the samples that is held out. The sizes τ_k and the noise follow from the
restricted likelihood by the generalized Fellner-Schall update (Wood and Fasiolo, Biometrics 73
(2017) 1071). A fit without some samples takes their products off.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import accumulate, islice, pairwise
from typing import Final, Self

import numpy as np
from numpy.typing import NDArray

from edge_ident.diagnosis.budget.curves import Curve

Array = NDArray[np.float64]

_ROUNDS: Final = 40
_SETTLED: Final = 1e-3
"""Change of the log likelihood at which the updates end."""
_SMALLEST: Final = 1e-6
"""Noise and size of a curve that vanishes, of the variance of the signal."""
_LARGEST: Final = 1e9
"""Size of a curve whose coefficients are free."""
_TINY: Final = float(np.finfo(float).tiny)


@dataclass(frozen=True)
class Products:
    """Products of all columns and of the signal, over all samples and over each part of them.

    Attributes
    ----------
    values : (n, p) array
        Base columns first, all scaled.
    places : tuple of slice
        Of each curve.
    parts : tuple of (n,) array of int
        Each numbers the part, from 0, that a sample is held out with.
    base : int
        Number of base columns.
    scale : (p,) array
        What columns were divided by.
    """

    values: Array
    places: tuple[slice, ...]
    penalties: tuple[Array, ...]
    signal: Array
    parts: tuple[NDArray[np.intp], ...]
    base: int
    scale: Array

    @classmethod
    def of(
        cls,
        base: Array,
        curves: Sequence[Curve],
        signal: Array,
        parts: Sequence[NDArray[np.intp]],
    ) -> Self:
        """From base columns (n, p0) and curves."""
        places, first = [], base.shape[1]
        for curve in curves:
            places.append(slice(first, first + curve.values.shape[1]))
            first = places[-1].stop
        values = np.hstack([base, *(c.values for c in curves)])
        scale = np.sqrt(np.mean(values**2, axis=0))
        for place in places:  # one scale for a curve, or its penalty would not fit it
            scale[place] = np.sqrt(np.sum(scale[place] ** 2))
        scale = np.maximum(scale, _TINY**0.5)
        penalties = tuple(curve.penalty for curve in curves)
        return cls(
            values / scale, tuple(places), penalties, signal, tuple(parts), base.shape[1], scale
        )

    @cached_property
    def gram(self) -> Array:
        """(p, p)."""
        return self.values.T @ self.values

    @cached_property
    def moment(self) -> Array:
        """(p,)."""
        return np.asarray(self.values.T @ self.signal)

    @cached_property
    def grams(self) -> list[Array]:
        """Gram matrices (F, p, p) of each way to hold out F parts."""
        return [
            np.stack([x.T @ x for x in (self.values[at] for at in _inside(part))])
            for part in self.parts
        ]

    @cached_property
    def moments(self) -> list[Array]:
        """Moments (F, p) of the same."""
        return [
            np.stack([self.values[at].T @ self.signal[at] for at in _inside(part)])
            for part in self.parts
        ]

    def with_signal(self, signal: Array) -> Self:
        """The same columns with another signal (n,)."""
        other = replace(self, signal=signal)
        # these know of no signal
        other.__dict__.update(gram=self.gram, grams=self.grams, roughness=self.roughness)
        return other

    def held_out_by(self, parts: Sequence[NDArray[np.intp]]) -> Self:
        """The same columns, held out by other parts of the samples (n,)."""
        other = replace(self, parts=tuple(parts))
        other.__dict__.update(gram=self.gram, moment=self.moment, roughness=self.roughness)
        return other

    @cached_property
    def roughness(self) -> list[float]:
        """Logarithm of the determinant of each penalty."""
        return [float(np.linalg.slogdet(penalty)[1]) for penalty in self.penalties]

    @cached_property
    def smallest(self) -> float:
        """Smallest size of a curve."""
        return _SMALLEST * max(float(np.mean(self.signal**2)), _TINY)

    def chosen(self, curves: Sequence[int]) -> NDArray[np.intp]:
        """Places of the base and of some curves."""
        return np.concatenate(
            [np.arange(self.base), *(np.arange(p.start, p.stop) for p in self._of(curves))]
        )

    def _of(self, curves: Sequence[int]) -> list[slice]:
        return [self.places[k] for k in curves]


@dataclass(frozen=True)
class Fit:
    """Base and some curves, fitted.

    Attributes
    ----------
    curves : tuple of int
        Which.
    sizes : tuple of float
        Of each, τ.
    noise : float
        Variance.
    coefficients : (p,) array
        Of the base and the curves that are in it.
    likelihood : float
        Restricted, its logarithm but for a constant.
    """

    products: Products
    curves: tuple[int, ...]
    sizes: tuple[float, ...]
    noise: float
    coefficients: Array
    covariance: Array
    likelihood: float

    @cached_property
    def predicted(self) -> Array:
        """(n,)."""
        columns = self.products.values[:, self.products.chosen(self.curves)]
        return np.asarray(columns @ self.coefficients)

    def place(self, curve: int) -> slice:
        """Where the coefficients of a curve are."""
        first = self.products.base
        for k in self.curves:
            size = len(self.products.penalties[k])
            if k == curve:
                return slice(first, first + size)
            first += size
        raise KeyError(curve)

    def freedom(self, curve: int) -> float:
        """Effective degrees of freedom of a curve: of its coefficients, as many as the data set."""
        rough, place = self.products.penalties[curve], self.place(curve)
        size = self.sizes[self.curves.index(curve)]
        return len(rough) - float(np.sum(rough * self.covariance[place, place])) / size

    def effort(self, curve: int) -> Array:
        """What a curve adds, (n,)."""
        values = self.products.values[:, self.products.places[curve]]
        return np.asarray(values @ self.coefficients[self.place(curve)])

    def held_out(self, ways: int | None = None) -> list[Array]:
        """Residuals (n,) of samples that the fit which predicts them did not see, for each way to
        hold out, or the first of them; the sizes of curves and noise stay as they are."""
        at = self.products.chosen(self.curves)
        penalty = _penalty(self.products, self.curves, self.sizes) * self.noise
        values, found = self.products.values[:, at], []
        of_parts = zip(self.products.parts, self.products.grams, self.products.moments, strict=True)
        for part, grams, moments in islice(of_parts, ways):
            inside = np.ix_(np.arange(len(grams)), at, at)
            normal = self.products.gram[np.ix_(at, at)] - grams[inside] + penalty
            wanted = self.products.moment[at] - moments[:, at]
            without = np.linalg.solve(normal, wanted[..., None])[..., 0]
            found.append(
                self.products.signal - np.einsum("np,np->n", values, without[part], optimize=True)
            )
        return found


def charge(freedom: float, tried: int, samples: float) -> float:
    """What a curve costs, in units of the criterion of laws: its degrees of freedom beside so many
    independent samples, and the curves that were tried."""
    return freedom * math.log(samples) + 2.0 * math.log(tried)


def fitted(products: Products, curves: Sequence[int], start: Fit | None = None) -> Fit:
    """Fit base and some curves, sizes by restricted likelihood.

    Parameters
    ----------
    curves : sequence of int
        Which.
    start : Fit, optional
        From whose sizes to begin.
    """
    at, n = products.chosen(curves), len(products.signal)
    gram, moment = products.gram[np.ix_(at, at)], products.moment[at]
    energy = float(products.signal @ products.signal)
    known = dict(zip(start.curves, start.sizes, strict=True)) if start else {}
    noise = start.noise if start else max(energy / n, products.smallest)
    sizes = [known.get(k, 0.1 * energy / n) for k in curves]
    places = _places(products, curves)
    last = -np.inf
    for _ in range(_ROUNDS):
        penalty = _penalty(products, curves, sizes)
        precision = gram / noise + penalty
        root = np.linalg.cholesky(precision)
        covariance = np.asarray(np.linalg.inv(precision), dtype=np.float64)
        found = np.asarray(covariance @ (moment / noise))
        left = max(float(energy - 2.0 * found @ moment + found @ gram @ found), 0.0)
        shrunk = float(found @ penalty @ found)
        likelihood = -0.5 * (n * np.log(noise) + left / noise + shrunk) - float(
            np.sum(np.log(np.diag(root)))
        )
        for k, size in zip(curves, sizes, strict=True):
            order = len(products.penalties[k])
            likelihood += 0.5 * (products.roughness[k] - order * math.log(size))
        if abs(likelihood - last) < _SETTLED:
            break
        last, freedom = likelihood, 0.0
        for j, (k, place) in enumerate(zip(curves, places, strict=True)):
            rough = products.penalties[k]
            used = len(rough) - float(np.sum(rough * covariance[place, place])) / sizes[j]
            used = max(used, 1e-3)
            size = float(found[place] @ rough @ found[place]) / used
            sizes[j] = min(max(size, products.smallest), _LARGEST)
            freedom += used
        noise = max(left / max(n - products.base - freedom, 1.0), products.smallest)
    return Fit(products, tuple(curves), tuple(sizes), noise, found, covariance, likelihood)


def _penalty(products: Products, curves: Sequence[int], sizes: Sequence[float]) -> Array:
    """Precision (p, p) of the prior."""
    places = _places(products, curves)
    size = places[-1].stop if places else products.base
    found = np.zeros((size, size))
    found[range(products.base), range(products.base)] = 1e-9 * len(products.signal)
    for k, place, of_curve in zip(curves, places, sizes, strict=True):
        found[place, place] = products.penalties[k] / of_curve
    return found


def _places(products: Products, curves: Sequence[int]) -> list[slice]:
    """Where the coefficients of some curves are, behind those of the base."""
    ends = accumulate((len(products.penalties[k]) for k in curves), initial=products.base)
    return [slice(*pair) for pair in pairwise(ends)]


def _inside(part: NDArray[np.intp]) -> list[NDArray[np.bool_]]:
    return [part == k for k in range(int(part.max()) + 1)]
