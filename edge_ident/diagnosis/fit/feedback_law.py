"""A controller's law, fitted to a recording in the place of the machine's dynamics.

A loop that holds a speed or a position answers every disturbance by effort = gain·(reference -
motion). Where the reference hardly moves, this law is all that the recording shows: least squares
finds minus the controller's gain and calls it friction (Ljung, System Identification, 1999,
section 13.4). The law differs from the dynamics by its signs: effort falls where position or
velocity is too high. It never acts before the motion that it answers. So does the weight of an arm
that stands on its joint: what a law explains by an angle, the dynamics may explain by a weight.
"""

from typing import Final, NamedTuple

import numpy as np
import scipy.optimize
from numpy.typing import NDArray

from edge_ident.diagnosis.prepare.axis_data import Segment
from edge_ident.signals.conditioning import unit_length
from edge_ident.signals.filters import strongest_line

Array = NDArray[np.float64]

_LAGS: Final = (0.0, 0.5, 1.0, 1.5, 2.0, 3.0, 5.0)
"""Sampling periods from a motion to the answer: calculation, and filters of position and speed."""
_AS_WELL: Final = 1.1
"""Residual of the law over that of the base model, up to which the law describes the effort as
well: with 100 independent samples two equally good models differ by a tenth."""
_EXPLAINS: Final = 0.7
"""Residual over the variation of the effort, up to which the law explains half of its variance."""


class FeedbackLaw(NamedTuple):
    """The best causal law, and what it leaves.

    Attributes
    ----------
    over_base : float
        Residual over that of base model and weight with physical signs, the larger of two: with and
        without the strongest line of the motion. At one frequency any law describes any effort.
    left : float
        Residual over the variation of the effort, the larger of the same two.
    position_gain, velocity_gain : float
        Effort per unit of position and velocity, never negative.
    """

    over_base: float
    left: float
    position_gain: float
    velocity_gain: float

    @property
    def describes(self) -> bool:
        """Whether the effort follows from the motion by the law as well as by dynamics."""
        return self.over_base < _AS_WELL and self.left < _EXPLAINS


def feedback_law(segment: Segment, effort: Array, regressor: Array, rotary: bool) -> FeedbackLaw:
    """Fit the law of a controller whose reference rests or moves at constant speed.

    Parameters
    ----------
    segment : Segment
    effort : (n,) array
        Filtered, at the compared samples.
    regressor : (n, 4) array
        Columns of the base model, filtered alike.
    rotary : bool
        Whether positions are angles, which a weight may follow.

    Returns
    -------
    FeedbackLaw
    """
    valid = segment.valid
    answers = [_answer(segment, lag)[valid] for lag in _LAGS]
    time_s = (segment.sample_index * segment.period_s)[valid]
    line = strongest_line(segment.motion.velocity, segment.period_s, segment.cutoff_hz)
    angle = 2.0 * np.pi * line.frequency_hz * time_s
    resting = segment.filter(np.ones(len(segment.motion.position)))[valid]
    ramp = segment.filter(segment.motion.time_s - np.mean(segment.motion.time_s))[valid]
    slow = np.stack([resting, ramp], axis=1)
    tone = np.stack([resting * np.sin(angle), resting * np.cos(angle)], axis=1)
    weight = _weight(segment)[valid] if rotary else np.empty((len(time_s), 0))
    dynamics = np.hstack([regressor[valid], -regressor[valid, 3:], weight, -weight])
    alone, beside_line = (
        _fitted(effort[valid], dynamics, answers, known)
        for known in (slow, np.hstack([slow, tone]))
    )
    over_base, left, *_ = np.maximum(alone, beside_line).tolist()
    return alone._replace(over_base=over_base, left=left)


def _answer(segment: Segment, lag: float) -> Array:
    """Position and velocity (n, 2) a few sampling periods ago, with the sign of an answer."""
    time_s = segment.motion.time_s
    before_s = time_s - lag * segment.raw_period_s
    motion = (segment.motion.position, segment.motion.velocity)
    before = np.stack([np.interp(before_s, time_s, x) for x in motion])
    return -segment.filter(before).T


def _weight(segment: Segment) -> Array:
    """What a weight on the axis adds, per its two parts, (n, 2)."""
    angle = segment.motion.position
    return segment.filter(np.stack([np.cos(angle), np.sin(angle)])).T


def _fitted(effort: Array, regressor: Array, answers: list[Array], known: Array) -> FeedbackLaw:
    """The law and dynamics (n, P) of no negative amounts, both beside columns (n, K) that explain
    nothing."""
    basis = np.linalg.qr(known / np.linalg.norm(known, axis=0))[0]

    def beside(signal: Array) -> Array:
        return np.asarray(signal - basis @ (basis.T @ signal))

    target = beside(effort)
    variation = float(np.linalg.norm(target))
    columns, _ = unit_length(beside(regressor))
    floor = np.finfo(float).eps * float(np.linalg.norm(effort))
    dynamics = max(float(scipy.optimize.nnls(columns, target)[1]), floor)
    laws = []
    for answer in answers:
        columns, length = unit_length(beside(answer))
        gains, left = scipy.optimize.nnls(columns, target)
        laws.append(FeedbackLaw(left / dynamics, left / max(variation, floor), *(gains / length)))
    return min(laws)
