"""The machine behind a virtual board: the feed drive with faults, or another one that is drawn."""

import difflib
import importlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Final, Self

import numpy as np

from firmware_interface.plant.bristles import BristleFriction, BristlePlant, Bristles
from firmware_interface.plant.drives import SAMPLE_S, Array, Drives, Motion, draw_drives, paper
from firmware_interface.plant.effect import Effect, Scales
from firmware_interface.plant.feed_drive import FEED_DRIVE, feed_drive
from firmware_interface.plant.plant import DELAY, Plant
from firmware_interface.plant.used import departures

CLEAR: Final = (0.5, 0.9)
"""Ranks that are drawn, on the logarithm of an effect's span; the strongest may stop a motion."""
_TYPICAL: Final = 0.75  # rank of an effect without a size
# Times the strongest of its span, beyond which a drive may not follow any more.
_LARGEST: Final = 2.0
_AXES: Final = tuple(FEED_DRIVE)
_HOLDS: Final = 0.5  # most of its Coulomb friction that a drawn drive's weight takes
# A rigid body's parameters, and their units.
_BODY: Final = {
    "inertia": "kg*m^2",
    "viscous_friction": "N*m*s/rad",
    "coulomb_friction": "N*m",
    "offset": "N*m",
}


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
    """What nobody is told of a machine.

    Attributes
    ----------
    effects : tuple of Effect
    faults : tuple of Fault
        What there is to tell.
    drives : Drives
        One; the documented feed drive, or a drawn one.
    bristles : Bristles, optional
        In place of the effects and of the drive's own friction: another simulation.
    """

    effects: tuple[Effect, ...]
    faults: tuple[Fault, ...]
    drives: Drives = field(default_factory=feed_drive)
    bristles: Bristles | None = None

    def plant(self, sample_s: float = SAMPLE_S, delay: float = DELAY) -> Plant:
        """A drive with the faults, at rest; see `Plant`."""
        if self.bristles is not None:
            return BristlePlant(self.drives, self.bristles, sample_s, delay)
        return Plant(self.drives, self.effects, sample_s, delay)

    @classmethod
    def used(cls, seed: int, wear: float = 1.0) -> Self:
        """A random drive with everything a little off; see `firmware_interface.plant.used`."""
        drives = _held(draw_drives(1, seed))
        off = departures(drives, seed, wear) if wear else ()
        faults = [
            _fault(effect, axis, column, float(strength[0, column]))
            for column, axis in enumerate(_AXES)
            for effect, strength in off
        ]
        return cls(tuple(effect for effect, _ in off), (*_bodies(drives), *faults), drives)

    @classmethod
    def rubbing(cls, seed: int, friction: BristleFriction) -> Self:
        """The same drive, clean, in another simulation; see `firmware_interface.plant.bristles`."""
        drives = _held(draw_drives(1, seed))
        bristles = Bristles.drawn(friction, len(_AXES), seed)
        return cls((), tuple(_bodies(drives)), drives, bristles)

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


def _held(drives: Drives) -> Drives:
    """The same with weights that friction holds, as without a brake it has to."""
    chain = drives.chain
    most = _HOLDS * chain.coulomb.sum(axis=0)
    return replace(drives, chain=replace(chain, offset=np.clip(chain.offset, -most, most)))


def _bodies(drives: Drives) -> Iterator[Fault]:
    """The rigid body that a drawn drive has on every axis."""
    for axis, body in zip(_AXES, drives.chain.rigid_body[0].tolist(), strict=True):
        for (name, unit), value in zip(_BODY.items(), body, strict=True):
            yield Fault(name, axis, value, unit, value, unit, {})


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


# All effects by name, found in the modules `*_effects`, and how one or several are drawn.

for _file in sorted(Path(__file__).parent.glob("*_effects.py")):
    if not _file.stem.startswith("test_"):
        importlib.import_module(f"firmware_interface.plant.{_file.stem}")


def names_of(*, in_catalogue: bool) -> tuple[str, ...]:
    """Effects that the library knows too, or disturbances that no catalogue holds."""
    kinds = [kind for kind in Effect.kinds.values() if kind.in_catalogue == in_catalogue]
    return tuple(kind.name for kind in sorted(kinds, key=lambda kind: (kind.number, kind.name)))


EFFECTS = names_of(in_catalogue=True)
UNKNOWN = names_of(in_catalogue=False)


def draw(
    names: Sequence[str],
    drives: Drives,
    motion: Motion,
    seed: int,
    *,
    strength: float | Array | None = None,
    one_axis: bool = False,
) -> tuple[Effect, ...]:
    """Effects of random size and kind for every drive; none for no names.

    Parameters
    ----------
    names : sequence of str
        From `EFFECTS` or `UNKNOWN`; several act together.
    strength : float, (B, A) array or None
        0, the faintest (below the noise), to 1, the strongest (in clear need of repair), even in
        the logarithm of size; None: at random.
    one_axis : bool
        One axis of each drive, the same for all effects, chosen at random; otherwise all axes.
        What couples axes always hits one.
    """
    rng = np.random.default_rng([seed, 3])
    count, axes = drives.shape
    alone = rng.integers(0, axes, (count, 1)) == np.arange(axes)
    scales = Scales.of(drives, motion)
    effects = []
    for name in names:
        kind = Effect.kinds[name]
        rank = rng.random(drives.shape) if strength is None else strength
        faint, strong = kind.span
        size = faint * (strong / faint) ** (rank * np.ones(drives.shape))
        sign = rng.choice([-1.0, 1.0], drives.shape) if kind.signed else 1.0
        hit = alone if one_axis or kind.one_way else np.ones(drives.shape, bool)
        effects.append(kind.draw(size * sign * hit, rng, scales))
    return tuple(effects)
