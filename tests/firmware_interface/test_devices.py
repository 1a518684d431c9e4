"""Opening a device, and serving one: what goes wrong, and what the user is told."""

import os
import socket
import subprocess
import sys
import threading
from collections.abc import Callable
from contextlib import AbstractContextManager, suppress
from pathlib import Path

import pytest

from firmware_interface import modbus
from firmware_interface.board import Board
from firmware_interface.connection import open_link
from firmware_interface.errors import LinkError
from firmware_interface.registers import State
from firmware_interface.virtual.board import VirtualBoard
from firmware_interface.virtual.server import serve

Served = Callable[[VirtualBoard, str], AbstractContextManager[str]]


@pytest.mark.parametrize(
    ("url", "cause", "advice"),
    [
        ("/dev/ttyNOTHERE", "cannot be opened: No such file or directory\n", "connect the board"),
        ("nonsense://x", "cannot be opened", "pySerial URL"),
        ("tcp://127.0.0.1", "no port given", "tcp://HOST:PORT"),
        ("tcp://127.0.0.1:²", "no port given", "tcp://HOST:PORT"),
        ("tcp://a..b:502", "no name of a host", "tcp://HOST:PORT"),
        ("tcp://127.0.0.1:1", "refuses the connection", "check address and port"),
    ],
)
def test_unknown_devices_say_what_to_do(url: str, cause: str, advice: str) -> None:
    with pytest.raises(LinkError, match=cause) as caught:
        open_link(url)
    assert advice in caught.value.next_step
    assert caught.value.exit_code == 3


def test_a_port_without_permission_says_whom_to_ask(monkeypatch: pytest.MonkeyPatch) -> None:
    def refused(*_: object, **__: object) -> None:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(modbus.serial, "serial_for_url", refused)
    with pytest.raises(LinkError) as caught:
        open_link("/dev/ttyACM0")
    assert "dialout" in caught.value.next_step


def test_a_serial_port_that_another_program_holds(served: Served) -> None:
    with served(VirtualBoard(), "pty") as url:
        first = open_link(url)
        with pytest.raises(LinkError) as caught:
            open_link(url)
        assert "close the program that has the port open" in caught.value.next_step
        first.close()


def test_a_silent_line_is_no_board() -> None:
    master, slave = os.openpty()
    try:
        with pytest.raises(
            LinkError, match=r"no board answers: no reply within 0\.1 s\n"
        ) as caught:
            open_link(os.ttyname(slave), timeout_s=0.1)
        assert "ModemManager" in caught.value.next_step
    finally:
        os.close(master)
        os.close(slave)


def test_a_server_that_speaks_something_else_is_no_board() -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:

        def greet() -> None:
            connection, _ = server.accept()
            with connection:
                connection.sendall(b"220 mail.example ESMTP ready\r\n")
                connection.recv(100)

        thread = threading.Thread(target=greet)
        thread.start()
        with pytest.raises(LinkError, match="no board"):
            open_link(f"tcp://127.0.0.1:{server.getsockname()[1]}", timeout_s=0.1)
        thread.join()


def test_a_board_that_hangs_up_may_serve_others() -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:

        def hang_up() -> None:
            with suppress(OSError):  # the server is closed in the end
                while True:
                    server.accept()[0].close()

        thread = threading.Thread(target=hang_up, daemon=True)
        thread.start()
        with pytest.raises(LinkError, match="no board") as caught:
            open_link(f"tcp://127.0.0.1:{server.getsockname()[1]}", timeout_s=0.1)
    assert "close other programs" in caught.value.next_step


def test_a_tcp_port_in_use_is_a_link_error() -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        with pytest.raises(LinkError, match=f"port {port}"):
            serve(tcp_port=port, on_ready=lambda url: None)


def test_serve_ends_with_ctrl_c() -> None:
    script = (
        "from firmware_interface.virtual.server import serve;"
        "serve(pty=True, on_ready=lambda url: print(url, flush=True))"
    )
    process = subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    assert process.stdout.readline().startswith("/dev/")
    process.send_signal(2)
    assert process.wait(5.0) == 0
    process.stdout.close()


def test_any_pyserial_url_will_do(served: Served, tmp_path: Path) -> None:
    with served(VirtualBoard(), "pty") as url:
        board = Board.connect(open_link(f"spy://{url}?file={tmp_path / 'trace'}"))
        assert board.status().state is State.IDLE
        board.close()
    assert (tmp_path / "trace").stat().st_size > 0
