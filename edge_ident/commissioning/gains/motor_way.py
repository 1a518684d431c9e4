"""Where gains with a term for play want the motor, which an encoder on it can judge.

Such gains let the motor lead its reference by half the gap, so that the load follows. The encoder
sits on the motor. So two motions are compared by how well the motor kept to the way that it was to
take. Whether the load follows better only a scale or a dial gauge at the load can show.
"""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from edge_ident.commissioning.motion.recorded_motion import RecordedMotion
from edge_ident.control.gain_design import GainDesign
from edge_ident.signals.recording import AxisRecord, Recording
from firmware_interface.gains import AxisGains, Bank
from firmware_interface.law_memory import NOTHING, Memory
from firmware_interface.motion import Trajectory

Array = NDArray[np.float64]


def of_motor(recording: Recording, gains: Bank, trajectory: Trajectory) -> Recording:
    """The recording with the way of the motor for its reference.

    Parameters
    ----------
    recording : Recording
        Of a motion with these gains.
    gains : mapping of axis name to AxisGains
    trajectory : Trajectory
        Of the motion: its way in decides on which side of the play the recording begins.
    """
    if not any("backlash" in of_axis.terms for of_axis in gains.values()):
        return recording
    moved = RecordedMotion.along(recording, trajectory)
    ways_in = {axis: way.position_rad[: moved.begin + 1] for axis, way in moved.references.items()}
    axes = {
        axis: _led(record, gains[axis], ways_in[axis]) for axis, record in recording.axes.items()
    }
    return replace(recording, axes=axes)


def _led(record: AxisRecord, gains: AxisGains, way_in_rad: Array) -> AxisRecord:
    if record.reference is None or "backlash" not in gains.terms:
        return record
    start = NOTHING.along(gains, way_in_rad).last
    return replace(record, reference=record.reference + lead_rad(gains, record.reference, start))


def lead_rad(gains: AxisGains, reference_rad: Array, start: Memory = NOTHING) -> Array:
    """How far the motor is to lead a reference (N,), whose first sample is where the law begins.

    Parameters
    ----------
    gains : AxisGains
    reference_rad : (N,) array
    start : Memory
        Of the law, before it.
    """
    way = np.concatenate([reference_rad[:1], reference_rad])
    return np.broadcast_to(start.along(gains, way).backlash_rad, reference_rad.shape)


def unseen_load(designs: Mapping[str, GainDesign]) -> str:
    """What an outcome must add where gains make up for play; empty where none do."""
    axes = [name for name, found in designs.items() if "backlash" in found.gains.terms]
    if not axes:
        return ""
    return (
        f"; axis {', '.join(axes)}: the error is that of the motor, which leads by half the play; "
        "its encoder cannot show whether the load follows better"
    )
