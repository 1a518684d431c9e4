"""Copies of drives in one batch, each with an effect of its own: as fast as one of them."""

from collections.abc import Sequence
from dataclasses import fields, replace
from typing import Any, TypeVar

import numpy as np

from firmware_interface.plant import Drives, Effect, Recordings

Part = TypeVar("Part")


def side_by_side(drives: Drives, effects: Sequence[Effect]) -> tuple[Drives, list[Effect]]:
    """As many copies of the drives as there are effects; the k-th copy has the k-th effect alone.

    Parameters
    ----------
    effects : sequence of Effect
        Drawn for these drives.
    """
    count, times = drives.shape[0], len(effects)
    copies = Drives(_copied(drives.chain, count, times), _copied(drives.control, count, times))
    own = np.repeat(np.arange(times), count)[:, None]
    spread = [_copied(effect, count, times) for effect in effects]
    return copies, [replace(e, size=e.size * (own == k)) for k, e in enumerate(spread)]


def copy_of(made: Recordings, place: int, count: int) -> Recordings:
    """What the drives of one copy recorded."""
    rows = slice(place * count, (place + 1) * count)
    parts = {item.name: getattr(made, item.name)[rows] for item in fields(made)}
    return Recordings(**parts | {"time_s": made.time_s})


def _copied(part: Part, count: int, times: int) -> Part:
    """Every array of a dataclass, repeated along its axis of drives."""
    values: dict[str, Any] = {item.name: getattr(part, item.name) for item in fields(part)}  # type: ignore[arg-type]
    copies = {
        name: np.concatenate([value] * times, axis=value.shape.index(count))
        for name, value in values.items()
        if isinstance(value, np.ndarray)
    }
    return replace(part, **copies)  # type: ignore[type-var]
