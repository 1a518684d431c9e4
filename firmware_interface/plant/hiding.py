"""The feed drive with something wrong: faults by name and size, or drawn by a number."""

import difflib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Final, Self

import numpy as np

from firmware_interface.plant.catalogue import EFFECTS, UNKNOWN
from firmware_interface.plant.effect import Effect, Scales
from firmware_interface.plant.feed_drive import FEED_DRIVE, feed_drive
from firmware_interface.plant.motions import SAMPLE_S, paper
from firmware_interface.plant.plant import DELAY, Plant

CLEAR: Final = (0.5, 0.9)
"""Ranks that are drawn, on the logarithm of an effect's span; the strongest may stop a motion."""
_TYPICAL: Final = 0.75
"""Rank of an effect without a size."""
_LARGEST: Final = 2.0
"""Times the strongest of its span, beyond which a drive may not follow any more."""
_AXES: Final = tuple(FEED_DRIVE)


@dataclass(frozen=True)
class Fault:
    """What is wrong with one axis.

    Attributes
    ----------
    effect, axis : str
    strength : float
        As a user gives it.
    measure : str
        What a strength of 1 is.
    size : float
    unit : str
    values : mapping
        The other numbers of the effect, in SI units, by their names in its class.
    """

    effect: str
    axis: str
    strength: float
    measure: str
    size: float
    unit: str
    values: Mapping[str, float]


@dataclass(frozen=True)
class Hidden:
    """Faults, with the drives that have them."""

    effects: tuple[Effect, ...]
    faults: tuple[Fault, ...]

    def plant(self, sample_s: float = SAMPLE_S, delay: float = DELAY) -> Plant:
        """A drive with the faults, at rest; see `Plant`."""
        return Plant(feed_drive(), self.effects, sample_s, delay)

    @classmethod
    def of(
        cls, wishes: Sequence[str], axis: str = _AXES[0], seed: int = 0, *, of_machine: bool = False
    ) -> Self:
        """Faults by name.

        Parameters
        ----------
        wishes : sequence of str
            `NAME` or `NAME=SIZE`, the size in the effect's `measure`.
        axis : str
        seed : int
            Of what the size leaves open: a speed, a phase, a course in time.
        of_machine : bool
            What acts in the board's record alone is refused.

        Raises
        ------
        ValueError
            No such effect or axis, no such size of it, or the same effect twice.
        """
        chosen = [(*_parsed(wish), axis) for wish in wishes]
        names = [name for name, _, _ in chosen]
        for name in names:
            if names.count(name) > 1:
                raise ValueError(f"{name} is there twice")
            if of_machine and _in_record(name):
                raise ValueError(f"{name} acts in a board's record, not in the machine")
        return cls._drawn(chosen, np.random.default_rng([seed, 5]))

    @classmethod
    def drawn(cls, seed: int, axis: str | None = None, *, of_machine: bool = False) -> Self:
        """One effect or two of the catalogue, clearly there; on a random axis each, or on one."""
        known = [name for name in EFFECTS if not (of_machine and _in_record(name))]
        rng = np.random.default_rng([seed, 6])
        names = rng.choice(known, size=rng.integers(1, 3), replace=False).tolist()
        chosen = []
        for name in names:
            sign = rng.choice([-1.0, 1.0]) if _both_signs(name) else 1.0
            strength = float(sign) * _strength(name, rng.uniform(*CLEAR))
            chosen.append((name, strength, axis or str(rng.choice(_AXES))))
        return cls._drawn(chosen, rng)

    @classmethod
    def _drawn(cls, chosen: Sequence[tuple[str, float, str]], rng: np.random.Generator) -> Self:
        scales = Scales.of(feed_drive(), paper())
        effects, faults = [], []
        for name, strength, axis in chosen:
            if axis not in _AXES:
                raise ValueError(f"there is no axis {axis!r}: it is one of {', '.join(_AXES)}")
            column = _AXES.index(axis)
            row = np.array([[strength if axis == other else 0.0 for other in _AXES]])
            effect = Effect.kinds[name].draw(row, rng, scales)
            effects.append(effect)
            faults.append(_fault(effect, axis, column, strength))
        return cls(tuple(effects), tuple(faults))


def _fault(effect: Effect, axis: str, column: int, strength: float) -> Fault:
    own = effect.of_axis(0, column)
    values = {item.name: getattr(own, item.name) for item in fields(own) if item.name != "size"}
    numbers = {name: value for name, value in values.items() if isinstance(value, float)}
    size = float(effect.size[0, column])
    return Fault(effect.name, axis, strength, effect.measure, size, effect.unit, numbers)


def _in_record(name: str) -> bool:
    """It acts in the effort that a board records, not in the machine."""
    return Effect.kinds[name].recorded is not Effect.recorded


def _both_signs(name: str) -> bool:
    """A record cannot be early: a board does not know what is to come."""
    return Effect.kinds[name].signed and name != "time_delay"


def default_strength(name: str) -> float:
    """Strength of an effect without a size: clearly there."""
    return _strength(name, _TYPICAL)


def _strength(name: str, rank: float) -> float:
    faint, strong = Effect.kinds[name].span
    return float(faint * (strong / faint) ** rank)


def _parsed(wish: str) -> tuple[str, float]:
    """Name and strength of a wish."""
    name, given, size = wish.partition("=")
    if name not in Effect.kinds:
        near = difflib.get_close_matches(name, Effect.kinds, 1)
        meant = f": did you mean {near[0]}?" if near else "."
        known = ", ".join((*EFFECTS, *UNKNOWN))
        raise ValueError(f"there is no effect {name!r}{meant} Known are: {known}")
    if not given:
        return name, default_strength(name)
    try:
        if "_" in size:  # Python would leave it out
            raise ValueError(size)
        strength = float(size)
    except ValueError:
        raise ValueError(f"{wish}: {size!r} is not a number") from None
    largest = _LARGEST * Effect.kinds[name].span[1]
    lowest = -largest if _both_signs(name) else 0.0
    if not (lowest <= strength <= largest and strength):
        sizes = f"a size from {lowest:g} to {largest:g}, but not 0"
        raise ValueError(f"{wish}: give {sizes} ({Effect.kinds[name].measure})")
    return name, strength
