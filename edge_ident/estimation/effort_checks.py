"""Whether an effort can be that of the motion beside it, before any parameter is believed.

The checks know no particular machine. They rest on what holds for all: a mass resists, friction
takes energy out of the motion, and an effort that moves an axis follows from the motion.
"""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.estimation.covariance import coloured_std
from edge_ident.estimation.least_squares import Columns, EstimationPart, motion_noise
from edge_ident.estimation.trust import CERTAIN_SIGN, RESIDUAL_LIMIT, Finding, negative
from edge_ident.model.model import PARAMETERS, POSITIVE, Estimate
from edge_ident.signals.conditioning import Signals
from edge_ident.signals.motion_lines import ONE_LINE, strongest_line
from edge_ident.signals.timing import REACH_S, STEPS_PER_PERIOD, vertex

Array = NDArray[np.float64]

UNRELATED: Final = "unrelated_effort"
_RELATED: Final = 0.01
"""Share of the effort's variance that the base model explains at least of an effort that belongs to
the motion: a tenth of its rms."""
_BY_CHANCE: Final = 15.0
"""The same by chance, over the number of samples: white noise stays below in 998 of 1000 cases
(chi-square with three degrees of freedom)."""
_COPY: Final = 1e-3
"""What is left of an effort after a multiple of the velocity, over its rms, in a copy. The effort
of a machine has friction and inertia beside, and noise of its own."""
_LONG_S: Final = 0.045
"""Shift from which two columns have different clocks: a loop with that delay could hardly follow
2 Hz (an integrating plant with a phase margin of 60 degrees)."""
_FEW_SAMPLES: Final = 3.0
"""Least value of that shift, in sampling periods: twice what belongs to the base model."""
_REACH: Final = 0.1
"""Largest shift that is tried, as a share of the record."""
_FALLS: Final = 0.5
"""What the shift must leave of the residual: no effect of an axis, recorded in time, loses half."""
_SEEN: Final = 0.5
"""Share of what the shift changes away from reversals that the effort must have there: nearer to
all than to nothing."""
_BEYOND_NOISE: Final = 2.0
"""That change over what encoder noise alone makes of it, rms. A loop answers its encoder's noise,
late, and is tuned to amplify it at most twice (peak of the sensitivity; Åström and Murray)."""
_MOST: Final = 1 << 14
"""Samples by which a shift is judged: what is left of an effort is known to a hundredth."""
_AT_ONCE: Final = 1 << 17
"""Samples, over several shifts, that are judged at once."""
_LINE_SAMPLES: Final = 1 << 16
"""Samples, from the first on, that tell whether a motion has one frequency."""
_LINE_RATE: Final = 10.0
"""Samples of these in a cut-off period: a millionth of the power folds into the band."""
_DIVISOR: Final = 32
"""Divisor of their number: the transform of a prime takes five times as long."""
_FEWEST: Final = 24
"""Samples, six for each parameter."""
_RANK: Final = 1e-9
"""Singular value over the largest that counts as zero."""
_TINY: Final = float(np.finfo(float).tiny)


def check_effort(signals: Signals, part: EstimationPart) -> list[Finding]:
    """Findings against the effort of an axis; the most telling alone, because it explains others.

    Parameters
    ----------
    signals : Signals
    part : EstimationPart
        What to judge by.
    """
    columns, effort = part.columns, signals.effort[part.samples]
    return (
        _copy_of_velocity(columns.values[:, 1], effort)
        or _wrong_sign(columns, effort)
        or _recorded_late(signals, part.samples)
        or _unrelated(columns, effort)
    )


def unbounded(regressor: Array, effort: Array) -> Estimate:
    """Least squares without bounds on (N, P) columns, with deviations for coloured residuals."""
    return _unbounded(Columns(regressor), effort)


def _unbounded(columns: Columns, effort: Array) -> Estimate:
    normalized = columns.solved(effort, _RANK)
    std = coloured_std(columns.unit, effort - columns.unit @ normalized, columns.svd)
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


def _wrong_sign(columns: Columns, effort: Array) -> list[Finding]:
    """Inertia negative, and friction that drives the motion."""
    inertia, viscous, coulomb = (columns.solved(effort, _RANK) / columns.length)[:3]
    velocity, direction = columns.values[:, 1], columns.values[:, 2]
    friction = float(np.mean(velocity * (viscous * velocity + coulomb * direction)))
    if inertia >= 0.0 or friction >= 0.0:  # as a rule; deviations would take most of the time
        return []
    found = _unbounded(columns, effort)
    negative = found.parameters[:3] < -CERTAIN_SIGN * found.std[:3]
    if not (negative[0] and (negative[1] or negative[2])):
        return []
    return [
        Finding(
            "effort_sign",
            f"inertia ({inertia:.3g}) and friction (viscous {viscous:.3g}, Coulomb {coulomb:.3g}) "
            "are all negative: the effort has the wrong sign against the position",
            "multiply the effort column, or the position column, by -1",
            blocks=True,
            contradicts=True,
        )
    ]


def _copy_of_velocity(velocity: Array, effort: Array) -> list[Finding]:
    """An effort that is a multiple of the velocity and nothing else."""
    factor = float(velocity @ effort) / max(float(velocity @ velocity), _TINY)
    left = np.linalg.norm(effort - factor * velocity)
    if left > _COPY * np.linalg.norm(effort):
        return []
    return [
        Finding(
            "effort_is_velocity",
            f"the effort is {factor:.4g} times the velocity but for "
            f"{left / max(float(np.linalg.norm(effort)), _TINY):.1g} of it: a machine has "
            "inertia and friction too",
            "check which signal the effort column holds; a computed velocity belongs in a column "
            "<axis>_velocity_rad_s or _m_s",
            blocks=True,
            contradicts=True,
        )
    ]


def _recorded_late(signals: Signals, part: NDArray[np.intp]) -> list[Finding]:
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
        return []
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
        return []
    if _one_line(signals):  # asked only here, because no shift fits as a rule
        return []
    shift = int(shifts[best])
    away = _away_from_reversals(signals, inside, shift)
    judged = len(away) >= _FEWEST
    if judged and not _shifted(signals, inside, away, shift):
        return []
    misses = f"the model misses {left[best]:.1%} of it, now {left[reach]:.1%}"
    return [
        Finding(
            "effort_late",
            f"the effort is {_late(late_s)}. With that, {misses}. {_reasons(late_s, judged)}",
            "record both at once, or say when the effort acted: "
            f"edge-ident identify FILE --effort-shift {-late_s:.2g}",
            blocks=judged,
            contradicts=judged,
        )
    ]


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
    columns = Columns(regressor[away])
    change, effort = (x - columns.unit @ columns.solved(x, _RANK) for x in both.T)
    noise = np.linalg.norm(fitted[:2] * motion_noise(signals))
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


def _unrelated(columns: Columns, effort: Array) -> list[Finding]:
    """An effort of which the motion explains nothing."""
    variation = float(np.var(effort))
    left = effort - columns.unit @ columns.solved(effort, _RANK)
    explained = 1.0 - float(np.var(left)) / max(variation, _TINY)
    if explained > max(_RELATED, _BY_CHANCE / len(effort)):
        return []
    return [
        Finding(
            UNRELATED,
            f"the motion explains {explained:.1%} of the effort: they do not belong together, or "
            "the effort is noise",
            "check that effort and position come from the same axis and the same time",
            blocks=True,
            contradicts=True,
        )
    ]
