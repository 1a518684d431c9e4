"""--fail: what fails on a virtual board, and what the host makes of it."""

import json
import sys
from contextlib import suppress
from pathlib import Path

import pytest
from typer.testing import CliRunner

from edge_ident.cli import app
from firmware_interface.board import Board
from firmware_interface.errors import NoReplyError
from firmware_interface.gains import AxisGains
from firmware_interface.registers import Fault, State
from firmware_interface.virtual.drive import SAMPLE_PERIOD_S
from firmware_interface.virtual.server import ENDING, OF_AXIS, OF_BOARD, FailingBoard, Failure
from tests.edge_ident.shared_board import SharedBoard
from tests.processes import running

LINK, BOARD = 3, 4


class Failing(SharedBoard):
    """A board on which things fail; `told` has what it says of them."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, *failures: str) -> None:
        self.told: list[str] = []
        wished = [Failure.parse(text) for text in failures]
        failing = FailingBoard(wished, on_failure=self.told.append)
        super().__init__(monkeypatch, virtual=failing)

    def outcome(self, tmp_path: Path) -> tuple[int, str, State, Fault]:
        """Exit code of a capture and what it says; then the board's state and fault."""
        code, _, said = self.run("capture", "--output", tmp_path)
        status = self.board.status()
        return code, said, status.state, status.fault


@pytest.mark.parametrize(
    ("failure", "fault"),
    [
        ("encoder_lost=x@motion+2s", Fault.FOLLOWING_ERROR),
        ("jam=z@motion+2s", Fault.FOLLOWING_ERROR),
        ("limit_switch=x@motion+2s", Fault.LIMIT_SWITCH),
        ("sto@motion+2s", Fault.STO),
    ],
)
def test_what_fails_in_a_motion_ends_it_in_fault_and_the_command_with_4(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, failure: str, fault: Fault
) -> None:
    shared = Failing(monkeypatch, failure)
    code, said, state, latched = shared.outcome(tmp_path)
    assert (code, state, latched) == (BOARD, State.FAULT, fault)
    assert f"fault {fault.name}" in said
    (told,) = shared.told
    assert told.startswith(f"{failure} begins")
    assert not shared.virtual.machine.enabled


