"""Faults that were hidden in a virtual drive: what they are in truth."""

import dataclasses
from collections.abc import Sequence
from typing import Any

from edge_ident.commissioning import Fault


def fault_documents(faults: Sequence[Fault]) -> list[dict[str, Any]]:
    """Field `hidden` of a document."""
    return [{**dataclasses.asdict(fault), "values": dict(fault.values)} for fault in faults]


def fault_lines(faults: Sequence[Fault]) -> list[str]:
    """One line for each fault."""
    return [f"hidden in {fault.axis}: {fault.effect}, {_size(fault)}" for fault in faults]


def _size(fault: Fault) -> str:
    """Size of a fault as it was given, and in its unit where that is another."""
    given = f"{fault.strength:.3g} {fault.measure}"
    if fault.unit in (fault.measure, "1"):
        return given
    return f"{given} ({fault.size:.3g} {fault.unit.replace('*', '·')})"
