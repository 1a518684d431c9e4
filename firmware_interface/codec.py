"""Values to Modbus words and back, gain banks apart. All scaling of the project is in here."""

import struct
import zlib
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import astuple, dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from firmware_interface.motion import (
    MAXIMUM_COMPONENTS,
    MAXIMUM_LEVELS,
    Multisine,
    SineComponent,
    Staircase,
    Trajectory,
)
from firmware_interface.registers import AXES, PAGE_SAMPLES, PAGE_WORDS, REGISTERS, TrajectoryKind

Counts = NDArray[np.int64]

_FORMATS: Final = {"u16": "H", "i16": "h", "u32": "I", "i32": "i", "f32": "f"}
_PAGE_HEADER: Final = struct.Struct(">IIH")
_SAMPLE: Final = np.dtype([("position", ">i4"), ("effort", ">i2"), ("following_error", ">i2")])


def encode(name: str, *values: float) -> list[int]:
    """Words of a register's value, or of the values of an array.

    Raises
    ------
    ValueError
        The value does not fit the register's type, or their number is wrong.
    """
    register = REGISTERS[name]
    if len(values) != register.count:
        raise ValueError(f"{name} holds {register.count} values, not {len(values)}")
    kind = _FORMATS[register.type]
    raw = [value / register.scale for value in values]
    try:
        packed = struct.pack(f">{register.count}{kind}", *(raw if kind == "f" else map(round, raw)))
    except (struct.error, OverflowError) as error:
        raise ValueError(f"{name}: {values} does not fit {register.type}: {error}") from error
    return bytes_to_words(packed)


def decode_array(name: str, words: Sequence[int], base: int | None = None) -> tuple[float, ...]:
    """Values of an array register.

    Parameters
    ----------
    name : str
    words : sequence of int
        A transfer that contains the register.
    base : int, optional
        Address of the first word; by default the register's own.
    """
    register = REGISTERS[name]
    start = 0 if base is None else register.address - base
    packed = words_to_bytes(words[start : start + register.words])
    raw = struct.unpack(f">{register.count}{_FORMATS[register.type]}", packed)
    return tuple(value * register.scale for value in raw)


def decode(name: str, words: Sequence[int], base: int | None = None) -> float:
    """Value of a register that is no array; see `decode_array`."""
    return decode_array(name, words, base)[0]


def decode_integer(name: str, words: Sequence[int], base: int | None = None) -> int:
    """Value of a code, counter or flag; see `decode_array`."""
    return int(decode(name, words, base))


def bytes_to_words(data: bytes) -> list[int]:
    """Big-endian."""
    return list(struct.unpack(f">{len(data) // 2}H", data))


def words_to_bytes(words: Sequence[int]) -> bytes:
    """Big-endian."""
    return struct.pack(f">{len(words)}H", *words)


def crc32(words: Sequence[int]) -> int:
    """CRC-32 (zlib's) of the words' bytes, big-endian."""
    return zlib.crc32(words_to_bytes(words))


# ---- capture pages


@dataclass(frozen=True)
class RawPage:
    """A capture page in counts; arrays are (samples, axes)."""

    index: int
    first_sample: int
    position: Counts
    effort: Counts
    following_error: Counts


def encode_page(page: RawPage) -> list[int]:
    """Words of a page; a short one is padded with zeros, following errors saturate."""
    samples = np.zeros((PAGE_SAMPLES, len(AXES)), dtype=_SAMPLE)
    count = len(page.position)
    samples["position"][:count] = page.position
    samples["effort"][:count] = page.effort
    samples["following_error"][:count] = np.clip(page.following_error, -(2**15), 2**15 - 1)
    body = _PAGE_HEADER.pack(page.index, page.first_sample, count) + samples.tobytes()
    return bytes_to_words(body + zlib.crc32(body).to_bytes(4, "big"))


def decode_page(words: Sequence[int]) -> RawPage:
    """A page from its words.

    Raises
    ------
    ValueError
        Wrong length, CRC or number of samples.
    """
    data = words_to_bytes(words)
    body, crc = data[:-4], int.from_bytes(data[-4:], "big")
    if len(words) != PAGE_WORDS or zlib.crc32(body) != crc:
        raise ValueError("capture page with a wrong CRC")
    index, first_sample, count = _PAGE_HEADER.unpack_from(body)
    if not 1 <= count <= PAGE_SAMPLES:
        raise ValueError(f"capture page with {count} samples")
    samples = np.frombuffer(body, _SAMPLE, offset=_PAGE_HEADER.size)
    samples = samples.reshape(PAGE_SAMPLES, len(AXES))[:count]
    return RawPage(
        index,
        first_sample,
        samples["position"].astype(np.int64),
        samples["effort"].astype(np.int64),
        samples["following_error"].astype(np.int64),
    )


# ---- trajectories


def encode_trajectory(
    trajectory: Trajectory, sample_period_s: float
) -> list[tuple[int, list[int]]]:
    """The writes, as (address, words), that hand a trajectory to the board.

    Raises
    ------
    ValueError
        Other axes than the board's, mixed kinds, too many components or levels, or a value
        outside its range.
    """
    if set(trajectory.axes) != set(AXES):
        raise ValueError(f"the board has the axes {', '.join(AXES)}")
    kinds = {type(motion) for motion in trajectory.axes.values()}
    if len(kinds) > 1:
        raise ValueError("all axes need a motion of the same kind")
    kind = TrajectoryKind.MULTISINE if kinds == {Multisine} else TrajectoryKind.STAIRCASE
    header = encode("trajectory.kind", kind)
    header += encode("trajectory.lead_in_samples", trajectory.lead_in_s / sample_period_s)
    header += encode("trajectory.capture_samples", trajectory.duration_s / sample_period_s)
    return [
        (REGISTERS["trajectory.kind"].address, header),
        *(
            (
                REGISTERS[f"trajectory.{axis}.components"].address,
                _encode_motion(f"trajectory.{axis}", trajectory.axes[axis]),
            )
            for axis in AXES
        ),
    ]


