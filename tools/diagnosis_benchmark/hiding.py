"""Simulates batches of drives with hidden faults, and measures how far each fault shows."""

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from functools import cache, lru_cache
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.signals.recording import AxisRecord, Recording
from firmware_interface.plant import (
    EFFECTS,
    UNKNOWN,
    Effect,
    Electronics,
    Noise,
    Recordings,
    Twin,
    draw,
    draw_drives,
    draw_electronics,
    draw_noise,
    simulate,
)
from firmware_interface.plant.drives import LEAD
from firmware_interface.plant.electric_effects import RecordDelay
from firmware_interface.plant.plant import STEPS_PER_SAMPLE
from tools.diagnosis_benchmark.cases import BATCH_DRIVES, DRAWN, Batch, Case
from tools.diagnosis_benchmark.measuring import ABOVE_BAND, added_share, variance_ratio
from tools.diagnosis_benchmark.reach import MeasurementNoise, Trace

Array = NDArray[np.float64]

AXES: Final = ("x", "z")
FOLDER: Final = Path(__file__).parents[2] / "runs" / "diagnosis_benchmark"
"""Simulated batches and results; git ignores it."""


@dataclass(frozen=True)
class Hidden:
    """A simulated batch.

    Attributes
    ----------
    time_s : (N,) array
    counts : (B, A, N) array of int
        Of the encoder.
    count_rad : (B, A) array
    effort : (B, A, N) array
    effort_shift_s : (B,) array
        From a stamp to the middle of the period in which its effort acts. The recording, as most
        files, does not state it.
    truth : (B, A, 4) array
        Base parameters with what the effects change in these four themselves.
    axis : (B,) array of int
        The one that has the fault.
    shows : (B, K) array
        Variance that the base model leaves outside reversals with each fault alone, over that
        without; K faults in each drive.
    share : (B, K) array
        Rms of what each fault alone adds that the base model cannot express, over the rms effort.
    added : (B, K, N) array
        What each fault alone adds at every sample, beyond the nearest sound drive.
    detectability : (B, K) array
        Of each fault alone: mean of the ideal test's statistic, in its standard deviations.
    """

    time_s: Array
    counts: NDArray[np.int32]
    count_rad: Array
    effort: NDArray[np.float32]
    effort_shift_s: Array
    truth: Array
    axis: NDArray[np.intp]
    shows: Array
    share: Array
    added: NDArray[np.float32]
    detectability: Array

    def recording(self, row: int) -> Recording:
        """What the board of one drive recorded, as in a CSV file."""
        axes = {
            name: AxisRecord(step * counts, effort.astype(np.float64), "rad", "N*m")
            for name, step, counts, effort in zip(
                AXES, self.count_rad[row], self.counts[row], self.effort[row], strict=True
            )
        }
        return Recording(self.time_s, axes, f"drive {row}")


def recording_of(made: Recordings, drive: int) -> Recording:
    """What one of some simulated drives recorded; it states when the effort acts."""
    axes = {
        name: AxisRecord(made.position[drive, axis], made.effort[drive, axis], "rad", "N*m")
        for axis, name in enumerate(AXES)
    }
    return Recording(made.time_s, axes, f"drive {drive}", float(made.effort_shift_s[drive]))


