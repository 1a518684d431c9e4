"""A plant in another process: its protocol, the C firmware on it, and the page's own example."""

import json
import math
import re
import socket
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
from conformance_boards import c_command, serving, sines, start, until
from typer.testing import CliRunner

from edge_ident import diagnose, load_recording
from edge_ident.cli import app
from firmware_interface.motion import Trajectory
from firmware_interface.plant import Hidden
from firmware_interface.plant.plant_socket import PlantSession
from firmware_interface.registers import State
from tests.processes import running

PAGE = Path(__file__).parents[2] / "docs" / "plant_socket.md"
HIDE = ["--hide", "stribeck_friction=0.5", "--axis", "z"]
FIRST = "plant 1 0.0025 0.0005 2\n"


@contextmanager
def served_plant(path: Path, *options: str) -> Iterator[None]:
    command = [sys.executable, "-m", "edge_ident", "plant", "--socket", str(path), *options]
    with running(command, errors=None) as process:
        assert process.stdout is not None
        assert process.stdout.readline().strip() == str(path)
        yield


# ---- the protocol


def test_it_answers_with_what_the_encoders_of_the_drive_show() -> None:
    hidden = Hidden.of(["encoder_eccentricity", "backlash"])
    session, plant = PlantSession(hidden.plant), hidden.plant()
    answers, expected = [session.answer(FIRST)], [plant.shown_rad]
    for row in range(400):
        command = [3.0 * math.sin(0.05 * row), -2.0]
        answers.append(session.answer(f"{command[0]!r} {command[1]!r}\n"))
        plant.advance(command)
        expected.append(plant.shown_rad)
    assert [[float(word) for word in answer.split()] for answer in answers] == expected
    assert abs(expected[-1][1]) > 0.1


@pytest.mark.parametrize(
    ("lines", "reason"),
    [
        (["hello\n"], "expected: plant 1 PERIOD_S DELAY_S AXES"),
        (["plant 2 0.0025 0.0005 2\n"], "expected: plant 1"),
        (["plant 1 0 0 2\n"], "no such period or delay"),
        (["plant 1 0.0025 0.003 2\n"], "no such period or delay"),
        (["plant 1 0.0025 0.0005 3\n"], "the plant has 2 axes"),
        ([FIRST, "1.0\n"], "2 efforts expected"),
        ([FIRST, "1.0 much\n"], "could not convert"),
        ([FIRST, "1.0 nan\n"], "not finite"),
    ],
)
def test_a_line_that_makes_no_sense_is_refused(lines: list[str], reason: str) -> None:
    session = PlantSession(Hidden((), ()).plant)
    *before, last = lines
    for line in before:
        session.answer(line)
    with pytest.raises(ValueError, match=reason):
        session.answer(last)


def test_a_connection_gets_a_new_drive_or_the_reason_and_no_socket_is_left(tmp_path: Path) -> None:
    path = tmp_path / "drive"
    with socket.socket(socket.AF_UNIX) as gone:
        gone.bind(str(path))  # of a plant that was killed
    answers = []
    with served_plant(path):
        for lines in ([FIRST, "9 9\n", "9 9\n"], [FIRST], ["hello\n"]):
            with socket.socket(socket.AF_UNIX) as client:
                client.connect(str(path))
                with client.makefile("rw", newline="\n") as stream:
                    for line in lines:
                        stream.write(line)
                        stream.flush()
                        answers.append(stream.readline())
        again = CliRunner().invoke(app, ["plant", "--socket", str(path)])
        assert again.exit_code == 3
        assert "cannot be a socket" in again.stderr
    assert answers[0] == answers[3] == "0.0 0.0\n" != answers[2]
    assert answers[4] == "error expected: plant 1 PERIOD_S DELAY_S AXES\n"
    assert not path.exists()


# ---- the firmware


def test_the_firmware_moves_a_drive_with_a_hidden_fault(firmware: Path, tmp_path: Path) -> None:
    with (
        served_plant(tmp_path / "drive", *HIDE),
        serving(c_command(firmware, "--plant", str(tmp_path / "drive"), speed=8.0)) as served,
    ):
        command = ["capture", "--device", served.url, "--output", str(tmp_path), "--json"]
        captured = CliRunner().invoke(app, command)
    assert captured.exit_code == 0, captured.output
    found = diagnose([load_recording(Path(json.loads(captured.stdout)["file"]))])
    (cause,) = found.axes["z"].causes
    assert cause.term.effect == "stribeck_friction"
    assert cause.term.values["level"] == pytest.approx(0.55, rel=0.15)
    assert not found.axes["x"].causes


def test_the_plant_of_the_page_follows_a_motion(firmware: Path, tmp_path: Path) -> None:
    (own,) = re.findall(r"```python\n(.*?)```", PAGE.read_text("utf-8"), re.DOTALL)
    motion = Trajectory({axis: sines((0.5, 3.0, 0.0)) for axis in ("x", "z")}, 1.0, 0.5)
    with running([sys.executable, "-c", own, str(tmp_path / "own")], errors=None) as plant:
        assert plant.stdout is not None
        assert plant.stdout.readline() == "ready\n"
        command = c_command(firmware, "--plant", str(tmp_path / "own"), speed=8.0)
        with serving(command) as served, served.connected() as board:
            start(board, motion)
            pages = list(board.capture_pages())
            until(board, lambda status: status.state is not State.DRAINING)
    positions = np.concatenate([page.position_rad for page in pages])
    assert np.all(np.ptp(positions, axis=0) > 0.3)


@pytest.mark.parametrize("answer", ["", "nan 0\n", "1\n", "0 0 0\n", "2e6 0\n", "error busy\n"])
def test_the_firmware_ends_where_the_plant_does_not_make_sense(
    firmware: Path, tmp_path: Path, answer: str
) -> None:
    path = tmp_path / "drive"
    with socket.socket(socket.AF_UNIX) as listener:
        listener.bind(str(path))
        listener.listen(1)
        with subprocess.Popen(
            c_command(firmware, "--plant", str(path)), stderr=subprocess.PIPE, text=True
        ) as process:
            connection, _ = listener.accept()
            with connection:
                assert connection.recv(200).decode() == FIRST
                connection.sendall(answer.encode())
            _, complaint = process.communicate(timeout=20)
    assert process.returncode == 1
    assert ("the plant answers: " if answer else "the plant has ended") in complaint


def test_the_firmware_says_where_no_plant_is(firmware: Path, tmp_path: Path) -> None:
    command = c_command(firmware, "--plant", str(tmp_path / "nobody"))
    ran = subprocess.run(command, capture_output=True, text=True, check=False)
    assert ran.returncode == 1
    assert "nobody" in ran.stderr
