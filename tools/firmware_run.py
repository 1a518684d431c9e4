"""What `edge-ident run` finds and mends on the C firmware, in real time, with one fault at a time.

    python -m tools.firmware_run
    python -m tools.firmware_run backlash torque_ripple=0.2 --axis z --motion multisine
    python -m tools.firmware_run used=3 used=4 --speed 4

The reference firmware for Linux serves a pseudo-terminal and moves the independent plant, which
hides the fault in a process of its own. `edge-ident run` works on that device as a user starts it,
and knows nothing of the fault. Then the gains that the board holds are read and compared with the
designed ones. All goes at the speed of time: some minutes for a fault, most of them motion.
"""

import argparse
import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

_ROOT = Path(__file__).parents[1]
sys.path[:0] = [str(_ROOT / "tests" / "firmware_interface")]

from conformance_boards import build_firmware, c_command  # noqa: E402

import edge_ident  # noqa: E402
from edge_ident.report.gains import gain_rows  # noqa: E402
from edge_ident.support.process import INTERRUPTED, end_as_by_ctrl_c  # noqa: E402
from firmware_interface.gains import AxisGains, Bank  # noqa: E402
from tests.processes import running  # noqa: E402

FAULTS: Final = ("nonlinear_viscous", "position_dependent_load", "torque_ripple")
"""Cured by a curve over speed, by a table over position, and by ripples."""
_COMMAND: Final = (sys.executable, "-m", "edge_ident")
Json = Mapping[str, Any]


@dataclass(frozen=True)
class FirmwareRun:
    """One run on one faulty drive.

    Attributes
    ----------
    wish, axis : str
        The fault, as `--hide` takes it, and where it is; used=NUMBER: the machine of `--used`.
    document : JSON object
        Of schema edge-ident/run/1, or of an error.
    seconds : float
        The command took, from start to end.
    held : mapping of axis name to AxisGains
        What the board used afterwards.
    """

    wish: str
    axis: str
    document: Json
    seconds: float
    held: Bank

    def lines(self) -> Iterator[str]:
        """What came of it."""
        yield f"{self.wish} on {self.axis}"
        document = self.document
        if "conclusion" not in document:
            yield f"  error      {document['cause']} ({self.seconds:.0f} s)"
            return
        axes = document["identification"]["axes"]
        yield f"  named      {'; '.join(f'{name}: {_named(axis)}' for name, axis in axes.items())}"
        took = ", ".join(f"{made['duration_s']:.0f} s" for made in document["motions"])
        yield f"  motions    {len(document['motions'])} to identify ({took})"
        for name, motions in (document["promise"] or {}).items():
            yield from (f"  tracking   {name}, {on}: {_kept(of)}" for on, of in motions.items())
        yield f"  verdict    {document['conclusion']}"
        yield from (f"  {line}" for line in self._gains())
        motion_s = 1e-3 * sum(document["timing_ms"].get(name, 0.0) for name in _MOVING)
        yield f"  time       {self.seconds:.0f} s, {motion_s:.0f} s of them motion"

    def _gains(self) -> Iterator[str]:
        """What was written, and whether the board holds what it ought to hold."""
        before = _bank(self.document["gains_before"])
        designs = {name: of["gains"] for name, of in self.document["designs"].items()}
        meant = _bank(designs) if self.document["confirmed"] else before
        for name, held in self.held.items():
            rows = gain_rows([before[name], held])
            changes = [f"{row.label} {' → '.join(row.cells(4))}" for row in rows if row.change]
            yield f"written    {name}: {', '.join(changes) or 'nothing'}"
        same = all(_alike(held, meant[name]) for name, held in self.held.items())
        what = "the designed gains" if self.document["confirmed"] else "the gains of before"
        yield f"read back  {what}{'' if same else ': NO, other numbers'}"


_MOVING: Final = ("motion", "second_motion", "verification")  # stages in which the axes move


def _named(axis: Json) -> str:
    """The verdict of an axis, and the causes that it names."""
    found = axis.get("diagnosis")
    if found is None:
        return "nothing" if axis["trusted"] else "nothing, and it is not trusted"
    causes = dict.fromkeys(cause["effect"] for cause in found["causes"])
    return f"{found['verdict']}, {', '.join(causes) or 'no cause'}"


