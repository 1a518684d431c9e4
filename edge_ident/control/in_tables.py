"""Effort that repeats over speed and stroke, in the curve and the tables of the board's law.

They may hold named effects already. Then what repeats is added on their grid: the law is straight
between entries. It fades out with the speed as they do (`edge_ident.control.law_terms`), and no
entry goes beyond what the board takes.
"""

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from edge_ident.control.law_terms import table_fade_speed
from edge_ident.control.position_loop import LoopHardware
from edge_ident.model.repeating import Repeating
from firmware_interface.gains import FRICTION_ENTRIES, TABLE_ENTRIES, AxisGains

Array = NDArray[np.float64]

_CURVE, _TABLES = "friction_forward", "load_table"
"""Fields of the law, by which its curve and its tables are known."""


def with_repeating(
    gains: AxisGains, repeating: Repeating, hardware: LoopHardware, late_s: float
) -> tuple[AxisGains, list[str]]:
    """Gains with what repeats, and what became of it, a sentence each.

    Parameters
    ----------
    gains : AxisGains
    repeating : Repeating
    hardware : LoopHardware
    late_s : float
        From a sample to the middle of the period in which its effort acts.
    """
    forward, backward, load, friction = repeating.tables
    said = []
    if _CURVE in hardware.law and (forward.any() or backward.any()):
        gains = _in_curve(gains, repeating, hardware)
        said.append(f"friction over speed, up to {max(map(abs, [*forward, *backward])):.2g} N·m")
    if _TABLES in hardware.law and (load.any() or friction.any()):
        gains = _in_tables(gains, repeating, hardware, late_s)
        said.append(f"effort over position, up to {max(map(abs, [*load, *friction])):.2g} N·m")
    return gains, said


def _in_curve(gains: AxisGains, repeating: Repeating, hardware: LoopHardware) -> AxisGains:
    used = any((*gains.friction_forward, *gains.friction_backward))
    top = gains.friction_top_speed_rad_s if used else repeating.grid.top_speed
    apart = math.sqrt(top / repeating.grid.top_speed)
    nodes = apart * np.arange(FRICTION_ENTRIES, dtype=np.float64)
    forward, backward, *_ = repeating.tables
    return replace(
        gains,
        friction_top_speed_rad_s=top,
        friction_forward=_added(gains, "friction_forward", forward, nodes, hardware),
        friction_backward=_added(gains, "friction_backward", backward, nodes, hardware),
    )


def _in_tables(
    gains: AxisGains, repeating: Repeating, hardware: LoopHardware, late_s: float
) -> AxisGains:
    used = any((*gains.load_table, *gains.local_friction_table))
    start, step = repeating.grid.start, repeating.grid.step
    if used:
        start, step = gains.table_start_rad, gains.table_step_rad
    at = start + step * np.arange(TABLE_ENTRIES, dtype=np.float64)
    nodes = (at - repeating.grid.start) / repeating.grid.step
    *_, load, friction = repeating.tables
    changed = replace(
        gains,
        table_start_rad=start,
        table_step_rad=step,
        load_table=_added(gains, "load_table", load, nodes, hardware),
        local_friction_table=_added(gains, "local_friction_table", friction, nodes, hardware),
    )
    tables = np.array([changed.load_table, changed.local_friction_table])
    fade = min(table_fade_speed(table, step, late_s) for table in tables)
    if hardware.gain_maximum is not None:
        fade = min(fade, hardware.gain_maximum.table_fade_speed_rad_s)
    return replace(changed, table_fade_speed_rad_s=min(fade, repeating.grid.top_speed))


def _added(
    gains: AxisGains, name: str, entries: Array, nodes: Array, hardware: LoopHardware
) -> tuple[float, ...]:
    """A table of the law with entries that lie elsewhere."""
    found = np.array(getattr(gains, name)) + np.interp(
        nodes, np.arange(len(entries), dtype=np.float64), entries, left=0.0, right=0.0
    )
    if hardware.gain_maximum is not None:
        most = np.array(getattr(hardware.gain_maximum, name))
        found = np.clip(found, -most, most)
    return tuple(found.tolist())
