"""What a latency profile says: percentiles of every stage, and whether the target is met."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final, Literal

import numpy as np

from edge_ident.estimation.manifest import Graph, Variant

TARGET_MS: Final = 1000.0
"""Target for the time from the last captured sample to gains committed and read back."""


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
        From the last page in hand to the machine at rest, for which gains have to wait unless the
        board takes them while its control law acts.
    ways_ms : mapping of way to list of float
        From the last captured sample to gains read back, after motions of their own: committed
        `at_rest` and, where the board can, while it is `running`.
    """

    device: str
    machine: str
    repetitions: int
    tail_ms: float
    stop_ms: float
    runs: tuple[ProfileRun, ...]
    ways_ms: Mapping[str, list[float]] = field(default_factory=dict)

    @property
    def awaited_stop_ms(self) -> float:
        """The stop, where gains have to wait for it."""
        return 0.0 if "running" in self.ways_ms else self.stop_ms

    @property
    def ways(self) -> str:
        """One sentence about the ways."""
        if "running" not in self.ways_ms:
            return "this board takes gains at rest only"
        stop, running = (spread(self.ways_ms[way]).p50 for way in ("at_rest", "running"))
        return (
            f"last sample to gains read back: {stop:.0f} ms with the stop, {running:.0f} ms "
            f"without (p50 of {len(self.ways_ms['running'])}), {stop / running:.2f} times as fast"
        )

    @property
    def network_medians_ms(self) -> dict[Variant, float]:
        """Median time of the warm network, by precision; none where no network fits the drive."""
        warm = [run for run in self.runs if run.start == "warm" and "network" in run.stages_ms]
        return {run.precision: spread(run.stages_ms["network"]).p50 for run in warm}

    @property
    def faster_precision(self) -> Variant | None:
        """The network to prefer on this machine; None where none fits the drive."""
        medians = self.network_medians_ms
        return min(medians, key=lambda precision: medians[precision], default=None)

    def within_target(self, run: ProfileRun) -> bool:
        """Whether tail and awaited stop, then 99 of 100 repetitions, take less than the target."""
        return self.tail_ms + self.awaited_stop_ms + spread(run.stages_ms["total"]).p99 < TARGET_MS

    @property
    def verdict(self) -> str:
        """One sentence against the target."""
        warm = [run for run in self.runs if run.start == "warm"]
        worst = max(spread(run.stages_ms["total"]).p99 for run in warm)
        medians = self.network_medians_ms.values()
        met = all(self.within_target(run) for run in warm)
        networks = (
            f"{self.faster_precision} is the faster network here, "
            f"by {1.0 - min(medians) / max(medians):.0%}"
            if medians
            else "no network fits this drive"
        )
        return (
            f"sub-second target {'met' if met else 'missed'}: 99 % of warm repetitions take "
            f"at most {worst:.0f} ms, the tail of the capture before them {self.tail_ms:.0f} ms "
            f"and the stop that they wait for {self.awaited_stop_ms:.0f} ms; {networks}"
        )


def spread(times_ms: list[float]) -> Spread:
    """Percentiles of measured times; nothing is left out."""
    p50, p95, p99 = np.percentile(times_ms, [50, 95, 99])
    return Spread(float(p50), float(p95), float(p99), float(np.max(times_ms)))