def test_a_lost_encoder_counts_no_more_and_the_other_axis_does(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    shared = Failing(monkeypatch, "encoder_lost=x")
    shared.outcome(tmp_path)
    x, z = shared.board.status().position_rad.values()
    assert x == 0.0
    assert abs(z) > 0.1
    assert abs(shared.virtual.machine.drive.plant.output_rad[0]) > 0.1


def test_a_jammed_axis_stands(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    shared = Failing(monkeypatch, "jam=x")
    shared.outcome(tmp_path)
    x, z = shared.virtual.machine.drive.plant.output_rad
    assert x == 0.0
    assert abs(z) > 0.1


def test_gains_for_the_whole_axis_swing_behind_a_broken_coupling_and_the_board_ends_it(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    shared = Failing(monkeypatch, "coupling=x@motion+1s")
    board = shared.board
    board.stage_gains(dict.fromkeys("xz", AxisGains(120.0, 13.0, *[0.0] * 5, 0.5, 0.0)))
    board.commit()
    board.confirm()
    board.release()
    assert shared.outcome(tmp_path)[::2] == (BOARD, State.FAULT)
    assert shared.board.status().fault is Fault.OSCILLATION


def test_behind_a_broken_coupling_a_twenty_fifth_of_the_inertia_is_left(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Torque for one sample: the speed that it gives tells the inertia, at negligible friction."""
    speeds = []
    for failures in ((), ("coupling=x",)):
        shared = Failing(monkeypatch, *failures)
        plant = shared.virtual.machine.drive.plant
        shared.virtual.read(0, 1)
        plant.advance([12.0, 0.0])
        plant.advance([12.0, 0.0])
        speeds.append(plant.output_rad_s[0])
    whole, broken = speeds
    # of the whole axis, the motor begins to move before the joints pass its torque on
    assert broken / whole == pytest.approx(25.0, rel=0.2)


def test_a_cut_cable_is_a_link_error_and_the_boards_watchdog_stops_the_axes(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    shared = Failing(monkeypatch, "cable@motion+2s-12s")
    code, _, said = shared.run("capture", "--output", tmp_path)
    assert code == LINK
    assert "cable" in said
    for _ in range(round(12.0 / SAMPLE_PERIOD_S)):
        with suppress(NoReplyError):
            shared.virtual.read(0, 1)
    status = shared.board.status()
    assert (status.state, status.fault) == (State.FAULT, Fault.WATCHDOG)
    assert [line.split(",")[0] for line in shared.told] == [
        "cable@motion+2s-12s begins",
        "cable@motion+2s-12s ends",
    ]


def test_after_a_brownout_the_board_is_idle_with_the_gains_as_stored(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    shared = Failing(monkeypatch, "brownout@motion+2s")
    board = shared.board
    first = board.active_gains()
    softer = AxisGains(25.0, 3.0, 0.0, 0.0078125, 0.0, 0.0, 0.0, 0.5, 0.0)
    for store in (True, False):
        gains = dict.fromkeys("xz", softer if store else first["x"])
        board.stage_gains(gains)
        board.commit()
        board.confirm()
        if store:
            board.store()
    board.release()
    code, said, state, fault = shared.outcome(tmp_path)
    assert (code, state, fault) == (BOARD, State.IDLE, Fault.NONE)
    assert "the board has restarted" in said
    assert shared.board.active_gains() == dict.fromkeys("xz", softer)
    assert not shared.virtual.machine.enabled


def test_several_fail_each_at_its_time(monkeypatch: pytest.MonkeyPatch) -> None:
    shared = Failing(monkeypatch, "limit_switch=z@0.5s-0.75s", "sto@0.25s-0.5s")
    seen = []
    for _ in range(320):
        shared.virtual.read(0, 1)
        inputs = shared.virtual.inputs
        seen.append((inputs.sto_active, inputs.limit_switches))
    changes = [n for n in range(1, 320) if seen[n] != seen[n - 1]]
    assert changes == [100, 200, 300]
    assert [seen[n] for n in (0, *changes)] == [(False, 0), (True, 0), (False, 0b1100), (False, 0)]


def test_a_motion_is_counted_from_its_start(monkeypatch: pytest.MonkeyPatch) -> None:
    shared = Failing(monkeypatch, "sto@motion2+0.1s")
    for target in ("x=0.1", "x=0.2"):
        code, _, said = shared.run("home", "--to", target)
        assert (code, "fault STO" in said) == ((0, False) if target == "x=0.1" else (BOARD, True))


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("encoder@3s", "there is no failure 'encoder': did you mean encoder_lost?"),
        ("", "there is no failure ''. Known are: encoder_lost=AXIS"),
        ("fire@3s", ", ".join(OF_BOARD)),
        ("jam@3s", "jam@3s: name its axis, as in jam=x@3s; there are x and z"),
        ("jam=y@3s", "jam=y@3s: name its axis"),
        ("sto=x@3s", "sto=x@3s: sto has no axis"),
        ("sto@", "sto@: '' is no time"),
        ("sto@3", "sto@3: '3' is no time. Write @3s"),
        ("sto@-3s", "'-3s' is no time"),
        ("sto@٣s", "'٣s' is no time"),
        ("sto@motion3s", "'motion3s' is no time"),
        ("sto@motion0+3s", "'motion0+3s' is no time"),
        ("sto@3s-3s", "sto@3s-3s: it ends before it begins"),
        ("jam=x@3s-4s", f"jam=x@3s-4s: jam does not end; these do: {', '.join(ENDING)}"),
    ],
)
def test_what_cannot_be_is_refused_by_name(text: str, says: str) -> None:
    done = CliRunner().invoke(app, ["board", "--pty", "--fail", "sto@5s", "--fail", text])
    assert done.exit_code == 2
    assert says in " ".join(done.stderr.replace("│", " ").split())


def test_each_is_read_as_it_is_written() -> None:
    assert Failure.parse("sto").begin_s == 0.0
    late = Failure.parse("cable@motion3+1.5s-2s")
    assert (late.motion, late.begin_s, late.end_s) == (3, 1.5, 2.0)
    assert Failure.parse("jam=z@3s").axis == 1
    assert {*ENDING} < {*OF_AXIS, *OF_BOARD}


@pytest.mark.real_time
@pytest.mark.parametrize("line", [["--pty"], ["--tcp", "0"]])
def test_on_a_served_board_a_cut_cable_is_silence(line: list[str], tmp_path: Path) -> None:
    command = [sys.executable, "-m", "edge_ident", "board", *line, "--speed", "10"]
    with running([*command, "--fail", "cable@motion+2s"]) as process:
        assert process.stdout is not None
        assert process.stderr is not None
        device = process.stdout.readline().strip()
        capture = ["capture", "--json", "--device", device, "--output", str(tmp_path)]
        done = CliRunner().invoke(app, capture)
        assert done.exit_code == LINK
        assert json.loads(done.stdout)["error"] == "NoReplyError"
        told = [process.stderr.readline() for _ in range(3 if "--tcp" in line else 2)]
    assert told[-1].startswith("cable@motion+2s begins")


def test_without_a_failure_the_board_is_as_any_other(monkeypatch: pytest.MonkeyPatch) -> None:
    shared = Failing(monkeypatch)
    assert shared.run("home", "--to", "x=0.1")[0] == 0
    assert Board.connect(shared.virtual).status().fault is Fault.NONE
