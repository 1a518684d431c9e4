"""A Modbus TCP port has no authentication, so it is open to this host alone unless told."""

import asyncio
import socket

import pytest
from typer.testing import CliRunner

from edge_ident.cli import app
from firmware_interface.virtual import server
from firmware_interface.virtual.board import VirtualBoard

ANOTHER_ADDRESS = "127.0.0.2"


@pytest.mark.parametrize(("bind", "reachable"), [({}, False), ({"bind": "0.0.0.0"}, True)])
def test_a_port_is_reached_through_loopback_alone(bind: dict[str, str], reachable: bool) -> None:
    async def knock() -> bool:
        ready = asyncio.get_running_loop().create_future()
        serving = server.serve_tcp(VirtualBoard(), 0, lambda: None, ready.set_result, **bind)
        task = asyncio.create_task(serving)
        port = int((await ready).rpartition(":")[2])
        try:
            _, writer = await asyncio.open_connection(ANOTHER_ADDRESS, port)
            writer.close()
        except ConnectionRefusedError:
            return False
        finally:
            task.cancel()
        return True

    try:
        socket.create_server((ANOTHER_ADDRESS, 0)).close()
    except OSError:
        pytest.skip(f"this system has no {ANOTHER_ADDRESS}")
    assert asyncio.run(knock()) is reachable


@pytest.mark.parametrize(
    ("options", "bound"), [([], "127.0.0.1"), (["--bind", "192.0.2.1"], "192.0.2.1")]
)
def test_the_command_says_what_modbus_lacks(
    monkeypatch: pytest.MonkeyPatch, options: list[str], bound: str
) -> None:
    served: list[dict[str, object]] = []
    monkeypatch.setattr(server, "serve", lambda **given: served.append(given))
    result = CliRunner().invoke(app, ["board", "--tcp", "0", *options])
    assert result.exit_code == 0
    assert "no authentication" in result.stderr
    assert served[0]["bind"] == bound
    help_text = CliRunner().invoke(app, ["board", "--help"]).stdout
    assert "no authentication" in help_text
