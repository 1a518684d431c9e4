"""What a board tells of itself, in SI units."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from firmware_interface import codec, errors, registers
from firmware_interface.gains import GAIN_FIELDS, AxisGains, bank_spans, decode_gains
from firmware_interface.received import nonsense, received, received_integer

Array = NDArray[np.float64]


ReadWords = Callable[[int, int], list[int]]


@dataclass(frozen=True)
class BoardIdentity:
    """Who the board is, and the constants of its control loop.

    Attributes
    ----------
    sample_period_s : float
        Of control loop and capture.
    control_delay_s : float
        From the encoder latch to the PWM update, measured by the board.
    counts_per_turn : int
        Encoder counts per turn of the gearbox output.
    effort_per_count_nm : float
        Torque at the gearbox output of one PWM count.
    map_version : int
        Of the register map that the board speaks.
    """

    firmware_version: str
    serial_number: int
    map_crc: int
    sample_period_s: float
    control_delay_s: float
    counts_per_turn: int
    effort_per_count_nm: float
    map_version: int = registers.MAP_VERSION

    @property
    def gain_fields(self) -> tuple[str, ...]:
        """Fields of `AxisGains` that the board's control law has; it takes no others."""
        return GAIN_FIELDS[self.map_version]

    @property
    def encoder_resolution_rad(self) -> float:
        """Angle of one count at the gearbox output."""
        return 2.0 * np.pi / self.counts_per_turn


@dataclass(frozen=True)
class BoardStatus:
    """State of the board at one moment.

    Attributes
    ----------
    fault_sample : int
        Control sample of the fault, counted from power-up like `clock_samples`.
    sto_latched : bool
        The wired emergency stop acted since the last clear_fault, however shortly.
    unconfirmed : bool
        Committed gains wait for confirm; `confirm_remaining_s` until the board rolls back.
    enabled, brake_released : bool
        The control law may command effort, and what the board asks of the brake.
    homed : tuple of str
        Axes that count from the machine's reference mark, the others from where they stood at
        power-up.
    limit_switches : tuple of str
        Those pressed, as axis and side: `x-`, `z+`.
    samples_to_check : int
        That ARM has still before it.
    stores : int
        Times that permanent memory was written, over the board's life.
    session_remaining_s : float
        For which a host still holds the board; 0 when none does.
    position_rad, speed_rad_s : mapping of axis name to float
        Measured now.
    pages_written, samples_captured, overflows : int
        Since the last start.
    """

    state: registers.State
    fault: registers.Fault
    fault_sample: int
    sto_active: bool
    sto_latched: bool
    last_token: int
    last_result: registers.Result
    staged_crc_ok: bool
    unconfirmed: bool
    confirm_remaining_s: float
    clock_samples: int
    pages_written: int
    samples_captured: int
    overflows: int
    enabled: bool
    brake_released: bool
    homed: tuple[str, ...]
    limit_switches: tuple[str, ...]
    samples_to_check: int
    stores: int
    session_remaining_s: float
    position_rad: Mapping[str, float]
    speed_rad_s: Mapping[str, float]

    @property
    def emergency_stop(self) -> bool:
        """The wired emergency stop cuts the effort, or has since the last clear_fault."""
        return self.sto_active or self.sto_latched

    @property
    def at_rest(self) -> bool:
        """The axes stand, and no motion is armed or under way."""
        return self.state in (registers.State.IDLE, registers.State.FAULT)


@dataclass(frozen=True)
class AxisLimits:
    """What the board enforces on one axis.

    Attributes
    ----------
    gain_step : float
        Largest change of a gain in one commit, as a share of its maximum.
    gain_maximum : AxisGains
        Largest value of each number, either sign where it may be negative.
    effort_jump_nm : float
        Largest jump of the effort that a commit evens out; 0: it takes none while the law acts.
    inertia, viscous_friction : float
        Of the drive as the board's settings state it, kg·m² and N·m·s/rad at the gearbox output: a
        commit is refused where feedback would be unstable with them. Inertia 0: not checked.
    """

    travel_rad: float
    speed_rad_s: float
    acceleration_rad_s2: float
    effort_nm: float
    following_error_rad: float
    gain_step: float
    gain_maximum: AxisGains
    effort_jump_nm: float = 0.0
    inertia: float = 0.0
    viscous_friction: float = 0.0


