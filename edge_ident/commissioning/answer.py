"""The answer of a run: two questions, two verdicts, and the figures that everybody shows.

Are the parameters known? Are new gains safe, and better? Only the second decides about a write.
Terminal, page and JSON take both, and the errors before and after, from here.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import Self

import numpy as np

from edge_ident.commissioning.gains.outcome import GainChange
from edge_ident.commissioning.gains.verification import Tracking
from edge_ident.estimation.trust import WEAK, WEAK_LIMIT, Finding
from edge_ident.identification.result import Identification, known_sentence, worth_acting_on
from edge_ident.model.model import PARAMETERS, AxisModel, Model


class Ending(StrEnum):
    """What became of the machine."""

    BETTER = "better"
    """It follows better than before."""
    AS_WELL = "as_well_as_it_can"
    """Nothing better is promised, or no difference was measured."""
    FORECAST = "forecast"
    """Nothing was to be written."""
    TAKEN_BACK = "taken_back"
    """New gains did not follow better."""
    CONTRADICTORY = "contradictory_data"
    """The data contradict themselves: nothing follows from them."""

    @property
    def good(self) -> bool:
        """Whether the machine follows better than before, or as well as it can."""
        return self in (Ending.BETTER, Ending.AS_WELL, Ending.FORECAST)

    @property
    def spoken(self) -> str:
        """The verdict, as a label."""
        return {
            Ending.BETTER: "better",
            Ending.AS_WELL: "unchanged",
            Ending.FORECAST: "dry run",
            Ending.TAKEN_BACK: "taken back",
            Ending.CONTRADICTORY: "nothing written",
        }[self]


@dataclass(frozen=True)
class AxisAnswer:
    """Both verdicts on an axis.

    Attributes
    ----------
    model : AxisModel
        The axis as it is, from all motions; where none count, from the first.
    known, unknown : tuple of str
        Parameters whose intervals are worth acting on, and the others.
    tracking : Tracking or None
        With the gains of before and of now, on the motion of the identification; None where it was
        not moved with both.
    """

    model: AxisModel
    known: tuple[str, ...]
    unknown: tuple[str, ...]
    tracking: Tracking | None

    @property
    def sentence(self) -> str:
        """What is known, in words."""
        return known_sentence(self.known, self.unknown)

    def settles(self, finding: Finding) -> bool:
        """Whether all motions together show well what the first shows weakly."""
        estimate = self.model.estimate
        well = estimate.std <= WEAK_LIMIT * np.abs(estimate.parameters)
        return finding.code in {f"{WEAK}{PARAMETERS[i]}" for i in np.flatnonzero(well)}


@dataclass(frozen=True)
class RunAnswer:
    """Both verdicts on a machine."""

    ending: Ending
    axes: Mapping[str, AxisAnswer]

    @classmethod
    def of(cls, found: Identification, local: Model, change: GainChange | None) -> Self:
        """From what was identified, first and from all motions, and what became of new gains."""
        tracked = change.verification.axes if change is not None and change.verification else {}
        axes = {}
        for name, axis in found.axes.items():
            model = local.axes[name]
            both = dict(zip(PARAMETERS, worth_acting_on(model.estimate), strict=True))
            known = tuple(name for name, sure in both.items() if sure and axis.consistent)
            unknown = tuple(name for name in both if name not in known)
            axes[name] = AxisAnswer(model, known, unknown, tracked.get(name))
        return cls(_ending(change), axes)

    @property
    def known_everywhere(self) -> bool:
        """Whether every parameter of every axis is known."""
        return not any(axis.unknown for axis in self.axes.values())


def _ending(change: GainChange | None) -> Ending:
    if change is None:
        return Ending.CONTRADICTORY
    if change.dry_run:
        return Ending.FORECAST
    if change.unchanged:
        return Ending.AS_WELL
    if not change.confirmed:
        return Ending.TAKEN_BACK
    verified = change.verification
    return Ending.BETTER if verified and verified.verdict == "better" else Ending.AS_WELL
