"""Time of a request on a line without pacing: this project's link beside pymodbus's own client.

Each client reads the same register from the same responder on one pseudo-terminal, in turn. The
responder sends a prepared frame. The time is therefore the host's own: it builds the request,
waits, and decodes the reply. A real line adds its own time (a status at 115200 baud: 4.3 ms).
`line` is the same exchange without Modbus: no client can be faster.

    python tools/link_overhead.py --requests 2000
"""

import argparse
import json
import multiprocessing
import os
import time
import tty
from collections.abc import Callable
from multiprocessing.connection import Connection

import numpy as np
from pymodbus.client import ModbusSerialClient
from pymodbus.framer import FramerRTU

from firmware_interface.board_types import NONCE_WORDS
from firmware_interface.connection import open_link
from firmware_interface.modbus import DEVICE_ID
from firmware_interface.registers import MAGIC, REGISTERS

_REGISTER = REGISTERS["identity.nonce"]
_REQUEST_BYTES = 8
_REPLY_BYTES = 9


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("--requests", type=int, default=1000, help="of each client")
    parser.add_argument("--json", action="store_true")
    given = parser.parse_args()
    times_ms = client_times_ms(given.requests)
    quantiles = {
        name: [float(q) for q in np.quantile(of_client, [0.5, 0.95, 0.99])]
        for name, of_client in times_ms.items()
    }
    if given.json:
        print(json.dumps({"quantiles": [0.5, 0.95, 0.99], "ms": quantiles}, indent=2))
        return
    print(f"{given.requests} requests of each, ms {'median':>12} {'95 %':>8} {'99 %':>8}")
    for name, row in quantiles.items():
        print(f"{name:24} {row[0]:15.3f} {row[1]:8.3f} {row[2]:8.3f}")


def client_times_ms(requests: int) -> dict[str, list[float]]:
    """Durations of requests by client, in ms."""
    ours, theirs = multiprocessing.Pipe()
    responder = multiprocessing.Process(target=_respond, args=(theirs,), daemon=True)
    responder.start()
    try:
        return _measure(ours.recv(), requests)
    finally:
        responder.terminate()


def _respond(ready: Connection) -> None:
    """Answer whatever asks with one and the same reply, and for the identity with a board's."""
    master, slave = os.openpty()
    tty.setraw(slave)
    ready.send(os.ttyname(slave))
    reply = _framed(bytes([0, 1, 2, 3]))
    identity = _framed(MAGIC.to_bytes(4, "big") + bytes(2 * NONCE_WORDS - 4))
    received = b""
    while True:
        received += os.read(master, 256)
        if len(received) >= _REQUEST_BYTES:
            request, received = received[:_REQUEST_BYTES], received[_REQUEST_BYTES:]
            os.write(master, identity if request[2:6] == bytes([0, 0, 0, NONCE_WORDS]) else reply)


def _framed(words: bytes) -> bytes:
    frame = bytes([DEVICE_ID, 3, len(words)]) + words
    return frame + FramerRTU.compute_CRC(frame).to_bytes(2, "big")


def _measure(device: str, requests: int) -> dict[str, list[float]]:
    """Durations by client, in ms; the clients take turns in blocks, each with the port open."""
    times_ms: dict[str, list[float]] = {"edge-ident": [], "pymodbus": [], "line": []}
    blocks = 10
    for _ in range(blocks):
        for name, opened in (("edge-ident", _edge_ident), ("pymodbus", _pymodbus), ("line", _line)):
            ask, close = opened(device)
            ask()
            for _ in range(requests // blocks):
                started = time.perf_counter()
                ask()
                times_ms[name].append(1e3 * (time.perf_counter() - started))
            close()
    return times_ms


Client = tuple[Callable[[], object], Callable[[], object]]


def _edge_ident(device: str) -> Client:
    link = open_link(device)
    return lambda: link.read(_REGISTER.address, _REGISTER.words), link.close


def _pymodbus(device: str) -> Client:
    client = ModbusSerialClient(device, baudrate=115200, timeout=0.3, retries=0)
    client.connect()
    return (
        lambda: client.read_holding_registers(_REGISTER.address, count=_REGISTER.words),
        client.close,
    )


def _line(device: str) -> Client:
    line = os.open(device, os.O_RDWR | os.O_NOCTTY)
    request = bytes(_REQUEST_BYTES)

    def ask() -> None:
        os.write(line, request)
        got = 0
        while got < _REPLY_BYTES:
            got += len(os.read(line, 64))

    return ask, lambda: os.close(line)


if __name__ == "__main__":
    main()
