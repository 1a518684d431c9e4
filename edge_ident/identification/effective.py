"""The axis as it is, from all of its motions: what gains are to make up for, explained or not.

A line through the friction, inertia and offset; beside them the effort that the line leaves and
that repeats over the speed and over the stroke (`edge_ident.model.motion`). Named effects are
taken off before. One least-squares fit to all recordings finds all of it. What repeats is held by a
ridge, whose strength is the one that predicts stretches best which were left out; where it does not
predict them better than the line alone, beyond chance, there is none.

The line has all that a line can have, and an entry over speed stays where it is certain. Few
samples are as slow as the first entries, and those come from reversals, where an axis sticks and
creeps: what they say of slow moves made these worse than no gains at all.

Every stretch is left out once more for the deviations (the jackknife over groups), so they hold
what is unexplained, too, and how all numbers of the fit move together.

Sources: Efron, The Jackknife, the Bootstrap and Other Resampling Plans (1982), ch. 2; Arlot and
Celisse, A survey of cross-validation procedures, Statistics Surveys 4 (2010).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.errors import DataError
from edge_ident.estimation.compensation import compensate_effects
from edge_ident.estimation.least_squares import estimation_part
from edge_ident.model.model import (
    PARAMETERS,
    POSITIVE,
    AxisModel,
    Estimate,
    Model,
    SupportedRange,
    Term,
    base_axis,
)
from edge_ident.model.motion import Array
from edge_ident.model.repeating import OVER_SPEED, Grid, Repeating
from edge_ident.signals.filters import differentiate
from edge_ident.signals.metrics import rms
from edge_ident.signals.recording import Recording

_STRETCH_S: Final = 1.0
_FEWEST: Final = 8  # stretches of a recording, at least
# Strength of the ridge over the mean of the entries' squares; infinite: nothing repeats.
_RIDGES: Final = (np.inf, 1.0, 0.1, 0.01)
_CERTAIN: Final = 2.0  # standard errors by which what repeats must predict better
_LEAST: Final = 0.01  # least value of a positive parameter, over its deviation
_NONZERO: Final = 3.0  # deviations by which an entry over speed differs from nothing
# Filtered direction, and cut-off periods since a reversal, from which on the filter mixes hardly
# any of the other direction in.
_ONE_WAY: Final = 0.99
_SETTLED_PERIODS: Final = 2.0
_BASE: Final = len(PARAMETERS)
_SPEED: Final = slice(_BASE, _BASE + OVER_SPEED)
_TINY: Final = float(np.finfo(float).tiny)


@dataclass(frozen=True)
class EffectiveAxis:
    """An axis as it is.

    Attributes
    ----------
    model : AxisModel
        The line, with its deviations, and the named effects.
    repeating : Repeating or None
        What repeats beside it.
    spread : (B, 4 + R) array
        Times B standard normal numbers, how base parameters and entries of what repeats may be off
        together.
    drift : (2,) array
        Deviation of Coulomb friction and offset from one motion to the next; zero where there is
        one motion alone.
    left : float
        What all of it leaves of the effort, rms over rms.
    """

    model: AxisModel
    repeating: Repeating | None
    spread: Array
    drift: Array
    left: float


def effective_axis(
    recordings: Sequence[Recording],
    name: str,
    effects: Sequence[Term] = (),
    late_s: float = 0.0,
    *,
    repeats: bool = True,
) -> EffectiveAxis:
    """Fit an axis to all of its motions.

    Parameters
    ----------
    recordings : sequence of Recording
    name : str
    effects : sequence of Term
        That are known of the axis, and do not belong to the time of one recording.
    late_s : float
        By which the effort is recorded late, beyond what the recordings state.
    repeats : bool
        Whether to look for what repeats.

    Raises
    ------
    DataError
        Hardly any sample shows the axis in motion.
    """
    rows = _Rows.of(recordings, name, effects, late_s)
    sums = _Sums.of(rows)
    ridge = _best_ridge(sums) if repeats else None
    found, spread = sums.jackknifed(ridge)
    if ridge is None:
        found, spread = found[:_BASE], spread[:, :_BASE]
    else:
        found, spread = _certain(rows.with_all_in_line(np.vstack([found, spread])))
    std = np.sqrt(np.sum(spread[:, :_BASE] ** 2, axis=0))
    left = rows.effort - rows.columns[:, : len(found)] @ found
    drift = rows.drift(left)
    units = recordings[0].axes[name].units
    base = base_axis(_physical(found[:_BASE], std), *units, rows.seen)
    model = AxisModel((*base.terms, *effects), *units)
    share = float(np.linalg.norm(left) / max(float(np.linalg.norm(rows.effort)), _TINY))
    repeating = None if ridge is None else Repeating(rows.grid, found[_BASE:])
    return EffectiveAxis(model, repeating, spread, drift, share)


def _certain(numbers: Array) -> tuple[Array, Array]:
    """Numbers (P,) and their spread (B, P), the rows of (1 + B, P), with those entries over speed
    that are certain."""
    over_speed = numbers[:, _SPEED]
    std = np.sqrt(np.sum(over_speed[1:] ** 2, axis=0))
    certain = numbers.copy()
    certain[:, _SPEED] = np.where(np.abs(over_speed[0]) < _NONZERO * std, 0.0, over_speed)
    return certain[0], certain[1:]


_Part = tuple[Array, Array, Array, NDArray[np.intp]]


def _physical(parameters: Array, std: Array) -> Estimate:
    """The line of a machine. A motion that does not show an inertia or a friction may say that it
    is below zero: then it is small, and its interval reaches as far as what was found."""
    least = _LEAST * np.maximum(std, np.abs(parameters))
    below = POSITIVE & (parameters < least)
    return Estimate(
        np.where(below, least, parameters),
        np.where(below, np.maximum(std, np.abs(parameters)), std),
    )


@dataclass(frozen=True)
class _Rows:
    """Samples of all recordings.

    Attributes
    ----------
    columns : (N, 4 + R) array
        Of the base model and of what repeats.
    effort : (N,) array
        Both over what a line leaves of the recording.
    stretch : (N,) array of int
        Which one each sample belongs to.
    motion : (N,) array of int
        Which recording.
    """

    columns: Array
    effort: Array
    stretch: NDArray[np.intp]
    motion: NDArray[np.intp]
    grid: Grid
    seen: SupportedRange

    @classmethod
    def of(
        cls, recordings: Sequence[Recording], name: str, effects: Sequence[Term], late_s: float
    ) -> "_Rows":
        parts = []
        for number, recording in enumerate(recordings):
            try:
                parts.append(_part(recording, name, effects, late_s))
            except DataError:
                if not parts and number == len(recordings) - 1:  # none tells anything
                    raise
        regressor, effort, position, stretch = map(np.concatenate, zip(*parts, strict=True))
        weight = np.concatenate(
            [np.full(len(part[1]), 1.0 / _left_by_line(part)) for part in parts]
        )
        firsts = np.cumsum([0] + [int(part[3][-1]) + 1 for part in parts[:-1]])
        samples = [len(part[3]) for part in parts]
        stretch += np.repeat(firsts, samples)
        motion = np.repeat(np.arange(len(parts)), samples)
        grid = Grid.over(position, regressor[:, 1])
        along = grid.columns(position, regressor[:, 1], regressor[:, 2])
        seen = SupportedRange.of(position, regressor[:, 1], regressor[:, 0], effort)
        columns = weight[:, None] * np.concatenate([regressor, along], axis=1)
        return cls(columns, weight * effort, stretch, motion, grid, seen)

    def with_all_in_line(self, numbers: Array) -> Array:
        """Numbers (K, P) in which the line has of the entries over speed what a line can have."""
        line = slice(1, _BASE)
        parts = np.linalg.lstsq(self.columns[:, line], self.columns[:, _SPEED], rcond=None)[0]
        moved = numbers[:, _SPEED] @ parts.T
        seen = np.any(self.columns[:, _SPEED], axis=0)
        changed = numbers.copy()
        changed[:, line] += moved
        changed[:, _SPEED] -= moved @ self.grid.lines.T * seen
        return changed

    def drift(self, left: Array) -> Array:
        """How far friction and offset of each motion are from those of all, as a deviation of the
        next one: what is left (N,) of each has lines of its own."""
        motions = int(self.motion[-1]) + 1
        if motions == 1:
            return np.zeros(2)
        own = []
        for number in range(motions):
            of_motion = self.motion == number
            columns = self.columns[of_motion][:, [2, 3]]
            own.append(np.linalg.lstsq(columns, left[of_motion], rcond=None)[0])
        # one degree of freedom went into the mean, and the next motion is one more
        variance = np.sum(np.square(own), axis=0) / (motions - 1)
        return np.asarray(np.sqrt(variance * (1.0 + 1.0 / motions)))


def _part(recording: Recording, name: str, effects: Sequence[Term], late_s: float) -> _Part:
    """Regressor, effort, position and stretch at the samples of one recording that tell."""
    units = recording.axes[name].units
    known = None
    if effects:
        base = base_axis(Estimate(np.array([1.0, 0.0, 0.0, 0.0]), np.zeros(_BASE)), *units)
        known = Model({name: AxisModel((*base.terms, *effects), *units)})
    axis = compensate_effects(recording, name, known, late_s=late_s)
    signals = axis.signals
    samples = estimation_part(signals).samples
    # slower than a count in half a period of the filter, no encoder shows a direction
    shown = 2.0 * signals.cutoff_hz * signals.encoder_count
    samples = samples[np.abs(signals.regressor[samples, 1]) > shown]
    (position,) = differentiate(axis.position, signals.cutoff_hz, signals.period_s, orders=[0])
    stretches = max(round(len(signals.effort) * signals.period_s / _STRETCH_S), _FEWEST)
    stretch = stretches * samples // len(signals.effort)
    acceleration, velocity, direction, _ = signals.regressor[samples].T
    settled = np.abs(velocity) > np.abs(acceleration) * _SETTLED_PERIODS / signals.cutoff_hz
    settled &= direction * np.sign(velocity) > _ONE_WAY
    # else the motion turns faster than the filter
    if np.count_nonzero(np.bincount(stretch[settled])) >= _FEWEST:
        samples, stretch = samples[settled], stretch[settled]
    return signals.regressor[samples], signals.effort[samples], position[samples], stretch


def _left_by_line(part: _Part) -> float:
    """What a line of its own leaves of a recording: noise, and what is unexplained."""
    regressor, effort, *_ = part
    line = np.linalg.lstsq(regressor, effort, rcond=None)[0]
    return max(rms(effort - regressor @ line), _TINY)


@dataclass(frozen=True)
class _Sums:
    """Normal equations of every stretch: (B, P, P), (B, P) and (B,) squares of the effort."""

    normal: Array
    right: Array
    squares: Array
    length: Array

    @classmethod
    def of(cls, rows: _Rows) -> "_Sums":
        length = np.maximum(np.linalg.norm(rows.columns, axis=0), _TINY)
        length[_BASE:] = np.sqrt(np.mean(length[_BASE:] ** 2))
        unit = rows.columns / length
        bounds = np.flatnonzero(np.diff(rows.stretch, prepend=-1, append=-1))
        parts = [slice(a, b) for a, b in pairwise(bounds)]
        return cls(
            np.stack([unit[p].T @ unit[p] for p in parts]),
            np.stack([unit[p].T @ rows.effort[p] for p in parts]),
            np.array([rows.effort[p] @ rows.effort[p] for p in parts]),
            length,
        )

    def without_each(self, ridge: tuple[float, float] | None) -> Array:
        """Numbers (B, P) of the fits that leave one stretch out."""
        kept = self._kept(ridge)
        normal = (self.normal.sum(axis=0) - self.normal)[:, kept][:, :, kept]
        right = (self.right.sum(axis=0) - self.right)[:, kept]
        found = np.zeros_like(self.right)
        held = normal + np.diag(self._held(ridge)[kept])
        found[:, kept] = np.linalg.solve(held, right[..., None])[..., 0]
        return found

    def left(self, ridge: tuple[float, float] | None) -> Array:
        """Squares (B,) that each stretch has left by the fit to the others."""
        found = self.without_each(ridge)
        explained = 2.0 * np.sum(found * self.right, axis=1)
        return np.asarray(
            self.squares - explained + np.einsum("bp,bpq,bq->b", found, self.normal, found)
        )

    def jackknifed(self, ridge: tuple[float, float] | None) -> tuple[Array, Array]:
        """Numbers (P,) from all stretches, and their spread (B, P)."""
        kept = self._kept(ridge)
        normal = self.normal.sum(axis=0)[np.ix_(kept, kept)] + np.diag(self._held(ridge)[kept])
        found = np.zeros(len(self.length))
        found[kept] = np.linalg.solve(normal, self.right.sum(axis=0)[kept])
        moved = self.without_each(ridge) - found
        spread = np.sqrt(1.0 - 1.0 / len(moved)) * moved
        return found / self.length, spread / self.length

    def _held(self, ridge: tuple[float, float] | None) -> Array:
        """Diagonal of the ridge."""
        held = np.full(len(self.length), 1e-10)
        for number, part in enumerate(_GROUPS):
            held[part] += ridge[number] / len(held[part]) if ridge else 0.0
        return held

    def _kept(self, ridge: tuple[float, float] | None) -> NDArray[np.intp]:
        return np.flatnonzero(np.isfinite(self._held(ridge or (np.inf, np.inf))))


# Entries over speed and over position.
_GROUPS: Final = (_SPEED, slice(_SPEED.stop, None))


def _best_ridge(sums: _Sums) -> tuple[float, float] | None:
    """The ridge that predicts best; None where the line alone is as good."""
    line = sums.left(None)
    left = {(a, b): sums.left((a, b)) for a in _RIDGES for b in _RIDGES if min(a, b) < np.inf}
    best = min(left, key=lambda ridge: float(np.sum(left[ridge])))
    better = line - left[best]
    error = np.sqrt(len(better)) * np.std(better)
    return best if np.sum(better) > _CERTAIN * error else None