def _kept(of: Json) -> str:
    """A promise and what came of it, rms."""
    now, after = (1e3 * of[when]["rms_rad"] for when in ("now", "after"))
    low, high = (1e3 * end for end in of["interval"]["rms_rad"])
    said = f"{now:.3g} mrad, promised {after:.3g} ({low:.3g} to {high:.3g})"
    if not of["tried"]:
        return f"{said}, not tried"
    kept = "kept" if of["kept"] else "NOT kept"
    return f"{said}, measured {1e3 * of['measured']['rms_rad']:.3g}, {kept}"


def _bank(document: Json) -> dict[str, AxisGains]:
    return {axis: _axis_gains(numbers) for axis, numbers in document.items()}


def _axis_gains(document: Json) -> AxisGains:
    numbers: dict[str, Any] = {
        name: tuple(value) if isinstance(value, list) else value for name, value in document.items()
    }
    return AxisGains(**numbers)


def _alike(one: AxisGains, other: AxisGains) -> bool:
    """Whether gains are the same to the last bit of a register."""
    first, second = (list(gains.numbers().values()) for gains in (one, other))
    return bool(np.array_equal(np.array(first, np.float32), np.array(second, np.float32)))


@contextmanager
def served(
    programs: Path, folder: Path, wish: str, axis: str = "x", speed: float = 1.0
) -> Iterator[str]:
    """The device of the firmware, with a faulty drive behind it.

    Ctrl-C is for the run, which stops the axes; board and drive end after it.

    Parameters
    ----------
    programs : Path
        Folder with the built firmware.
    folder : Path
        For the socket between firmware and drive.
    wish, axis : str
        As in `FirmwareRun`.
    speed : float
        Times real time.
    """
    place = folder / "drive"
    name, _, number = wish.partition("=")
    fault = ["--used", number] if name == "used" else ["--hide", wish, "--axis", axis]
    plant = [*_COMMAND, "plant", "--quiet", "--socket", str(place), *fault]
    with running(plant, errors=None, own_session=True) as drive:
        _first_line(drive)
        firmware = c_command(programs, "--plant", str(place), speed=speed)
        with running(firmware, errors=None, own_session=True) as board:
            yield _first_line(board)


def _first_line(process: "subprocess.Popen[str]") -> str:
    assert process.stdout is not None
    line = process.stdout.readline().strip()
    if not line:
        raise RuntimeError(f"{process.args!r} ended at its start")
    return line


def run_on(
    device: str, folder: Path, wish: str, axis: str = "x", motion: str = "sinusoid"
) -> FirmwareRun:
    """Run on a device of `served`, and read what its board holds afterwards."""
    command = [*_COMMAND, "run", "--device", device, "--motion", motion, "--json"]
    started_s = time.monotonic()
    with running([*command, "--output", str(folder)], errors=None) as process:
        output, _ = process.communicate()
    seconds = time.monotonic() - started_s
    with edge_ident.connect(device) as board:
        held = board.active_gains()
    return FirmwareRun(wish, axis, json.loads(output), seconds, held)


def main() -> None:
    """Entry point."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("faults", nargs="*", default=FAULTS, metavar="NAME[=SIZE]")
    parser.add_argument("--axis", default="x")
    parser.add_argument("--motion", default="sinusoid", help="the first")
    parser.add_argument("--speed", type=float, default=1.0, help="times real time")
    given = parser.parse_args()
    end_as_by_ctrl_c()
    with tempfile.TemporaryDirectory() as folder:
        build_firmware(Path(folder), "all")
        for number, wish in enumerate(given.faults):
            with served(Path(folder), Path(folder), wish, given.axis, given.speed) as device:
                own = Path(folder) / str(number)
                found = run_on(device, own, wish, given.axis, given.motion)
            print(*found.lines(), sep="\n", flush=True)


if __name__ == "__main__":
    try:
        main()
    except KeyboardInterrupt:
        sys.exit(INTERRUPTED)
