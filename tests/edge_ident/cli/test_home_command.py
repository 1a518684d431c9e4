"""`edge-ident home` and `hold`, and what every command that moves does about the effort."""

import json
import math
from pathlib import Path

import pytest

from edge_ident.commissioning.homing import Homing, Way
from edge_ident.drive.description import load_drive
from firmware_interface.registers import State
from tests.edge_ident.shared_board import SharedBoard


@pytest.fixture
def shared(monkeypatch: pytest.MonkeyPatch) -> SharedBoard:
    return SharedBoard(monkeypatch)


def positions(shared: SharedBoard) -> dict[str, float]:
    return dict(shared.board.status().position_rad)


def test_home_moves_only_what_was_named_and_back_to_zero(shared: SharedBoard) -> None:
    document = shared.json("home", "--to", "x=2.5")
    assert document["axes"]["x"]["to_rad"] == 2.5
    # soft start-up gains leave it short of the target by what friction holds
    assert positions(shared)["x"] == pytest.approx(2.5, abs=0.06)
    assert positions(shared)["z"] == pytest.approx(0.0, abs=0.01)
    document = shared.json("home")
    assert document["axes"]["x"]["from_rad"] == pytest.approx(2.5, abs=0.06)
    assert positions(shared)["x"] == pytest.approx(0.0, abs=0.06)
    assert document["time_s"] > 1.875 * 2.4 / 0.8


def test_home_says_what_is_left_of_the_way(shared: SharedBoard) -> None:
    _, printed, messages = shared.run("home", "--to", "x=2.5")
    left = 2.5 - positions(shared)["x"]
    assert f"{left:.4f} rad from 2.5000" in printed.splitlines()[0]
    assert "less than half" not in messages
    code, printed, messages = shared.run("home", "--by", "x=0.005")
    assert code == 1
    assert "axis x made less than half of its way" in messages


def test_an_axis_that_was_not_told_to_move_is_not_stuck(shared: SharedBoard) -> None:
    """Positions pass the board as float32: rounding makes a way of some nanoradians."""
    shared.run("home", "--to", "z=0.7")
    _, _, messages = shared.run("home", "--to", "x=1.0")
    assert "less than half" not in messages


@pytest.mark.parametrize("way_rad", [6e-9, 1e-5, 2e-3])
def test_only_a_way_of_a_count_can_be_missed(way_rad: float) -> None:
    homing = Homing({"z": Way(0.7, 0.7 + way_rad, 0.7)}, 1.0, 1e-3)
    assert homing.stuck == (("z",) if way_rad > 1e-3 else ())


def test_a_command_that_fails_says_that_the_effort_is_off_again(shared: SharedBoard) -> None:
    code, _, messages = shared.run("home", "--to", "x=0.5", "--speed", "1e9")
    assert code != 0
    assert "drives now produce effort" not in messages
    code, _, messages = shared.run("run", "--bandwidth", "40", "--no-diagnose", "--cycles", "1")
    assert code == 1
    lines = messages.splitlines()
    enabled = next(at for at, line in enumerate(lines) if "drives now produce effort" in line)
    assert lines.index("axes disabled again") > enabled
    assert not shared.board.status().enabled


@pytest.mark.parametrize("option", ["--to", "--by"])
def test_an_axis_has_one_target(shared: SharedBoard, option: str) -> None:
    code, _, messages = shared.run("home", option, "x=1", option, "x=2")
    assert code == 2
    assert "x is named twice" in messages


@pytest.mark.parametrize("speed", ["1e-9", "1e-300"])
def test_a_way_that_takes_too_long_asks_for_more_speed(shared: SharedBoard, speed: str) -> None:
    code, _, messages = shared.run("home", "--by", "x=0.1", "--speed", speed)
    assert code == 4
    assert "longer than the board allows" in messages
    assert "--speed" in messages


def test_home_keeps_the_speed_that_it_is_given(
    shared: SharedBoard, monkeypatch: pytest.MonkeyPatch
) -> None:
    fastest = 0.0
    drive = shared.virtual.machine.drive
    sample = drive.sample

    def watched(setpoints: list) -> object:  # type: ignore[type-arg]
        nonlocal fastest
        fastest = max(fastest, *(abs(setpoint.velocity_rad_s) for setpoint in setpoints))
        return sample(setpoints)

    monkeypatch.setattr(drive, "sample", watched)
    shared.json("home", "--to", "x=1.0", "--to", "z=-0.5", "--speed", "0.4")
    assert fastest == pytest.approx(0.4, rel=0.01)


def test_home_moves_by_degrees_from_where_an_axis_stands(shared: SharedBoard) -> None:
    shared.json("home", "--to", "x=60deg")
    stood = positions(shared)
    code, text, _ = shared.run("home", "--by", "x=-5deg", "--speed", "0.1", "--json")
    assert code == 1  # soft start-up gains leave it short
    document = json.loads(text)
    way = document["axes"]["x"]
    assert way["from_rad"] == pytest.approx(stood["x"], abs=0.001)
    assert way["to_rad"] == pytest.approx(stood["x"] - math.radians(5.0), abs=0.001)
    assert document["axes"]["z"]["reached_rad"] == pytest.approx(stood["z"], abs=0.001)


