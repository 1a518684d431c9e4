"""Timing of a recording: its effort in step with its motion, and what a further shift would do.

A friction that bends leaves a rest that changes with the speed, and beside the base model alone a
shift takes a part of it. So the shift that moves an effort is estimated beside any curve of
friction over speed, for either direction.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Final, Self

import numpy as np
from numpy.typing import NDArray

from edge_ident.diagnosis.prepare.axis_data import WHOLE_BAND, Segment, once
from edge_ident.model.model import AxisModel, regressor
from edge_ident.model.motion import LARGEST_SHIFT
from edge_ident.signals.filters import lowpass
from edge_ident.signals.timing import (
    CERTAIN,
    REACH_S,
    Shift,
    beyond_limit,
    slow,
    smallest_at,
    solve_shift,
    within_limits,
)

Array = NDArray[np.float64]

SHARE_OF_DELAY: Final = 0.5
"""Of what is left without a delay, squared. A delay takes more out than all else leaves: a wrong
model asks for a shift as well, and for a smaller share."""
_STEPS: Final = 3
"""Of the estimation of a delay of many samples, whose effect is not linear."""
_FAR: Final = 2.0
"""Times the limit of timing."""
_MOVES: Final = 2
"""Of an effort into step; the first is right to first order."""
MOST_MOVES: Final = 6
"""Beside causes that are fitted anew after each."""
_SMALLEST: Final = 0.1
"""Move in sampling periods beside causes, at least: what a smaller one changes is linear."""
_KNOTS: Final = 4
"""Speeds that a curve of friction is straight between: at rest, the fastest, and with as many
samples between each two. With 6 and 8 the shift changes by less than its deviation."""


def in_time(segments: Sequence[Segment], *, move: bool) -> tuple[tuple[Segment, ...], float]:
    """Bring recordings in step with their motion, and find what a further shift would add.

    Parameters
    ----------
    move : bool
        False leaves every effort where it is.

    Returns
    -------
    float
        About how late in s one is, if by more than a controller's timing: then all stay. Else zero.
    """
    shifts = tuple(_Signals.of(s).shift(s) for s in segments)
    for segment, shift in zip(segments, shifts, strict=True):
        if _late(segment, shift):
            return tuple(map(out_of_step, segments, shifts)), shift.unlimited_s
    if move:
        segments = [_in_step(s) for s in segments]
    return tuple(map(_with_timing, segments)), 0.0


def far_shift_s(segments: Sequence[Segment], step_s: float, reach_s: float) -> float:
    """The shift, common to all recordings, at which the base model leaves least.

    Along one sinusoid the slow part of an effort tells no shift: it is as well a phase, which
    inertia and viscous friction share. So the shifts are tried.

    Parameters
    ----------
    step_s, reach_s : float
        Between shifts, and the largest that makes sense.
    """
    count = int(min(reach_s, REACH_S) / step_s)
    shifts = step_s * np.arange(-count, count + 1)
    inner = [replace(s, valid=s.valid & ~s.near_ends(shifts[-1])) for s in segments]
    left = [sum(_Signals.of(s.in_step(float(shift))).left for s in inner) for shift in shifts]
    return float(shifts[np.argmin(left)])


def out_of_step(segment: Segment, shift: Shift) -> Segment:
    """A recording whose effort is as it was recorded, with what timing at its limit adds to it.

    The rate of a slow part says what a shift does to first order and to that part. So far out of
    step the base model would leave what its own timing explains, and a delay would have that.
    """
    segment = segment.in_step(0.0) if segment.applied_s else segment
    if not beyond_limit(shift, segment.raw_period_s):
        return _with_timing(segment)
    largest_s = float(np.copysign(LARGEST_SHIFT * segment.raw_period_s, shift.unlimited_s))
    inertia, viscous, *_ = np.maximum(_Signals.of(segment.in_step(largest_s)).parameters, 0.0)
    effort = inertia * segment.motion.acceleration + viscous * segment.motion.velocity
    late = lowpass(effort, WHOLE_BAND / segment.period_s, segment.period_s, delay_s=largest_s)
    return replace(segment, timing_column=segment.filter(late - effort) / largest_s)


def _with_timing(segment: Segment) -> Segment:
    """A recording with what a further shift adds to its effort.

    To the slow part: a controller answers encoder noise, and that would look like a shift.
    """
    inertia, viscous, *_ = np.maximum(_Signals.of(segment).parameters, 0.0)
    smooth = slow(segment.motion.acceleration, segment.timing_hz, segment.period_s)
    rate = inertia * np.gradient(smooth, segment.period_s) + viscous * smooth
    return replace(segment, timing_column=-segment.filter(rate))


def _in_step(segment: Segment) -> Segment:
    """A recording that is moved into step.

    It stays where a wrong model asks for far more than timing can be.
    """
    largest_s = _FAR * LARGEST_SHIFT * segment.raw_period_s
    for _ in range(_MOVES):
        further = _Signals.of(segment).beside_friction(segment).shift(segment)
        whole_s = further.unlimited_s + segment.applied_s
        if abs(whole_s) > largest_s + CERTAIN * further.unlimited_std_s:
            return segment.in_step(0.0)
        whole = within_limits(whole_s, further.unlimited_std_s, segment.raw_period_s)
        segment = segment.in_step(whole.shift_s)
    return segment


def whole_shift(segment: Segment, axis: AxisModel) -> Shift:
    """By which the effort of a recording is late, beside the terms of a model that was fitted."""
    further = _Signals.of(segment).beside_terms(segment, axis).shift(segment)
    whole_s = further.unlimited_s + segment.applied_s
    return within_limits(whole_s, further.unlimited_std_s, segment.raw_period_s)


def moved_beside(segment: Segment, axis: AxisModel) -> Segment:
    """A recording in step beside the terms of a model that was fitted, to first order; itself where
    it hardly moves.

    The slow part of its effort says where. Within what that leaves open, which is all for short
    moves, it is the shift at which the model leaves least.
    """
    shift = whole_shift(segment, axis)
    if shift.unlimited_std_s < _SMALLEST * segment.raw_period_s:
        return _moved(segment, shift.shift_s)
    open_s = CERTAIN * shift.unlimited_std_s
    best_s = _best_fit_s(segment, lambda s: _Signals.of(s).beside_terms(s, axis))
    return _moved(segment, float(np.clip(best_s, shift.shift_s - open_s, shift.shift_s + open_s)))


def untold(segment: Segment) -> bool:
    """Whether the slow part of an effort says less of its timing than the limits do."""
    shift = _Signals.of(segment).shift(segment)
    return shift.unlimited_std_s > LARGEST_SHIFT * segment.raw_period_s


def at_best_fit(segment: Segment) -> Segment:
    """A recording at the shift within the limits at which the base model leaves least; itself where
    it hardly moves."""
    return _moved(segment, _best_fit_s(segment, _Signals.of))


def _best_fit_s(segment: Segment, signals: Callable[[Segment], "_Signals"]) -> float:
    """The shift within the limits at which the signals of a recording leave least.

    It is that of the recording where a parabola through three shifts leads to no better one: of a
    slow record the limits are no small part of a period.
    """

    def left(shift_s: float) -> float:
        return signals(segment.in_step(shift_s)).left

    limit_s = LARGEST_SHIFT * segment.raw_period_s
    found_s = smallest_at([left(s) for s in (-limit_s, 0.0, limit_s)], segment.raw_period_s)
    return min(segment.applied_s, found_s, key=left)


def _moved(segment: Segment, shift_s: float) -> Segment:
    """A recording with another shift; itself where it hardly moves."""
    if abs(shift_s - segment.applied_s) < _SMALLEST * segment.raw_period_s:
        return segment
    return _with_timing(segment.in_step(shift_s))


def _late(segment: Segment, shift: Shift) -> bool:
    """Whether a shift is beyond the limit, and most of what the base model leaves."""
    if not beyond_limit(shift, segment.raw_period_s):
        return False
    before, moved = _Signals.of(segment).left, segment
    for _ in range(_STEPS):
        moved = moved.in_step(shift.unlimited_s)
        signals = _Signals.of(moved)
        if signals.left < (1.0 - SHARE_OF_DELAY) * before:
            return True
        further = signals.shift(moved)
        shift = replace(shift, unlimited_s=moved.applied_s + further.unlimited_s)
    return False


@dataclass(frozen=True)
class _Signals:
    """Columns of the base model, and more, (n, P) and their rates (n, P); the effort (n,); the
    samples that count (n,); and a model whose terms are not in the effort, if any."""

    columns: Array
    rates: Array
    effort: Array
    valid: NDArray[np.bool_]
    known: AxisModel | None = None

    @classmethod
    def of(cls, segment: Segment) -> Self:
        """The signals of a recording, filtered and weighted as it is compared."""
        columns, rates = once(segment.cache, _of_motion, lambda: _of_motion(segment))
        return cls(columns, rates, segment.effort[segment.sample_index], segment.valid)

    def beside_terms(self, segment: Segment, axis: AxisModel) -> Self:
        """The same without what the terms of a model add to the base model."""
        effort = self.effort - segment.predicted(axis) + self.columns @ axis.parameters
        return replace(self, effort=effort, known=axis)

    def beside_friction(self, segment: Segment) -> Self:
        """The same with columns for what a curve of friction adds to the base model."""
        curve = segment.filter(_friction_curve(segment.motion.velocity).T).T
        at = self.valid
        curve = curve - self.columns @ np.linalg.lstsq(self.columns[at], curve[at], rcond=None)[0]
        return replace(
            self,
            columns=np.hstack([self.columns, curve]),
            rates=np.hstack([self.rates, np.zeros_like(curve)]),
        )

    def shift(self, segment: Segment) -> Shift:
        """By which the effort of the recording is late."""
        at, period_s = self.valid, segment.raw_period_s
        slow_effort = slow(segment.raw_effort, segment.timing_hz, period_s)
        rate = segment.sampled(np.gradient(slow_effort, period_s))
        known_rate = np.zeros(len(at))
        if self.known is not None:
            known_rate = segment.filter(np.gradient(_added(segment, self.known), segment.period_s))
        return solve_shift(
            self.columns[at], self.rates[at], self.effort[at], -rate[at], period_s, known_rate[at]
        )

    @property
    def parameters(self) -> Array:
        """Of the base model, (4,), without timing."""
        at = self.valid
        return np.asarray(np.linalg.lstsq(self.columns[at], self.effort[at], rcond=None)[0])

    @property
    def left(self) -> float:
        """Sum of squares that the base model leaves."""
        residual = (self.effort - self.columns @ self.parameters)[self.valid]
        return float(residual @ residual)


def _of_motion(segment: Segment) -> tuple[Array, Array]:
    """Columns (n, 4) of the base model and their rates (n, 4), wherever the effort is moved."""
    motion, nothing = segment.motion, np.zeros(len(segment.effort))
    columns = regressor(motion.velocity, motion.acceleration)
    jerk = np.gradient(motion.acceleration, segment.period_s)
    rates = np.stack([jerk, motion.acceleration, nothing, nothing])
    return segment.filter(columns.T).T, segment.filter(rates).T


def _added(segment: Segment, axis: AxisModel) -> Array:
    """Effort (N,) that the terms of a model add to its base model."""
    columns = regressor(segment.motion.velocity, segment.motion.acceleration)
    return segment.obeyed_effort(axis) - columns @ axis.parameters


def _friction_curve(velocity: Array) -> Array:
    """Columns (N, 2 K) that span the curves of friction over speed, by direction."""
    speed = np.abs(velocity)
    knots = np.quantile(speed, np.linspace(0.0, 1.0, _KNOTS))
    hats = [np.interp(speed, knots, hat) for hat in np.eye(_KNOTS)]
    return np.stack([hat * (velocity * way > 0.0) for hat in hats for way in (1, -1)], axis=1)
