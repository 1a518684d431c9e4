"""Simulates batches of drives with hidden faults, and measures how far each fault shows."""

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from functools import cache, lru_cache
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.signals.conditioning import choose_cutoff, filtered_regressor
from edge_ident.signals.filters import lowpass
from edge_ident.signals.recording import AxisRecord, Recording
from tests.plant import (
    COUNT_RAD,
    EFFECTS,
    UNKNOWN,
    Effect,
    Noise,
    Recordings,
    draw,
    draw_drives,
    simulate,
)
from tools.diagnosis_benchmark.cases import BATCH_DRIVES, Batch, Case

Array = NDArray[np.float64]

AXES: Final = ("x", "z")
FOLDER: Final = Path(__file__).parents[2] / "runs" / "diagnosis_benchmark"
"""Simulated batches and results; git ignores it."""
_SMEARED_PERIODS: Final = 0.7
"""Cut-off periods around a reversal in which the filtered sign of the velocity is not judged."""


@dataclass(frozen=True)
class Hidden:
    """A simulated batch.

    Attributes
    ----------
    time_s : (N,) array
    counts : (B, A, N) array of int
        Of the encoder.
    effort : (B, A, N) array
    effort_shift_s : float
    truth : (B, A, 4) array
        Base parameters with what the effects change in these four themselves.
    axis : (B,) array of int
        The one that has the fault.
    shows : (B, K) array
        Variance that the base model leaves outside reversals with each fault alone, over that
        without; K faults in each drive.
    shows_sliding : (B, K) array
        The same outside standstills as well: an axis that sticks where it turns tells nothing
        until it has come loose.
    """

    time_s: Array
    counts: NDArray[np.int32]
    effort: NDArray[np.float32]
    effort_shift_s: Array
    truth: Array
    axis: NDArray[np.intp]
    shows: Array
    shows_sliding: Array

    def recording(self, row: int) -> Recording:
        """What the board of one drive recorded."""
        axes = {
            name: AxisRecord(COUNT_RAD * counts, effort.astype(np.float64), "rad", "N*m")
            for name, counts, effort in zip(AXES, self.counts[row], self.effort[row], strict=True)
        }
        return Recording(self.time_s, axes, f"drive {row}", float(self.effort_shift_s))


def faults(batch: Batch, only: int | None = None) -> list[Effect]:
    """All effects of a batch, each of size zero where it is not hidden.

    Parameters
    ----------
    only : int, optional
        Place in the drives' lists of faults: hide that one alone.
    """
    place = slice(None) if only is None else slice(only, only + 1)
    hidden = [names[place] for names in batch.hidden]
    drives = draw_drives(BATCH_DRIVES, batch.plant_seed)
    # all are drawn, so that an effect is the same whichever others act
    drawn = draw(
        (*EFFECTS, *UNKNOWN),
        drives,
        batch.reference,
        batch.plant_seed,
        strength=batch.strength,
        one_axis=True,
    )
    having = [np.array([[effect.name in names] for names in hidden]) for effect in drawn]
    return [
        replace(effect, size=batch.scale * effect.size * has)
        for effect, has in zip(drawn, having, strict=True)
        if has.any()
    ]


def fault_values(case: Case) -> list[str]:
    """Parameters of what is hidden in a case, one line for each fault, in the order of names."""
    axis = load_batch(case.batch).axis[case.row]
    lines = {}
    for effect in faults(case.batch):
        if effect.name in case.hidden:
            values = {field.name: getattr(effect, field.name) for field in fields(effect)}
            shown = [
                f"{name} {value[case.row, axis]:.4g}"
                for name, value in values.items()
                if np.shape(value) == effect.size.shape
            ]
            lines[effect.name] = f"{effect.name}: {', '.join(shown)}"
    return [lines[name] for name in case.hidden]


