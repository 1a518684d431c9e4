"""Writes the recordings and pages of docs/examples: three machines with something hidden in each.

python -m tools.example_recordings            the recordings, then their pages
python -m tools.example_recordings --pages    the pages alone, after a change of their look

The machines are those of the independent plant, firmware_interface.plant. What is hidden stands
here and in the README beside each recording.
"""

import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.cli.command import UNTRUSTED
from firmware_interface.plant import (
    Chain,
    Control,
    Drives,
    Effect,
    Electronics,
    Motion,
    Noise,
    Recordings,
    draw_drives,
    multisine,
    simulate,
)
from firmware_interface.plant.friction_effects import Stribeck
from firmware_interface.plant.load_effects import PositionLoad, Ripple

Array = NDArray[np.float64]

FOLDER: Final = Path(__file__).parents[1] / "docs" / "examples"
NOISE: Final = Noise()
"""White, 2 % of the effort's rms."""
GRAVITY_NM: Final = 3.0 * 0.4 * 9.81
"""3 kg, 0.4 m from the joint."""
COGGING_N: Final = 6.0
POLE_PAIR_M: Final = 0.024
STRIBECK_NM: Final = 0.5
STRIBECK_SPEED_RAD_S: Final = 0.3


@dataclass(frozen=True)
class Example:
    """A machine, its motion, and what is hidden in it.

    Attributes
    ----------
    file : str
        Recording, below docs/examples.
    columns : tuple of str
        Position and effort of each axis, as the contract names them.
    formats : tuple of str
        How a column of position and one of effort are printed.
    effects : tuple of Effect
        Of the plant.
    seed : int
        Of the noise.
    """

    file: str
    columns: tuple[tuple[str, str], ...]
    formats: tuple[str, str]
    drives: Drives
    motion: Motion
    electronics: Electronics
    effects: tuple[Effect, ...]
    seed: int

    @property
    def path(self) -> Path:
        """Where the recording lies."""
        return FOLDER / self.file

    def record(self) -> Recordings:
        """Let the machine move, and record it."""
        return simulate(
            self.drives, self.motion, effects=self.effects, noise=NOISE, seed=self.seed,
            electronics=self.electronics,
        )  # fmt: skip


def feed_drive() -> Example:
    """The paper's kind of drive on a multisine; axis x has Stribeck friction, z is sound."""
    sizes, speeds = np.array([[STRIBECK_NM, 0.0]]), np.full((1, 2), STRIBECK_SPEED_RAD_S)
    return Example(
        "feed_drive/recording.npz",
        (("x_position_rad", "x_torque_nm"), ("z_position_rad", "z_torque_nm")),
        ("%.6f", "%.3f"),
        draw_drives(1, seed=1),
        multisine(8000, seed=1),
        Electronics(),
        (Stribeck(sizes, speeds),),
        seed=1,
    )


def linear_stage() -> Example:
    """A linear motor in m and N; its magnets pull at the carriage."""
    one = np.ones((1, 1))
    cogging = Ripple(
        COGGING_N * one, 2.0 * np.pi / POLE_PAIR_M * one, 0.4 * one, 0.0 * one, one, 0.0 * one
    )
    chain = _chain((6.0, 2.0, 4.0), (20.0, 4.0, 6.0), (4.0, 0.0, 4.0), 2e7)
    return Example(
        "linear_stage/recording.csv",
        (("y_position_m", "y_force_n"),),
        ("%.6f", "%.2f"),
        Drives(chain, _control(chain, 30.0)),
        _scaled(multisine(6000, seed=2), 0.1),
        Electronics(1e-6, 0.01, 400.0),
        (cogging,),
        seed=2,
    )


