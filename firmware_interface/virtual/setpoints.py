"""Where the axes should be: holding, following the trajectory, or coming to rest."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Final

import numpy as np

from firmware_interface.board_types import AxisLimits
from firmware_interface.motion import (
    Reference,
    Trajectory,
    reference,
    stop_duration_s,
    stopping_reference,
)
from firmware_interface.virtual.controller import Setpoint
from firmware_interface.virtual.drive import SAMPLE_PERIOD_S

_CHUNK: Final = 2048


class SetpointGenerator:
    """Gives the setpoints of all axes, sample by sample.

    Attributes
    ----------
    current : sequence of Setpoint
        The last ones given, by axis.
    moving : bool
        The reference is not constant.
    """

    def __init__(self, positions_rad: Sequence[float]) -> None:
        self.hold(positions_rad)

    def hold(self, positions_rad: Sequence[float]) -> None:
        """Stay at these positions."""
        self.current: Sequence[Setpoint] = [Setpoint(p, 0.0, 0.0) for p in positions_rad]
        self._ahead: Iterator[Sequence[Setpoint]] = iter(())
        self.moving = False

    def follow(self, trajectory: Trajectory) -> None:
        """Start a trajectory from the present position, then come to rest."""
        rest = [setpoint.position_rad for setpoint in self.current]
        self._ahead = (row for chunk in _chunks(trajectory, rest) for row in _rows(chunk))
        self.moving = True

    def stop(self) -> None:
        """Decelerate to rest from the present reference."""
        duration = max(stop_duration_s(setpoint.velocity_rad_s) for setpoint in self.current)
        times = np.arange(1, round(duration / SAMPLE_PERIOD_S) + 1) * SAMPLE_PERIOD_S
        self._ahead = _rows(
            [
                stopping_reference(s.position_rad, s.velocity_rad_s, times, float(times[-1]))
                for s in self.current
            ]
        )

    def advance(self) -> Sequence[Setpoint]:
        """The setpoints of the next sample."""
        if self.moving:
            following = next(self._ahead, None)
            if following is None:
                self.hold([setpoint.position_rad for setpoint in self.current])
            else:
                self.current = following
        return self.current


def within_limits(
    trajectory: Trajectory, rest_rad: Sequence[float], limits: Mapping[str, AxisLimits]
) -> bool:
    """Whether speed, and position with the way to a stop, stay inside the limits throughout."""
    for chunk in _chunks(trajectory, rest_rad):
        for axis, limit in zip(chunk, (limits[name] for name in trajectory.axes), strict=True):
            speed = np.abs(axis.velocity_rad_s)
            way = axis.velocity_rad_s * stop_duration_s(float(speed.max())) / 2.0
            farthest = np.maximum(np.abs(axis.position_rad), np.abs(axis.position_rad + way))
            if not (speed.max() <= limit.speed_rad_s and farthest.max() <= limit.travel_rad):
                return False
    return True


def _chunks(trajectory: Trajectory, rest_rad: Sequence[float]) -> Iterator[list[Reference]]:
    """The references of all axes, a stretch of time after the other."""
    first = -round(trajectory.lead_in_s / SAMPLE_PERIOD_S)
    last = round(trajectory.duration_s / SAMPLE_PERIOD_S)
    for start in range(first, last, _CHUNK):
        times = np.arange(start, min(start + _CHUNK, last)) * SAMPLE_PERIOD_S
        yield [
            reference(trajectory.axes[name], times, trajectory.lead_in_s, rest)
            for name, rest in zip(trajectory.axes, rest_rad, strict=True)
        ]


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
