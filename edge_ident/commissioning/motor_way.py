"""Where gains with a term for play want the motor, which an encoder on it can judge.

Such gains let the motor lead its reference by half the gap, so that the load follows. The encoder
sits on the motor. So two motions are compared by how well the motor kept to the way that it was to
take. Whether the load follows better only a scale or a dial gauge at the load can show.
"""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from edge_ident.control.gain_design import GainDesign
from edge_ident.signals.recording import AxisRecord, Recording
from firmware_interface.gains import AxisGains, Bank
from firmware_interface.law_memory import Memory


def of_motor(recording: Recording, gains: Bank) -> Recording:
    """The recording with the way of the motor for its reference.

    Parameters
    ----------
    recording : Recording
        Of a motion with these gains, which began long enough before it for the play to be on the
        side that the motion goes to.
    gains : mapping of axis name to AxisGains
    """
    return replace(
        recording,
        axes={axis: _led(record, gains[axis]) for axis, record in recording.axes.items()},
    )


def _led(record: AxisRecord, gains: AxisGains) -> AxisRecord:
    if record.reference is None or "backlash" not in gains.terms:
        return record
    way = np.concatenate([record.reference[:1], record.reference])
    steps = np.diff(way)
    moves = steps[steps != 0.0]
    side = float(np.sign(moves[0])) if len(moves) else 0.0
    start = Memory(backlash_rad=side * gains.backlash_offset_rad)
    return replace(record, reference=record.reference + start.along(gains, way).backlash_rad)


def unseen_load(designs: Mapping[str, GainDesign]) -> str:
    """What an outcome must add where gains make up for play; empty where none do."""
    axes = [name for name, found in designs.items() if "backlash" in found.gains.terms]
    if not axes:
        return ""
    return (
        f"; axis {', '.join(axes)}: this compares the motor with its way, which leads by half the "
        "play; whether the load follows better, the encoder on the motor cannot show"
    )
