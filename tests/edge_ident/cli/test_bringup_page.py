"""The commands of docs/bringup.md, one after the other, on the virtual board."""

import re
from collections.abc import Iterator
from pathlib import Path

import pytest
from typer.testing import CliRunner

from edge_ident.cli import app
from firmware_interface.registers import State
from tests.edge_ident.shared_board import SharedBoard
from tests.test_docs import whole_lines

PAGE = Path(__file__).parents[3] / "docs" / "bringup.md"
SERVES = "board --pty --link ./board"
"""Ends only with Ctrl-C: the test has a board of its own."""
EXPORTED = {"EDGE_IDENT_DEVICE": "shared", "EDGE_IDENT_DRIVE": "machine.toml"}
"""By the page, with the board of the test."""
TAP = "board --press-stop"
"""Is for a board in a process of its own."""
OF_TIME = ("BAD  board clock", "BAD  jitter", "BAD  round trip", "BAD  capture")
"""What the doctor may say of a board whose time passes with the requests."""


def steps() -> Iterator[str]:
    """Command lines of the page's blocks, in their order."""
    for block in re.findall(r"^```\n(.*?)^```", whole_lines(PAGE), re.M | re.S):
        yield from re.findall(r"^edge-ident (.+?)(?:  .*)?$", block, re.M)


def answer(arguments: str) -> str:
    """What a command prints; it must end well."""
    ran = CliRunner().invoke(app, arguments.split(), env=EXPORTED)
    if arguments == "doctor":
        bad = [line for line in ran.stdout.splitlines() if line.startswith("BAD")]
        assert all(line.startswith(OF_TIME) for line in bad), ran.stdout
    else:
        assert ran.exit_code == 0, f"edge-ident {arguments}\n{ran.stdout}{ran.stderr}"
    return ran.stdout


def tap_the_stop(shared: SharedBoard) -> None:
    inputs = shared.virtual.inputs
    inputs.press_stop()
    inputs.release_stop()
    assert shared.board.status().state is State.FAULT


def test_the_page_from_its_first_command_to_its_last(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.chdir(tmp_path)
    shared = SharedBoard(monkeypatch)
    said: dict[str, str] = {}
    for step in steps():
        if step == TAP:
            tap_the_stop(shared)
        elif step != SERVES:
            said[step] = answer(step)
    assert re.search(r"fault_code +STO\b", said["registers status"], re.M)
    assert re.search(r"timeout +0\.8 s\b", said["registers watchdog"], re.M)
    # friction of 1.4 N*m and 30 N*m/rad leave the axis 0.046 rad short of 0.174
    way = re.search(r"^x: 0\.0000 → (\S+) rad", said["home --by x=10deg --speed 0.1"], re.M)
    assert way
    assert float(way[1]) == pytest.approx(0.128, abs=0.01)
    assert (tmp_path / "real" / "report.html").is_file()
