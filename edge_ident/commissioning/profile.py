"""What a latency profile says: percentiles of every stage, and whether the target is met."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np

from edge_ident.estimation.manifest import Graph, Variant

TARGET_MS: Final = 1000.0
"""From the last captured sample to gains committed and read back."""


@dataclass(frozen=True)
class Spread:
    """Percentiles of a stage's time, ms."""

    p50: float
    p95: float
    p99: float
    maximum: float


@dataclass(frozen=True)
class ProfileRun:
    """All repetitions of one start and precision: times by stage, ms.

    Attributes
    ----------
    graph : {"rank_one", "image"}
        That this machine runs faster.
    """

    start: Literal["warm", "cold"]
    precision: Variant
    graph: Graph
    stages_ms: Mapping[str, list[float]]


@dataclass(frozen=True)
class Profile:
    """All that was measured on one machine with one board.

    Attributes
    ----------
    tail_ms : float
        Board time from the last captured sample to the last page in hand.
    stop_ms : float
        From the last page in hand to the machine at rest, after which gains may be committed.
    """

    device: str
    machine: str
    repetitions: int
    tail_ms: float
    stop_ms: float
    runs: tuple[ProfileRun, ...]

    @property
    def network_medians_ms(self) -> dict[Variant, float]:
        """Median time of the warm network, by precision."""
        warm = [run for run in self.runs if run.start == "warm"]
        return {run.precision: spread(run.stages_ms["network"]).p50 for run in warm}

    @property
    def faster_precision(self) -> Variant:
        """The network to prefer on this machine."""
        medians = self.network_medians_ms
        return min(medians, key=lambda precision: medians[precision])

    def within_target(self, run: ProfileRun) -> bool:
        """Whether tail and stop, then 99 of 100 repetitions, take less than the target."""
        return self.tail_ms + self.stop_ms + spread(run.stages_ms["total"]).p99 < TARGET_MS

    @property
    def verdict(self) -> str:
        """One sentence against the target."""
        warm = [run for run in self.runs if run.start == "warm"]
        worst = max(spread(run.stages_ms["total"]).p99 for run in warm)
        medians = self.network_medians_ms.values()
        met = all(self.within_target(run) for run in warm)
        return (
            f"sub-second target {'met' if met else 'missed'}: 99 % of warm repetitions take "
            f"at most {worst:.0f} ms, the tail of the capture before them {self.tail_ms:.0f} ms "
            f"and the stop {self.stop_ms:.0f} ms; "
            f"{self.faster_precision} is the faster network here, "
            f"by {1.0 - min(medians) / max(medians):.0%}"
        )


def spread(times_ms: list[float]) -> Spread:
    """Percentiles of measured times; nothing is left out."""
    p50, p95, p99 = np.percentile(times_ms, [50, 95, 99])
    return Spread(float(p50), float(p95), float(p99), float(np.max(times_ms)))
