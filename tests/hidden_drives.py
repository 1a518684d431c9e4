"""Drives of the independent plant that hide faults, and what a diagnosis says of each.

A fault shows if it at least doubles what the base model leaves, outside reversals, of the same
drive with the same noise; only those that show are asked for.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from edge_ident.diagnosis.diagnose import diagnose
from edge_ident.diagnosis.measures import Verdict
from edge_ident.diagnosis.result import AxisDiagnosis
from edge_ident.signals.conditioning import choose_cutoff
from edge_ident.signals.recording import AxisRecord, Recording
from firmware_interface.plant import (
    EFFECTS,
    SAMPLE_S,
    UNKNOWN,
    Motion,
    Recordings,
    draw,
    draw_drives,
    simulate,
)
from tools.diagnosis_benchmark.hiding import AXES
from tools.diagnosis_benchmark.measuring import unexplained_variance
from tools.diagnosis_benchmark.outcome import SHOWS, Named, all_named, named_in

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Drive:
    """A diagnosed drive.

    Attributes
    ----------
    hidden : tuple of str
    truth : (4,) array
        Base parameters of the axis that was hit.
    faulty : AxisDiagnosis
        Of the axis that was hit.
    duration_s : float
    """

    hidden: tuple[str, ...]
    truth: Array
    faulty: AxisDiagnosis
    duration_s: float

    @property
    def causes(self) -> tuple[Named, ...]:
        """What is named on the axis that was hit."""
        return named_in(self.faulty.causes)

    @property
    def right(self) -> bool:
        """Whether the first cause is a fault that was hidden."""
        return any(cause.meets(name) for cause in self.causes[:1] for name in self.hidden)

    @property
    def exact(self) -> bool:
        """Whether all that was hidden is named, nothing else, and the verdict says so."""
        complete = all_named(self.hidden, self.causes) and len(self.causes) == len(self.hidden)
        return complete and self.faulty.verdict == Verdict.EXPLAINED

    def errors(self, parameters: Array) -> Array:
        """Relative errors (3,) of inertia, viscous and Coulomb friction."""
        return (abs(parameters - self.truth) / abs(self.truth))[:3]


class Batch:
    """Drives simulated together, each with its own faults on one random axis.

    Parameters
    ----------
    motion : Motion
    hidden : sequence of tuple of str
        Names of the faults of each drive.
    strength : (B,) array
    seed : int
    asked : slice
        Drives whose faults act. The others are drawn too, or these would be other drives.
    """

    def __init__(
        self,
        motion: Motion,
        hidden: Sequence[tuple[str, ...]],
        strength: Array,
        seed: int,
        asked: slice = slice(None),
    ) -> None:
        self._motion, self._seed = motion, seed
        self._drives = draw_drives(len(hidden), seed)
        names = [name for name in (*EFFECTS, *UNKNOWN) if any(name in some for some in hidden)]
        self._faults = draw(
            names, self._drives, motion, seed, strength=strength[:, None], one_axis=True
        )
        acting = range(len(hidden))[asked]
        hidden = [names if row in acting else () for row, names in enumerate(hidden)]
        self._hidden = hidden
        self._made, self._sound = self._simulate(hidden), self._simulate([()] * len(hidden))
        hits = [self._hit(fault.name, hidden) & fault.hit for fault in self._faults]
        self._axis = np.argmax(np.any(hits, axis=0), axis=1).tolist()

    def diagnosed(self, rows: slice) -> list[Drive]:
        """Diagnose the axis that was hit of some of the drives."""
        return [self._diagnosed(row) for row in self._rows(rows)]

    def shown(self, rows: slice) -> list[Drive]:
        """The same of those in which every fault alone shows."""
        return [self._diagnosed(row) for row in self._rows(rows) if self._shows(row)]

    def sound(self, rows: slice) -> list[AxisDiagnosis]:
        """Diagnose the axis that was left alone."""
        return [self._axis_diagnosis(row, 1 - self._axis[row]) for row in self._rows(rows)]

    @cached_property
    def _alone(self) -> list[Recordings]:
        """Each of two faults without the other."""
        pairs = [names if len(names) == 2 else () for names in self._hidden]
        return [self._simulate([names[k : k + 1] for names in pairs]) for k in range(2)]

    def _rows(self, rows: slice) -> range:
        return range(len(self._hidden))[rows]

    def _diagnosed(self, row: int) -> Drive:
        hit = self._axis[row]
        return Drive(
            self._hidden[row],
            self._made.truth[row, hit],
            self._axis_diagnosis(row, hit),
            float(self._made.time_s[-1]),
        )

    def _axis_diagnosis(self, row: int, axis: int) -> AxisDiagnosis:
        made = self._made
        axes = {
            name: AxisRecord(made.position[row, k], made.effort[row, k], "rad", "N*m")
            for k, name in enumerate(AXES)
        }
        recording = Recording(made.time_s, axes, f"drive {row}", float(made.effort_shift_s[row]))
        return diagnose([recording], only=(AXES[axis],)).axes[AXES[axis]]

    def _shows(self, row: int) -> bool:
        hit = self._axis[row]
        alone = self._alone if len(self._hidden[row]) == 2 else [self._made]
        cutoff_hz = choose_cutoff(self._sound.position[row, hit], SAMPLE_S)
        left, *others = (
            unexplained_variance(
                made.position[row, hit],
                made.effort[row, hit],
                SAMPLE_S,
                float(made.effort_shift_s[row]),
                cutoff_hz,
            )
            for made in (self._sound, *alone)
        )
        return all(other >= SHOWS * left for other in others)

    @staticmethod
    def _hit(name: str, hidden: Sequence[tuple[str, ...]]) -> NDArray[np.bool_]:
        return np.array([[name in names] for names in hidden])

    def _simulate(self, hidden: Sequence[tuple[str, ...]]) -> Recordings:
        """Hide faults; noise of 0.5 to 3 % of the effort, the same whatever is hidden."""
        masked = [replace(f, size=f.size * self._hit(f.name, hidden)) for f in self._faults]
        faults = [fault for fault in masked if fault.hit.any()]
        made = simulate(self._drives, self._motion, effects=faults, steps_per_sample=5)
        rng = np.random.default_rng([self._seed, 8])
        scale = np.sqrt((made.effort**2).mean(axis=-1, keepdims=True))
        share = rng.uniform(0.005, 0.03, (len(hidden), 1, 1))
        noise = share * scale * rng.standard_normal(made.effort.shape)
        return replace(made, effort=made.effort + noise)


def report(drives: Sequence[Drive]) -> str:
    """What was hidden and what was said, for the message of a failed test."""
    return "; ".join(
        f"{' + '.join(d.hidden)}: {d.faulty.verdict}, {' + '.join(map(str, d.causes)) or 'nothing'}"
        for d in drives
    )
