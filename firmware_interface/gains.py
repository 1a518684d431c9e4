"""The numbers of the board's control law: the gains of an axis, and what a bank of them may hold.

What the numbers do stands in `firmware_interface.control_law`.

A bank is accepted if every number n with its largest value N (the gain_maximum registers) obeys
|n| <= N and |n - active n| <= gain_step * N; if those in `POSITIVE` are above zero; and if all
but those in `SIGNED` are not below it. The entries of a table count as numbers of their own.
"""

import struct
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from functools import cached_property
from typing import Any, Final, Self

import numpy as np

from firmware_interface import codec, registers

RIPPLES: Final = 4
"""Entries of the ripple table."""
FRICTION_ENTRIES: Final = 12
"""Entries of each friction curve over speed."""
TABLE_ENTRIES: Final = 24
"""Entries of each table over position."""
FEEDBACK: Final = ("proportional", "derivative", "integral", "velocity_filter_s")
"""Numbers that decide whether the loop is stable."""


def _entries(name: str, count: int) -> tuple[str, ...]:
    """Names of a table's numbers."""
    return tuple(f"{name}[{k}]" for k in range(count))


SIGNED: Final = frozenset(
    {
        "offset_feedforward",
        "viscous_difference_feedforward",
        *_entries("ripple_cosine", RIPPLES),
        *_entries("ripple_sine", RIPPLES),
        *_entries("friction_forward", FRICTION_ENTRIES),
        *_entries("friction_backward", FRICTION_ENTRIES),
        "table_start_rad",
        *_entries("load_table", TABLE_ENTRIES),
        *_entries("local_friction_table", TABLE_ENTRIES),
        "cross_inertia_feedforward",
        "cross_viscous_feedforward",
        "cross_coulomb_feedforward",
    }
)
"""Numbers that may be negative."""
POSITIVE: Final = frozenset(
    {
        "coulomb_smoothing_rad_s",
        "stribeck_speed_rad_s",
        *_entries("ripple_period_rad", RIPPLES),
        "friction_top_speed_rad_s",
        "table_step_rad",
        "presliding_distance_rad",
        "backlash_distance_rad",
        "deadband_smoothing",
    }
)
"""Numbers that divide, and so may not be zero."""
MOST_LOSS: Final = 0.9
"""No board may set a larger maximum for `transmission_loss`: all of it would divide by zero."""
# Terms of the law that are off where all of these numbers are zero.
_TERMS: Final = {
    "stribeck": ("stribeck_feedforward",),
    "viscous_difference": ("viscous_difference_feedforward",),
    "ripple": ("ripple_cosine", "ripple_sine"),
    "ripple_fade": ("ripple_fade_speed_rad_s",),
    "friction_curve": ("friction_forward", "friction_backward"),
    "load_table": ("load_table",),
    "local_friction_table": ("local_friction_table",),
    "table_fade": ("table_fade_speed_rad_s",),
    "presliding": ("presliding_feedforward",),
    "backlash": ("backlash_offset_rad",),
    "deadband": ("deadband_inverse",),
    "cross": (
        "cross_inertia_feedforward",
        "cross_viscous_feedforward",
        "cross_coulomb_feedforward",
    ),
    "transmission": ("transmission_loss",),
}


