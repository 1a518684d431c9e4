"""How an axis follows its reference: where it stands although it is told to move, and by how much.

With an encoder on the load, play shows here and nowhere in the effort: the motor runs through it,
and the load stands. Stiction stands the axis, too; the effort then rises until it lets go.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np

from edge_ident.signals import conditioning, filters, time_stamps
from edge_ident.signals.metrics import quantile, rms
from edge_ident.signals.recording import Array, Recording
from edge_ident.support.words import listed

OFF: Final = "off_reference"
# Way of the reference, in noises or counts of the encoder, after which a standstill shows.
_RESOLVED: Final = 10.0
_STANDS: Final = 4.0  # range of the position, in the same, up to which it stands
_MOVES: Final = 0.2  # of its rms speed, from which a reference moves
# Of the samples in which the reference moves, from which standing is no turning.
_SHARE: Final = 0.05
_OFTEN: Final = 0.2  # the same, from which an axis sticks, however short the way
# Of the stroke, from which what the axis stands for, or its step at reversals, is told. A
# judgement: a loop that only friction holds back is a tenth of that off.
_STEP: Final = 0.01
_NEAR: Final = 0.7  # of that step, from which it is told more exactly
# Share of the standstills that begin where the reference turns, from which all do.
_AT_REVERSAL: Final = 0.8
_WIDEST: Final = 0.05  # of the record, a window in which an axis stands
_MOST: Final = 4000  # samples by which play and lag are told
_TRIED: Final = 9
_ROUNDS: Final = 4
_UNITS: Final = {"m": (1e3, "mm"), "rad": (1.0, "rad")}
_TINY: Final = float(np.finfo(float).tiny)


@dataclass(frozen=True)
class Tracking:
    """How an axis follows its reference; lengths in the unit of its position.

    Attributes
    ----------
    off_rms : float
        Distance from the reference.
    share : float
        Of the samples in which the reference moves, those in which the axis stands.
    stands : tuple of float
        Way of the reference in a standstill, the median, towards plus and towards minus; 0 where
        there is none.
    at_reversals : float
        Share of the standstills that begin where the reference turns.
    effort_ratio : float
        Effort at the end of a standstill over that of the axis in motion.
    lag_s : float
    step : float
        Lost motion where the reference turns.
    stroke : float
    """

    off_rms: float
    share: float
    stands: tuple[float, float]
    at_reversals: float
    effort_ratio: float
    lag_s: float
    step: float
    stroke: float

    @property
    def off(self) -> bool:
        """Whether the axis does not follow."""
        stands = self.share >= _SHARE and max(self.stands) >= _STEP * self.stroke
        return stands or self.share >= _OFTEN or self.step >= _STEP * self.stroke

    @property
    def _sticks(self) -> bool:
        """Whether it stands for more than the turning takes."""
        lost = self.step >= _STEP * self.stroke and max(self.stands) >= self.step
        return lost or self.share >= _SHARE

    @property
    def next_step(self) -> str:
        """What to look at."""
        if not self._sticks:
            return (
                "repeat the motion at half the speed: play keeps its size, and what a soft loop "
                "leaves becomes smaller"
            )
        if self.effort_ratio < 1.0:
            return (
                "repeat the motion with stiffer gains: what a soft loop leaves becomes smaller, "
                "and play keeps its size; or hold the motor and move the load by hand: what it "
                "moves is the play of coupling, nut, gear or pinion"
            )
        return "look at guides, seals and lubrication, where the axis sticks"

    def sentence(self, unit: str) -> str:
        """What that is, in words, with lengths in mm or rad."""
        factor, name = _UNITS[unit]

        def length(value: float) -> str:
            return f"{factor * value:.3g} {name}"

        said = [
            f"it is {length(self.off_rms)} off its reference (rms; stroke {length(self.stroke)})",
            f"it loses {length(self.step)} at each reversal of the reference",
        ]
        if self._sticks:
            ways = zip(self.stands, ("plus", "minus"), strict=True)
            each = listed(f"{length(way)} towards {side}" for way, side in ways if way)
            said.append(
                f"it stands in {self.share:.0%} of the samples in which the reference moves, while "
                f"that goes on by {each}: {self._why()}"
            )
        way = "behind" if self.lag_s >= 0.0 else "ahead of"
        said.append(f"in motion it is {1e3 * abs(self.lag_s):.3g} ms {way} the reference")
        return "; ".join(said)

    def _why(self) -> str:
        where = "after reversals" if self.at_reversals >= _AT_REVERSAL else "also between reversals"
        if self.effort_ratio < 1.0:
            return (
                f"{where}, with less effort than in motion, as with play between motor and "
                "encoder, or in a loop that is soft for its friction"
            )
        pushed = f"{self.effort_ratio:.2g} times that of motion"
        return f"{where}, until the effort is {pushed}, as stiction"


def tracking(recording: Recording, name: str) -> Tracking | None:
    """Compare the position of an axis with its reference; None without one that moves."""
    axis = recording.axes[name]
    if axis.reference is None or np.ptp(axis.reference) <= 0.0 or axis.sampling is not None:
        return None
    grid = time_stamps.EvenGrid.of(recording.time_s)
    position, reference = grid.resampled(axis.position), grid.resampled(axis.reference)
    effort, period_s = grid.resampled(axis.effort), grid.period_s
    count, noise = conditioning.count_and_noise(position)
    resolution = max(count, noise, 1e-6 * float(np.ptp(reference)))
    speed = np.gradient(reference, period_s)
    usual = rms(speed)
    width = int(np.ceil(_RESOLVED * resolution / max(usual * period_s, _TINY)))
    if width > _WIDEST * len(position):
        return None
    moves = np.abs(speed) > _MOVES * usual
    direction = _held(np.where(moves, np.sign(speed), 0.0))
    rests = conditioning.at_rest(position, _STANDS * resolution, max(width, 3))
    stands = rests & moves
    share = int(np.count_nonzero(stands)) / max(int(np.count_nonzero(moves)), 1)
    step, lag_s = _step_along(reference - position, speed, direction)
    if share >= _SHARE or step >= _NEAR * _STEP * float(np.ptp(reference)):
        step, lag_s = _step_and_lag(position, reference, period_s)
    runs = _runs(rests, stands, max(width, 3))
    return Tracking(
        off_rms=rms(reference - position),
        share=share,
        stands=_ways(reference, direction, runs),
        at_reversals=_at_reversals(position, direction, runs, _STANDS * resolution),
        effort_ratio=_effort_ratio(effort, stands | ~moves, runs),
        lag_s=lag_s,
        step=step,
        stroke=float(np.ptp(reference)),
    )


def _held(direction: Array) -> Array:
    """A direction (N,), with the last one where it is zero."""
    at = np.maximum.accumulate(np.where(direction != 0.0, np.arange(len(direction)), 0))
    return np.asarray(direction[at])


def _step_along(off: Array, speed: Array, direction: Array) -> tuple[float, float]:
    """What of a distance (N,) from the reference follows its direction, twice, and its speed, s."""
    columns = np.stack([np.ones_like(off), speed, direction], axis=1)
    fitted = np.linalg.lstsq(columns, off, rcond=None)[0]
    return 2.0 * max(float(fitted[2]), 0.0), float(fitted[1])


def _step_and_lag(position: Array, reference: Array, period_s: float) -> tuple[float, float]:
    """Play between a reference (N,) and a position (N,), and its lag besides, s.

    The reference is led through a play; what is left of the distance follows the speed. The play
    that leaves least is searched for on a grid that becomes finer.
    """
    every = -(-len(position) // _MOST)
    position, reference = position[::every], reference[::every]
    low, high = 0.0, float(np.ptp(position - reference))
    best, lag_s = 0.0, 0.0
    for _ in range(_ROUNDS):
        plays = np.linspace(low, high, _TRIED)
        left = [_left_by_play(position, reference, play, every * period_s) for play in plays]
        at = int(np.argmin([each[0] for each in left]))
        best, lag_s = float(plays[at]), left[at][1]
        low, high = float(plays[max(at - 1, 0)]), float(plays[min(at + 1, _TRIED - 1)])
    return best, lag_s


def _left_by_play(
    position: Array, reference: Array, play: float, period_s: float
) -> tuple[float, float]:
    """Squared distance that a play and a lag leave, and that lag, s."""
    led, at, half = np.empty_like(reference), float(reference[0]), 0.5 * play
    for i, told in enumerate(reference.tolist()):
        at = min(max(at, told - half), told + half)
        led[i] = at
    columns = np.stack([np.ones_like(led), np.gradient(led, period_s)], axis=1)
    fitted, *_ = np.linalg.lstsq(columns, led - position, rcond=None)
    left = led - position - columns @ fitted
    return float(left @ left), float(fitted[1])


def _runs(rests: filters.Mask, stands: filters.Mask, shortest: int) -> list[tuple[int, int]]:
    """First and last sample of rests in which the reference moves for a window."""
    edges = np.flatnonzero(np.diff(rests, prepend=False, append=False)).reshape(-1, 2)
    moving = np.concatenate([[0], np.cumsum(stands)])
    return [(int(a), int(b) - 1) for a, b in edges if moving[b] - moving[a] >= shortest]


def _ways(reference: Array, direction: Array, runs: list[tuple[int, int]]) -> tuple[float, float]:
    """Way of the reference in standstills, from where it turned, up to their end."""
    ways: dict[bool, list[float]] = {True: [], False: []}
    for first, last in runs:
        way = (reference[last] - reference[first : last + 1]) * direction[last]
        ways[bool(direction[last] > 0.0)].append(float(np.max(way)))
    medians = [quantile(np.array(ways[side]), 0.5) if ways[side] else 0.0 for side in (True, False)]
    return medians[0], medians[1]


def _at_reversals(
    position: Array, direction: Array, runs: list[tuple[int, int]], still: float
) -> float:
    """Share of standstills before which the axis went the other way."""
    turned, before = 0, 0
    for first, last in runs:
        gone = position[first] - position[before : first + 1]
        moved = gone[np.abs(gone) > still]
        turned += bool(len(moved)) and bool(moved[-1] * direction[last] < 0.0)
        before = last
    return turned / len(runs) if runs else 0.0


def _effort_ratio(effort: Array, rest: filters.Mask, runs: list[tuple[int, int]]) -> float:
    """Effort at the end of standstills over that in motion, without its mean."""
    if not runs or rest.all():
        return 0.0
    pushed = np.abs(effort - np.mean(effort))
    last = np.array([pushed[max(last - 1, 0)] for _, last in runs])
    return quantile(last, 0.5) / max(quantile(pushed[~rest], 0.5), _TINY)
