"""Whether an effort can be that of the motion beside it, before any parameter is believed.

The checks know no particular machine. They rest on what holds for all: a mass resists, friction
takes energy out of the motion, and an effort that moves an axis follows from the motion.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.estimation import least_squares
from edge_ident.estimation.trust import CERTAIN_SIGN, RESIDUAL_LIMIT, Finding, negative
from edge_ident.model.model import PARAMETERS, POSITIVE, Array, Estimate
from edge_ident.signals.conditioning import Signals, unit_length
from edge_ident.signals.filters import LONG, ONE_LINE, strongest_line
from edge_ident.signals.timing import REACH_S, STEPS_PER_PERIOD, vertex

UNRELATED: Final = "unrelated_effort"
# Share of the effort's variance that the base model explains at least of an effort that belongs to
# the motion: a tenth of its rms.
_RELATED: Final = 0.01
# The same by chance, over the number of samples: white noise stays below in 998 of 1000 cases (chi-
# square with three degrees of freedom).
_BY_CHANCE: Final = 15.0
# What is left of an effort after a multiple of the velocity, over its rms, in a copy. The effort of
# a machine has friction and inertia beside, and noise of its own.
_COPY: Final = 1e-3
# Shift from which two columns have different clocks: a loop with that delay could hardly follow 2
# Hz (an integrating plant with a phase margin of 60 degrees).
_LONG_S: Final = 0.045
# Least value of that shift, in sampling periods: twice what belongs to the base model.
_FEW_SAMPLES: Final = 3.0
_REACH: Final = 0.1  # largest shift that is tried, as a share of the record
# What the shift must leave of the residual: no effect of an axis, recorded in time, loses half.
_FALLS: Final = 0.5
# Share of what the shift changes away from reversals that the effort must have there: nearer to all
# than to nothing.
_SEEN: Final = 0.5
# That change over what encoder noise alone makes of it, rms. A loop answers its encoder's noise,
# late, and is tuned to amplify it at most twice (peak of the sensitivity; Åström and Murray).
_BEYOND_NOISE: Final = 2.0
# Samples by which a shift is judged: what is left of an effort is known to a hundredth.
_MOST: Final = 1 << 14
_AT_ONCE: Final = 1 << 17  # samples, over several shifts, that are judged at once
# Samples, from the first on, that tell whether a motion has one frequency.
_LINE_SAMPLES: Final = 1 << 16
# Samples of these in a cut-off period: a millionth of the power folds into the band.
_LINE_RATE: Final = 10.0
_DIVISOR: Final = 32  # divisor of their number: the transform of a prime takes five times as long
_FEWEST: Final = 24  # samples, six for each parameter
_RANK: Final = 1e-9  # singular value over the largest that counts as zero
_TINY: Final = float(np.finfo(float).tiny)


def check_effort(signals: Signals, part: least_squares.EstimationPart) -> list[Finding]:
    """Findings against the effort of an axis; the most telling alone, because it explains others.

    Parameters
    ----------
    signals : Signals
    part : EstimationPart
        What to judge by.
    """
    columns, effort = part.columns, signals.effort[part.samples]
    found = (
        _copy_of_velocity(columns.values[:, 1], effort)
        or _wrong_sign(columns, effort)
        or _recorded_late(signals, part.samples)
        or _unrelated(columns, effort)
    )
    return [found] if found else []


def unbounded(regressor: Array, effort: Array) -> Estimate:
    """Least squares without bounds on (N, P) columns, with deviations for coloured residuals."""
    return _unbounded(least_squares.Columns(regressor), effort)


def _unbounded(columns: least_squares.Columns, effort: Array) -> Estimate:
    normalized = columns.solved(effort, _RANK)
    std = least_squares.coloured_std(columns.unit, effort - columns.unit @ normalized, columns.svd)
    return Estimate(normalized / columns.length, std / columns.length)


def unphysical(estimate: Estimate) -> list[Finding]:
    """Inertia and frictions of an optimum without bounds that are negative beyond doubt; they do
    not block, because an effect of the extended model may explain them.

    Parameters
    ----------
    estimate : Estimate
        Its first four parameters are those of the base model.
    """
    return [
        negative(name, estimate.parameters[i], estimate.std[i], blocks=False)
        for i, name in enumerate(PARAMETERS)
        if POSITIVE[i] and estimate.parameters[i] < -CERTAIN_SIGN * estimate.std[i]
    ]


def _wrong_sign(columns: least_squares.Columns, effort: Array) -> Finding | None:
    """Inertia negative, and friction that drives the motion."""
    inertia, viscous, coulomb = (columns.solved(effort, _RANK) / columns.length)[:3]
    velocity, direction = columns.values[:, 1], columns.values[:, 2]
    friction = float(np.mean(velocity * (viscous * velocity + coulomb * direction)))
    if inertia >= 0.0 or friction >= 0.0:  # as a rule; deviations would take most of the time
        return None
    found = _unbounded(columns, effort)
    negative = found.parameters[:3] < -CERTAIN_SIGN * found.std[:3]
    if not (negative[0] and (negative[1] or negative[2])):
        return None
    return Finding(
        "effort_sign",
        f"inertia ({inertia:.3g}) and friction (viscous {viscous:.3g}, Coulomb {coulomb:.3g}) "
        "are all negative: the effort has the wrong sign against the position",
        "multiply the effort by -1: edge-ident identify FILE --effort-encoding opposite",
        blocks=True,
        contradicts=True,
    )


def _copy_of_velocity(velocity: Array, effort: Array) -> Finding | None:
    """An effort that is a multiple of the velocity and nothing else."""
    factor = float(velocity @ effort) / max(float(velocity @ velocity), _TINY)
    left = np.linalg.norm(effort - factor * velocity)
    if left > _COPY * np.linalg.norm(effort):
        return None
    return Finding(
        "effort_is_velocity",
        f"the effort is {factor:.4g} times the velocity but for "
        f"{left / max(float(np.linalg.norm(effort)), _TINY):.1g} of it: a machine has "
        "inertia and friction too",
        "check which signal the effort column holds; a computed velocity belongs in a column "
        "<axis>_velocity_rad_s or _m_s",
        blocks=True,
        contradicts=True,
    )


def _recorded_late(signals: Signals, part: NDArray[np.intp]) -> Finding | None:
    """An effort that fits the motion only a good while earlier or later.

    At one frequency a shift is any phase, and a spring, a hysteresis or a vibration in the loop
    makes what else it changes. So nothing is said there.
    """
    period_s = signals.period_s
    border_s = max(_LONG_S, _FEW_SAMPLES * signals.recorded_period_s)
    step = max(1, int(1.0 / (STEPS_PER_PERIOD * signals.cutoff_hz * period_s)))
    reach = int(min(REACH_S / period_s, _REACH * len(signals.effort)) / step)
    shifts = step * np.arange(-reach, reach + 1)
    inside = part[(part >= -shifts[0]) & (part < len(signals.effort) - shifts[-1])]
    inside = inside[:: -(-len(inside) // _MOST) or 1]
    if len(inside) < _FEWEST or not reach:
        return None
    basis = np.linalg.qr(signals.regressor[inside])[0]
    blocks = np.array_split(shifts, -(-len(shifts) * len(inside) // _AT_ONCE))
    left = np.concatenate([_left_of(signals.effort[inside + b[:, None]], basis) for b in blocks])
    best = int(np.argmin(left))
    late_s = step * (_least_between(left, best) - reach) * period_s
    if (
        abs(shifts[best]) * period_s < border_s
        or left[best] > _FALLS * left[reach]
        or left[best] > RESIDUAL_LIMIT
    ):
        return None
    if _one_line(signals):  # asked only here, because no shift fits as a rule
        return None
    shift = int(shifts[best])
    away = _away_from_reversals(signals, inside, shift)
    judged = len(away) >= _FEWEST
    if judged and not _shifted(signals, inside, away, shift):
        return None
    misses = f"the model misses {left[best]:.1%} of it, now {left[reach]:.1%}"
    return Finding(
        "effort_late",
        f"the effort is {_late(late_s)}. With that, {misses}. {_reasons(late_s, judged)}",
        "record both at once, or say when the effort acted: "
        f"edge-ident identify FILE --effort-shift {-late_s:.2g}",
        blocks=judged,
        contradicts=judged,
    )


def _reasons(late_s: float, judged: bool) -> str:
    """What makes an effort late, in words."""
    reasons = ["The two columns were recorded by different clocks"]
    reasons += ["what lies between motor and encoder is soft"] if late_s < 0.0 else []
    reasons += [] if judged else ["the axis sticks where it turns"]
    return ", or ".join(reasons)


def _late(late_s: float) -> str:
    """Of which time the effort of a row is, in words."""
    by = f"{abs(late_s):.2g} s"
    if late_s < 0.0:
        return f"read late by {by}: each row has the effort of {by} after its position"
    return f"delayed by {by}: each row has the effort of {by} before its position"


def _least_between(left: Array, best: int) -> float:
    """Where a parabola through the smallest value and those beside it is least."""
    if not 0 < best < len(left) - 1:
        return float(best)
    place, _ = vertex(np.square(left[best - 1 : best + 2]).tolist())
    return best + place


def _away_from_reversals(
    signals: Signals, inside: NDArray[np.intp], shift: int
) -> NDArray[np.intp]:
    """Samples that are farther from any reversal or standstill than shift and filter reach.

    Nearer to one, the friction of an axis that sticks and of a chain that winds up is late too.
    """
    velocity = signals.regressor[:, 1]
    turning = ~signals.moving
    turning[1:] |= velocity[1:] * velocity[:-1] <= 0.0
    passed = np.cumsum(turning)
    margin = abs(shift) + int(np.ceil(1.0 / (signals.cutoff_hz * signals.period_s)))
    before = passed[np.maximum(inside - margin, 0)]
    after = passed[np.minimum(inside + margin, len(passed) - 1)]
    away: NDArray[np.intp] = inside[before == after]
    return away


def _shifted(
    signals: Signals, inside: NDArray[np.intp], away: NDArray[np.intp], shift: int
) -> bool:
    """Whether the effort has, away from reversals, what the shift changes there.

    The model that fits with the shift predicts that change. The part of it that the base model
    expresses without a shift is no evidence and is left out.
    """
    regressor = signals.regressor
    fitted = np.linalg.lstsq(regressor[inside], signals.effort[inside + shift], rcond=None)[0]
    both = np.stack([regressor[away - shift] @ fitted, signals.effort[away]], axis=1)
    columns = least_squares.Columns(regressor[away])
    change, effort = (x - columns.unit @ columns.solved(x, _RANK) for x in both.T)
    noise = np.linalg.norm(fitted[:2] * least_squares.motion_noise(signals))
    if np.sqrt(np.mean(change**2)) <= _BEYOND_NOISE * noise:
        return False
    share = unbounded(change[:, None], effort)
    return bool(share.parameters[0] - CERTAIN_SIGN * share.std[0] > _SEEN)


def _left_of(efforts: Array, basis: Array) -> Array:
    """What an orthonormal basis (n, R) leaves of efforts (S, n), over their norms."""
    left = efforts - (efforts @ basis) @ basis.T
    lengths = [np.einsum("sn,sn->s", x, x) for x in (left, efforts)]
    return np.asarray(np.sqrt(lengths[0] / np.maximum(lengths[1], _TINY)))


def _one_line(signals: Signals) -> bool:
    """Whether the velocity has one frequency, from as many samples as its bandwidth needs."""
    step = max(1, int(1.0 / (_LINE_RATE * signals.cutoff_hz * signals.period_s)))
    velocity = signals.regressor[:_LINE_SAMPLES:step, 1]
    whole = len(velocity) - len(velocity) % _DIVISOR
    line = strongest_line(velocity[:whole], step * signals.period_s, signals.cutoff_hz)
    return line.share >= ONE_LINE


def _unrelated(columns: least_squares.Columns, effort: Array) -> Finding | None:
    """An effort of which the motion explains nothing."""
    variation = float(np.var(effort))
    left = effort - columns.unit @ columns.solved(effort, _RANK)
    explained = 1.0 - float(np.var(left)) / max(variation, _TINY)
    if explained > max(_RELATED, _BY_CHANCE / len(effort)):
        return None
    return Finding(
        UNRELATED,
        f"the motion explains {explained:.1%} of the effort: they do not belong together, or "
        "the effort is noise",
        "check that effort and position come from the same axis and the same time",
        blocks=True,
        contradicts=True,
    )


# Model error of an estimate: how far it moves when one regime of the motion is left out.
#
# A right model fits every part of the motion with the same parameters. A wrong one balances its
# errors over all of them, so its parameters depend on which parts there are. The samples are
# divided into quarters by speed, by position, by time and by acceleration, and each quarter is left
# out in turn. The direction is no such regime: one direction alone cannot tell Coulomb friction
# from offset.
#
# The moves make a deviation as in the jackknife over groups (Quenouille 1956; Efron 1982, ch. 2).
# What noise alone makes of the moves is taken off, so that a right model moves nowhere.
#
# No model of a machine is right, and what it lacks may be too little to be noticed. This part
# follows from the least that is noticed. It matters where noise is small.

QUARTERS: Final = 4
SMALLEST_EXCESS: Final = 0.002
"""Residual beyond noise, of the rms effort, from which a model lacks something: it moves a
parameter that makes up a tenth of the effort by 2 % of its value."""
# Added to normal matrices of unit diagonal: what a part of the motion does not show moves far, and
# the noise of its move is as large.
_RIDGE: Final = 1e-10


@dataclass(frozen=True)
class RegimeSpread:
    """How far least-squares parameters depend on the regimes of the motion.

    Attributes
    ----------
    model_error : (P,) array
        Standard deviation of each parameter by model error, beyond that by noise.
    significance : (P,) array
        Largest move of each parameter in standard deviations of the move by noise.
    largest_move : (P,) array
        In the parameter's unit.
    """

    model_error: Array
    significance: Array
    largest_move: Array


@dataclass(frozen=True)
class RegimeMoves:
    """Parameters without each of K quarters of the motion, less those of all of it.

    Attributes
    ----------
    move : (K, P) array
    by_noise : (K, P) array
        Deviation by noise of each move, in deviations by noise of the parameter.
    """

    move: Array
    by_noise: Array

    def beyond(self, std: Array) -> RegimeSpread:
        """What deviations by noise (P,) of the parameters leave of the moves."""
        noise = self.by_noise * std
        beyond = (self.move**2 - noise**2).reshape(-1, QUARTERS, len(std))
        variance = (QUARTERS - 1) / QUARTERS * beyond.sum(axis=1)
        with np.errstate(over="ignore"):  # a move that noise cannot make at all
            certainty = np.abs(self.move) / np.maximum(noise, _TINY)
        return RegimeSpread(
            model_error=np.sqrt(np.maximum(variance.max(axis=0), 0.0)),
            significance=certainty.max(axis=0),
            largest_move=np.abs(self.move).max(axis=0),
        )


def regimes(
    regressor: Array, position: Array, samples: NDArray[np.intp]
) -> tuple[Array, Array, Array, Array]:
    """Speed, position, time and acceleration, (N,) each.

    Parameters
    ----------
    regressor : (N, 4) array
        Of the base model.
    position : (N,) array
    samples : (N,) array of int
        Their numbers, which tell the time.
    """
    speed, acceleration = np.abs(regressor[:, 1]), regressor[:, 0]
    return speed, position, samples.astype(np.float64), acceleration


def unnoticed_error(regressor: Array, effort: Array) -> Array:
    """Deviation (P,) of least-squares parameters by what a model lacks and nothing shows.

    It leaves anything between nothing and `SMALLEST_EXCESS` in the residual, evenly distributed.
    In each of the P directions that the columns span, it is taken to be as large.

    Parameters
    ----------
    regressor : (N, P) array
    effort : (N,) array
    """
    unit, length = unit_length(regressor)
    inverse = np.linalg.inv(unit.T @ unit + _RIDGE * np.eye(unit.shape[1]))
    unnoticed = SMALLEST_EXCESS / np.sqrt(3.0) * np.linalg.norm(effort)
    return np.asarray(unnoticed * np.sqrt(np.diag(inverse)) / length)


def regime_spread(
    regressor: Array, effort: Array, regimes: Sequence[Array], std: Array
) -> RegimeSpread:
    """Leave out one regime at a time and compare the parameters.

    Parameters
    ----------
    regressor : (N, P) array
    effort : (N,) array
    regimes : sequence of (N,) arrays
        Quantities by which the samples are divided into quarters.
    std : (P,) array
        Standard deviations by noise of the parameters from all samples.
    """
    return regime_moves(regressor, effort, regimes).beyond(std)


def regime_moves(regressor: Array, effort: Array, regimes: Sequence[Array]) -> RegimeMoves:
    """The first half of `regime_spread`, which needs no deviations."""
    unit, length = unit_length(regressor)
    count = unit.shape[1]
    quarters = [_quarters(values) for values in regimes]
    whole, parts = np.zeros(count**2 + count), np.zeros((len(regimes), QUARTERS, count**2 + count))
    for begin in range(0, len(unit), LONG):  # in blocks: there are many products
        block = slice(begin, begin + LONG)
        rows = np.column_stack(
            [least_squares.pair_products(unit[block]), unit[block] * effort[block, None]]
        )
        whole += rows.sum(axis=0)
        parts += [_sums(rows, quarter[block]) for quarter in quarters]
    inverse, parameters = _solved(whole[None], count)
    inverses, moved = _solved((whole - parts).reshape(-1, len(whole)), count)
    share = np.diagonal(inverses, axis1=1, axis2=2) / np.diagonal(inverse, axis1=1, axis2=2) - 1.0
    return RegimeMoves((moved - parameters) / length, np.sqrt(np.maximum(share, 0.0)))


def _quarters(values: Array) -> NDArray[np.intp]:
    """Number of the quarter, by size, of each of N values."""
    rank = np.empty(len(values), dtype=np.intp)
    rank[np.argsort(values, kind="stable")] = np.arange(len(values))
    return rank * QUARTERS // len(values)


def _sums(rows: Array, quarter: NDArray[np.intp]) -> Array:
    """Sums (4, R) of rows (N, R) by quarter."""
    return np.asarray((quarter == np.arange(QUARTERS)[:, None]).astype(np.float64) @ rows)


def _solved(sums: Array, count: int) -> tuple[Array, Array]:
    """Inverses (K, P, P) and parameters (K, P) of K normal equations of P parameters."""
    normal = sums[:, : count**2].reshape(-1, count, count) + _RIDGE * np.eye(count)
    inverse = np.asarray(np.linalg.inv(normal), dtype=np.float64)
    return inverse, (inverse @ sums[:, count**2 :, None])[..., 0]
