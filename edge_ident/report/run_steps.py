"""What to do next after a run; the terminal and the page say the same."""

from typing import Final

from edge_ident.commissioning.gain_transfer import BACKUP_FILE
from edge_ident.commissioning.run import Ending, Outcome
from edge_ident.identification.result import AxisIdentification
from edge_ident.report.next_steps import blocking_steps, distinct, look_at

_VIRTUAL: Final = "virtual"
"""The device that ends with the command, and its gains with it."""


def run_steps(outcome: Outcome, device: str | None = None) -> list[str]:
    """After a run, of all axes: what to do with the gains, and where to look at the machine.

    Parameters
    ----------
    outcome : Outcome
    device : str, optional
        The board's, as --device names it.
    """
    axes = outcome.identification.axes
    if outcome.answer.ending is Ending.CONTRADICTORY:
        return distinct([step for axis in axes.values() for step in blocking_steps(axis.findings)])
    return [
        *(_look_at(name, outcome) for name in axes if _to_adjust(name, outcome)),
        _gains(outcome, device),
    ]


def axis_steps(axis: AxisIdentification, outcome: Outcome, device: str | None = None) -> list[str]:
    """After a run, of one axis."""
    if outcome.answer.ending is Ending.CONTRADICTORY:
        steps = blocking_steps(axis.findings)
        return steps or ["correct what is wrong on the other axis, then run again"]
    return [_gains(outcome, device)]


def _gains(outcome: Outcome, device: str | None) -> str:
    """What to do with gains that were designed."""
    change = outcome.change
    if change is None or change.dry_run:
        promise = None if change is None else change.promise
        if promise is not None and not promise.worth_a_write:
            return "nothing: the board's gains are as good"
        return "run it again without --dry-run to write these gains"
    if change.next_step:
        return change.next_step
    old = f"the old gains are in {BACKUP_FILE}"
    if device == _VIRTUAL:
        return f"run a virtual board that keeps its gains: edge-ident board --pty; {old}"
    if outcome.confirmed and not outcome.stored:
        where = f" --device {device}" if device else ""
        return f"keep the new gains over a power cycle: edge-ident gains store{where}; {old}"
    return f"nothing; {old}"


def _to_adjust(name: str, outcome: Outcome) -> bool:
    """Whether a diagnosis names a part of the machine, and no motion contradicts it."""
    found, change = outcome.identification.axes[name].diagnosis, outcome.change
    contradicted = change is not None and name in change.contradicted
    return found is not None and bool(found.causes) and not contradicted


def _look_at(name: str, outcome: Outcome) -> str:
    found = outcome.identification.axes[name].diagnosis
    assert found is not None
    return f"{look_at(name, found.causes)}; the page of the run says why"
