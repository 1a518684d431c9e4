"""Both boards, and the host, with Modbus programs that nobody here wrote."""

import shutil
import socket
import subprocess
from pathlib import Path

import numpy as np
import pytest
from conformance_boards import Served

from firmware_interface.board import Board
from firmware_interface.board_types import read_status
from firmware_interface.codec import (
    crc32,
    decode_page,
    encode,
    encode_trajectory,
    trajectory_words,
    words_to_bytes,
)
from firmware_interface.connection import open_link
from firmware_interface.motion import Multisine, SineComponent, Trajectory
from firmware_interface.registers import (
    MAGIC,
    MAP_CRC,
    PAGE_ADDRESS,
    PAGE_WORDS,
    REGISTERS,
    Opcode,
    State,
)

HERE = Path(__file__).parent
STATUS = REGISTERS["status.state"].address
STATUS_WORDS = REGISTERS["measured.z.speed"].address + 2 - STATUS
KEY = 4711
SINE = Multisine((SineComponent(0.2, 2.0, 0.0),))
MOTION = Trajectory({"x": SINE, "z": SINE}, 0.25, 0.5)


@pytest.fixture(scope="session")
def libmodbus(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder with the programs made of libmodbus."""
    flags = ["pkg-config", "--cflags", "--libs", "libmodbus"]
    missing = [tool for tool in ("gcc", "pkg-config") if shutil.which(tool) is None]
    if missing or subprocess.run(flags, capture_output=True, check=False).returncode:
        pytest.skip("needs gcc, pkg-config and libmodbus-dev")
    folder = tmp_path_factory.mktemp("libmodbus")
    found = subprocess.run(flags, capture_output=True, text=True, check=True).stdout.split()
    for name in ("libmodbus_master", "libmodbus_slave"):
        source = HERE / f"{name}.c"
        command = ["gcc", "-std=c99", "-Wall", "-Wextra", "-Werror", "-o", folder / name, source]
        subprocess.run([*command, *found], check=True)
    return folder


class Master:
    """The libmodbus master, one process a call."""

    def __init__(self, programs: Path, url: str) -> None:
        self._command = [str(programs / "libmodbus_master"), url]

    def __call__(self, *words: object) -> list[str]:
        """Lines that it prints."""
        command = [*self._command, *map(str, words)]
        ran = subprocess.run(command, capture_output=True, text=True, timeout=10, check=False)
        assert ran.returncode == 0, ran.stderr
        return ran.stdout.splitlines()

    def read(self, address: int, count: int) -> list[int]:
        """Words of consecutive registers."""
        return list(map(int, self("read", address, count)[0].split()))

    def write(self, address: int, words: list[int]) -> str:
        """What comes of a write of several registers."""
        return self("writes", address, *words)[0]

    def command(self, opcode: Opcode, token: int, argument: int = 0) -> str:
        """What comes of a command."""
        words = encode("command.opcode", opcode) + encode("command.token", token)
        words += encode("command.argument", argument) + encode("command.key", KEY)
        return self.write(REGISTERS["command.opcode"].address, words)

    def beat(self, pages: int = 0) -> str:
        """Hold the board, and feed its watchdog."""
        words = encode("session.key", KEY) + encode("capture.pages_acknowledged", pages)
        return self.write(REGISTERS["session.key"].address, words)


def test_a_libmodbus_master_moves_the_machine_and_reads_the_capture(
    either_kind: Served, libmodbus: Path
) -> None:
    master = Master(libmodbus, either_kind.url)
    assert master.read(0, 2) == [MAGIC >> 16, MAGIC & 0xFFFF]
    assert read_status(master.read).state is State.IDLE
    assert master.beat() == "done"
    token = read_status(master.read).last_token + 1
    assert master.command(Opcode.ENABLE, token) == "done"
    writes = encode_trajectory(MOTION, 0.0025)
    for address, words in writes:
        assert master.write(address, words) == "done"
    assert master.command(Opcode.ARM, token + 1, crc32(trajectory_words(writes))) == "done"
    for _ in range(200):
        if read_status(master.read).state is State.ARMED:
            break
    assert master.command(Opcode.START, token + 2, MAP_CRC) == "done"
    for _ in range(200):
        assert master.beat() == "done"
        if read_status(master.read).state is State.DRAINING:
            break
    assert read_status(master.read).samples_captured == 100
    pages = [decode_page(master.read(PAGE_ADDRESS + 128 * n, PAGE_WORDS)) for n in range(8)]
    position = np.vstack([page.position + page.following_error for page in pages])[:, 0]
    wanted = 0.2 * np.sin(2.0 * 0.0025 * np.arange(100)) * 8400 / (2.0 * np.pi)
    np.testing.assert_allclose(position, wanted, atol=0.51)
    assert master.beat(8) == "done"
    for _ in range(200):
        if read_status(master.read).state is State.DONE:
            break
    assert master.command(Opcode.FINISH, token + 3) == "done"
    assert read_status(master.read).state is State.IDLE
    assert master.command(Opcode.DISABLE, token + 4) == "done"
    assert not read_status(master.read).enabled
    assert master.write(REGISTERS["session.release"].address, [0, KEY]) == "done"


def test_a_libmodbus_master_understands_refusals(either_kind: Served, libmodbus: Path) -> None:
    master = Master(libmodbus, either_kind.url)
    timeout = REGISTERS["watchdog.timeout"].address
    assert master("write", timeout, 900, "read", timeout, 1) == ["done", "900"]
    assert master("write", timeout, 1, "write", 0, 1, "read", 0x0F00, 1) == [
        "Illegal data value",
        "Illegal data address",
        "Illegal data address",
    ]
    assert master("write", timeout, 1000) == ["done"]


@pytest.mark.skipif(shutil.which("mbpoll") is None, reason="needs mbpoll")
@pytest.mark.parametrize(
    ("address", "count"),
    [(0, 20), (STATUS, STATUS_WORDS), (PAGE_ADDRESS, PAGE_WORDS)],
    ids=["identity", "status", "page"],
)
def test_mbpoll_reads(either_kind: Served, address: int, count: int) -> None:
    line = ["-m", "rtu", "-a", "1", "-b", "115200", "-P", "none"]
    what = ["-0", "-1", "-r", str(address), "-c", str(count), "-t", "4:hex"]
    command = ["mbpoll", *line, *what, either_kind.url]
    ran = subprocess.run(command, capture_output=True, text=True, timeout=10, check=False)
    assert ran.returncode == 0, ran.stdout + ran.stderr
    rows = [row.split() for row in ran.stdout.splitlines() if row.startswith("[")]
    words = {int(row[0].strip("[]:")): int(row[1], 16) for row in rows}
    assert list(words) == list(range(address, address + count))
    if address == 0:
        assert (words[0], words[1]) == (MAGIC >> 16, MAGIC & 0xFFFF)
    if address == STATUS:
        assert read_status(lambda *_: list(words.values())).state is State.IDLE
    if address == PAGE_ADDRESS and any(words.values()):
        decode_page(list(words.values()))


def test_the_host_reads_a_libmodbus_slave(
    either_board: Board, libmodbus: Path, tmp_path: Path
) -> None:
    """A register image of the board, served by libmodbus, is the board to the host."""
    either_board.enable()
    either_board.write_trajectory(MOTION)
    either_board.arm()
    either_board.start()
    pages = list(either_board.capture_pages())
    either_board.finish()
    image = [0] * 0x9000
    for register in REGISTERS.values():
        end = register.address + register.words
        image[register.address : end] = either_board._link.read(register.address, register.words)
    for address in range(PAGE_ADDRESS, PAGE_ADDRESS + 8 * 128, 128):
        image[address : address + PAGE_WORDS] = either_board._link.read(address, PAGE_WORDS)
    (tmp_path / "image").write_bytes(words_to_bytes(image))
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    command = [str(libmodbus / "libmodbus_slave"), str(tmp_path / "image"), str(port)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as slave:
        assert slave.stdout is not None
        assert slave.stdout.readline() == "ready\n"
        copy = Board.connect(open_link(f"tcp://127.0.0.1:{port}"))
        assert copy.identity == either_board.identity
        assert copy.limits() == either_board.limits()
        assert copy.active_gains() == either_board.active_gains()
        last = copy.read_last_page()
        np.testing.assert_array_equal(last.position_rad, pages[-1].position_rad)
        copy.close()
        assert slave.wait(5.0) == 0