def trajectory_words(writes: Iterable[tuple[int, list[int]]]) -> list[int]:
    """The whole trajectory group as a board holds it after these writes.

    From its first register to its last, gaps as zeros: ARM names these words by their CRC-32.
    """
    names = [name for name in REGISTERS if name.startswith("trajectory.")]
    base, last = REGISTERS[names[0]].address, REGISTERS[names[-1]]
    words = [0] * (last.address + last.words - base)
    for address, part in writes:
        words[address - base : address - base + len(part)] = part
    return words


def decode_trajectory(words: Sequence[int], base: int, sample_period_s: float) -> Trajectory:
    """A trajectory from a copy of the whole trajectory group."""

    def samples_s(name: str) -> float:
        return decode(f"trajectory.{name}", words, base) * sample_period_s

    kind = TrajectoryKind(decode_integer("trajectory.kind", words, base))
    return Trajectory(
        axes={axis: _decode_motion(f"trajectory.{axis}", kind, words, base) for axis in AXES},  # type: ignore[arg-type]
        duration_s=samples_s("capture_samples"),
        lead_in_s=samples_s("lead_in_samples"),
    )


def _encode_motion(prefix: str, motion: Multisine | Staircase) -> list[int]:
    components = motion.components if isinstance(motion, Multisine) else ()
    stairs = motion if isinstance(motion, Staircase) else Staircase((), 0.0, 0.0)
    if len(components) > MAXIMUM_COMPONENTS or len(stairs.speeds_rad_s) > MAXIMUM_LEVELS:
        raise ValueError(f"at most {MAXIMUM_COMPONENTS} sines or {MAXIMUM_LEVELS} levels per axis")

    def padded(values: Iterable[float], length: int) -> list[float]:
        return [*values, *[0.0] * length][:length]

    sines = [astuple(component) for component in components]
    amplitudes, rates, phases = ([sine[n] for sine in sines] for n in range(3))
    return [
        *encode(f"{prefix}.components", len(components)),
        *encode(f"{prefix}.levels", len(stairs.speeds_rad_s)),
        *encode(f"{prefix}.amplitude", *padded(amplitudes, MAXIMUM_COMPONENTS)),
        *encode(f"{prefix}.angular_frequency", *padded(rates, MAXIMUM_COMPONENTS)),
        *encode(f"{prefix}.phase", *padded(phases, MAXIMUM_COMPONENTS)),
        *encode(f"{prefix}.level_speed", *padded(stairs.speeds_rad_s, MAXIMUM_LEVELS)),
        *encode(f"{prefix}.dwell", stairs.dwell_s),
        *encode(f"{prefix}.acceleration", stairs.acceleration_rad_s2),
    ]


def _decode_motion(
    prefix: str, kind: TrajectoryKind, words: Sequence[int], base: int
) -> Multisine | Staircase:
    def array(name: str) -> tuple[float, ...]:
        return decode_array(f"{prefix}.{name}", words, base)

    if kind is TrajectoryKind.MULTISINE:
        used = decode_integer(f"{prefix}.components", words, base)
        sines = zip(array("amplitude"), array("angular_frequency"), array("phase"), strict=True)
        return Multisine(tuple(SineComponent(*sine) for sine in list(sines)[:used]))
    levels = array("level_speed")[: decode_integer(f"{prefix}.levels", words, base)]
    return Staircase(levels, array("dwell")[0], array("acceleration")[0])


# Stretches of consecutive registers, and the transfers that carry them.

Span = tuple[int, int]
"""Address of the first of consecutive registers, and how many they are."""

READ_WORDS: Final = 124
WRITTEN_WORDS: Final = 122
"""Whole values in one transfer: Modbus reads at most 125 registers and writes at most 123."""


def addresses(spans: Iterable[Span]) -> Iterator[int]:
    """Addresses of all words, in their order."""
    for address, count in spans:
        yield from range(address, address + count)


def transfers(spans: Iterable[Span], longest: int) -> Iterator[Span]:
    """Words in as few transfers as it takes, by address.

    Of the transfers of one stretch, the shorter one comes second: of two reads of one length in a
    row, a late reply to the first could pass for the second, so the link puts another in between.
    """
    ordered = sorted(addresses(spans))
    breaks = [n for n in range(1, len(ordered)) if ordered[n] != ordered[n - 1] + 1]
    for first, last in zip([0, *breaks], [*breaks, len(ordered)], strict=True):
        full, rest = divmod(last - first, longest)
        counts = [longest] * full
        counts[1:1] = [rest] if rest else []
        for count in counts:
            yield ordered[first], count
            first += count


def read_spans(read: Callable[[int, int], list[int]], spans: Iterable[Span]) -> dict[int, int]:
    """Words by their address."""
    return {
        first + n: word
        for first, count in transfers(spans, READ_WORDS)
        for n, word in enumerate(read(first, count))
    }
