"""Serial ports, and what answers at each."""

import json
import os
from types import SimpleNamespace

import pytest
from typer.testing import CliRunner

from edge_ident.cli import app
from edge_ident.commissioning import ports
from tests.boards import served_board


def test_every_port_says_what_answered(monkeypatch: pytest.MonkeyPatch) -> None:
    master, slave = os.openpty()  # a line on which nobody answers
    silent = os.ttyname(slave)
    with served_board(settings="serial_number=4711") as board:
        listed = [
            SimpleNamespace(device=device, description="adapter", hwid="USB")
            for device in (board, silent, "/dev/ttyGONE")
        ]
        monkeypatch.setattr(ports.list_ports, "comports", lambda: listed)
        found = {port["device"]: port for port in json.loads(asked("--json"))["ports"]}
    os.close(master)
    os.close(slave)
    assert found[board]["board"]["serial_number"] == 4711
    assert "board 4711" in found[board]["answer"]
    assert found[silent]["board"] is None
    assert "no reply" in found[silent]["answer"]
    assert "baud rate" in found[silent]["next_step"]
    assert "cannot be opened" in found["/dev/ttyGONE"]["answer"]


def test_no_port_at_all(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ports.list_ports, "comports", list)
    assert json.loads(asked("--json"))["ports"] == []


def asked(*arguments: str) -> str:
    result = CliRunner().invoke(app, ["ports", *arguments])
    assert result.exit_code == 0, result.stderr
    return result.stdout