def rotary_joint() -> Example:
    """An arm that turns in a vertical plane; the angle counts from where it hangs down."""
    one = np.ones((1, 1))
    weight = PositionLoad(GRAVITY_NM * one, 0.0 * one, one, 0.0 * one, 0.0 * one, one, 0.0 * one)
    chain = _chain((0.3, 0.05, 0.48), (0.8, 0.1, 0.3), (1.0, 0.0, 0.5), 6e4)
    return Example(
        "rotary_joint/recording.csv",
        (("q_position_rad", "q_torque_nm"),),
        ("%.6f", "%.3f"),
        Drives(chain, _control(chain, 20.0)),
        _scaled(multisine(6000, seed=3), 1.0),
        Electronics(2.0 * np.pi / 2**17, 0.005, 80.0),
        (weight,),
        seed=3,
    )


EXAMPLES: Final = (feed_drive, linear_stage, rotary_joint)


def _chain(
    inertia: Sequence[float], viscous: Sequence[float], coulomb: Sequence[float], stiffness: float
) -> Chain:
    """One axis of one machine, with two equal joints."""
    one, joints = np.ones((1, 1)), np.ones((2, 1, 1))

    def masses(values: Sequence[float]) -> Array:
        return np.reshape(np.asarray(values, dtype=np.float64), (3, 1, 1))

    return Chain(
        masses(inertia), masses(viscous), masses(coulomb), stiffness * joints, 0.05 * joints,
        0.0 * one, 0.0 * one, 0.0 * one, 0.0 * one,
    )  # fmt: skip


def _control(chain: Chain, bandwidth: float) -> Control:
    """Feedback with both poles at `bandwidth` (rad/s), and no feed-forward."""
    inertia = chain.rigid_body[..., 0]
    return Control(
        inertia * bandwidth**2,
        2.0 * inertia * bandwidth,
        5e-3 * np.ones((1, 1)),
        np.zeros((1, 1, 4)),
    )


def _scaled(motion: Motion, factor: float) -> Motion:
    """The first axis of a motion, larger or smaller."""
    first = (motion.position[..., :1], motion.velocity[..., :1], motion.acceleration[..., :1])
    position, velocity, acceleration = (factor * part for part in first)
    return replace(motion, position=position, velocity=velocity, acceleration=acceleration)


def write(example: Example, path: Path) -> None:
    """Write a recording with as many digits as its encoder and its amplifier have.

    `.npz` is compressed, which halves it; `.csv` has the contract's names.
    """
    made = example.record()
    columns = {"time_s": made.time_s}
    digits = ["%.4f"]
    for axis, names in enumerate(example.columns):
        measured = (made.position[0, axis], made.effort[0, axis])
        columns |= dict(zip(names, measured, strict=True))
        digits += example.formats
    rounded = {
        name: np.round(values, int(form[2]))
        for (name, values), form in zip(columns.items(), digits, strict=True)
    }
    path.parent.mkdir(parents=True, exist_ok=True)
    shift_s = float(made.effort_shift_s[0])
    if path.suffix == ".npz":
        np.savez_compressed(path, allow_pickle=False, effort_shift_s=shift_s, **rounded)
        return
    head = f"# effort_shift_s={shift_s:g}\n{','.join(columns)}"
    table = np.column_stack(list(rounded.values()))
    np.savetxt(path, table, fmt=digits, delimiter=",", header=head, comments="")


def write_page(path: Path) -> None:
    """Diagnose a recording, and keep the page beside it.

    The page quotes the command, so it is the one that a reader would write.
    """
    command = Path(sys.executable).with_name("edge-ident")
    done = subprocess.run(
        [command, "diagnose", path.name, "--output", "diagnosis"],
        cwd=path.parent, stdout=subprocess.DEVNULL, check=False,
    )  # fmt: skip
    if done.returncode not in (0, UNTRUSTED):
        raise SystemExit(done.returncode)
    for beside in ("diagnosis.json", "model.json"):
        (path.parent / "diagnosis" / beside).unlink()


def main(arguments: list[str]) -> int:
    """Write everything, or the pages alone."""
    if arguments not in ([], ["--pages"]):
        print("usage: python -m tools.example_recordings [--pages]", file=sys.stderr)
        return 2
    for made in EXAMPLES:
        example = made()
        if not arguments:
            write(example, example.path)
        write_page(example.path)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
