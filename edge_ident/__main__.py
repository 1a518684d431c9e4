"""The `edge-ident` script, and `python -m edge_ident`.

Loading the command line takes a quarter of a second. So that Ctrl-C in this time ends the process
without a traceback, this file loads nothing heavy before it has set the signals' handlers.

numpy's threads gain nothing on matrices as small as these, and wait for each other where other
programs have the cores. It asks how many to start when it is loaded.

`hashlib` loads OpenSSL, which takes 3 MiB, and does without where it finds none: Python has hash
functions of its own, unless its distributor left them out.
"""

import gc
import os
import sys
from importlib.util import find_spec
from typing import Final

from edge_ident.support import process

_ALLOCATED: Final = 100_000
"""Objects after which garbage is looked for: more than a command loads, which all stay."""
_OWN_HASHES: Final = (
    *("_md5", "_sha1", "_sha3", "_blake2"),
    "_sha2" if sys.version_info >= (3, 12) else "_sha256",
)
"""Modules of Python's own hash functions."""


@process.uncut
def main() -> None:
    """Entry point of the `edge-ident` script."""
    process.end_at_once()
    process.open_closed()
    process.show_any_character()
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    gc.set_threshold(_ALLOCATED)
    if all(find_spec(name) for name in _OWN_HASHES):
        sys.modules.setdefault("_hashlib", None)  # type: ignore[arg-type]
    from edge_ident.cli import main as command_line

    try:
        try:
            command_line()
        finally:
            process.end_at_once()
    except KeyboardInterrupt:  # after the last that the command line does
        sys.exit(process.INTERRUPTED)
    finally:
        process.flushed(sys.stderr)
        # nothing is left to be cleaned up while the interpreter shuts down
        process.exit_code_counts()
        gc.freeze()


if __name__ == "__main__":
    main()