@dataclass(frozen=True)
class AxisGains:
    """Gains of one axis; the defaults switch a term off.

    Attributes
    ----------
    proportional : float
        N*m/rad.
    derivative : float
        N*m*s/rad.
    integral : float
        N*m/(rad*s).
    velocity_filter_s : float
        Time constant of the velocity filter, s; 0 switches it off.
    inertia_feedforward : float
        kg*m^2.
    viscous_feedforward : float
        N*m*s/rad.
    coulomb_feedforward : float
        N*m.
    coulomb_smoothing_rad_s : float
        rad/s, positive.
    offset_feedforward : float
        N*m.
    stribeck_feedforward : float
        N*m, static less Coulomb friction.
    stribeck_speed_rad_s : float
        rad/s, positive.
    viscous_difference_feedforward : float
        N*m*s/rad, viscous friction forward over that of both directions' mean.
    ripple_cosine, ripple_sine : tuple of `RIPPLES` floats
        N*m; an entry with both zero is off.
    ripple_period_rad : tuple of `RIPPLES` floats
        rad, positive.
    friction_top_speed_rad_s : float
        rad/s, positive: end of the friction curves.
    friction_forward, friction_backward : tuple of `FRICTION_ENTRIES` floats
        N*m, friction beyond Coulomb's and Stribeck's at speeds that grow with the square of the
        entry's number up to the top speed.
    table_start_rad : float
        rad, position of the first entry of both tables over position.
    table_step_rad : float
        rad, positive: from one entry to the next.
    load_table, local_friction_table : tuple of `TABLE_ENTRIES` floats
        N*m: load, and friction beyond Coulomb's.
    table_fade_speed_rad_s : float
        rad/s, up to which both tables act whole; at twice it they are gone. 0: at every speed.
    ripple_fade_speed_rad_s : tuple of `RIPPLES` floats
        The same for each ripple.
    presliding_feedforward : float
        N*m, friction that builds up over a distance after each reversal.
    presliding_distance_rad : float
        rad, positive.
    backlash_offset_rad : float
        rad, half the gap.
    backlash_distance_rad : float
        rad, positive: over which the reference crosses the gap.
    deadband_inverse : float
        N*m that the actuator swallows.
    deadband_smoothing : float
        N*m, positive: effort over which the inverse changes sign.
    cross_inertia_feedforward, cross_viscous_feedforward, cross_coulomb_feedforward : float
        kg*m^2, N*m*s/rad, N*m: effort of this axis for the motion of the other one.
    transmission_loss : float
        Share of the transmitted effort that is lost, at most 0.9.
    transmitted_inertia : float
        kg*m^2, part of the inertia beyond the transmission.
    transmitted_friction : float
        Share of viscous and Coulomb friction beyond the transmission.
    """

    proportional: float
    derivative: float
    integral: float
    velocity_filter_s: float
    inertia_feedforward: float
    viscous_feedforward: float
    coulomb_feedforward: float
    coulomb_smoothing_rad_s: float
    offset_feedforward: float
    stribeck_feedforward: float = 0.0
    stribeck_speed_rad_s: float = 1.0
    viscous_difference_feedforward: float = 0.0
    ripple_cosine: tuple[float, ...] = (0.0,) * RIPPLES
    ripple_sine: tuple[float, ...] = (0.0,) * RIPPLES
    ripple_period_rad: tuple[float, ...] = (1.0,) * RIPPLES
    friction_top_speed_rad_s: float = 1.0
    friction_forward: tuple[float, ...] = (0.0,) * FRICTION_ENTRIES
    friction_backward: tuple[float, ...] = (0.0,) * FRICTION_ENTRIES
    table_start_rad: float = 0.0
    table_step_rad: float = 1.0
    load_table: tuple[float, ...] = (0.0,) * TABLE_ENTRIES
    local_friction_table: tuple[float, ...] = (0.0,) * TABLE_ENTRIES
    table_fade_speed_rad_s: float = 0.0
    ripple_fade_speed_rad_s: tuple[float, ...] = (0.0,) * RIPPLES
    presliding_feedforward: float = 0.0
    presliding_distance_rad: float = 1.0
    backlash_offset_rad: float = 0.0
    backlash_distance_rad: float = 1.0
    deadband_inverse: float = 0.0
    deadband_smoothing: float = 1.0
    cross_inertia_feedforward: float = 0.0
    cross_viscous_feedforward: float = 0.0
    cross_coulomb_feedforward: float = 0.0
    transmission_loss: float = 0.0
    transmitted_inertia: float = 0.0
    transmitted_friction: float = 0.0

    @cached_property
    def terms(self) -> frozenset[str]:
        """Terms of the law that these gains switch on, of those that can be off."""
        return frozenset(
            term
            for term, names in _TERMS.items()
            if any(np.any(getattr(self, name)) for name in names)
        )

    @cached_property
    def ripples(self) -> tuple[int, ...]:
        """Entries of the ripple table that are on."""
        return tuple(
            k
            for k in range(RIPPLES)
            if np.any(self.ripple_cosine[k]) or np.any(self.ripple_sine[k])
        )

    def numbers(self) -> dict[str, float]:
        """Every number by name, in the order of a gain bank; entry k of a table is `name[k]`."""
        found: dict[str, float] = {}
        for field in fields(self):
            value = getattr(self, field.name)
            if isinstance(value, tuple):
                found |= {f"{field.name}[{k}]": entry for k, entry in enumerate(value)}
            else:
                found[field.name] = value
        return found

    @classmethod
    def of_numbers(cls, numbers: Sequence[float]) -> Self:
        """Gains from their numbers in the order of a gain bank; what is not there is off."""
        values: dict[str, Any] = {}
        left = list(numbers)
        for field in fields(cls):
            if not left:
                break
            count = len(field.default) if isinstance(field.default, tuple) else 0
            values[field.name] = tuple(left[:count]) if count else left[0]
            del left[: count or 1]
        return cls(**values)


