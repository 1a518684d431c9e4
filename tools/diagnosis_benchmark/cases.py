"""What is hidden where: batches of drives, reproducible from their names alone."""

from dataclasses import dataclass, fields, is_dataclass, replace
from functools import lru_cache
from typing import Any, Final, Self, TypeVar

import numpy as np
from numpy.typing import NDArray

from firmware_interface.plant import EFFECTS, UNKNOWN, Motion, multisine, paper, staircase

Drawn = TypeVar("Drawn")

SINGLE: Final = "single"
CLEAN: Final = "clean"
PAIRS: Final = "pairs"
UNKNOWN_KIND: Final = "unknown"
KINDS: Final = (SINGLE, CLEAN, PAIRS, UNKNOWN_KIND)
MOTIONS: Final = ("paper", "multisine", "staircase")
DRAWN: Final = 0.0
"""Noise: 0.5 to 4 % of the rms effort, drawn for every drive."""
BATCH_DRIVES: Final = 100
"""Simulated at once, about as many with each effect."""


@dataclass(frozen=True)
class Batch:
    """Drives that are simulated at once, every one with its own fault or none.

    Attributes
    ----------
    kind : str
        Of `KINDS`.
    motion : str
        Of `MOTIONS`.
    seed, number : int
        Seed of the whole benchmark and number of the batch in it.
    scale : float
        What the effects' sizes are multiplied by after they are drawn.
    noise : float
        Effort noise over rms effort; `DRAWN` for one of every drive's own.
    drives : int
        So many of those that are drawn, the first, are simulated.
    """

    kind: str
    motion: str
    seed: int
    number: int
    scale: float = 1.0
    noise: float = DRAWN
    drives: int = BATCH_DRIVES

    @property
    def plant_seed(self) -> int:
        """Of drives, effects, motions and noise; no other batch has it, but for scale and noise."""
        key = (self.seed, KINDS.index(self.kind), MOTIONS.index(self.motion), self.number)
        return int(np.random.SeedSequence(key).generate_state(1)[0])

    @property
    def hidden(self) -> list[tuple[str, ...]]:
        """Names of what is hidden in each drive."""
        rows = range(BATCH_DRIVES)
        if self.kind == SINGLE:
            return [(EFFECTS[row % len(EFFECTS)],) for row in rows]
        if self.kind == UNKNOWN_KIND:
            return [(UNKNOWN[row % len(UNKNOWN)],) for row in rows]
        if self.kind == PAIRS:
            rng = np.random.default_rng([self.plant_seed, 5])
            return [tuple(rng.choice(EFFECTS, 2, replace=False).tolist()) for _ in rows]
        return [() for _ in rows]

    @property
    def strength(self) -> NDArray[np.float64] | None:
        """Relative strength of the effects, (B, 1): of pairs not the faintest; None: any.

        Hardly any pair would show otherwise, as both must.
        """
        if self.kind != PAIRS:
            return None
        return np.random.default_rng([self.plant_seed, 7]).uniform(0.4, 1.0, (BATCH_DRIVES, 1))

    @property
    def reference(self) -> Motion:
        """A phase of the paper's motion, or a multisine, of its own for every drive."""
        return _reference(self.motion, self.plant_seed)

    def of_drives(self, drawn: Drawn) -> Drawn:
        """What was drawn for every drive, of those that are simulated.

        Parameters
        ----------
        drawn : array or dataclass
            Arrays have an axis of `BATCH_DRIVES`, or one value for all.
        """
        kept: Any = drawn
        if isinstance(drawn, np.ndarray):
            sizes = (self.drives if n == BATCH_DRIVES else n for n in drawn.shape)
            kept = drawn[tuple(map(slice, sizes))]
        elif is_dataclass(drawn) and not isinstance(drawn, type):
            parts = {item.name: self.of_drives(getattr(drawn, item.name)) for item in fields(drawn)}
            kept = replace(drawn, **parts)
        same: Drawn = kept
        return same

    @property
    def full_size(self) -> Self:
        """The same drives with their effects as drawn."""
        return replace(self, scale=1.0)


@dataclass(frozen=True)
class Case:
    """One drive of a batch; its name is kind/motion/seed/batch/drive/scale/noise."""

    batch: Batch
    row: int

    def __str__(self) -> str:
        b = self.batch
        return f"{b.kind}/{b.motion}/{b.seed}/{b.number}/{self.row}/{b.scale:g}/{b.noise:g}"

    @classmethod
    def parse(cls, name: str) -> Self:
        """The case of this name."""
        kind, motion, seed, number, row, scale, noise = name.split("/")
        batch = Batch(kind, motion, int(seed), int(number), float(scale), float(noise))
        return cls(batch, int(row))

    @property
    def hidden(self) -> tuple[str, ...]:
        """Names of what is hidden in it."""
        return self.batch.hidden[self.row]


def plan(
    kind: str, motion: str, drives: int, effects: tuple[str, ...], seed: int, noise: float
) -> list[Case]:
    """Cases at full size: so many drives for every effect, ten times as many of other kinds.

    Parameters
    ----------
    effects : tuple of str
        Those wanted; the cases are those that a run with all effects would have.
    """
    per_batch = BATCH_DRIVES // len(EFFECTS) if kind == SINGLE else BATCH_DRIVES
    wanted = drives if kind == SINGLE else 10 * drives
    cases = []
    for number in range(-(-wanted // per_batch)):
        rows = min(wanted - number * per_batch, per_batch) * BATCH_DRIVES // per_batch
        batch = Batch(kind, motion, seed, number, noise=noise, drives=rows)
        for row, hidden in enumerate(batch.hidden[:rows]):
            if set(hidden) <= set(effects) or kind == UNKNOWN_KIND:
                cases.append(Case(batch, row))
    return cases


@lru_cache(maxsize=1)
def _reference(motion: str, seed: int) -> Motion:
    rng = np.random.default_rng([seed, 6])
    if motion == "paper":
        return paper(phase_rad=rng.uniform(0, 2 * np.pi, BATCH_DRIVES))
    if motion == "staircase":
        return staircase()
    moves = [multisine(seed=int(one)) for one in rng.integers(0, 2**31, BATCH_DRIVES)]
    parts = ("position", "velocity", "acceleration")
    return Motion(motion, *(np.concatenate([getattr(m, part) for m in moves], 1) for part in parts))
