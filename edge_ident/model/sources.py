"""The axes that act on another one: one of them, or joints by the sum of their angles.

A link's angle in space is the sum of the angles of all joints up to it that turn in its plane. So a
term names as its source one axis, `j2`, or several, `j1 + j2`. A joint that counts its angle the
other way round has a minus: `-j2`, `j1 - j2`.
"""

import re
from collections.abc import Collection, Iterable, Iterator, Sequence
from functools import reduce
from itertools import combinations, product
from typing import Final, NamedTuple

import numpy as np

from edge_ident.model.motion import Motion

_SIGNS: Final = re.compile(r"(?:^|\s)([+-])(?:\s|(?=\S))")


class Acting(NamedTuple):
    """An axis that takes part, and the sense in which it counts: 1 or -1."""

    axis: str
    sense: int


def sources(axes: Sequence[str], most: int) -> Iterator[str]:
    """What a term may name where so many axes act by the sum of their angles, in either sense of
    each."""
    for count in range(1, most + 1):
        for group, senses in product(combinations(axes, count), product("+-", repeat=count)):
            yield _source(zip(senses, group, strict=True))


def turned(source: str, axis: str) -> str:
    """The same source, with one axis that counts in the other sense."""
    acts = ((one.sense * (-1 if one.axis == axis else 1), one.axis) for one in acting(source, ()))
    return _source(("-" if sense < 0 else "+", name) for sense, name in acts)


def _source(signed: Iterable[tuple[str, str]]) -> str:
    text = " ".join(f"{sign} {axis}" for sign, axis in signed)
    return text.removeprefix("+ ") if text[0] == "+" else f"-{text[2:]}"


def acting(source: str | None, known: Collection[str]) -> tuple[Acting, ...]:
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
    if source in known:
        return (Acting(source, 1),)
    first, *others = _SIGNS.split(source)
    pairs = zip(others[::2], others[1::2], strict=True)
    named = [("+", first)] if first else []
    return tuple(Acting(a, -1 if sign == "-" else 1) for sign, a in (*named, *pairs))


def axes_of(source: str | None, known: Collection[str]) -> tuple[str, ...]:
    """Their names."""
    return tuple(one.axis for one in acting(source, known))


def together(motions: Iterable[tuple[Motion, int]]) -> Motion:
    """The motion of what acts, from those of its axes and the senses in which these count."""
    return reduce(_sum, (_turned(motion, sense) for motion, sense in motions))


def _turned(one: Motion, sense: int) -> Motion:
    if sense > 0:
        return one
    signals = (-one.position, -one.velocity, -one.acceleration, -one.direction)
    return Motion(one.time_s, *signals, clock=one.clock)


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
