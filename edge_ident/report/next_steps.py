"""What to do next after an identification.

Each step is one line, without a capital letter and without a full stop, as in a finding.
"""

from collections.abc import Iterable
from typing import Final

from edge_ident.identification.result import AxisIdentification, Identification

MOST: Final = 3
"""Steps for one axis; more would hide the first."""
DESIGN_GAINS: Final = "edge-ident gains designs gains from this recording"


def blocking_steps(axis: AxisIdentification) -> list[str]:
    """What makes an axis trusted that is not."""
    return [finding.next_step for finding in axis.findings if finding.blocks][:MOST]


def identification_steps(found: Identification) -> list[str]:
    """After an identification: what the findings of its axes ask for; none where all is well."""
    steps = [step for axis in found.axes.values() for step in blocking_steps(axis)]
    steps += [
        finding.next_step
        for axis in found.axes.values()
        for finding in axis.findings
        if finding.code == "extended_model" and axis.trusted
    ]
    return distinct(steps)


def distinct(steps: Iterable[str]) -> list[str]:
    """Each step once, in their order; empty ones are none."""
    return list(dict.fromkeys(filter(None, steps)))
