"""The program of a helper (`edge_ident.support.side_by_side`): a job on stdin, frames on stdout.

It ends where its stdin does: then the caller has ended it, or is gone.
"""

import os
import pickle
import sys
from contextlib import suppress
from threading import Thread
from typing import Any


def do_job() -> None:
    """Do the job, and send what it tells, then its result; nothing where it raises an error."""
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # what a library prints is no answer

    def send(kind: str, value: Any) -> None:
        answers.write(pickle.dumps((kind, value)))
        answers.flush()

    def tell(*values: Any) -> None:
        send("told", values)

    try:
        function, job = pickle.load(sys.stdin.buffer)
    except (EOFError, pickle.UnpicklingError):
        return  # the caller ended before it had asked
    Thread(target=_end_with_the_caller, daemon=True).start()
    with suppress(Exception):
        send("done", function(*job, tell))


def _end_with_the_caller() -> None:
    while os.read(0, 1):  # not through a buffer, whose lock the end of the interpreter waits for
        pass
    os._exit(1)
