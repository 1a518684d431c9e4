"""Fleets of units of one kind, made by the independent plant: alike but for a few percent."""

from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from edge_ident.signals.recording import AxisRecord, Recording
from edge_ident.signals.recording_files import save_recording
from firmware_interface.plant import (
    Motion,
    Noise,
    Recordings,
    draw,
    draw_drives,
    multisine,
    simulate,
)
from firmware_interface.plant.drives import Chain, Control, Drives

_VARIED = ("inertia", "viscous", "coulomb", "offset")
_STEPS = 5
"""A sampling period. Six times as many change an effort by 0.04 %; its noise is 1 %."""


def fleet_drives(count: int, seed: int, spread: float = 0.03, first_coulomb: float = 1.0) -> Drives:
    """Copies of one random drive whose parameters scatter.

    Parameters
    ----------
    count, seed : int
    spread : float
        Relative standard deviation of each parameter of each axis.
    first_coulomb : float
        Factor of the Coulomb friction of the first axis of the first unit.
    """
    one = draw_drives(1, seed)
    rng = np.random.default_rng([seed, 77])
    chain = {name: _copied(value, count) for name, value in vars(one.chain).items()}
    for name in _VARIED:
        shape = chain[name].shape[-2:]
        chain[name] = chain[name] * (1.0 + spread * rng.standard_normal(shape))
    chain["coulomb"][:, 0, 0] *= first_coulomb
    control = vars(one.control)
    ahead = np.repeat(control["feedforward"], count, axis=0)
    others = {name: _copied(of, count) for name, of in control.items() if name != "feedforward"}
    return Drives(replace(one.chain, **chain), Control(**others, feedforward=ahead))


def fleet_recordings(
    drives: Drives, seed: int, motion: Motion | None = None, hidden: Iterable[str] = ()
) -> list[Recording]:
    """A recording of each unit; effects are hidden in the first unit alone.

    Parameters
    ----------
    drives : Drives
    seed : int
    motion : Motion, optional
        Default: a multisine of 10 s.
    hidden : iterable of str
        Names of effects, at half of their largest strength.
    """
    motion, noise, names = motion or multisine(4000), Noise(0.01), tuple(hidden)
    sound = simulate(drives, motion, noise=noise, seed=seed, steps_per_sample=_STEPS)
    made = [_recording(sound, unit) for unit in range(drives.shape[0])]
    if names:
        effects = draw(names, drives, motion, seed, strength=0.5)
        faulty = simulate(
            drives, motion, effects=effects, noise=noise, seed=seed, steps_per_sample=_STEPS
        )
        made[0] = _recording(faulty, 0)
    return made


def recordings_of_each(
    fleets: Sequence[Drives], seed: int, motion: Motion | None = None
) -> list[list[Recording]]:
    """Those of several sound fleets of the same size, which are simulated at once."""
    count = fleets[0].shape[0]
    chain, control = (
        {
            name: np.concatenate(
                [vars(part)[name] for part in parts], axis=value.shape.index(count)
            )
            for name, value in vars(parts[0]).items()
        }
        for parts in ([fleet.chain for fleet in fleets], [fleet.control for fleet in fleets])
    )
    made = fleet_recordings(Drives(Chain(**chain), Control(**control)), seed, motion)
    return [made[first : first + count] for first in range(0, len(made), count)]


def save_fleet(recordings: Iterable[Recording], folder: Path, ending: str = ".npz") -> None:
    """Write `unit-01`, `unit-02` and so on."""
    for number, recording in enumerate(recordings, start=1):
        folder.mkdir(parents=True, exist_ok=True)
        save_recording(recording, folder / f"unit-{number:02d}{ending}")


def _copied(values: NDArray[np.float64], count: int) -> NDArray[np.float64]:
    return np.repeat(values, count, axis=-2)


def _recording(made: Recordings, unit: int) -> Recording:
    axes = {
        name: AxisRecord(made.position[unit, axis], made.effort[unit, axis], "rad", "N*m")
        for axis, name in enumerate("xz")
    }
    return Recording(made.time_s, axes, f"unit {unit + 1}", float(made.effort_shift_s[unit]))