@dataclass(frozen=True)
class CapturePage:
    """Consecutive samples; arrays are (samples, axes).

    Row k: the position latched at sample k, the effort computed from it (in force from the
    control delay after the latch, for one period), and reference - position.
    """

    first_sample: int
    position_rad: Array
    effort_nm: Array
    following_error_rad: Array


_STATUS_BASE = registers.REGISTERS["status.state"].address
_STATUS_LAST = registers.REGISTERS[f"measured.{registers.AXES[-1]}.speed"]
_STATUS_WORDS = _STATUS_LAST.address + _STATUS_LAST.words - _STATUS_BASE
_SWITCHES = tuple(f"{axis}{side}" for axis in registers.AXES for side in "-+")
_IDENTITY_BASE = registers.REGISTERS["identity.magic"].address
NONCE_WORDS = registers.REGISTERS["identity.nonce"].address + 2 - _IDENTITY_BASE
"""From the identity's first word to the end of the nonce."""
_IDENTITY_WORDS = registers.REGISTERS["identity.effort_per_count"].address + 2 - _IDENTITY_BASE


def twice(read: ReadWords) -> ReadWords:
    """Transfers that are repeated and compared: identity and limits have no checksum of their own,
    and every check of a motion or of gains goes by them."""

    def compared(address: int, count: int) -> list[int]:
        words = read(address, count)
        if read(address, count) != words:
            raise errors.ChangedWordError(
                "what the board says of itself differs from one reading to the next"
            )
        return words

    return compared


def read_identity(read: ReadWords) -> BoardIdentity:
    """One transfer."""
    words = read(_IDENTITY_BASE, _IDENTITY_WORDS)

    def value(name: str) -> float:
        return received(f"identity.{name}", words, _IDENTITY_BASE)

    version = int(value("firmware_version"))
    return BoardIdentity(
        firmware_version=f"{version >> 8}.{version & 0xFF}",
        serial_number=int(value("serial_number")),
        map_crc=int(value("map_crc")),
        sample_period_s=value("sample_period"),
        control_delay_s=value("control_delay"),
        counts_per_turn=int(value("counts_per_turn")),
        effort_per_count_nm=value("effort_per_count"),
        map_version=int(value("map_version")),
    )


def read_nonce(read: ReadWords) -> int:
    """The number that the board drew at power-up; one transfer that says whose it is."""
    words = read(_IDENTITY_BASE, NONCE_WORDS)
    if codec.decode_integer("identity.magic", words) != registers.MAGIC:
        raise errors.LinkError(
            "the reply to the request for the board's identity is not from a board",
            "check the cable, make sure that no other host or device is connected, then try again",
        )
    return received_integer("identity.nonce", words, _IDENTITY_BASE)


