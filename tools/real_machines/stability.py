"""Which causes stay when a recording is disturbed by less than its own noise."""

from dataclasses import dataclass
from typing import Final

from edge_ident.diagnosis.diagnose import diagnose
from edge_ident.signals.recording import Recording
from tools.real_machines.pairs import disturbed
from tools.real_machines.scores import described

SEEDS: Final = (1, 2, 3, 4)
"""One noisy copy each."""
NOISE: Final = 0.001
"""Rms of the added noise over that of the effort."""


@dataclass(frozen=True)
class Run:
    """What a diagnosis says of one axis of one copy.

    Attributes
    ----------
    copy, axis, verdict : str
    causes, suspected : tuple of str
        Described, strongest first.
    left : float
        Relative residual of the extended model.
    """

    copy: str
    axis: str
    verdict: str
    causes: tuple[str, ...]
    suspected: tuple[str, ...]
    left: float


def stability(recording: Recording) -> list[Run]:
    """Diagnose a recording as it is and disturbed."""
    copies = [recording, *disturbed(recording, SEEDS, NOISE)]
    return [run for copy in copies for run in _runs(copy)]


def _runs(recording: Recording) -> list[Run]:
    return [
        Run(
            recording.source,
            name,
            str(axis.verdict),
            described(axis.causes),
            described(axis.suspected),
            float(axis.extended.fitted),
        )
        for name, axis in diagnose([recording]).axes.items()
    ]
