"""The error budget of an axis, from what its base model leaves.

What is missed, r, is orthogonal to the base model's columns. So are the parts c_k of the curves and
the rest e that add up to it, once the base is taken out of them. The share of a part is its product
with r: ⟨c_k, r⟩ / ⟨r, r⟩. Shares add up to one, and what two parts have in common is split half and
half. Of the rest, noise is what instruments and repetition say; what a later lap shows again
repeats.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.diagnosis.budget.curves import (
    HISTORY,
    LOAD,
    Curve,
    curves_of,
    law_of,
)
from edge_ident.diagnosis.budget.smoothing import Fit, Products, fitted
from edge_ident.diagnosis.error_budget import (
    ABOVE_BAND,
    NOISE,
    REPEATS,
    UNREPEATED,
    AgreeingCurve,
    BudgetCurve,
    BudgetEntry,
    ErrorBudget,
)
from edge_ident.diagnosis.fit.fitting import FittedModel
from edge_ident.diagnosis.fit.linear import orthonormal
from edge_ident.diagnosis.fit.noise_floor import kept_period
from edge_ident.diagnosis.prepare.axis_data import AxisData
from edge_ident.diagnosis.select.thresholds import STRUCTURE
from edge_ident.model.effects import named
from edge_ident.model.model import NORMAL_90
from edge_ident.support.words import spoken

Array = NDArray[np.float64]


ALIKE: Final = 0.9
"""Concurvity: share of the mean square of a curve's effort that the curves over another quantity
imitate, from which the motion does not tell the two apart."""
_RIDGE: Final = 1e-6
"""Share of an effort beyond the base model, below which the base model has it already."""
_SMOOTHED: Final = 20
"""Parts of a spectrum over one of which its power is averaged to either side."""
_TINY: Final = float(np.finfo(float).tiny)


@dataclass(frozen=True)
class Missed:
    """What the base model of an axis misses, at n compared samples.

    Attributes
    ----------
    model : FittedModel
        The base model, fitted to it.
    noise : float
        Rms that noise alone leaves.
    contributions : mapping of effect to array
        What the effects of a diagnosis contribute, at all samples.
    above : float
        Rms of what is missed above the band.
    """

    data: AxisData
    model: FittedModel
    noise: float
    contributions: Mapping[str, Array] = field(default_factory=dict)
    above: float = 0.0

    @cached_property
    def residual(self) -> Array:
        """What is left, (n,), orthogonal to the base."""
        return (self.data.effort - self.model.predicted)[self.data.valid]

    @property
    def effort(self) -> Array:
        """The whole, (n,)."""
        return self.data.effort[self.data.valid]

    @cached_property
    def block(self) -> NDArray[np.intp]:
        """Numbers of the blocks of time, (n,)."""
        return self.data.block[self.data.valid]

    @cached_property
    def laws(self) -> dict[str, Array]:
        """What the effects contribute, (n,) each."""
        return {name: part[self.data.valid] for name, part in self.contributions.items()}

    @property
    def curves(self) -> Sequence[Curve]:
        """Along that motion, made once."""
        return self.data.once(curves_of, lambda: curves_of(self.data))

    @cached_property
    def scale(self) -> float:
        """Rms of the residual."""
        return max(float(np.sqrt(np.mean(self.residual**2))), _TINY)


def fitted_curves(missed: Missed) -> "Account":
    """The curves, and effects that no curve imitates, which the recordings support."""
    curves = missed.curves
    products = products_of(missed, curves)
    if laws := _unlike(missed, products):
        curves = [*curves, *(law_of(_place(name), name, part) for name, part in laws.items())]
        products = products_of(missed, curves)
    enough = min((missed.noise / missed.scale) ** 2, 1.0)
    return Account(missed, curves, select(products, curves, missed.block, enough))


def products_of(missed: Missed, curves: Sequence[Curve]) -> Products:
    """Products of curves and of what is missed, in units of its scale."""
    data, valid = missed.data, missed.data.valid
    position, velocity, acceleration = (
        data.of_motion(name)[valid] for name in ("position", "velocity", "acceleration")
    )
    ways = parts(missed.block, [position, np.abs(velocity), acceleration])
    # along a motion of one direction, direction and offset are the same
    base = orthonormal(missed.model.jacobian[valid])
    return Products.of(base, curves, missed.residual / missed.scale, ways)


def _place(effect: str) -> str:
    """Where an effect is in a budget whose effort is along no curve."""
    law = named(effect)
    if law.memory_size or law.effort_delay:
        return HISTORY
    return LOAD if law.overrides("withheld") else spoken(effect)


def _unlike(missed: Missed, products: Products) -> dict[str, Array]:
    """Contributions of the effects that no curve imitates."""
    every = range(len(products.places))
    return {
        name: part
        for name, part in missed.laws.items()
        if not any(map(imitation(products, part), every))
    }


def imitation(products: Products, part: Array) -> Callable[[int], bool]:
    """Tells of each curve whether it imitates a part (n,) beside the base, in stretches of time to
    which it was not fitted (concurvity)."""
    scale = max(float(np.sqrt(np.mean(part**2))), _TINY)
    of_part = products.with_signal(part / scale)

    def left(*curves: int) -> float:
        return float(np.mean(fitted(of_part, curves).held_out(1)[0] ** 2))

    alone = left()
    return lambda curve: alone > _RIDGE and left(curve) < (1.0 - ALIKE) * alone


@dataclass(frozen=True)
class Account:
    """What a fit with curves says of what is missed."""

    missed: Missed
    curves: Sequence[Curve]
    model: Fit

    @property
    def budget(self) -> ErrorBudget:
        """The whole."""
        missed = self.missed
        whole = float(np.mean(missed.residual**2)) + missed.above**2
        entries = [self._entry(group, whole) for group in self._groups()]
        entries = sorted(entries, key=lambda entry: -entry.share)
        effort = max(float(np.sqrt(np.mean(missed.effort**2))), _TINY)
        return ErrorBudget(
            entries=(*entries, *self._rest(whole)),
            missed=float(np.sqrt(whole)),
            share_of_effort=float(np.sqrt(whole)) / effort,
            cutoff_hz=max(s.cutoff_hz for s in missed.data.segments),
            unit=missed.model.axis.effort_unit,
        )

    @cached_property
    def _parts(self) -> dict[int, Array]:
        """What each curve accounts for beyond the base, (n,)."""
        efforts = {k: self.missed.scale * self.model.effort(k) for k in self.model.curves}
        base = self.model.products.values[:, : self.model.products.base]
        return {
            k: np.asarray(effort - base @ np.linalg.lstsq(base, effort, rcond=None)[0])
            for k, effort in efforts.items()
        }

    def _groups(self) -> list[tuple[list[int], tuple[str, ...]]]:
        """Curves that stand together, and all quantities that would do for each group.

        Together stand curves over the same, those that imitate each other, and those that oppose
        each other so much that one would have a negative share.
        """
        groups: list[tuple[list[int], tuple[str, ...]]] = []
        for k in self.model.curves:
            groups = _joined(groups, [k], self.alike(k), self._wheres)
        while len(groups) > 1:
            parts = [sum(self._parts[k] for k in members) for members, _ in groups]
            shares = [float(np.mean(part * self.missed.residual)) for part in parts]
            least = int(np.argmin(shares))
            if shares[least] >= 0.0:
                break
            opposed = [float(np.mean(parts[least] * part)) for part in parts]
            (one, alike), (other, others) = groups[least], groups[int(np.argmin(opposed))]
            rest = [g for g in groups if g[0] not in (one, other)]
            groups = [*rest, ([*other, *one], tuple(dict.fromkeys((*others, *alike))))]
        return groups

    def _wheres(self, members: Sequence[int]) -> set[str]:
        return {self.curves[j].kind.where for j in members}

    def alike(self, k: int) -> tuple[str, ...]:
        """The quantities whose curves imitate what a curve accounts for."""
        part, own = self._parts[k], self.curves[k].kind.where
        found, imitates = [own], imitation(self.model.products, part)
        for j, curve in enumerate(self.curves):
            where = curve.kind.where
            if where not in found and imitates(j):
                found.append(where)
        return tuple(found)

    def _entry(self, group: tuple[list[int], tuple[str, ...]], whole: float) -> BudgetEntry:
        """The entry of curves that stand together."""
        members, wheres = group
        ordered = sorted(members, key=lambda k: -float(np.mean(self._parts[k] ** 2)))
        where = self.curves[ordered[0]].kind.where
        part = np.sum([self._parts[k] for k in members], axis=0)
        share, interval = self._share(part, whole)
        shown = [self._curve(k) for k in ordered if len(self.curves[k].points)]
        return BudgetEntry(
            where=where,
            share=share,
            interval=interval,
            effort=float(np.sqrt(abs(share) * whole)),
            curves=tuple(shown),
            named=self._named(members),
            together_with=tuple(w for w in wheres if w != where),
        )

    def _named(self, members: Sequence[int]) -> tuple[str, ...]:
        """Effects of the diagnosis whose contribution the curves of an entry are."""
        return tuple(
            name
            for name, effort in self.missed.laws.items()
            if any(map(imitation(self.model.products, effort), members))
        )

    def _share(self, part: Array, whole: float) -> tuple[float, tuple[float, float]]:
        """Share of what is missed, and its 90 % interval over blocks of time."""
        n, block = len(part), self.missed.block
        here = np.unique(block)
        products = np.bincount(block, part * self.missed.residual)[here]
        above = self.missed.above**2 * np.bincount(block)[here]
        wholes = np.bincount(block, self.missed.residual**2)[here] + above
        share = float(np.sum(products)) / (n * whole)
        spread = products - share * wholes
        std = float(np.sqrt(np.sum(spread**2) * len(here) / max(len(here) - 1, 1))) / (n * whole)
        return share, (share - NORMAL_90 * std, share + NORMAL_90 * std)

    @property
    def terms(self) -> tuple[AgreeingCurve, ...]:
        """The curves as terms of a model, the largest first."""
        effort = max(float(np.sqrt(np.mean(self.missed.effort**2))), _TINY)
        found = []
        for k in self.model.curves:
            term = self.curves[k].term(
                self._scaled(k) * self.model.coefficients[self.model.place(k)]
            )
            share = float(np.sqrt(np.mean(self._parts[k] ** 2))) / effort
            found.append(AgreeingCurve(term, self._curve(k), share, self.model.freedom(k)))
        return tuple(sorted(found, key=lambda curve: -curve.share))

    def _scaled(self, k: int) -> Array:
        """What the coefficients of a curve are multiplied by, (m,)."""
        products = self.model.products
        return np.asarray(self.missed.scale / products.scale[products.places[k]])

    def _curve(self, k: int) -> BudgetCurve:
        """A curve with its band, beyond the base model."""
        curve, place = self.curves[k], self.model.place(k)
        shown = curve.shown * self._scaled(k)
        values = shown @ self.model.coefficients[place]
        covariance = self.model.covariance[place, place] * self._colour(k)
        std = np.sqrt(np.maximum(np.einsum("pm,mk,pk->p", shown, covariance, shown), 0.0))
        kind = curve.kind
        coordinate_unit, unit = kind.units(*self.missed.model.axis.units)
        return BudgetCurve(
            what=kind.what,
            over=kind.over_what,
            coordinate=curve.points,
            values=values,
            low=values - NORMAL_90 * std,
            high=values + NORMAL_90 * std,
            unit=unit,
            coordinate_unit=coordinate_unit,
        )

    def _colour(self, k: int) -> float:
        """By how much what is left, which is not white, widens the covariance of a curve.

        Its power where the curve's columns have theirs, over its mean power.
        """
        products, place = self.model.products, self.model.place(k)
        left = products.signal - self.model.predicted
        # of a stiff curve some variances are zero but for rounding, which a Cholesky factor refuses
        variances, axes = np.linalg.eigh(self.model.covariance[place, place])
        root = axes * np.sqrt(np.maximum(variances, 0.0))
        directions = products.values[:, products.places[k]] @ root
        seen = np.sum(np.abs(np.fft.rfft(directions, axis=0)) ** 2, axis=1)
        power = np.abs(np.fft.rfft(left)) ** 2
        width = max(len(power) // _SMOOTHED, 1)
        window = np.ones(2 * width + 1)
        count = np.convolve(np.ones_like(power), window, "same")
        smooth = np.convolve(power, window, "same") / count
        white = float(np.sum(seen)) * float(np.mean(power))
        return max(float(np.sum(seen * smooth)) / max(white, _TINY), 1.0)

    def _rest(self, whole: float) -> Iterator[BudgetEntry]:
        """Above the band, along no curve, and noise."""
        parts = list(self._parts.values())
        left = self.missed.residual - np.sum(parts, axis=0) if parts else self.missed.residual
        share, (_, high) = self._share(left, whole)
        noise = min(self.missed.noise**2 / whole, max(share, 0.0))
        again = min(share * repeated(left, self.missed.data), share - noise)
        off = high - share
        for where, one in (
            (ABOVE_BAND, self.missed.above**2 / whole),
            (REPEATS, again),
            (UNREPEATED, share - noise - again),
            (NOISE, noise),
        ):
            spread = off if where in (REPEATS, UNREPEATED) else 0.0
            if one or where == NOISE:
                effort = float(np.sqrt(max(one, 0.0) * whole))
                yield BudgetEntry(where, one, (max(one - spread, 0.0), one + spread), effort)


def _joined(
    groups: list[tuple[list[int], tuple[str, ...]]],
    members: list[int],
    alike: tuple[str, ...],
    wheres: Callable[[Sequence[int]], set[str]],
) -> list[tuple[list[int], tuple[str, ...]]]:
    """Groups with one more, joined with those whose curves are over one of the same quantities."""
    others = [g for g in groups if wheres(g[0]) & set(alike) or wheres(members) & set(g[1])]
    rest = [g for g in groups if g not in others]
    together = [*(k for g in others for k in g[0]), *members]
    quantities = dict.fromkeys(w for g in (*others, (members, alike)) for w in g[1])
    return [*rest, (together, tuple(quantities))]


def repeated(left: Array, data: AxisData) -> float:
    """Share of a rest (n,), beyond noise, that a later lap shows again; 0 where none is repeated.

    From the product of samples one lap apart.
    """
    both = alone = 0.0
    ends = np.cumsum([np.count_nonzero(s.valid) for s in data.segments])[:-1]
    for s, here in zip(data.segments, np.split(left, ends), strict=True):
        lap, at = kept_period(s), s.sample_index[s.valid]
        if lap is None or len(here) < 2:
            continue
        step = float(np.median(np.diff(at)))
        later = at + lap
        after = np.clip(np.searchsorted(at, later), 1, len(at) - 1)
        near = (at[after] - at[after - 1] <= 1.5 * step) & (later <= at[-1])
        again = np.interp(later, at, here)
        both += float(np.sum((here * again)[near]))
        alone += float(np.sum(0.5 * (here**2 + again**2)[near]))
    return float(np.clip(both / alone, 0.0, 1.0)) if alone > 0.0 else 0.0


# Which curves the recordings support: each has to predict what is held out, in time and by regime.
#
# A curve enters where its likelihood gains, where the error on held-out stretches of time falls in
# more of them than chance allows, and where no error grows that is held out by quarters of
# position, speed or acceleration: its own coordinate aside, because no curve is known where it was
# not seen.


_NATS: Final = 6.0
"""Gain of the logarithm of the likelihood: odds of 1 to 400, because a score of curves are tried.
"""
_SURE: Final = 2.0
"""Standard deviations by which the logarithm of the held-out error falls, over blocks of time."""
_FALL: Final = 0.02
"""Least share by which a curve reduces the mean square that the base model leaves held out: what
reduces it less shows in no picture."""
_FOLDS: Final = 5
_COORDINATES: Final = ("position", "speed", "acceleration")


def parts(block: NDArray[np.intp], coordinates: Sequence[Array]) -> list[NDArray[np.intp]]:
    """Ways to hold samples (n,) out: stretches of time, and quarters of each coordinate."""
    return [block % _FOLDS, *(_quarters(x) for x in coordinates)]


def _quarters(x: Array) -> NDArray[np.intp]:
    return np.digitize(x, np.quantile(x, [0.25, 0.5, 0.75]))


def select(
    products: Products, curves: Sequence[Curve], block: NDArray[np.intp], noise: float
) -> Fit:
    """The curves that the recordings support, fitted beside the base model.

    Parameters
    ----------
    products : Products
        Of all curves; the ways to hold out are those of `parts`.
    block : (n,) array of int
        Number of the block of time of each sample.
    noise : float
        Mean square that noise alone leaves of the signal: less is not divided among curves.
    """
    model = fitted(products, ())
    errors = _squares(model)
    least, least_held_out = _FALL * _left(model), _FALL * float(np.sum(errors[0]))
    while (left := _left(model)) > STRUCTURE**2 * noise:
        best: tuple[Fit, list[Array]] | None = None
        for k, curve in enumerate(curves):
            if k in model.curves:
                continue
            tried = fitted(products, (*model.curves, k), model)
            gain = tried.likelihood - model.likelihood
            if gain < _NATS or left - _left(tried) < least:
                continue
            found = _squares(tried)
            if not _agrees(errors, found, curve, block, least_held_out):
                continue
            if best is None or np.sum(found[0]) < np.sum(best[1][0]):
                best = tried, found
        if best is None:
            break
        model, errors = best
    return model


def _left(model: Fit) -> float:
    """Mean square that a fit leaves."""
    return float(np.mean((model.products.signal - model.predicted) ** 2))


def _squares(model: Fit) -> list[Array]:
    return [left**2 for left in model.held_out()]


def _agrees(
    before: Sequence[Array],
    after: Sequence[Array],
    curve: Curve,
    block: NDArray[np.intp],
    least: float,
) -> bool:
    """Whether what is held out is predicted better with a curve, by at least so much.

    By the logarithm of the error of each block: a few blocks hold most of the squares.
    """
    if np.sum(before[0]) - np.sum(after[0]) < least:
        return False
    here = np.unique(block)
    then, now = (np.log(np.bincount(block, e)[here] + _TINY) for e in (before[0], after[0]))
    falls = then - now
    if np.mean(falls) < _SURE * float(np.std(falls, ddof=1) / np.sqrt(len(falls))):
        return False
    return all(
        np.sum(now) <= np.sum(then)
        for coordinate, then, now in zip(_COORDINATES, before[1:], after[1:], strict=True)
        if coordinate not in curve.kind.over_what
    )
