"""A virtual board behind a real line, served from a thread of the test's own process."""

import asyncio
import threading
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, suppress

from firmware_interface.virtual.board import VirtualBoard
from firmware_interface.virtual.server import serve_pty, serve_tcp

Serve = Callable[[VirtualBoard, str], AbstractContextManager[str]]


@contextmanager
def served(board: VirtualBoard, kind: str) -> Iterator[str]:
    """Serve a board from a thread of its own; gives the device URL."""
    urls: list[str] = []
    ready = threading.Event()
    loop = asyncio.new_event_loop()

    def on_ready(url: str) -> None:
        urls.append(url)
        ready.set()

    if kind == "pty":
        serving = serve_pty(board, board.idle, on_ready)
    else:
        serving = serve_tcp(board, 0, board.idle, on_ready)
    task = loop.create_task(serving)

    def run() -> None:
        with suppress(asyncio.CancelledError):
            loop.run_until_complete(task)
        loop.run_until_complete(asyncio.sleep(0))
        loop.close()

    thread = threading.Thread(target=run)
    thread.start()
    assert ready.wait(5.0)
    try:
        yield urls[0]
    finally:
        loop.call_soon_threadsafe(task.cancel)
        thread.join()
        assert task.cancelled()


class SharedBoard(VirtualBoard):
    """A virtual board that one thread serves while others look inside, under its lock."""

    def __init__(self, *arguments: object) -> None:
        self.lock = threading.RLock()
        super().__init__(*arguments)  # type: ignore[arg-type]

    def read(self, address: int, count: int) -> list[int]:
        with self.lock:
            return super().read(address, count)

    def write(self, address: int, words: list[int]) -> None:
        with self.lock:
            super().write(address, words)

    def idle(self) -> None:
        with self.lock:
            super().idle()

    def power_cycle(self) -> None:
        with self.lock:
            super().power_cycle()
