"""Where the axes should be: holding, following the trajectory, or coming to rest."""

from collections.abc import Iterator, Sequence
from typing import Final

import numpy as np

from firmware_interface.motion import (
    Reference,
    Trajectory,
    stop_duration_s,
    stopping_reference,
)
from firmware_interface.virtual.controller import Setpoint
from firmware_interface.virtual.drive import SAMPLE_PERIOD_S
from firmware_interface.virtual.trajectory_check import chunk

_CHUNK: Final = 2048


class SetpointGenerator:
    """Gives the setpoints of all axes, sample by sample.

    Attributes
    ----------
    current : sequence of Setpoint
        The last ones given, by axis; always numbers.
    moving : bool
        The reference is not constant.
    finite : bool
        None was asked for that is no number; such a one holds the axes instead.
    """

    def __init__(self, positions_rad: Sequence[float]) -> None:
        self.hold(positions_rad)

    def hold(self, positions_rad: Sequence[float]) -> None:
        """Stay at these positions."""
        self.finite = True
        self.current: Sequence[Setpoint] = [Setpoint(p, 0.0, 0.0) for p in positions_rad]
        self._ahead: Iterator[Sequence[Setpoint]] = iter(())
        self.moving = False

    def follow(self, trajectory: Trajectory) -> None:
        """Start a trajectory from the present position, then come to rest."""
        rest = [setpoint.position_rad for setpoint in self.current]
        self._ahead = (row for stretch in _stretches(trajectory, rest) for row in _rows(stretch))
        self.moving = True

    def stop(self) -> None:
        """Decelerate to rest from the present reference."""
        self._ahead = _rows(_stop([s._replace(acceleration_rad_s2=0.0) for s in self.current]))

    def take_up(self, setpoints: Sequence[Setpoint], *, moving: bool) -> None:
        """Be here now, and come to rest from there or, unless moving, stay."""
        if not moving:
            self.hold([setpoint.position_rad for setpoint in setpoints])
            return
        self.current, self.moving = setpoints, True
        self._ahead = _rows(_stop(setpoints))

    def advance(self) -> Sequence[Setpoint]:
        """The setpoints of the next sample."""
        if self.moving:
            following = next(self._ahead, None)
            finite = following is None or all(setpoint.finite for setpoint in following)
            if following is None or not finite:
                self.hold([setpoint.position_rad for setpoint in self.current])
                self.finite = finite
            else:
                self.current = following
        return self.current


def rest_from(setpoints: Sequence[Setpoint]) -> list[float]:
    """Where a stop from these setpoints ends, by axis."""
    return [float(axis.position_rad[-1]) for axis in _stop(setpoints)]


def _stop(setpoints: Sequence[Setpoint]) -> list[Reference]:
    """The stop of all axes, from the sample that follows."""
    duration = max(stop_duration_s(setpoint.velocity_rad_s) for setpoint in setpoints)
    times = np.arange(1, round(duration / SAMPLE_PERIOD_S) + 1) * SAMPLE_PERIOD_S
    return [
        stopping_reference(
            s.position_rad, s.velocity_rad_s, times, float(times[-1]), s.acceleration_rad_s2
        )
        for s in setpoints
    ]


def _stretches(trajectory: Trajectory, rest_rad: Sequence[float]) -> Iterator[list[Reference]]:
    """The references of all axes, a stretch of time after the other."""
    first = -round(trajectory.lead_in_s / SAMPLE_PERIOD_S)
    last = round(trajectory.duration_s / SAMPLE_PERIOD_S)
    for start in range(first, last, _CHUNK):
        yield chunk(trajectory, rest_rad, start, min(_CHUNK, last - start))


def _rows(axes: Sequence[Reference]) -> Iterator[Sequence[Setpoint]]:
    """Sample by sample, from the references of all axes."""
    columns = [
        map(
            Setpoint,
            axis.position_rad.tolist(),
            axis.velocity_rad_s.tolist(),
            axis.acceleration_rad_s2.tolist(),
        )
        for axis in axes
    ]
    return iter(zip(*columns, strict=True))
