"""The axes that act on another one: one of them, or several joints by the sum of their angles.

A link's angle in space is the sum of the angles of all joints up to it that turn in its plane. So a
term names as its source one axis, `j2`, or several, `j2 + j3`.
"""

from collections.abc import Collection, Sequence
from functools import reduce
from typing import Final

import numpy as np

from edge_ident.model.motion import Motion

_PLUS: Final = " + "


def together(axes: Sequence[str]) -> str:
    """What a term names as its source where several axes act by the sum of their positions."""
    return _PLUS.join(axes)


def axes_of(source: str | None, known: Collection[str]) -> tuple[str, ...]:
    """The axes that a source stands for; none for no source.

    Parameters
    ----------
    source : str or None
        As a term names it.
    known : collection of str
        Axes that there are. One that is called like a sum is meant itself.
    """
    if source is None:
        return ()
    return (source,) if source in known else tuple(source.split(_PLUS))


def acting(motions: Sequence[Motion]) -> Motion:
    """The motion of what acts: that of one axis, or the sum of several."""
    return reduce(_sum, motions)


def _sum(one: Motion, other: Motion) -> Motion:
    velocity = one.velocity + other.velocity
    return Motion(
        one.time_s,
        one.position + other.position,
        velocity,
        one.acceleration + other.acceleration,
        np.sign(velocity),
        clock=one.clock,
    )
