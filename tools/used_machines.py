"""What `edge-ident run` is worth on machines that are used, worn, or of another simulation.

    python -m tools.used_machines --count 100 --output used.jsonl
    python -m tools.used_machines --count 20 --wear 2 2 --output worn.jsonl
    python -m tools.used_machines --count 20 --friction lugre --output lugre.jsonl
    python -m tools.used_machines --output used.jsonl --summary

Each machine of `--used` is run as a user runs it, with default options, in a process of its own, on
the virtual board that is embedded in the command. The gains that the board has at the end are then
judged on machines as they were at the start: on the second motion of `run`, and on a third one that
nobody was told of. So are the gains before, and those that are designed from the true local
parameters: true inertia, and the line through the true friction. A row a run goes to the file; what
is there is not run again, and Ctrl-C ends it. The tables are of all rows in the file.
"""

import argparse
import json
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from typer.testing import CliRunner

from edge_ident.cli import app
from edge_ident.commissioning.further_motions import second_motion, within_limits
from edge_ident.control.gain_design import design
from edge_ident.drive.description import load_drive
from edge_ident.errors import EdgeIdentError
from edge_ident.model.model import Estimate, Model, base_axis
from firmware_interface import board_session, registers
from firmware_interface.gains import CONSERVATIVE_GAINS, Bank
from firmware_interface.plant import drives, hiding, plant
from firmware_interface.virtual.board import VirtualBoard
from firmware_interface.virtual.drive import SAMPLE_PERIOD_S
from firmware_interface.virtual.settings import GainBanks
from tools.judged_machines import JudgedMachine, third_motion, watched, worse_by
from tools.used_machine_table import key_of, table

_KNOWN: Final = 0.01  # to which true parameters are known where gains are designed from them
# Share of the peak speed below which friction is no line: a reversal is not far.
_SLOWEST: Final = 0.25
Row = dict[str, Any]
Errors = Mapping[str, Mapping[str, float]]


@dataclass(frozen=True)
class Case:
    """A machine, as `--used` draws it."""

    seed: int
    wear: float | None
    friction: str | None
    options: tuple[str, ...] = ()

    @property
    def words(self) -> list[str]:
        """Of the command that runs on it."""
        how = [] if self.wear is None else ["--wear", f"{self.wear:g}"]
        how += [] if self.friction is None else ["--friction", self.friction]
        return ["run", "--device", "virtual", "--used", str(self.seed), *how, *self.options]

    def hidden(self) -> hiding.Hidden:
        """The machine."""
        if self.friction is not None:
            return hiding.Hidden.rubbing(self.seed, self.friction)  # type: ignore[arg-type]
        return hiding.Hidden.used(self.seed, 1.0 if self.wear is None else self.wear)


