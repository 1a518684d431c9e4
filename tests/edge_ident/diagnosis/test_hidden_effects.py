"""Faults hidden in drives of a simulation that knows no effect file: what must be said of them.

Effects, strengths, drives, noise and the axis that is hit come from a seed taken blindly. A fault
shows if it at least doubles what the base model leaves, outside reversals, of the same drive with
the same noise; only those that show are asked for. `tools/diagnosis_benchmark` does the same to
hundreds of drives (docs/diagnosis.md), and `tests/accuracy/test_floors.py` on other motions.
The bounds here are looser: sixteen drives tell a broken diagnosis from a working one, no more.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import pytest
from numpy.typing import NDArray

from edge_ident.diagnosis.diagnose import diagnose
from edge_ident.diagnosis.result import AxisDiagnosis, Verdict
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
    multisine,
    simulate,
)
from tools.diagnosis_benchmark.hiding import AXES
from tools.diagnosis_benchmark.measuring import unexplained_variance
from tools.diagnosis_benchmark.outcome import SHOWS, Named, all_named, mean_parameters, named_in

Array = NDArray[np.float64]

SEED = 1
PAIR, FAINT, CLEAN = 5, 3, 2  # drives of each kind
SINGLES = slice(0, len(EFFECTS))
PAIRS = slice(SINGLES.stop, SINGLES.stop + PAIR)
UNKNOWNS = slice(PAIRS.stop, PAIRS.stop + len(UNKNOWN))
FAINTS = slice(UNKNOWNS.stop, UNKNOWNS.stop + FAINT)
CLEANS = slice(FAINTS.stop, FAINTS.stop + CLEAN)


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
    """Drives simulated together, each with its own faults on one random axis."""

    def __init__(
        self, motion: Motion, hidden: Sequence[tuple[str, ...]], strength: Array, seed: int
    ) -> None:
        self._motion, self._hidden, self._seed = motion, hidden, seed
        self._drives = draw_drives(len(hidden), seed)
        names = [name for name in (*EFFECTS, *UNKNOWN) if any(name in some for some in hidden)]
        self._faults = draw(
            names, self._drives, motion, seed, strength=strength[:, None], one_axis=True
        )
        self._made, self._sound = self._simulate(hidden), self._simulate([()] * len(hidden))
        pairs = [names if len(names) == 2 else () for names in hidden]
        self._alone = [
            self._simulate([names[place : place + 1] for names in pairs])
            for place in range(2)
            if any(pairs)
        ]
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


@pytest.fixture(scope="module")
def batch() -> Batch:
    """On a multisine: each effect, pairs of effects, each unknown, faint effects, and nothing."""
    rng = np.random.default_rng(SEED)
    some = rng.permutation(EFFECTS).tolist()
    hidden: list[tuple[str, ...]] = [(name,) for name in EFFECTS]
    hidden += list(zip(some[:PAIR], some[PAIR : 2 * PAIR], strict=True))
    hidden += [(name,) for name in UNKNOWN]
    hidden += [(name,) for name in some[2 * PAIR : 2 * PAIR + FAINT]]
    hidden += [()] * CLEAN
    strength = rng.uniform(0.6, 1.0, len(hidden))
    strength[PAIRS] = rng.uniform(0.8, 1.0, PAIR)
    strength[FAINTS] = 0.0
    return Batch(multisine(5000, SEED), hidden, strength, SEED)


@pytest.fixture(scope="module")
def singles(batch: Batch) -> list[Drive]:
    """Of one drive with each effect, those in which it shows."""
    return batch.shown(SINGLES)


def test_an_effect_that_shows_is_named(singles: list[Drive]) -> None:
    assert len(singles) >= 10
    assert np.mean([drive.right for drive in singles]) >= 0.85, report(singles)


def test_the_whole_verdict_is_exact(singles: list[Drive]) -> None:
    assert np.mean([drive.exact for drive in singles]) >= 0.8, report(singles)


def test_the_extension_takes_the_bias_out_of_the_base_parameters(singles: list[Drive]) -> None:
    before = [drive.errors(drive.faulty.base.estimate.parameters) for drive in singles]
    after = [
        drive.errors(mean_parameters(drive.faulty.model, drive.duration_s)) for drive in singles
    ]
    left = np.median(after, axis=0) / np.median(before, axis=0)
    # several effects hardly touch the inertia: what is left of that bias is noise
    assert np.all(left <= [1 / 2, 1 / 3, 1 / 3]), left


def test_two_effects_on_one_axis_are_both_named(batch: Batch) -> None:
    shown = batch.shown(PAIRS)
    assert len(shown) >= 2
    missed = [drive for drive in shown if not all_named(drive.hidden, drive.causes)]
    assert len(missed) <= len(shown) / 4, report(missed)


def test_a_disturbance_that_nothing_known_explains_is_not_explained(batch: Batch) -> None:
    shown = batch.shown(UNKNOWNS)
    assert shown
    assert all(drive.faulty.verdict == Verdict.UNEXPLAINED for drive in shown), report(shown)
    assert not any(cause.confident for drive in shown for cause in drive.causes), report(shown)


def test_an_effect_below_the_noise_draws_no_false_name(batch: Batch) -> None:
    faint = batch.diagnosed(FAINTS)
    wrong = [d for d in faint if not all(cause.meets(d.hidden[0]) for cause in d.causes)]
    assert not wrong, report(wrong)


def test_a_sound_drive_is_adequate(batch: Batch) -> None:
    one = [drive.faulty for drive in batch.diagnosed(CLEANS)]
    for axis in (*one, *batch.sound(CLEANS)):
        assert axis.verdict == Verdict.ADEQUATE
        assert axis.causes == ()


def report(drives: Sequence[Drive]) -> str:
    """What was hidden and what was said, for the message of a failed test."""
    return "; ".join(
        f"{' + '.join(d.hidden)}: {d.faulty.verdict}, {' + '.join(map(str, d.causes)) or 'nothing'}"
        for d in drives
    )
