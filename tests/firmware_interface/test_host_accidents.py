"""What happens to the host during `edge-ident run`: it is killed at every step, it is held up, its
disk is full. A whole run then works on the board that it left."""

import json
import os
import resource
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from dataclasses import dataclass, field
from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest
from conformance_boards import c_command, put_gains, python_command, refused_value, serving, until
from fault_line import FaultyLine, Sender
from fault_proxy import FaultProxy
from pty_bench import connected_board

from edge_ident.commissioning.gain_transfer import load_gains
from firmware_interface.board import Board, BoardStatus
from firmware_interface.capture_pages import _TIMED_PAGES
from firmware_interface.codec import addresses
from firmware_interface.gains import AxisGains, bank_spans, decode_gains
from firmware_interface.registers import PAGE_ADDRESS, REGISTERS, Fault, Opcode, State

COMMAND = [sys.executable, "-m", "edge_ident"]
PYTHON_SPEED = 8.0
C_SPEED = 10.0
QUICKER = {"= 0.2875": "= 2.0", "= 5.0": "= 1.0", "= 6.283185307179586": "= 0.9"}
"""In the drive's description: angular frequency, lead-in and amplitudes; three seconds."""
SHADOW_SPANS = bank_spans("shadow")
Gains = dict[str, AxisGains]


def begin(function: int, address: int, *rest: int) -> bytes:
    """How a request begins."""
    return bytes([1, function]) + address.to_bytes(2, "big") + bytes(rest)


def command(opcode: Opcode) -> bytes:
    """How a command begins."""
    return begin(16, REGISTERS["command.opcode"].address, 0, 6, 12, 0, opcode)


TRAJECTORY = [
    begin(16, REGISTERS[f"trajectory.{name}"].address)
    for name in ("kind", "x.components", "z.components")
]
PAGE = begin(3, PAGE_ADDRESS)
WRITE = 16
SHADOW = begin(WRITE, REGISTERS["shadow.x.proportional"].address)
MOTION = {
    "header": TRAJECTORY[0],
    "axis x": TRAJECTORY[1],
    "axis z": TRAJECTORY[2],
    "arm": command(Opcode.ARM),
    "start": command(Opcode.START),
    "first page": PAGE,
    "finish": command(Opcode.FINISH),
}
STEPS = {
    "enable": (command(Opcode.ENABLE), 1),
    **{name: (request, 1) for name, request in MOTION.items()},
    "first page": (PAGE, _TIMED_PAGES + 1),  # the line is timed by reading it before the motion
    "first piece of a table": (begin(WRITE, REGISTERS["shadow.x.friction_top_speed"].address), 1),
    "stage": (SHADOW, 1),
    "commit": (command(Opcode.COMMIT), 1),
    **{f"{name} again": (request, 2) for name, request in MOTION.items()},
    "confirm": (command(Opcode.CONFIRM), 1),
    "store": (command(Opcode.STORE), 1),
    "disable": (command(Opcode.DISABLE), 1),
}
"""What `run --store` asks of the board, in this order: each request, and its which coming."""
FEW = ("arm", "first piece of a table", "commit", "start again", "store")
"""At rest and in both motions, with gains in no bank, in a part of one, tried, and for good."""


@dataclass
class Ambush:
    """Does something to the host when a request comes for the nth time; notes staged gains."""

    request: bytes = b""
    times: int = 0
    strike: Callable[[], None] = lambda: None
    staged: list[Gains] = field(default_factory=list)
    shadow: dict[int, int] = field(default_factory=dict)
    struck: threading.Event = field(default_factory=threading.Event)

    def __call__(self, sender: Sender, frame: bytes) -> None:
        """See `fault_line.Choose`."""
        if sender is not Sender.HOST:
            return
        if frame[1] == WRITE:
            address, words = int.from_bytes(frame[2:4], "big"), np.frombuffer(frame[7:-2], ">u2")
            self.shadow |= zip(range(address, address + len(words)), words.tolist(), strict=True)
        if frame.startswith(SHADOW):  # the last piece
            staged = [self.shadow[address] for address in addresses(SHADOW_SPANS)]
            self.staged.append(decode_gains(staged))
        if self.request and frame.startswith(self.request):
            self.times -= 1
            if self.times == 0:
                self.strike()
                self.struck.set()