def test_home_moves_from_where_the_machine_comes_to_rest(shared: SharedBoard) -> None:
    """A host began a motion, and went away."""
    gone = shared.board
    gone.enable()
    gone.write_register("watchdog.timeout", 2.0)
    gone.write_trajectory(load_drive().trajectory())
    gone.arm()
    gone.start()
    while gone.status().clock_samples < 2400:
        gone.heartbeat()
    assert gone.status().state is State.MOVING
    x = shared.json("home", "--by", "x=0.3")["axes"]["x"]
    assert x["to_rad"] - x["from_rad"] == pytest.approx(0.3, abs=0.002)


def test_hold_says_how_far_an_axis_was_pushed_and_what_held_it(
    shared: SharedBoard, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A hand pushes x with 4 N*m: 1.4 are friction's, the spring of 30 N*m/rad has the rest."""
    drive = shared.virtual.machine.drive
    advance = drive.plant.advance

    def pushed(effort_nm: list[float]) -> None:
        push_nm = 4.0 if drive.powered else 0.0
        advance([effort_nm[0] + push_nm, effort_nm[1]])

    monkeypatch.setattr(drive.plant, "advance", pushed)
    document = shared.json("hold", "--seconds", "2")
    x, z = document["axes"]["x"], document["axes"]["z"]
    assert x["pushed_rad"] == pytest.approx(2.6 / 30.0, rel=0.2)
    assert x["effort_nm"] == pytest.approx(-2.6, rel=0.2)
    assert abs(z["pushed_rad"]) < 0.002
    assert not shared.board.status().enabled


def test_home_says_the_way_and_the_time_before_it_moves(shared: SharedBoard) -> None:
    _, _, errors = shared.run("home", "--to", "x=1.0")
    assert "x 0.000 → 1.000 rad" in errors
    assert " s\n" in errors


@pytest.mark.parametrize(
    ("arguments", "code", "said"),
    [
        (["--to", "x=11"], 4, "outside the travel"),
        (["--to", "x=nan"], 4, "outside the travel"),
        (["--to", "y=1"], 4, "no axis y"),
        (["--to", "x"], 2, "x=90deg"),
        (["--by", "x=5grad"], 2, "x=90deg"),
        (["--by", "x=600deg"], 4, "outside the travel"),
        (["--by", "y=5deg"], 4, "no axis y"),
        (["--by", "x=5deg", "--to", "z=1"], 2, "either --to or --by"),
        (["--speed", "4.1"], 4, "4.1 rad/s is refused"),
        (["--speed", "0"], 4, "0 rad/s is refused"),
    ],
)
def test_what_home_may_not_do_is_refused_before_anything_is_switched_on(
    shared: SharedBoard, arguments: list[str], code: int, said: str
) -> None:
    found, _, errors = shared.run("home", *arguments)
    assert found == code
    assert said in errors
    assert not shared.board.status().enabled


@pytest.mark.parametrize("found_on", [False, True])
@pytest.mark.parametrize("command", ["capture", "home", "hold"])
def test_the_effort_is_left_as_it_was_found_and_its_change_is_said(
    shared: SharedBoard, command: str, found_on: bool, tmp_path: Path
) -> None:
    if found_on:
        board = shared.board
        board.enable()
        board.release()
    arguments = ["--to", "x=0.5"] if command == "home" else []
    code, _, errors = shared.run(command, *arguments, "--output", tmp_path)
    assert code == 0, errors
    assert ("axes enabled" in errors) is not found_on
    status = shared.board.status()
    assert status.state is State.IDLE
    assert status.enabled is found_on
    assert status.session_remaining_s == 0.0


def test_that_axes_are_not_homed_is_said_once(shared: SharedBoard) -> None:
    _, _, errors = shared.run("home", "--to", "x=0.5")
    assert errors.count("not homed") == 1


@pytest.mark.parametrize("angle", ["x=0_5", "x=1_5deg"])
def test_a_number_that_python_alone_would_read_moves_nothing(
    angle: str, shared: SharedBoard
) -> None:
    code, _, errors = shared.run("home", "--by", angle)
    assert (code, "write the axis and a number" in errors) == (2, True)
    assert not shared.board.status().pages_written


def test_a_speed_with_an_underscore_is_not_ten_times_as_fast(shared: SharedBoard) -> None:
    """Python would take 0_3 for 3."""
    code, _, errors = shared.run("home", "--to", "x=0.5", "--speed", "0_3")
    assert (code, "not a valid float" in errors) == (2, True)
    assert not shared.board.status().pages_written
