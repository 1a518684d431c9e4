"""The firmware identifies as Python says that it should, beside everything else that it does.

`edge_ident.estimation.network_estimate` defines what is computed. Both read the same counts.
"""

import json
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, Final

import numpy as np
import pytest

from tests.repetitions import a_few

pytest.importorskip("onnx")

from edge_ident.commissioning.capture import capture_motion
from edge_ident.drive.description import load_drive
from edge_ident.estimation.network import load_network
from edge_ident.estimation.network_estimate import BoardNetwork
from export.c_source.source import export_c
from firmware_interface.board import Board
from firmware_interface.board_identification import (
    BoardIdentification,
    CapturedCounts,
    decoded_identification,
    network_code,
    read_identification,
)
from firmware_interface.connection import open_link
from firmware_interface.registers import AXES, IdentificationReason, IdentificationState
from tests.export.c_builds import PROGRAMS, needs
from tests.export.identification_builds import (
    BOARD,
    FIRMWARE,
    build,
    exact_board,
    identified,
    rows,
    shortened,
    simulated,
)
from tools.arm_check.agreement import exact_int8

SINGLE: Final = 2.0**-24
"""Relative error of a register: half a digit of single precision."""
CASES: Final[dict[str, dict[str, Any]]] = {
    "soft gains, standstills": {},
    "noise": {"noise": 0.05, "seed": 3},
    "stiff gains": {"stiff": True},
    "little noise": {"noise": 0.01, "seed": 8, "cycles": 1},
    "two periods": {"cycles": 2},
}

with_reference = pytest.mark.skipif(
    not exact_int8(), reason="needs an x86-64 processor with VNNI, for onnxruntime to be exact"
)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("identification")


@pytest.fixture(scope="module")
def program(folder: Path) -> Path:
    return build(folder, "identify_counts")


def require_same(found: BoardIdentification, captured: CapturedCounts) -> None:
    wanted = exact_board().identify(captured, BOARD)
    for name, axis in wanted.items():
        at = found.axes[name]
        assert (at.reason, at.images) == (axis.reason, axis.images)
        np.testing.assert_allclose(at.parameters, axis.parameters, rtol=2.0 * SINGLE)
        np.testing.assert_allclose(at.relative_residual, axis.relative_residual, rtol=1e-5)


# ---- what it finds


@with_reference
@needs("gcc", "make")
@pytest.mark.parametrize("case", a_few(CASES, ["soft gains, standstills", "two periods"]))
def test_the_firmware_finds_what_python_finds(case: str, program: Path) -> None:
    """To the last digit of the registers; every stage differs by rounding in double alone."""
    captured = simulated(**CASES[case])
    found = identified(program, captured)
    assert found.state is IdentificationState.DONE
    assert found.network == network_code(load_network("int8").sha256)
    require_same(found, captured)


@needs("gcc", "make")
def test_the_sigmoid_moves_what_it_finds_by_less_than_a_standard_deviation(program: Path) -> None:
    """Python asks the network as it is exported, whose sigmoid errs: `run` compares with that."""
    captured = simulated()
    found = identified(program, captured)
    network = BoardNetwork(load_network("int8"))
    for name, (_, estimate) in network.estimates(captured, BOARD).items():
        assert estimate is not None
        apart = np.array(found.axes[name].parameters) - estimate.parameters
        assert np.max(np.abs(apart) / estimate.std) < 1.0


def _still(captured: CapturedCounts) -> CapturedCounts:
    return CapturedCounts(np.zeros_like(captured.position), captured.effort)


def _twice_as_fast(captured: CapturedCounts) -> CapturedCounts:
    position = np.concatenate([captured.position[::2], captured.position[::2]])
    return CapturedCounts(position, captured.effort[: len(position)])


def _without_effort(captured: CapturedCounts) -> CapturedCounts:
    return CapturedCounts(captured.position, np.zeros_like(captured.effort))


