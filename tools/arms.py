"""What a diagnosis of an arm of six joints is worth along another path.

Each arm moves along two paths, and each path twice. Its efforts follow from Newton and Euler: most
of what one joint feels of the others has no law in the catalogue. A model of one path is scored on
the other as in `tools.real_machines`; a name that does not hold there harms.

    python -m tools.arms                          two arms, two seeds, two amplitudes
    python -m tools.arms --seeds 7,8 --output F   others; every score is a line of JSON
    python -m tools.real_machines --compare tools/real_machines/frozen_arms.jsonl runs/arms.jsonl
"""

import os

# one thread for each process; before numpy is loaded
os.environ["OMP_NUM_THREADS"] = os.environ["OPENBLAS_NUM_THREADS"] = "1"

import argparse
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray
from rich.console import Console

from edge_ident.signals.recording import AxisRecord, Recording
from tools.real_machines.scores import kept_scores
from tools.real_machines.tables import print_scores

Array = NDArray[np.float64]

# Scores of the last run; git ignores it.
_OUTPUT: Final = Path(__file__).parents[1] / "runs" / "arms.jsonl"

PERIOD_S: Final = 0.008
PATH_S: Final = 10.0
TIMES: Final = 2
HARMONICS: Final = 5
AMPLITUDES_RAD: Final = (1.0, 0.5)
COUNT_RAD: Final = 2e-5
NOISE: Final = 0.02
"""Of the effort's rms."""
GYRATION_M2: Final = 0.02
"""Inertia of a link about its centre, over its mass."""
GRAVITY: Final = np.array([0.0, 0.0, 9.81])
REST_RAD: Final = np.array([0.0, -1.2, 1.0, -0.8, 0.5, 0.0])
"""About which the joints move."""
MOTORS: Final = np.array([2.5, 2.5, 1.2, 0.4, 0.4, 0.3])
"""Inertia of the joints' own drives, kg·m²."""
VISCOUS: Final = np.array([10.0, 10.0, 6.0, 2.0, 2.0, 1.5])
COULOMB: Final = np.array([8.0, 8.0, 5.0, 2.0, 2.0, 1.5])
STATIC: Final = 0.15
"""Friction at rest beyond Coulomb's, over it; it falls within a speed."""
FALLS_RAD_S: Final = 0.15
TURNS_RAD_S: Final = 0.01


@dataclass(frozen=True)
class Arm:
    """Links of an arm, by the convention of Denavit and Hartenberg; (6,) each, in m, rad and kg.

    Attributes
    ----------
    lengths, offsets, twists : arrays
    masses : array
    centres : (6, 3) array
        Of the masses, in the frame at the end of each link.
    """

    lengths: Array
    offsets: Array
    twists: Array
    masses: Array
    centres: Array


_QUARTER: Final = 0.5 * np.pi
ARMS: Final = {
    "three parallel joints": Arm(
        np.array([0.0, -0.6, -0.55, 0.0, 0.0, 0.0]),
        np.array([0.13, 0.0, 0.0, 0.16, 0.11, 0.09]),
        np.array([_QUARTER, 0.0, 0.0, _QUARTER, -_QUARTER, 0.0]),
        np.array([8.0, 12.0, 4.0, 2.0, 2.0, 0.3]),
        np.array(
            [[0.02, 0.0, 0.02], [0.35, 0.0, 0.15], [0.25, 0.0, 0.07], [0.0, 0.01, 0.02],
             [0.0, 0.01, 0.02], [0.0, 0.0, -0.03]]
        ),
    ),
    "spherical wrist": Arm(
        np.array([0.0, 0.22, 0.0, 0.0, 0.0, 0.0]),
        np.array([0.3, 0.04, 0.0, 0.23, 0.0, 0.07]),
        np.array([-_QUARTER, 0.0, _QUARTER, -_QUARTER, _QUARTER, 0.0]),
        np.array([8.0, 7.0, 5.0, 2.5, 1.5, 0.4]),
        np.array(
            [[0.0, 0.05, 0.02], [-0.1, 0.0, 0.05], [0.0, 0.02, 0.03], [0.0, -0.05, 0.01],
             [0.0, 0.0, 0.02], [0.0, 0.0, 0.01]]
        ),
    ),
}  # fmt: skip


def main() -> int:
    """Score the arms and print the table; 0."""
    given = _arguments()
    console = Console(width=180, highlight=False)
    print_scores(kept_scores(_paths(given.seeds), given.output), console)
    console.print(f"every score: {given.output}")
    return 0


def _paths(seeds: Sequence[int]) -> Iterator[tuple[str, Recording, Recording]]:
    """Each arm along two paths."""
    for name, arm in ARMS.items():
        for seed in seeds:
            for amplitude in AMPLITUDES_RAD:
                first, second = (
                    recorded(arm, seed, path, amplitude) for path in (2 * seed, 2 * seed + 1)
                )
                yield f"{name}, {seed}, {amplitude} rad", first, second