def read_status(read: ReadWords) -> BoardStatus:
    """One transfer, so that state, token and counters belong together."""
    words = read(_STATUS_BASE, _STATUS_WORDS)

    def integer(name: str) -> int:
        return received_integer(name, words, _STATUS_BASE)

    def number(name: str) -> float:
        return received(name, words, _STATUS_BASE)

    return BoardStatus(
        state=registers.State(integer("status.state")),
        fault=registers.Fault(integer("status.fault_code")),
        fault_sample=integer("status.fault_sample"),
        sto_active=bool(integer("status.sto_active")),
        sto_latched=bool(integer("status.sto_latched")),
        last_token=integer("status.last_token"),
        last_result=registers.Result(integer("status.last_result")),
        staged_crc_ok=bool(integer("status.staged_crc_ok")),
        unconfirmed=bool(integer("status.unconfirmed")),
        confirm_remaining_s=number("status.confirm_remaining"),
        clock_samples=integer("status.board_clock"),
        pages_written=integer("capture.pages_written"),
        samples_captured=integer("capture.samples_captured"),
        overflows=integer("capture.overflows"),
        enabled=bool(integer("status.enabled")),
        brake_released=bool(integer("status.brake_released")),
        homed=_named_bits(integer("status.homed"), registers.AXES),
        limit_switches=_named_bits(integer("status.limit_switches"), _SWITCHES),
        samples_to_check=integer("status.samples_to_check"),
        stores=integer("status.stores"),
        session_remaining_s=number("session.remaining"),
        position_rad={axis: number(f"measured.{axis}.position") for axis in registers.AXES},
        speed_rad_s={axis: number(f"measured.{axis}.speed") for axis in registers.AXES},
    )


def _named_bits(bits: int, names: Sequence[str]) -> tuple[str, ...]:
    """Names of the bits that are set, from the lowest on."""
    return tuple(name for n, name in enumerate(names) if bits >> n & 1)


def read_limits(read: ReadWords, axis: str, version: int = registers.MAP_VERSION) -> AxisLimits:
    """Limits of an axis, from a board of this version of the map."""
    first, last = (
        registers.REGISTERS[f"limits.{axis}.{name}"] for name in ("travel", "acceleration")
    )
    base, maxima = first.address, bank_spans("gain_maximum", version, (axis,))
    own = (base, last.address + last.words - base)
    found = codec.read_spans(read, [own, *maxima])
    words = [found[address] for address in codec.addresses([own])]
    bank = decode_gains([found[address] for address in codec.addresses(maxima)], version, (axis,))

    def value(name: str) -> float:
        return received(f"limits.{axis}.{name}", words, base)

    def later(name: str) -> float:
        """Of a register that boards of older maps do not have."""
        register = registers.REGISTERS[name]
        if register.since > version:
            return 0.0
        return received(name, read(register.address, register.words))

    return AxisLimits(
        travel_rad=value("travel"),
        speed_rad_s=value("speed"),
        acceleration_rad_s2=value("acceleration"),
        effort_nm=value("effort"),
        following_error_rad=value("following_error"),
        gain_step=value("gain_step"),
        gain_maximum=checked_gains("gain_maximum", bank)[axis],
        effort_jump_nm=later(f"bumpless.{axis}.jump_limit"),
        inertia=later(f"stated.{axis}.inertia"),
        viscous_friction=later(f"stated.{axis}.viscous_friction"),
    )


def page_in_si(page: codec.RawPage, identity: BoardIdentity) -> CapturePage:
    """Counts to rad and N*m."""
    rad_per_count = identity.encoder_resolution_rad
    return CapturePage(
        first_sample=page.first_sample,
        position_rad=np.multiply(page.position, rad_per_count, dtype=np.float64),
        effort_nm=np.multiply(page.effort, identity.effort_per_count_nm, dtype=np.float64),
        following_error_rad=np.multiply(page.following_error, rad_per_count, dtype=np.float64),
    )


def checked_gains(group: str, gains: Mapping[str, AxisGains]) -> dict[str, AxisGains]:
    """Gains by axis; the group of registers is for the message.

    Raises
    ------
    BoardError
        A number is not finite.
    """
    for axis, bank in gains.items():
        for name, value in bank.numbers().items():
            if not math.isfinite(value):
                raise nonsense(f"{group}.{axis}.{name}", value)
    return dict(gains)


# The register maps whose boards a host drives: its own, and the older ones that it still knows.

MAP_CRCS: Final[Mapping[int, int]] = {
    3: 0x58329FE3,
    4: 0x0A052151,
    5: 0x70F6F3EB,
    registers.MAP_VERSION: registers.MAP_CRC,
}
"""CRC-32 of each map, by its version."""
