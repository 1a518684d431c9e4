"""Whether the feedback keeps an axis swinging to and fro.

A swing is the way of the deviation (position - reference) from one turning point to the next; what
rest allows is none. Two swings are a cycle. The feedback feeds a cycle if, over it, the effort less
the feed-forward does positive work on the deviation: a passivity observer (Hannaford and Ryu,
Time-domain passivity control of haptic interfaces, IEEE Trans. Robotics and Automation 18, 2002). A
hand that pushes the axis, stick-slip, and whatever else the feedback damps put work into it. Where
the reference itself changes its speed more than the deviation does, it may ask for such work. What
swings faster than the encoder can show is seen by the effort alone: it alternates from sample to
sample.
"""

from collections import deque
from typing import Final

LARGE_SHARE: Final = 0.3
"""Of the effort limit: what the effort sweeps in a swing that counts, and its rms value where it
alternates."""
_SMOOTHED: Final = 4
"""Means over so many samples, of deviation and effort alike: encoder rounding, which the feedback
turns into effort one sample later, would look like work."""
LONGEST_SWING_S: Final = 0.7
SHORTEST_TIME_S: Final = 0.25
"""An impact rings for less."""
_LATEST: Final = 3
"""Samples of control delay; a longer one counts as this."""
_FED_CYCLES: Final = 2
"""That overlap: three swings."""
_DECAY: Final = 0.5
"""A swing of less than this share of the largest is one that dies away."""


class _Swing:
    """Sums over the samples of a swing, in counts."""

    __slots__ = (
        "effort",
        "highest",
        "lowest",
        "reference_square",
        "reference_way",
        "samples",
        "square",
        "way",
        "work",
    )

    def __init__(self) -> None:
        self.samples = 0
        self.way = self.square = self.work = self.effort = 0.0
        self.reference_way = self.reference_square = 0.0
        self.lowest, self.highest = float("inf"), float("-inf")

    def add(self, other: "_Swing") -> None:
        self.samples += other.samples
        self.way += other.way
        self.square += other.square
        self.work += other.work
        self.effort += other.effort
        self.reference_way += other.reference_way
        self.reference_square += other.reference_square
        self.lowest = min(self.lowest, other.lowest)
        self.highest = max(self.highest, other.highest)


class OscillationWatch:
    """Watches one axis, sample by sample.

    Parameters
    ----------
    effort_limit : float
        In counts.
    rest : int
        Counts that an axis at rest may stray.
    period_s, control_delay_s : float
        Of the loop; from the encoder latch to the effort that follows from it.
    """

    def __init__(
        self, effort_limit: float, rest: int, *, period_s: float, control_delay_s: float
    ) -> None:
        self._large = LARGE_SHARE * effort_limit
        self._rest = rest
        self._longest, self._shortest = LONGEST_SWING_S / period_s, SHORTEST_TIME_S / period_s
        late, rest_s = divmod(control_delay_s, period_s)
        late = min(late, _LATEST)
        self._before_share = rest_s / period_s
        self._efforts: deque[float] = deque([0.0] * (int(late) + 2), maxlen=int(late) + 2)
        self._in_force = deque([0.0] * _SMOOTHED, maxlen=_SMOOTHED)
        self._seen: deque[tuple[int, int]] = deque(maxlen=_SMOOTHED)
        self._last, self._now, self._back = _Swing(), _Swing(), _Swing()
        self._direction = 0
        self._fed_cycles, self._fed_samples, self._largest = 0, 0, 0.0
        self._alternating, self._forgotten = 0.0, period_s / SHORTEST_TIME_S

    def seen(self, position: int, following_error: int, feedback: float) -> bool:
        """Take in a sample; whether the axis is kept swinging.

        Parameters
        ----------
        position, following_error : int
            In counts; following error is reference - position.
        feedback : float
            Effort that this sample asks for, less the feed-forward, in counts.
        """
        first, second = self._efforts[0], self._efforts[1]
        self._efforts.append(feedback)
        # what was asked for at the beginning of the period came into force a control delay later
        self._in_force.append(second + self._before_share * (first - second))
        full = len(self._seen) == _SMOOTHED
        oldest_deviation, oldest_position = self._seen[0] if full else (0, 0)
        self._seen.append((-following_error, position))
        if not full:
            return False
        step = (-following_error - oldest_deviation) / _SMOOTHED
        reference_step = (position - oldest_position) / _SMOOTHED - step
        effort = sum(self._in_force) / _SMOOTHED
        taken = self._in_force[-1] - effort
        self._alternating += self._forgotten * (taken * taken - self._alternating)
        back = self._back
        back.samples += 1
        back.way += step
        back.square += step * step
        back.work += effort * step
        back.effort += effort
        back.reference_way += reference_step
        back.reference_square += reference_step * reference_step
        if effort < back.lowest:
            back.lowest = effort
        if effort > back.highest:
            back.highest = effort
        beyond_rest = abs(back.way) > self._rest
        if not self._direction and beyond_rest:
            self._direction = 1 if back.way > 0 else -1
        if self._direction * back.way > 0:
            self._now.add(back)
            self._back = _Swing()
        elif beyond_rest and self._direction and self._swung():
            return True
        return self._alternating > self._large * self._large

    def _swung(self) -> bool:
        """At a turning point, where a swing has ended; whether it is one too many."""
        if self._fed():
            self._fed_samples += self._now.samples
            self._fed_samples += 0 if self._fed_cycles else self._last.samples
            self._fed_cycles += 1
            self._largest = max(self._largest, abs(self._now.way))
        else:
            self._fed_cycles, self._fed_samples, self._largest = 0, 0, 0.0
        self._last, self._now, self._back = self._now, self._back, _Swing()
        self._direction = -self._direction
        return self._fed_cycles >= _FED_CYCLES and self._fed_samples >= self._shortest

    def _fed(self) -> bool:
        """Whether the feedback fed the cycle that ends here."""
        last, now, cycle = self._last, self._now, _Swing()
        cycle.add(last)
        cycle.add(now)
        drift = cycle.way / cycle.samples
        # a constant effort, against a load, does no work on a swing to and fro
        work = cycle.work - cycle.effort * drift
        speed_power = cycle.square - cycle.way * drift
        asked_power = cycle.reference_square - cycle.reference_way**2 / cycle.samples
        return (
            all(
                swing.highest - swing.lowest >= self._large and swing.samples <= self._longest
                for swing in (last, now)
            )
            and work > 0.0
            and speed_power > asked_power
            and abs(now.way) >= _DECAY * max(self._largest, abs(last.way))
        )
