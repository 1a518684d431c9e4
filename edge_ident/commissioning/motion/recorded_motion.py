"""A motion that was recorded, together with where its axes should have been."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.errors import DataError
from edge_ident.model.motion import Motion
from edge_ident.signals.conditioning import choose_cutoff
from edge_ident.signals.filters import differentiate
from edge_ident.signals.recording import AxisRecord, Recording
from firmware_interface.motion import Multisine, Reference, Staircase, Trajectory, reference

Array = NDArray[np.float64]

_REMEMBERED_S: Final = 2.0
"""Last part of the lead-in that a loop may remember."""


@dataclass(frozen=True)
class RecordedMotion:
    """A motion that was recorded, and where its axes should have been.

    Attributes
    ----------
    recording : Recording
    references : mapping of axis name to Reference
        Where each axis should be: in the last part of the lead-in, then at the recording's samples.
    begin : int
        Samples of the lead-in.
    """

    recording: Recording
    references: Mapping[str, Reference]
    begin: int = 0

    @classmethod
    def along(cls, recording: Recording, trajectory: Trajectory) -> "RecordedMotion":
        """The beginning of a recording, as long as the trajectory that it follows."""
        wanted_s = trajectory.duration_s
        part = recording.time_s - recording.time_s[0] < wanted_s - 1e-9
        record = beginning(recording, int(np.sum(part)))
        period_s = _period_s(record)
        begin = int(min(trajectory.lead_in_s, _REMEMBERED_S) / period_s)
        time_s = period_s * np.arange(-begin, len(record.time_s))
        references = {
            name: reference(motion, time_s, trajectory.lead_in_s, _rest_rad(motion, axis))
            for name, motion in trajectory.axes.items()
            for axis in (record.axes[name],)
        }
        return cls(record, references, begin)

    @classmethod
    def of(cls, recording: Recording, axes: Sequence[str]) -> "RecordedMotion":
        """A recording whose trajectory is not known: its references, filtered.

        Raises
        ------
        DataError
            The recording lacks an axis.
        """
        references = {}
        for name in axes:
            if name not in recording.axes:
                raise DataError(
                    f"{recording.source}: it has axes {', '.join(recording.axes)}, not {name}",
                    "give a recording of this drive, or rename columns with --column",
                )
            axis, period_s = recording.axes[name], _period_s(recording)
            cutoff_hz = choose_cutoff(axis.position, period_s)
            references[name] = Reference(*differentiate(_wanted(axis), cutoff_hz, period_s))
        return cls(recording, references)

    @property
    def period_s(self) -> float:
        """Sampling period."""
        return _period_s(self.recording)

    def errors(self, name: str) -> Array:
        """Reference less position as recorded, (N,)."""
        axis = self.recording.axes[name]
        return np.asarray(_wanted(axis) - axis.position)

    def motions(self, cutoff_hz: float) -> dict[str, Motion]:
        """As the axes went, filtered, at the recording's samples."""
        period_s = _period_s(self.recording)
        return {
            name: Motion.known(
                self.recording.time_s, *differentiate(axis.position, cutoff_hz, period_s)
            )
            for name, axis in self.recording.axes.items()
        }

    def wanted_motions(self) -> dict[str, Motion]:
        """As the axes should go, the last part of the lead-in included."""
        period_s = _period_s(self.recording)
        return {
            name: Motion.known(
                np.asarray(
                    period_s * (np.arange(len(wanted.position_rad)) - self.begin), np.float64
                ),
                wanted.position_rad,
                wanted.velocity_rad_s,
                wanted.acceleration_rad_s2,
            )
            for name, wanted in self.references.items()
        }


def _rest_rad(motion: Multisine | Staircase, axis: AxisRecord) -> float:
    """Where the axis stood before: zero, unless the motion counts from there."""
    return float(_wanted(axis)[0]) if isinstance(motion, Staircase) else 0.0


def _wanted(axis: AxisRecord) -> Array:
    """Commanded position; where none was recorded, the axis is taken to have followed."""
    return axis.position if axis.reference is None else axis.reference


def _period_s(recording: Recording) -> float:
    return float(recording.time_s[-1] - recording.time_s[0]) / (len(recording.time_s) - 1)


def beginning(recording: Recording, samples: int) -> Recording:
    """The first samples of a board's recording."""
    axes = {
        name: replace(
            axis,
            position=axis.position[:samples],
            effort=axis.effort[:samples],
            reference=None if axis.reference is None else axis.reference[:samples],
            velocity=None,
            temperature_c=None,
        )
        for name, axis in recording.axes.items()
    }
    return replace(recording, time_s=recording.time_s[:samples], axes=axes)
