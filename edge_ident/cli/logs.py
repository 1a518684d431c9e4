"""Where a command's log goes while it runs."""

import logging
from collections.abc import Iterator, Sequence
from contextlib import contextmanager


@contextmanager
def logged(handler: logging.Handler, line: str, names: Sequence[str]) -> Iterator[None]:
    """Give what loggers of these names tell to a handler, as lines of a format."""
    handler.setFormatter(logging.Formatter(line))
    loggers = [logging.getLogger(name) for name in names]
    for logger in loggers:
        logger.setLevel(logging.INFO)
        logger.addHandler(handler)
    try:
        yield
    finally:
        for logger in loggers:
            logger.removeHandler(handler)