def recorded(arm: Arm, seed: int, path: int, amplitude: float) -> Recording:
    """An arm along a path.

    Parameters
    ----------
    arm : Arm
    seed : int
        Of the drives and links.
    path : int
        Seed of the path.
    amplitude : float
        Largest excursion of each joint, rad.
    """
    rng, noise = np.random.default_rng(seed), np.random.default_rng([seed, path])
    time_s = PERIOD_S * np.arange(round(TIMES * PATH_S / PERIOD_S), dtype=np.float64)
    angles = REST_RAD[:, None] + amplitude * _path(np.random.default_rng(path), time_s)
    speed = np.gradient(angles, PERIOD_S, axis=1)
    direction = np.tanh(speed / TURNS_RAD_S)
    motors, viscous, coulomb = (
        drive[:, None] * rng.uniform(0.6, 1.4, (6, 1)) for drive in (MOTORS, VISCOUS, COULOMB)
    )
    dry = coulomb * (1.0 + STATIC * np.exp(-np.abs(speed) / FALLS_RAD_S))
    effort = moments(arm, angles, rng) + motors * np.gradient(speed, PERIOD_S, axis=1)
    effort += viscous * speed + dry * direction
    effort += NOISE * np.std(effort, axis=1, keepdims=True) * noise.standard_normal(effort.shape)
    counted = COUNT_RAD * np.round(angles / COUNT_RAD)
    axes = {f"j{k + 1}": AxisRecord(counted[k], effort[k], "rad", "N*m") for k in range(6)}
    return Recording(time_s, axes, f"path {path}")


def _path(rng: np.random.Generator, time_s: Array) -> Array:
    """Six sums of harmonics, (6, N), whose largest value is one."""
    order = np.arange(1, HARMONICS + 1)
    waves = np.exp(2j * np.pi / PATH_S * order[:, None] * time_s) / order[:, None]
    phasors = rng.standard_normal((6, HARMONICS)) + 1j * rng.standard_normal((6, HARMONICS))
    found = (phasors @ waves).real
    return np.asarray(found / np.max(np.abs(found), axis=1, keepdims=True))


def moments(arm: Arm, angles: Array, rng: np.random.Generator) -> Array:
    """Moments (6, N) about the joints that carry and accelerate the links.

    Newton's and Euler's laws in the frame of the base; derivatives are differences. Source:
    Siciliano et al., Robotics (2009), sec. 7.5.

    Parameters
    ----------
    arm : Arm
    angles : (6, N) array
    rng : numpy.random.Generator
        Draws the inertia of each link about its centre.
    """
    count = angles.shape[1]
    frame, origin = np.broadcast_to(np.eye(3), (count, 3, 3)), np.zeros((count, 3))
    turning, rate = np.zeros((count, 3)), np.gradient(angles, PERIOD_S, axis=1)
    axes, origins, places, forces, spins = [], [], [], [], []
    for k in range(6):
        axes.append(frame[:, :, 2])
        origins.append(origin)
        turning = turning + axes[k] * rate[k][:, None]
        along, across = arm.lengths[k], arm.offsets[k]
        cosine, sine = np.cos(angles[k]), np.sin(angles[k])
        ahead = np.stack([along * cosine, along * sine, np.full(count, across)], axis=1)
        origin = origin + np.einsum("nij,nj->ni", frame, ahead)
        frame = frame @ _turn(angles[k], arm.twists[k])
        places.append(origin + frame @ arm.centres[k])
        forces.append(arm.masses[k] * (_derivative(_derivative(places[k])) + GRAVITY))
        inertia = GYRATION_M2 * arm.masses[k] * rng.uniform(0.6, 1.4, 3)
        spin = np.einsum("nij,j,nkj,nk->ni", frame, inertia, frame, turning)
        spins.append(_derivative(spin))
    found = []
    for k in range(6):
        outer = zip(places[k:], forces[k:], spins[k:], strict=True)
        moment = sum(np.cross(place - origins[k], force) + spin for place, force, spin in outer)
        found.append(np.einsum("ni,ni->n", axes[k], moment))
    return np.array(found)


def _turn(angle: Array, twist: float) -> Array:
    """From the frame of one link to that of the next, (N, 3, 3)."""
    c, s, ct, st = np.cos(angle), np.sin(angle), np.cos(twist), np.sin(twist)
    rows = [[c, -s * ct, s * st], [s, c * ct, -c * st], [0.0 * c, st + 0.0 * c, ct + 0.0 * c]]
    return np.moveaxis(np.array(rows), -1, 0)


def _derivative(values: Array) -> Array:
    return np.gradient(values, PERIOD_S, axis=0)


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "--seeds", type=lambda text: [int(s) for s in text.split(",")], default=[5, 6]
    )
    parser.add_argument("--output", type=Path, default=_OUTPUT)
    return parser.parse_args()


if __name__ == "__main__":
    sys.exit(main())
