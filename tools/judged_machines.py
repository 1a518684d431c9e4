"""Random machines behind virtual boards whose true motion is watched, for judging what is promised.

Drives are those of `firmware_interface.plant.drives`, hidden effects those of its catalogue. The
motions are those of the built-in drive, or a quarter of their amplitude in a quarter of their time.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.commissioning.capture import Capture, capture_motion
from edge_ident.control.gain_design import design
from edge_ident.control.position_loop import LoopHardware
from edge_ident.drive.description import Drive, load_drive
from edge_ident.errors import EdgeIdentError
from edge_ident.model.model import Estimate, base_axis
from firmware_interface import board_session
from firmware_interface.board import Board
from firmware_interface.gains import CONSERVATIVE_GAINS, AxisGains, Bank
from firmware_interface.motion import Multisine, SineComponent, Trajectory, reference
from firmware_interface.plant.drives import COUNT_RAD, draw_drives, paper
from firmware_interface.plant.effect import Effect
from firmware_interface.plant.hiding import EFFECTS, draw
from firmware_interface.plant.plant import DELAY, Plant
from firmware_interface.registers import AXES
from firmware_interface.virtual.board import VirtualBoard
from firmware_interface.virtual.drive import SAMPLE_PERIOD_S
from firmware_interface.virtual.settings import DEFAULT_LIMITS, BoardSettings
from tests.short_runs import brief_drive

Array = NDArray[np.float64]

_HARMONICS: Final = (2, 5, 9, 13)  # of the third motion: none of them is one of the named motions'
_THIRD_SPEED: Final = 0.3
_THIRD_S: Final = 6.0


class Watch:
    """Remembers of a plant, before every sample, where its axes truly are and what moves them.

    Attributes
    ----------
    shown, true : list of (A,) lists
        Angles: what the encoders show, and where their shafts are, rad.
    speed : list of (A,) lists
        Of those shafts, rad/s.
    command : list of (A,) lists
        Efforts that are given in this sample, N·m.
    """

    def __init__(self, plant: Plant) -> None:
        self.clear()
        self._plant, self._advance = plant, plant.advance
        vars(plant)["advance"] = self._noted

    def clear(self) -> None:
        """Forget all of it."""
        self.shown: list[list[float]] = []
        self.true: list[list[float]] = []
        self.speed: list[list[float]] = []
        self.command: list[list[float]] = []

    def _noted(self, command: Sequence[float]) -> None:
        self.shown.append(self._plant.shown_rad)
        self.true.append(self._plant.output_rad)
        self.speed.append(self._plant.output_rad_s)
        self.command.append(list(command))
        self._advance(command)


@dataclass(frozen=True)
class JudgedMachine:
    """A board with a machine, as its user sees both, and what he does not see.

    Attributes
    ----------
    board : Board
    drive : Drive
        Its description.
    hidden : mapping of axis name to tuple of str
        Effects that the machine has.
    base : (A, 4) array
        True base parameters.
    zero_rad : (A,) array
        What the encoders showed when the board was switched on.
    """

    board: Board
    drive: Drive
    hidden: Mapping[str, tuple[str, ...]]
    base: Array
    watch: Watch
    zero_rad: Array

    @property
    def hardware(self) -> dict[str, LoopHardware]:
        """What the board does to each loop."""
        return LoopHardware.of_axes(self.board.identity, self.board.limits())

    def move(self, trajectory: Trajectory) -> tuple[Capture, dict[str, float]]:
        """Do a motion; what the board recorded, and the true rms error of each axis."""
        self.watch.clear()
        capture = capture_motion(self.board, trajectory, lambda done, of: None)
        self.board.finish()
        recorded = np.stack([axis.position for axis in capture.recording.axes.values()], axis=-1)
        counts = np.round(recorded / COUNT_RAD)
        shown = np.round(np.array(self.watch.shown) / COUNT_RAD)
        zero = np.round(self.zero_rad / COUNT_RAD)
        begin = _place(counts + zero, shown)
        true = np.array(self.watch.true)[begin : begin + len(counts)] - zero * COUNT_RAD
        time_s = capture.recording.time_s
        errors = {}
        for n, name in enumerate(trajectory.axes):
            way = reference(trajectory.axes[name], time_s, trajectory.lead_in_s, 0.0)
            errors[name] = float(np.sqrt(np.mean((way.position_rad - true[:, n]) ** 2)))
        return capture, errors


def judged_machine(
    seed: int,
    *,
    tuned: bool,
    effects: int = 1,
    strength: tuple[float, float] = (0.3, 0.8),
    brief: bool = True,
) -> JudgedMachine:
    """A random drive with so many hidden effects.

    Parameters
    ----------
    seed : int
    tuned : bool
        Its board has gains for the base parameters, which are known to some per cent, in place of
        the soft gains of the first start.
    effects : int
    strength : tuple of float
        Range of their strengths, as `draw` of the catalogue takes them.
    brief : bool
        Its motions are short, not those of the built-in drive.
    """
    rng = np.random.default_rng([seed, 11])
    drives = draw_drives(1, seed)
    base = drives.chain.rigid_body[0]
    names = tuple(rng.choice(EFFECTS, size=effects, replace=False).tolist())
    hidden: tuple[Effect, ...] = ()
    if names:
        hidden = draw(names, drives, paper(), seed, strength=float(rng.uniform(*strength)))
    gains = dict.fromkeys(AXES, CONSERVATIVE_GAINS)
    if tuned:
        known = base * (1.0 + 0.03 * rng.normal(size=base.shape))
        gains = {axis: _designed(known[n]) for n, axis in enumerate(AXES)}
    on = {axis: tuple(e.name for e in hidden if e.hit[0, n]) for n, axis in enumerate(AXES)}
    drive = brief_drive() if brief else load_drive()
    return watched(Plant(drives, hidden), gains, drive, on, base)


def watched(
    plant: Plant, gains: Bank, drive: Drive, hidden: Mapping[str, tuple[str, ...]], base: Array
) -> JudgedMachine:
    """A plant behind a board that has these gains; see `JudgedMachine`."""
    zero_rad = np.array(plant.shown_rad)
    watch = Watch(plant)
    vars(board_session)["POLL_S"] = 0.0  # the board's time goes by requests
    board = Board.connect(VirtualBoard(BoardSettings(gains=gains), plant=plant))
    return JudgedMachine(board, drive, hidden, base, watch, zero_rad)


def third_motion(drive: Drive, seed: int) -> Trajectory:
    """A motion that nobody was told of."""
    rng, rate = np.random.default_rng([seed, 12]), drive.angular_frequency_rad_s
    axes = {
        name: Multisine(
            tuple(
                SineComponent(_THIRD_SPEED / (k * rate), k * rate, float(rng.uniform(0, 2 * np.pi)))
                for k in _HARMONICS
            )
        )
        for name in drive.axes
    }
    return Trajectory(axes, _THIRD_S, drive.lead_in_s)


def why(error: EdgeIdentError) -> str:
    """The first words of what went wrong."""
    return f"{type(error).__name__}: {' '.join(str(error).split()[:4])}"


def worse_by(before: Mapping[str, float], after: Mapping[str, float]) -> float:
    """Largest relative growth of an error beyond a twentieth of an encoder count."""
    return max(after[a] / (before[a] + 0.05 * COUNT_RAD) for a in before) - 1.0


def _designed(base: Array) -> AxisGains:
    hardware = LoopHardware(
        SAMPLE_PERIOD_S, DELAY * SAMPLE_PERIOD_S, COUNT_RAD, DEFAULT_LIMITS.effort_nm
    )
    return design(base_axis(Estimate(base, 0.02 * np.abs(base))), hardware).gains


def _place(recorded: Array, shown: Array) -> int:
    """Where the recorded counts begin among those shown."""
    last = len(shown) - len(recorded) + 1
    return next(n for n in range(last) if np.array_equal(shown[n : n + len(recorded)], recorded))