def faults(batch: Batch, only: int | None = None) -> list[Effect]:
    """All effects of a batch, each of size zero where it is not hidden, on its drives.

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
    hidden_effects = [
        replace(effect, size=batch.scale * effect.size * has)
        for effect, has in zip(drawn, having, strict=True)
        if has.any()
    ]
    hidden_effects = [batch.of_drives(effect) for effect in hidden_effects]
    shift_s = _boards(batch).effort_shift_s
    return [
        e.beyond(shift_s) if isinstance(e, RecordDelay) else e
        for e in hidden_effects
        if e.hit.any()
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
    shape = batch.drives, len(AXES)
    count_rad = np.broadcast_to(_boards(batch).count_rad, shape)
    axis = sum((effect.hit for effect in effects), np.zeros(shape)).argmax(axis=1)
    count = len(batch.hidden[0])
    alone = [_simulated_beside(batch, faults(batch, place), axis) for place in range(count)]
    made = alone[0][0] if count == 1 else _simulated(batch, effects)
    measured = _measured(batch, alone, axis, len(made.time_s))
    path.parent.mkdir(parents=True, exist_ok=True)
    part = path.with_suffix(".part.npz")
    np.savez(
        part,
        time_s=made.time_s,
        counts=np.round(made.position / count_rad[..., None]).astype(np.int32),
        count_rad=count_rad,
        effort=made.effort.astype(np.float32),
        effort_shift_s=made.effort_shift_s,
        truth=made.truth,
        axis=axis,
        shows=measured["shows"],
        share=measured["share"],
        added=measured["added"].astype(np.float32),
        detectability=measured["detectability"],
    )
    part.replace(path)


@lru_cache(maxsize=4)
def load_batch(batch: Batch) -> Hidden:
    """A batch that was simulated."""
    with np.load(_path(batch), allow_pickle=False) as stored:
        return Hidden(**{name: stored[name] for name in stored.files})


def _simulated(batch: Batch, effects: Sequence[Effect], twin: Twin | None = None) -> Recordings:
    drawn = draw_noise(BATCH_DRIVES, batch.plant_seed)
    return simulate(
        batch.of_drives(draw_drives(BATCH_DRIVES, batch.plant_seed)),
        batch.of_drives(batch.reference),
        effects=effects,
        noise=_BatchNoise(drawn.share if batch.noise == DRAWN else batch.noise),
        seed=batch.plant_seed,
        electronics=_boards(batch),
        twin=twin,
    )


def _simulated_beside(
    batch: Batch, effects: Sequence[Effect], axis: NDArray[np.intp]
) -> tuple[Recordings, Twin]:
    """Drives with their faults, and sound twins that move as they do."""
    drives = batch.of_drives(draw_drives(BATCH_DRIVES, batch.plant_seed))
    twin = Twin(drives, batch.of_drives(batch.reference), effects, axis)
    return _simulated(batch, effects, twin), twin


class _BatchNoise(Noise):
    """The noise of a drive is the same, however many of its batch are simulated."""

    def added_to(self, effort: Array, seed: int) -> Array:
        """As drawn for the whole batch."""
        samples, drives, axes = effort.shape
        whole = np.zeros((samples, BATCH_DRIVES, axes))
        whole[:, :drives] = effort
        return super().added_to(whole, seed)[:, :drives]


def _boards(batch: Batch) -> Electronics:
    return batch.of_drives(draw_electronics((BATCH_DRIVES, len(AXES)), batch.plant_seed))


def _measured(
    batch: Batch,
    alone: Sequence[tuple[Recordings, Twin]],
    axis: NDArray[np.intp],
    samples: int,
) -> dict[str, Array]:
    """How far each of K faults alone shows, what it adds, and how well it can be told, (B, K)."""
    each = batch.drives, len(alone)
    found = {name: np.ones(each) for name in ("shows", "share", "detectability")}
    found["added"] = np.zeros((*each, samples))
    if not alone:
        return found
    sound = _simulated(batch, [])
    for place, (made, twin) in enumerate(alone):
        for row, hit in enumerate(axis.tolist()):
            trace = _trace(batch, made, twin, row, hit)
            above_band = batch.hidden[row][place] in ABOVE_BAND
            found["shows"][row, place] = variance_ratio(made, sound, row, hit)
            share = added_share(made, row, hit) if above_band else trace.share
            found["share"][row, place] = share
            found["added"][row, place] = trace.added
            found["detectability"][row, place] = trace.detectability
    return found


def _trace(batch: Batch, made: Recordings, twin: Twin, row: int, axis: int) -> Trace:
    """What the axis with the fault did."""
    count_rad = np.broadcast_to(_boards(batch).count_rad, made.truth.shape[:2])
    quiet = made.quiet_effort[row, axis]
    inertia, viscous_friction = made.truth[row, axis, :2].tolist()
    return Trace(
        effort=quiet,
        torque=twin.torque[:, row],
        velocity=twin.velocity[:, row],
        lead=STEPS_PER_SAMPLE * LEAD,
        noise=MeasurementNoise(
            effort_nm=float(np.std(made.effort[row, axis] - quiet)),
            count_rad=float(count_rad[row, axis]),
            inertia=inertia,
            viscous_friction=viscous_friction,
        ),
    )


def _path(batch: Batch) -> Path:
    key = hashlib.sha256(f"{batch} {_plant_version()}".encode()).hexdigest()[:12]
    return FOLDER / f"{batch.kind}_{batch.motion}_{batch.seed}_{batch.number}_{key}.npz"


@cache
def _plant_version() -> str:
    """Changes with any file of the plant, or with what makes the cases."""
    here = Path(__file__).parent
    plant = here.parents[1] / "firmware_interface" / "plant"
    mine = [here / f"{name}.py" for name in ("cases", "hiding", "measuring", "reach")]
    sources = [*sorted(plant.glob("*.py")), *mine]
    return hashlib.sha256(b"".join(path.read_bytes() for path in sources)).hexdigest()