class Seen:
    """What happens on the virtual boards of this process, and what time goes by elsewhere.

    Attributes
    ----------
    board : VirtualBoard
        The last one.
    writes : int
        Times that other gains were put in force.
    moved : int
        Samples in which an axis moved.
    first_write : tuple of float, optional
        Wall and processor time outside the board from the end of the first motion to the first of
        them, s.
    """

    board: VirtualBoard

    def __init__(self) -> None:
        self.writes = self.moved = 0
        self.first_write: tuple[float, float] | None = None
        self._moved_at: tuple[float, float] | None = None
        self._inside = np.zeros(2)
        self._began = _clocks()

    @property
    def spent(self) -> tuple[float, float]:
        """Wall and processor time outside the board, s: on a real one, all that is computing."""
        wall, processor = _clocks() - self._began - self._inside
        return float(wall), float(processor)

    @contextmanager
    def watching(self) -> Iterator["Seen"]:
        """Look at every board while the body runs."""
        originals = VirtualBoard.read, VirtualBoard.write, GainBanks.commit
        read, write, commit = originals

        def noted_read(board: VirtualBoard, address: int, count: int) -> list[int]:
            with self._in_board(board):
                return read(board, address, count)

        def noted_write(board: VirtualBoard, address: int, words: list[int]) -> None:
            with self._in_board(board):
                write(board, address, words)

        def noted_commit(banks: GainBanks, now_s: float, staged: Bank) -> None:
            if staged != banks.active:  # a run first commits what is there, to try the way back
                self.writes += 1
                wall, processor = self._moved_at or (0.0, 0.0)
                now = self.spent[0] - wall, self.spent[1] - processor
                self.first_write = self.first_write or now
            commit(banks, now_s, staged)

        _put(noted_read, noted_write, noted_commit)
        try:
            yield self
        finally:
            _put(*originals)

    @contextmanager
    def _in_board(self, board: VirtualBoard) -> Iterator[None]:
        self.board = board
        machine, began = board.machine, np.array([time.perf_counter(), time.thread_time()])
        before, moved = machine.samples, machine.state is registers.State.MOVING or machine.moving
        try:
            yield
        finally:
            self.moved += moved * (machine.samples - before)
            self._inside += np.array([time.perf_counter(), time.thread_time()]) - began
            if machine.state is registers.State.DRAINING:
                self._moved_at = self._moved_at or self.spent


def _put(read: Any, write: Any, commit: Any) -> None:
    """Methods of the virtual board."""
    for owner, name, method in (
        (VirtualBoard, "read", read),
        (VirtualBoard, "write", write),
        (GainBanks, "commit", commit),
    ):
        setattr(owner, name, method)


def _clocks() -> drives.Array:
    """Wall and processor time, that of ended children included, s."""
    children = resource.getrusage(resource.RUSAGE_CHILDREN)
    processor = time.process_time() + children.ru_utime + children.ru_stime
    return np.array([time.perf_counter(), processor])


def one_run(case: Case, keep: Path | None = None, judged: Row | None = None) -> Row:
    """Run on a machine, and judge what came of it.

    Parameters
    ----------
    case : Case
    keep : Path, optional
        Folder for the folder of the run.
    judged : row, optional
        An earlier one of the same machine: errors before and of ideal gains stand there.
    """
    vars(board_session)["POLL_S"] = 0.0  # the board's time goes by requests
    seen = Seen()
    with tempfile.TemporaryDirectory() as folder, seen.watching():
        own = Path(folder) / "run" if keep is None else keep / key_of(asdict(case))
        done = CliRunner().invoke(app, [*case.words, "--json", "--output", str(own)])
        wall_s, processor_s = seen.spent
    document = _document(done.stdout)
    machine = seen.board.machine
    row = {
        **asdict(case),
        "command": " ".join(["edge-ident", *case.words]),
        "exit": done.exit_code,
        **_said(document),
        "writes": seen.writes,
        "first_write_s": seen.first_write,
        "computing_s": (wall_s, processor_s),
        "board_s": SAMPLE_PERIOD_S * machine.samples,
        "moving_s": SAMPLE_PERIOD_S * seen.moved,
    }
    if not document:
        row["error"] = (done.stderr or repr(done.exception))[-400:]
    return {**row, **_judged(case, machine.banks.active, judged)}


def _document(text: str) -> Row:
    """JSON of a run; none where it ended early."""
    with suppress(ValueError):
        found: Row = json.loads(text)
        return found
    return {}


def _said(document: Row) -> Row:
    """What a run says of itself, and how its forecasts came true."""
    axes = document.get("identification", {}).get("axes", {})
    hits = [
        [on, axis, quantity, *_held(of, quantity)]
        for axis, motions in (document.get("promise") or {}).items()
        for on, of in motions.items()
        if of.get("measured")
        for quantity in ("rms_rad", "peak_rad")
    ]
    return {
        "conclusion": document.get("conclusion", document.get("cause", "")),
        "confirmed": document.get("confirmed", False),
        "trusted": {name: of.get("trusted") for name, of in axes.items()},
        "base_residual": {
            name: of.get("adequacy", {}).get("relative_residual") for name, of in axes.items()
        },
        "motions": len(document.get("motions", ())),
        "forecasts": hits,
    }