def _other_effort(captured: CapturedCounts) -> CapturedCounts:
    noise = np.random.default_rng(4).integers(-2000, 2000, (20, len(AXES)))
    effort = np.repeat(noise, len(captured.effort) // 20 + 1, axis=0)
    return CapturedCounts(captured.position, effort[: len(captured.effort)])


@needs("gcc", "make")
@pytest.mark.parametrize(
    ("change", "reason"),
    [
        (lambda captured: shortened(captured, 8000), IdentificationReason.TOO_SHORT),
        (lambda captured: shortened(captured, 900), IdentificationReason.TOO_SHORT),
        (_still, IdentificationReason.STANDSTILL),
        (_twice_as_fast, IdentificationReason.OTHER_MOTION),
        (_without_effort, IdentificationReason.NO_EFFORT),
        (_other_effort, IdentificationReason.UNEXPLAINED),
    ],
    ids=["short", "very short", "still", "other motion", "no effort", "unexplained"],
)
def test_why_it_finds_nothing(
    change: Callable[[CapturedCounts], CapturedCounts], reason: IdentificationReason, program: Path
) -> None:
    captured = change(simulated())
    found = identified(program, captured)
    assert found.state is IdentificationState.FAILED
    assert {axis.reason for axis in found.axes.values()} == {reason}
    assert {axis.parameters for axis in found.axes.values()} == {(0.0,) * 4}
    wanted = BoardNetwork(load_network("int8")).identify(captured, BOARD)
    assert {axis.reason for axis in wanted.values()} == {reason}


@needs("gcc", "make")
def test_counters_may_wrap_around(program: Path) -> None:
    captured = simulated()
    moved = (captured.position + 2**31 - 3000 + 2**31) % 2**32 - 2**31
    assert np.ptp(moved) > 2**31
    again = identified(program, CapturedCounts(moved, captured.effort))
    assert again == identified(program, captured)


# ---- on a microcontroller


@with_reference
@needs("arm-none-eabi-gcc", "qemu-system-arm")
@pytest.mark.parametrize(
    ("cpu", "fpu", "machine", "mhz"),
    a_few(
        [("m7", "fpv5-d16", "mps2-an500", 480), ("m4", "fpv4-sp-d16", "mps2-an386", 168)],
        [("m4", "fpv4-sp-d16", "mps2-an386", 168)],
    ),
)
def test_a_cortex_m_finds_the_same(
    cpu: str, fpu: str, machine: str, mhz: int, folder: Path
) -> None:
    """Within a billion instructions for both axes, and 4 KiB of stack.

    The line is served again after a millisecond at most, at one instruction per cycle. A Cortex-M4
    computes the signals, which are in double precision, in software.
    """
    captured = simulated()
    said = _on_cortex_m(folder, captured, cpu, fpu, machine)
    words = [value for name, value in said if name == "word"]
    require_same(decoded_identification(words), captured)
    numbers = dict(said)
    assert numbers["thousands"] < 1_000_000
    assert numbers["most"] < 1000 * mhz
    assert numbers["stack"] < 4096


def _on_cortex_m(
    folder: Path, captured: CapturedCounts, cpu: str, fpu: str, machine: str
) -> list[tuple[str, int]]:
    """What the program says: names and values."""
    network, target = folder / "network", folder / f"cortex_{cpu}"
    if not network.exists():
        export_c(network)
    lines = "\n".join("{" + ", ".join(map(str, row)) + "}," for row in rows(captured))
    (folder / "capture.h").write_text(
        f"#define COUNTS_PER_TURN {BOARD.counts_per_turn}u\n"
        f"#define EFFORT_PER_COUNT_NM {BOARD.effort_per_count_nm.hex()}f\n"
        f"#define CONTROL_DELAY_NS {round(1e9 * BOARD.control_delay_s)}u\n"
        f"#define SAMPLES {len(captured.position)}u\n"
        f"static const int32_t captured[SAMPLES][4] = {{\n{lines}\n}};\n"
    )
    sources = [*sorted((FIRMWARE / "identification").glob("*.c")), *sorted(network.glob("*.c"))]
    sources += [FIRMWARE / f"{name}.c" for name in ("crc", "register_file", "numbers")]
    command = [
        "arm-none-eabi-gcc", f"-mcpu=cortex-{cpu}", "-mthumb", "-mfloat-abi=hard", f"-mfpu={fpu}",
        "-std=c99", "-O2", "-ffunction-sections", "-Wl,--gc-sections", "-nostartfiles",
        "-specs=nosys.specs", "-DFD_IDENTIFICATION", "-DNETWORK_PAUSE=identification_pause",
        "-I", folder, "-I", FIRMWARE, "-I", network, "-T", PROGRAMS / "cortex_m.ld",
        "-o", target, PROGRAMS / "identify_cortex_m.c", *sources, "-lm",
    ]  # fmt: skip
    subprocess.run(list(map(str, command)), check=True)
    emulator = [
        "qemu-system-arm", "-machine", machine, "-nographic", "-icount", "shift=0",
        "-semihosting-config", "enable=on,target=native", "-kernel", target,
    ]  # fmt: skip
    done = subprocess.run(
        list(map(str, emulator)), capture_output=True, text=True, check=True, timeout=300
    )
    said = (line.split() for line in (done.stdout + done.stderr).splitlines())
    return [(name, int(value, 16)) for name, value in said]


# ---- beside everything else


@pytest.fixture(scope="module")
def sanitized(folder: Path) -> Path:
    build(folder, "sanitized")
    return folder / "sanitized"


@pytest.fixture
def board(sanitized: Path) -> Iterator[Board]:
    # a motion of 27 s takes three: on a busy computer, pages of a quicker one come too fast
    command = [str(sanitized / "firmware"), "--speed", "10"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        try:
            link = open_link(process.stdout.readline().strip(), timeout_s=2.0)
            yield Board.connect(link)
            link.close()
        finally:
            process.terminate()
    assert process.returncode == 0  # a sanitizer's complaint is an exit code


def _move(board: Board, cycles: int | None = None) -> None:
    if not board.status().enabled:
        board.enable()
    capture_motion(board, load_drive().trajectory(cycles), lambda done, of: None)


@needs("gcc", "make")
def test_a_board_identifies_while_it_answers(board: Board) -> None:
    """And computes after a host is gone as well; it may be done before the first question."""
    assert read_identification(board._session.read, 5).state is IdentificationState.NONE
    _move(board)
    while (found := board.identification(0.0)).state is not IdentificationState.DONE:
        assert found.state is IdentificationState.RUNNING
        assert not found.axes["x"].images
        board.heartbeat()
    board.finish()
    for name, axis in found.axes.items():
        assert axis.reason is IdentificationReason.NONE, name
        assert axis.relative_residual < 0.01
    assert board.identification(0.0) == found


@needs("gcc", "make")
def test_a_stopped_motion_has_no_answer_nor_the_one_before(board: Board) -> None:
    _move(board)
    board.finish()
    drive = load_drive()
    board.write_trajectory(drive.trajectory())
    board.arm()
    board.start()
    found = board.identification(0.0)
    assert found.state is IdentificationState.CAPTURING
    assert found.axes["x"].parameters == (0.0,) * 4
    board.quick_stop()
    found = board.identification(1.0)
    assert found.state is IdentificationState.FAILED
    assert {axis.reason for axis in found.axes.values()} == {IdentificationReason.STOPPED}


@needs("gcc", "make")
def test_its_checks_in_simulated_time_pass_with_the_network_too(sanitized: Path) -> None:
    listed = subprocess.run([sanitized / "checks"], capture_output=True, text=True, check=True)
    for name in listed.stdout.split():
        done = subprocess.run([sanitized / "checks", name], capture_output=True, text=True)
        assert done.returncode == 0, (name, done.stderr)


@needs("gcc", "make")
def test_run_tells_what_the_board_says_and_that_it_agrees(folder: Path, tmp_path: Path) -> None:
    """The whole job on the C firmware with its own network, built as for a user."""
    build(folder, "all")
    command = [str(folder / "firmware"), "--speed", "20"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        try:
            device = process.stdout.readline().strip()
            run = [sys.executable, "-m", "edge_ident", "run", "--dry-run", "--json"]
            run += ["--device", device, "--output", str(tmp_path)]
            done = subprocess.run(run, capture_output=True, text=True, timeout=120, check=False)
        finally:
            process.terminate()
    assert done.returncode == 0, done.stderr
    document = json.loads(done.stdout)
    said = document["board_identification"]
    assert said["state"] == "DONE"
    assert said["network"] == load_network("int8").sha256[:8]
    for name, axis in said["axes"].items():
        assert axis["verdict"] == "agrees", axis["said"]
        inertia = axis["parameters"]["inertia"]
        own = document["identification"]["axes"][name]["parameters"]["inertia"]["value"]
        assert inertia["value"] - own == pytest.approx(inertia["difference"])
        assert abs(inertia["value"] - inertia["recomputed"]) < inertia["std"]
    assert "The board itself" in (tmp_path / "report.html").read_text("utf-8")
