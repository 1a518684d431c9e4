"""One thing that was looked at, and what to do where it is not well."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Check:
    """Outcome of one look."""

    what: str
    good: bool
    detail: str
    next_step: str = ""