def simulate_batch(batch: Batch) -> None:
    """Simulate a batch unless it lies in the folder."""
    path = _path(batch)
    if path.is_file():
        return
    effects = faults(batch)
    made = _simulated(batch, effects)
    axis = sum((effect.hit for effect in effects), np.zeros((BATCH_DRIVES, 2))).argmax(axis=1)
    shows, shows_sliding = _shows(batch, made, axis)
    path.parent.mkdir(parents=True, exist_ok=True)
    part = path.with_suffix(".part.npz")
    np.savez(
        part,
        time_s=made.time_s,
        counts=np.round(made.position / COUNT_RAD).astype(np.int32),
        effort=made.effort.astype(np.float32),
        effort_shift_s=made.effort_shift_s,
        truth=made.truth,
        axis=axis,
        shows=shows,
        shows_sliding=shows_sliding,
    )
    part.replace(path)


@lru_cache(maxsize=4)
def load_batch(batch: Batch) -> Hidden:
    """A batch that was simulated."""
    with np.load(_path(batch), allow_pickle=False) as stored:
        return Hidden(**{name: stored[name] for name in stored.files})


def unexplained_variance(
    position: Array,
    effort: Array,
    period_s: float,
    shift_s: float,
    cutoff_hz: float,
    stands: NDArray[np.bool_] | None = None,
) -> float:
    """Variance of what a base model, fitted by least squares, leaves outside reversals.

    Parameters
    ----------
    position, effort : (N,) arrays
    shift_s : float
        From a stamp to the middle of the interval in which its effort acted.
    stands : (N,) array of bool, optional
        Standstills, to be left out as well.
    """
    columns = filtered_regressor(position, cutoff_hz, period_s)
    smooth = lowpass(effort, cutoff_hz, period_s, delay_s=shift_s)
    turns = np.diff(np.sign(columns[:, 1])) != 0
    if stands is not None:
        turns |= stands[:-1]
    width = int(np.ceil(_SMEARED_PERIODS / (cutoff_hz * period_s)))
    clear = np.convolve(turns, np.ones(2 * width + 1), "same")[: len(effort) - 1] < 0.5
    clear[:width] = clear[-width:] = False
    kept, wanted = columns[:-1][clear], smooth[:-1][clear]
    solved = np.linalg.lstsq(kept, wanted, rcond=None)[0]
    return float(np.mean((wanted - kept @ solved) ** 2))


def _simulated(batch: Batch, effects: Sequence[Effect]) -> Recordings:
    return simulate(
        draw_drives(BATCH_DRIVES, batch.plant_seed),
        batch.reference,
        effects=effects,
        noise=Noise(batch.noise),
        seed=batch.plant_seed,
    )


def _shows(batch: Batch, made: Recordings, axis: NDArray[np.intp]) -> tuple[Array, Array]:
    """How far each fault alone shows, (B, K): outside reversals, and outside standstills too."""
    count = len(batch.hidden[0])
    if count == 0:
        return np.ones((BATCH_DRIVES, 0)), np.ones((BATCH_DRIVES, 0))
    sound = _simulated(batch, [])
    alone = [made] if count == 1 else [_simulated(batch, faults(batch, k)) for k in range(count)]
    period_s = float(made.time_s[1] - made.time_s[0])
    shows, shows_sliding = np.empty((2, BATCH_DRIVES, count))
    for row, hit in enumerate(axis):
        cutoff_hz = choose_cutoff(sound.position[row, hit], period_s)
        for ratios, sliding in ((shows, False), (shows_sliding, True)):
            left = [
                unexplained_variance(
                    one.position[row, hit],
                    one.effort[row, hit],
                    period_s,
                    one.effort_shift_s,
                    cutoff_hz,
                    one.true_velocity[row, hit] == 0.0 if sliding else None,
                )
                for one in (sound, *alone)
            ]
            ratios[row] = np.array(left[1:]) / left[0]
    return shows, shows_sliding


def _path(batch: Batch) -> Path:
    key = hashlib.sha256(f"{batch} {_plant_version()}".encode()).hexdigest()[:12]
    return FOLDER / f"{batch.kind}_{batch.motion}_{batch.seed}_{batch.number}_{key}.npz"


@cache
def _plant_version() -> str:
    """Changes with any file of the plant, or with what makes the cases."""
    here, plant = Path(__file__).parent, Path(__file__).parents[2] / "tests" / "plant"
    sources = [*sorted(plant.glob("*.py")), here / "cases.py", here / "hiding.py"]
    return hashlib.sha256(b"".join(path.read_bytes() for path in sources)).hexdigest()
