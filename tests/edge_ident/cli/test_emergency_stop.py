"""A person clears the wired emergency stop; no command does it by itself, on boards old and new."""

from pathlib import Path

import pytest

from edge_ident.commissioning import doctor
from edge_ident.commissioning.safety import make_ready
from firmware_interface.board import Board
from firmware_interface.errors import BoardError
from firmware_interface.registers import Fault
from firmware_interface.virtual.machine import Machine
from firmware_interface.virtual.settings import BoardSettings
from tests.edge_ident.shared_board import SharedBoard

CUT = "the wired emergency stop cut the effort"
CLEAR = "release the emergency stop, then run edge-ident clear-fault"


def _first_fault_stays(machine: Machine, fault: Fault) -> None:
    if not machine.fault:
        machine.fault, machine.fault_sample = fault, machine.samples


@pytest.fixture(params=["this firmware", "an older one"])
def shared(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> SharedBoard:
    """A board whose host fell silent; an older firmware goes on saying so after the stop."""
    if request.param == "an older one":
        monkeypatch.setattr(Machine, "_latch", _first_fault_stays)
    return SharedBoard(monkeypatch, BoardSettings(fault=Fault.WATCHDOG))


def tap_stop(shared: SharedBoard) -> None:
    """Press the emergency stop and release it, within a sample."""
    shared.virtual.inputs.press_stop()
    shared.virtual.inputs.release_stop()


@pytest.mark.parametrize("command", ["home", "hold --seconds 1", "capture", "run --dry-run"])
def test_no_command_clears_the_emergency_stop(
    shared: SharedBoard, command: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    tap_stop(shared)
    code, _, errors = shared.run(*command.split())
    assert code == 4
    assert CUT in errors
    assert "edge-ident clear-fault" in errors
    status = shared.board.status()
    assert (status.sto_latched, status.enabled) == (True, False)


def test_a_stop_pressed_while_the_command_waits_for_the_board_stays(
    shared: SharedBoard, monkeypatch: pytest.MonkeyPatch
) -> None:
    claim = Board.claim

    def waited(board: Board) -> None:
        claim(board)
        tap_stop(shared)

    monkeypatch.setattr(Board, "claim", waited)
    code, _, errors = shared.run("clear-fault")
    assert (code, CUT in errors) == (4, True)
    assert shared.board.status().sto_latched
    monkeypatch.setattr(Board, "claim", claim)
    assert shared.run("clear-fault")[0] == 0


def test_a_person_clears_it_and_is_told_what_it_was(shared: SharedBoard) -> None:
    tap_stop(shared)
    code, _, errors = shared.run("clear-fault")
    assert (code, CUT in errors) == (0, True)
    assert not shared.board.status().sto_latched
    assert shared.run("home")[0] == 0


def test_doctor_names_it(shared: SharedBoard, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(doctor, "_REQUESTS", 2)
    tap_stop(shared)
    code, checks, _ = shared.run("doctor")
    assert code == 1
    assert CUT in checks


def test_a_stop_that_comes_while_a_host_waits_for_the_board_counts(
    shared: SharedBoard, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The hold of a host that is gone lasts for seconds."""
    board = shared.board
    claim = board.claim

    def wait_and_claim() -> None:
        tap_stop(shared)
        claim()

    monkeypatch.setattr(board, "claim", wait_and_claim)
    with pytest.raises(BoardError, match=CUT):
        make_ready(board)
    assert board.status().sto_latched


@pytest.mark.parametrize("fault", [Fault.NONE, Fault.STO, Fault.TRAVEL])
def test_the_stop_is_said_beside_another_fault(
    monkeypatch: pytest.MonkeyPatch, fault: Fault
) -> None:
    shared = SharedBoard(monkeypatch, BoardSettings(fault=fault))
    tap_stop(shared)
    with pytest.raises(BoardError, match=CUT) as caught:
        make_ready(Board.connect(shared.virtual))
    if fault is Fault.TRAVEL:
        assert caught.value.cause.startswith("fault TRAVEL at sample 0: an axis left its travel")
        assert caught.value.next_step.startswith("release the emergency stop; move the axis back")
    else:
        assert caught.value.cause.startswith("fault STO")
        assert caught.value.next_step == CLEAR