def _held(of: Row, quantity: str) -> tuple[bool, float]:
    """Whether an interval held, and measured over forecast."""
    (low, high), measured = of["interval"][quantity], of["measured"][quantity]
    return low <= measured <= high, measured / of["after"][quantity]


def _judged(case: Case, after: Bank, known: Row | None) -> Row:
    """True errors on fresh machines, with the gains before, after, and from the truth."""
    before = dict.fromkeys(registers.AXES, CONSERVATIVE_GAINS)
    try:
        found = known or _measured(case, before)
        errors = dict(found["errors_rad"])
        same = after == _machine(case, before).board.active_gains()
        errors["after"] = errors["before"] if same else _followed(case, after)[0]
    except EdgeIdentError as error:
        return {"not_judged": str(error)}
    grown = {on: worse_by(of, errors["after"][on]) for on, of in errors["before"].items()}
    return {"errors_rad": errors, "grown": grown, "truth": found["truth"]}


def _measured(case: Case, before: Bank) -> Row:
    """What needs no run: errors with the gains before, and with those from the truth."""
    errors, truth = _followed(case, before)
    hardware = _machine(case, before).hardware
    ideal = {
        axis: design(base_axis(Estimate(body, _KNOWN * np.abs(body))), hardware[axis]).gains
        for axis, body in zip(registers.AXES, truth, strict=True)
    }
    best, _ = _followed(case, ideal)
    return {"errors_rad": {"before": errors, "ideal": best}, "truth": truth.tolist()}


def _machine(case: Case, gains: Bank) -> JudgedMachine:
    hidden = case.hidden()
    base = hidden.drives.chain.rigid_body[0]
    return watched(hidden.plant(), gains, load_drive(), {axis: () for axis in registers.AXES}, base)


def _followed(case: Case, gains: Bank) -> tuple[Errors, drives.Array]:
    """True rms errors on two motions, and the local parameters that were true on them, (A, 4)."""
    machine = _machine(case, gains)
    board, drive = machine.board, machine.drive
    model = Model(
        {
            axis: base_axis(Estimate(body, _KNOWN * np.abs(body)))
            for axis, body in zip(registers.AXES, machine.base, strict=True)
        }
    )
    soft = dict.fromkeys(registers.AXES, CONSERVATIVE_GAINS)
    second = within_limits(second_motion(drive, "sinusoid"), model, soft, board.limits())
    board.enable()
    errors, parts = {}, []
    for name, motion in (("second", second.trajectory), ("third", third_motion(drive, case.seed))):
        _, errors[name] = machine.move(motion)
        parts.append(_friction(machine))
    rows = [np.concatenate(both) for both in zip(*parts, strict=True)]
    inertia = machine.base[:, 0]
    return errors, np.array([[inertia[n], *_line(part)] for n, part in enumerate(rows)])


def _friction(machine: JudgedMachine) -> tuple[drives.Array, ...]:
    """Speed and friction of each axis in a motion, (T, 2): what is left of the efforts."""
    watch, inertia = machine.watch, machine.base[:, 0]
    speed, command = np.array(watch.speed), np.array(watch.command)
    acting = plant.DELAY * command[:-2] + (1.0 - plant.DELAY) * command[1:-1]
    left = acting - inertia * np.diff(speed, axis=0)[1:] / SAMPLE_PERIOD_S
    middle = 0.5 * (speed[1:-1] + speed[2:])
    return tuple(np.stack([middle[:, n], left[:, n]], axis=-1) for n in range(len(registers.AXES)))


