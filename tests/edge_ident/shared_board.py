"""One virtual board that every command of a test finds, as if it stayed on between them."""

import json
from typing import Any

import pytest
from typer.testing import CliRunner

from edge_ident.cli import app
from edge_ident.commissioning import doctor, ports, safety
from firmware_interface.board import Board
from firmware_interface.virtual.board import VirtualBoard
from firmware_interface.virtual.settings import BoardSettings


class SharedBoard:
    """A board with its state, and the commands that are given to it."""

    def __init__(
        self,
        monkeypatch: pytest.MonkeyPatch,
        settings: BoardSettings | None = None,
        virtual: VirtualBoard | None = None,
    ):
        self.virtual = virtual or VirtualBoard(settings)
        for module in (ports, doctor, safety):
            monkeypatch.setattr(module, "open_link", lambda *_, **__: self.virtual)

    @property
    def board(self) -> Board:
        return Board.connect(self.virtual)

    def run(self, *arguments: object) -> tuple[int, str, str]:
        """Exit code, stdout and stderr of a command."""
        result = CliRunner().invoke(app, [*map(str, arguments), "--device", "shared"])
        assert result.exception is None or isinstance(result.exception, SystemExit), result
        return result.exit_code, result.stdout, result.stderr

    def json(self, *arguments: object) -> dict[str, Any]:
        """The document of a command that ended well."""
        code, text, errors = self.run(*arguments, "--json")
        assert code == 0, errors
        return json.loads(text)