@dataclass
class Site:
    """A board behind a proxy, and runs against it."""

    proxy: FaultProxy
    folder: Path
    first_gains: Gains
    changed: dict[str, str] = field(default_factory=dict)
    runs: int = 0

    @contextmanager
    def board(self) -> Iterator[Board]:
        """Another host, between runs."""
        with closing(connected_board(self.proxy.url)) as board:
            yield board

    @contextmanager
    def run(self, **options: object) -> Iterator[subprocess.Popen[str]]:
        """`edge-ident run --store` with the built-in drive, changed where the site says so."""
        self.runs += 1
        described = files("edge_ident.drive").joinpath("feed_drive.toml").read_text("utf-8")
        for old, new in self.changed.items():
            described = described.replace(old, new)
        drive = self.folder / "drive.toml"
        drive.write_text(described, "utf-8")
        arguments = ["run", "--device", self.proxy.url, "--drive", drive, "--store", "--json"]
        process = subprocess.Popen(
            [*COMMAND, *map(str, arguments), "--output", str(self.output)],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            **options,  # type: ignore[call-overload]
        )
        try:
            yield process
        finally:
            process.kill()
            process.communicate()

    @property
    def output(self) -> Path:
        """Folder of the last run."""
        return self.folder / f"run{self.runs}"

    def check_left_over(self, ambush: Ambush) -> None:
        """The machine stands, the gains are one whole set, and every file is whole."""
        with self.board() as board:
            resting = {State.IDLE, State.ARMED, State.DRAINING, State.DONE, State.FAULT}
            until(board, lambda status: status.state in resting)
            assert board.status().fault in (Fault.NONE, Fault.WATCHDOG)
            assert board.active_gains() in [self.first_gains, *ambush.staged]
        for path in self.output.glob("[!.]*"):
            if path.suffix == ".json":
                json.loads(path.read_text("utf-8"))
            elif path.suffix == ".npz":
                with np.load(path) as columns:
                    assert all(np.all(np.isfinite(columns[name])) for name in columns.files)

    def check_a_whole_run(self) -> None:
        """Another run ends with new gains; then the board is given back its first ones."""
        self.proxy.line.choose = Ambush()
        with self.run() as process:
            document, messages = process.communicate(timeout=60)
        assert process.returncode == 0, messages
        assert json.loads(document)["stored"]
        self.restore()

    def let_go(self) -> None:
        """End a dead host's hold before its five seconds are over; pages left to fetch keep it."""
        with self.board() as board:
            key = board.register_values("session.key")[0]

            def over(status: BoardStatus) -> bool:  # not as long as an axis moves
                draining = status.state is State.DRAINING
                return draining or refused_value(board, "session.release", key) == 0

            until(board, over)

    def restore(self) -> None:
        """Give the board its first gains, where they are not in force."""
        with self.board() as board:
            if board.active_gains() != self.first_gains:
                put_gains(board, self.first_gains)
                board.store()

    def gains_before(self) -> Gains:
        """What the last run found and backed up."""
        return dict(load_gains(self.output / "gains_before.json").gains)


@contextmanager
def site_of(
    board: list[str], folder: Path, changed: dict[str, str] | None = None
) -> Iterator[Site]:
    """A board that stops soon when the host is gone."""
    with serving(board) as served, FaultProxy(served.url, folder, FaultyLine()) as proxy:
        with closing(connected_board(proxy.url)) as host:
            host.write_register("watchdog.timeout", 0.4)
            first_gains = host.active_gains()
        yield Site(proxy, folder, first_gains, changed or {})


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Site]:
    """A Python virtual board for all tests of this file."""
    command = python_command(speed=PYTHON_SPEED)
    with site_of(command, tmp_path_factory.mktemp("site"), QUICKER) as found:
        yield found


def kill_at(site: Site, step: str) -> None:
    """A run that is killed when a request is on the line, and what it must leave."""
    request, times = STEPS[step]
    if step == "disable":  # a run leaves the effort on where a dead host had left it on
        with site.board() as board:
            board.disable()
    with site.run() as process:
        site.proxy.line.choose = ambush = Ambush(request, times, process.kill)
        _, messages = process.communicate(timeout=90)
    assert process.returncode == -signal.SIGKILL, messages
    assert ambush.struck.is_set()
    site.check_left_over(ambush)
    assert site.gains_before() == site.first_gains
    site.let_go()
    if step in ("confirm", "store", "disable"):
        with site.board() as board:
            assert board.active_gains() == ambush.staged[-1]
            assert not board.status().unconfirmed
        site.restore()


def test_killed_at_every_step_a_run_leaves_a_board_for_the_next(
    firmware: Path, tmp_path: Path, thorough: bool
) -> None:
    """Each run gets as far as its predecessor and one step further, from wherever that left the
    axes; the last gets to its end."""
    with site_of(c_command(firmware, speed=C_SPEED), tmp_path, QUICKER) as site:
        for step in STEPS if thorough else FEW:
            kill_at(site, step)
        site.check_a_whole_run()


@pytest.mark.parametrize("step", ["first page", "commit"])
def test_killed_where_most_is_under_way_a_run_leaves_the_virtual_board_for_the_next(
    site: Site, step: str
) -> None:
    kill_at(site, step)


def test_a_host_that_is_held_up_finds_the_machine_stopped(site: Site) -> None:
    with site.run() as process:
        # from the start on: on a busy machine a motion is soon over
        ambush = Ambush(MOTION["start"], 1, lambda: os.kill(process.pid, signal.SIGSTOP))
        site.proxy.line.choose = ambush
        assert ambush.struck.wait(60.0)
        time.sleep(0.8)
        process.send_signal(signal.SIGCONT)
        document, messages = process.communicate(timeout=60)
    assert process.returncode == 4, messages
    error = json.loads(document)
    assert "fault WATCHDOG" in error["cause"]
    assert "edge-ident clear-fault" in error["next_step"]
    site.check_left_over(ambush)


@pytest.mark.parametrize(
    ("room", "file"), [(0, "gains_before.json"), (20_000, "capture.npz")], ids=lambda value: value
)
def test_a_full_disk_ends_the_run_with_the_machine_stopped(
    site: Site, room: int, file: str
) -> None:
    """No file of this process may grow beyond so many bytes."""

    def limit() -> None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (room, room))

    site.proxy.line.choose = ambush = Ambush()
    with site.run(preexec_fn=limit) as process:
        document, messages = process.communicate(timeout=60)
    assert process.returncode == 5, messages
    assert "Traceback" not in messages
    error = json.loads(document)
    assert file in error["cause"]
    assert "free some space" in error["next_step"]
    assert not (site.output / file).exists()
    assert not ambush.staged
    site.check_left_over(ambush)
    with site.board() as board:
        assert board.status().state is State.IDLE


def test_after_all_of_that_a_run_gets_to_its_end(site: Site) -> None:
    site.check_a_whole_run()