def _line(part: drives.Array) -> drives.Array:
    """Viscous and Coulomb friction and offset of the line through friction over speed."""
    speed, left = part.T
    fast = np.abs(speed) > _SLOWEST * np.max(np.abs(speed))
    columns = np.stack([speed, np.sign(speed), np.ones_like(speed)], axis=-1)
    found: drives.Array = np.linalg.lstsq(columns[fast], left[fast], rcond=None)[0]
    return found


def cases(given: argparse.Namespace) -> Iterator[Case]:
    """Machines that are asked for; wear is even between its bounds."""
    for seed in range(given.first, given.first + given.count):
        low, high = given.wear
        share = np.random.default_rng([seed, 41]).random()
        wear = None if given.friction else round(float(low + (high - low) * share), 2)
        yield Case(seed, wear, given.friction, tuple(given.options.split()))


def main(words: Sequence[str] | None = None) -> None:
    """Entry point."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--first", type=int, default=1, help="first number of --used")
    parser.add_argument("--count", type=int, default=20)
    parser.add_argument("--wear", type=float, nargs=2, default=(0.3, 1.5), metavar=("LOW", "HIGH"))
    parser.add_argument("--friction", choices=("lugre", "dahl"), help="clean, other simulation")
    parser.add_argument("--options", default="", help="more of `edge-ident run`, in one word")
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--known", type=Path, help="rows of earlier runs on these machines")
    parser.add_argument("--keep", type=Path, help="folder for the runs' own folders")
    parser.add_argument("--output", type=Path, required=True, help="rows, JSON lines")
    parser.add_argument("--summary", action="store_true", help="run nothing")
    given = parser.parse_args(words)
    rows, done = _read(given.output), {key_of(row) for row in _read(given.output)}
    left = [case for case in cases(given) if key_of(asdict(case)) not in done]
    judged = {_machine_of(row): row for row in _read(given.known) if "errors_rad" in row}
    with suppress(KeyboardInterrupt):
        for row in () if given.summary else _rows(left, given.processes, given.keep, judged):
            rows.append(row)
            with given.output.open("a") as file:
                file.write(json.dumps(row) + "\n")
            print(f"{key_of(row)}: exit {row['exit']}, {row['conclusion']}", flush=True)
    print(table(rows))


def _read(file: Path | None) -> list[Row]:
    """Rows of a file; none where there is none."""
    if file is None or not file.exists():
        return []
    return [json.loads(line) for line in file.read_text("utf-8").splitlines()]


def _machine_of(row: Row) -> tuple[Any, ...]:
    return row["seed"], row["wear"], row["friction"]


def _rows(
    left: Sequence[Case], processes: int, keep: Path | None, judged: Mapping[Any, Row]
) -> Iterator[Row]:
    """Rows as they come; Ctrl-C ends those that are not begun."""
    with ThreadPoolExecutor(processes) as pool:
        every = [
            pool.submit(_in_process, case, keep, judged.get(_machine_of(asdict(case))))
            for case in left
        ]
        try:
            for done in as_completed(every):
                yield from done.result()
        finally:
            pool.shutdown(cancel_futures=True)


def _in_process(case: Case, keep: Path | None, judged: Row | None) -> list[Row]:
    """The row of a run; none where Ctrl-C ended it.

    A diagnosis that was out of time may compute on after its run: each has a process of its own.
    """
    given = json.dumps([asdict(case), None if keep is None else str(keep), judged])
    words = [sys.executable, "-m", "tools.used_machines", *_ONE]
    done = subprocess.run(words, input=given, stdout=subprocess.PIPE, text=True, check=False)
    return [json.loads(done.stdout)] if not done.returncode else []


def _one() -> None:
    """Print the row of a run that is asked for on stdin."""
    case, keep, judged = json.load(sys.stdin)
    case["options"] = tuple(case["options"])
    print(json.dumps(one_run(Case(**case), keep and Path(keep), judged)))


_ONE: Final = ["--one"]

if __name__ == "__main__":
    if sys.argv[1:] == _ONE:
        _one()
    else:
        main(sys.argv[1:])