CONSERVATIVE_GAINS: Final = AxisGains(
    proportional=30.0,
    derivative=4.0,
    integral=0.0,
    velocity_filter_s=0.010,
    inertia_feedforward=0.0,
    viscous_feedforward=0.0,
    coulomb_feedforward=0.0,
    coulomb_smoothing_rad_s=0.1,
    offset_feedforward=0.0,
)
"""Soft feedback without feed-forward: safe on any drive of this size, and slow to follow."""
Bank = Mapping[str, AxisGains]
"""Gains of all axes, by name."""
GAIN_FIELDS: Final[Mapping[int, tuple[str, ...]]] = {
    3: tuple(field.name for field in fields(AxisGains))[:15],
    4: tuple(field.name for field in fields(AxisGains)),
    5: tuple(field.name for field in fields(AxisGains)),
    6: tuple(field.name for field in fields(AxisGains)),
}
"""Fields of `AxisGains` that a board knows, by the version of its register map."""
OFF: Final = AxisGains.of_numbers([0.0] * 9).numbers()
"""What each number is by default, zero where it has none: a term that is off."""
_ALWAYS: Final = frozenset(name for name in GAIN_FIELDS[3] if name in OFF)


def numbers_in_use(banks: Sequence[AxisGains]) -> list[str]:
    """Names of the numbers that tell what gains do.

    Those of the first terms, and of the others those that a bank does not leave at their default.
    """
    numbers = [bank.numbers() for bank in banks]
    return [
        name
        for name, default in OFF.items()
        if name in _ALWAYS or any(bank[name] != default for bank in numbers)
    ]


# Gain banks as words: in which order, and at which addresses.
#
# A bank's words stand in the order of their addresses: of all axes the numbers that map 3 had, then
# of all axes those that came with map 4. Its CRC-32 is of all of them.

# The first number that each version of the map brought.
_FIRST: Final = {3: "proportional", 4: "friction_top_speed"}
# Words of one axis that each version of the map brought.
_WORDS: Final = {
    version: sum(
        register.words
        for register in registers.REGISTERS.values()
        if register.name.startswith(f"active.{registers.AXES[0]}.") and register.since == version
    )
    for version in _FIRST
}


def encode_gains(gains: Mapping[str, AxisGains], version: int = registers.MAP_VERSION) -> list[int]:
    """Words of the axes in a gain bank of this version of the map, without CRC."""
    left = {axis: list(bank.numbers().values()) for axis, bank in gains.items()}
    words = []
    for count in _counts(version):
        for axis in (axis for axis in registers.AXES if axis in gains):
            words += codec.bytes_to_words(struct.pack(f">{count}f", *left[axis][:count]))
            del left[axis][:count]
    return words


def decode_gains(
    words: Sequence[int], version: int = registers.MAP_VERSION, axes: Sequence[str] = registers.AXES
) -> dict[str, AxisGains]:
    """Gains of the axes from a bank's words; numbers that its map does not have are off."""
    numbers: dict[str, list[float]] = {axis: [] for axis in axes}
    first = 0
    for count in _counts(version):
        for axis in axes:
            packed = codec.words_to_bytes(words[first : first + 2 * count])
            numbers[axis] += struct.unpack(f">{count}f", packed)
            first += 2 * count
    return {axis: AxisGains.of_numbers(numbers[axis]) for axis in axes}


def _counts(version: int) -> list[int]:
    """Numbers of one axis in each part of a bank."""
    return [words // 2 for since, words in _WORDS.items() if since <= version]


def bank_spans(
    group: str, version: int = registers.MAP_VERSION, axes: Sequence[str] = registers.AXES
) -> list[codec.Span]:
    """Where the words of a bank stand, in their order.

    Parameters
    ----------
    group : {"active", "shadow", "gain_maximum"}
    version : int
        Of the board's map.
    axes : sequence of str
    """
    return [
        (registers.REGISTERS[f"{group}.{axis}.{_FIRST[since]}"].address, words)
        for since, words in _WORDS.items()
        if since <= version
        for axis in axes
    ]


def span_of(name: str) -> codec.Span:
    """Where a register stands."""
    return registers.REGISTERS[name].address, registers.REGISTERS[name].words


def staged_writes(
    gains: Mapping[str, AxisGains], version: int = registers.MAP_VERSION
) -> tuple[list[tuple[int, list[int]]], int]:
    """The writes, as (address, words), that stage gains, and their CRC, which goes out last."""
    bank, crc = encode_gains(gains, version), span_of("shadow.crc")
    spans = bank_spans("shadow", version)
    words = dict(zip(codec.addresses(spans), bank, strict=True))
    words |= zip(codec.addresses([crc]), codec.encode("shadow.crc", codec.crc32(bank)), strict=True)
    parts = sorted(
        codec.transfers([*spans, crc], codec.WRITTEN_WORDS),
        key=lambda part: part[0] <= crc[0] < sum(part),
    )
    return [
        (first, [words[a] for a in codec.addresses([(first, n)])]) for first, n in parts
    ], codec.crc32(bank)
