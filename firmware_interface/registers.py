"""The register map as data.

Generated from registers.toml by firmware_interface/generate.py; do not edit.
"""
# ruff: noqa: E501

from enum import IntEnum
from typing import Final

from firmware_interface.register import Register

MAGIC: Final = 0x4D464453
MAP_VERSION: Final = 3
MAP_CRC: Final = 0x58329FE3
FLOAT_TEST: Final = 3.1415927
STORE_SIGNATURE: Final = 0x65766173
SESSION_LEASE_S: Final = 5.0
AXES: Final = ("x", "z")
PAGE_ADDRESS: Final = 0x1000
PAGE_SLOTS: Final = 256
PAGE_SLOT_REGISTERS: Final = 128
PAGE_SAMPLES: Final = 14
PAGE_WORDS: Final = 119


class State(IntEnum):
    """State of the board."""

    INIT = 0
    IDLE = 1
    ARMED = 2
    MOVING = 3
    DRAINING = 4
    DONE = 5
    FAULT = 6
    STOPPING = 7
    CHECKING = 8


class Fault(IntEnum):
    """Why the board is in FAULT."""

    NONE = 0
    SELF_TEST = 1
    TRAVEL = 2
    SPEED = 3
    FOLLOWING_ERROR = 4
    WATCHDOG = 5
    STO = 6
    NOT_FINITE = 7
    LIMIT_SWITCH = 8


class Opcode(IntEnum):
    """Commands; each is written with a fresh token and its argument in one write."""

    ARM = 1
    START = 2
    QUICK_STOP = 3
    FINISH = 4
    CLEAR_FAULT = 5
    COMMIT = 6
    CONFIRM = 7
    ROLL_BACK = 8
    STORE = 9
    ENABLE = 10
    DISABLE = 11


class Result(IntEnum):
    """What became of the last command."""

    NONE = 0
    DONE = 1
    UNKNOWN_COMMAND = 2
    WRONG_STATE = 3
    WRONG_ARGUMENT = 4
    BAD_TRAJECTORY = 5
    TRAJECTORY_LIMITS = 6
    GAIN_CRC = 7
    GAIN_LIMITS = 8
    UNCONFIRMED = 9
    NOTHING_COMMITTED = 10
    STO_ACTIVE = 11
    NOT_AT_REST = 12
    STORE_FAILED = 13
    PENDING = 14
    NOT_ENABLED = 15
    NOT_HELD = 16


class TrajectoryKind(IntEnum):
    """Which of the two tables the board follows."""

    MULTISINE = 1
    STAIRCASE = 2


class WatchdogAction(IntEnum):
    """What the board does when the watchdog expires during a motion; then it is in FAULT."""

    QUICK_STOP = 1
    COAST = 2


FAULT_TEXTS: Final = {
    Fault.NONE: (
        "no fault",
        "nothing to do",
    ),
    Fault.SELF_TEST: (
        "the self-test after power-up failed",
        "switch the board off and on; if it comes back, have the board checked",
    ),
    Fault.TRAVEL: (
        "an axis left its travel range",
        "move the axis back inside by hand, then clear the fault",
    ),
    Fault.SPEED: (
        "an axis was faster than its speed limit",
        "choose a slower motion or softer gains, then clear the fault",
    ),
    Fault.FOLLOWING_ERROR: (
        "an axis fell too far behind its reference",
        "look for an obstacle or a loose coupling, then clear the fault",
    ),
    Fault.WATCHDOG: (
        "the host that started the motion fell silent",
        "check cable and host load, then clear the fault",
    ),
    Fault.STO: (
        "the wired emergency stop cut the effort",
        "release the emergency stop, then clear the fault",
    ),
    Fault.NOT_FINITE: (
        "a setpoint or an effort was not a finite number",
        "keep the trajectory and the gains for the maintainer of the firmware, then clear the fault",
    ),
    Fault.LIMIT_SWITCH: (
        "an axis moved onto a limit switch",
        "clear the fault, then move away from the switch: edge-ident home",
    ),
}

RESULT_TEXTS: Final = {
    Result.NONE: (
        "no command yet",
        "nothing to do",
    ),
    Result.DONE: (
        "carried out",
        "nothing to do",
    ),
    Result.UNKNOWN_COMMAND: (
        "the board does not know this command",
        "install the same release on board and host",
    ),
    Result.WRONG_STATE: (
        "not allowed in the board's present state",
        "read the status; finish or stop the motion, or clear the fault first",
    ),
    Result.WRONG_ARGUMENT: (
        "the argument is not the expected signature",
        "install the same release on board and host",
    ),
    Result.BAD_TRAJECTORY: (
        "the trajectory is incomplete, not finite, faster than the sampling, or not the one that the host wrote",
        "make sure that no other host writes to the board, then write the whole trajectory again",
    ),
    Result.TRAJECTORY_LIMITS: (
        "the trajectory would leave the limits of travel, speed, acceleration or effort",
        "use a smaller or slower motion, a longer lead-in, or start nearer to it: edge-ident home",
    ),
    Result.GAIN_CRC: (
        "the shadow bank does not match its CRC, or is not the one that the host staged",
        "make sure that no other host writes to the board, then stage the gains again",
    ),
    Result.GAIN_LIMITS: (
        "a staged gain is outside the board's limits or changes too much at once",
        "compare the staged gains with the limits; lower the bandwidth",
    ),
    Result.UNCONFIRMED: (
        "gains committed before are not confirmed yet",
        "confirm or roll back first",
    ),
    Result.NOTHING_COMMITTED: (
        "there are no unconfirmed gains; the window may have expired",
        "read the active gains; commit again if they are the old ones",
    ),
    Result.STO_ACTIVE: (
        "the wired emergency stop is active",
        "release the emergency stop",
    ),
    Result.NOT_AT_REST: (
        "an axis still moves",
        "wait until it stands still",
    ),
    Result.STORE_FAILED: (
        "permanent memory did not take the gains",
        "have the board checked; until its next power-up the gains stay in force",
    ),
    Result.PENDING: (
        "still being carried out",
        "wait for its end",
    ),
    Result.NOT_ENABLED: (
        "the effort is off",
        "enable the axes first",
    ),
    Result.NOT_HELD: (
        "the command came from a host that does not control the board",
        "wait until the other host is finished, or stop it with edge-ident stop",
    ),
}

_ALL = (
    Register(
        name="identity.magic",
        address=0,
        type="u32",
        description="Tells this kind of board from any other Modbus device.",
    ),
    Register(
        name="identity.map_version",
        address=2,
        type="u16",
        description="Version of this map.",
    ),
    Register(
        name="identity.firmware_version",
        address=3,
        type="u16",
        description="Major version in the high byte, minor in the low one.",
    ),
    Register(
        name="identity.map_crc",
        address=4,
        type="u32",
        description="CRC-32 of the map that the firmware was built with; argument of START.",
    ),
    Register(
        name="identity.serial_number",
        address=6,
        type="u32",
        description="Serial number of the board.",
    ),
    Register(
        name="identity.float_test",
        address=8,
        type="f32",
        description="Always 3.1415927.",
    ),
    Register(
        name="identity.nonce",
        address=10,
        type="u32",
        description="Random, drawn at power-up: a match proves that a reply is no stale one.",
    ),
    Register(
        name="identity.sample_period",
        address=12,
        type="u32",
        scale=1e-09,
        unit="s",
        minimum=1e-05,
        maximum=0.1,
        description="Period of control loop and capture.",
    ),
    Register(
        name="identity.control_delay",
        address=14,
        type="u32",
        scale=1e-09,
        unit="s",
        minimum=0.0,
        maximum=0.1,
        description="Measured by the board: encoder latch to PWM update.",
    ),
    Register(
        name="identity.counts_per_turn",
        address=16,
        type="u32",
        minimum=4,
        maximum=1000000000.0,
        description="Encoder counts per turn of the gearbox output.",
    ),
    Register(
        name="identity.effort_per_count",
        address=18,
        type="f32",
        unit="N*m",
        minimum=1e-09,
        maximum=1000.0,
        description="Torque at the gearbox output of one PWM count.",
    ),
    Register(
        name="status.state",
        address=64,
        type="u16",
        enum="State",
        description="Present state.",
    ),
    Register(
        name="status.fault_code",
        address=65,
        type="u16",
        enum="Fault",
        description="First fault since the last CLEAR_FAULT.",
    ),
    Register(
        name="status.fault_sample",
        address=66,
        type="u32",
        description="Control sample, counted from power-up, of the fault.",
    ),
    Register(
        name="status.sto_active",
        address=68,
        type="u16",
        minimum=0,
        maximum=1,
        description="1 while the wired emergency stop cuts the effort.",
    ),
    Register(
        name="status.last_token",
        address=69,
        type="u16",
        description="Token of the last command carried out or refused.",
    ),
    Register(
        name="status.last_result",
        address=70,
        type="u16",
        enum="Result",
        description="What became of that command.",
    ),
    Register(
        name="status.staged_crc_ok",
        address=71,
        type="u16",
        minimum=0,
        maximum=1,
        description="1 when the shadow bank matches its CRC.",
    ),
    Register(
        name="status.unconfirmed",
        address=72,
        type="u16",
        minimum=0,
        maximum=1,
        description="1 between COMMIT and CONFIRM or roll back.",
    ),
    Register(
        name="status.confirm_remaining",
        address=73,
        type="u16",
        scale=0.01,
        unit="s",
        description="Time left for CONFIRM before the board rolls back by itself.",
    ),
    Register(
        name="status.board_clock",
        address=74,
        type="u32",
        description="Control samples since power-up.",
    ),
    Register(
        name="capture.pages_written",
        address=76,
        type="u32",
        description="Pages completed since START.",
    ),
    Register(
        name="capture.samples_captured",
        address=78,
        type="u32",
        description="Samples captured since START.",
    ),
    Register(
        name="capture.overflows",
        address=80,
        type="u32",
        description="Pages overwritten before they were acknowledged, since START.",
    ),
    Register(
        name="status.enabled",
        address=82,
        type="u16",
        minimum=0,
        maximum=1,
        description="1 while the control law may command effort; 0 after power-up and after every fault.",
    ),
    Register(
        name="status.homed",
        address=83,
        type="u16",
        minimum=0,
        maximum=3,
        description="Bit n: axis n counts from the machine's reference mark; else travel counts from where the axis stood at power-up.",
    ),
    Register(
        name="status.limit_switches",
        address=84,
        type="u16",
        minimum=0,
        maximum=15,
        description="Bits 2n and 2n + 1: the limit switch of axis n at its negative and its positive end is pressed.",
    ),
    Register(
        name="status.brake_released",
        address=85,
        type="u16",
        minimum=0,
        maximum=1,
        description="What the board asks of the brake: released while enabled.",
    ),
    Register(
        name="status.sto_latched",
        address=86,
        type="u16",
        minimum=0,
        maximum=1,
        description="1 from a pulse of the wired emergency stop, however short, until CLEAR_FAULT.",
    ),
    Register(
        name="status.samples_to_check",
        address=87,
        type="u32",
        description="Samples of the trajectory that ARM has still to check.",
    ),
    Register(
        name="status.stores",
        address=89,
        type="u32",
        description="Times that permanent memory was written, over the board's life.",
    ),
    Register(
        name="session.remaining",
        address=91,
        type="u16",
        scale=0.01,
        unit="s",
        description="Time for which a host still holds the board; 0 when none does. Does not run out while an axis moves.",
    ),
    Register(
        name="measured.x.position",
        address=92,
        type="f32",
        unit="rad",
        minimum=-1000000.0,
        maximum=1000000.0,
        description="Position latched last.",
    ),
    Register(
        name="measured.x.speed",
        address=94,
        type="f32",
        unit="rad/s",
        minimum=-100000.0,
        maximum=100000.0,
        description="Mean over the last 50 ms.",
    ),
    Register(
        name="measured.z.position",
        address=96,
        type="f32",
        unit="rad",
        minimum=-1000000.0,
        maximum=1000000.0,
        description="Position latched last.",
    ),
    Register(
        name="measured.z.speed",
        address=98,
        type="f32",
        unit="rad/s",
        minimum=-100000.0,
        maximum=100000.0,
        description="Mean over the last 50 ms.",
    ),
    Register(
        name="command.opcode",
        address=128,
        type="u16",
        access="rw",
        enum="Opcode",
        description="Command; opcode, token and argument are written in one write.",
    ),
    Register(
        name="command.token",
        address=129,
        type="u16",
        access="rw",
        description="Number of the command; a token seen before is ignored.",
    ),
    Register(
        name="command.argument",
        address=130,
        type="u32",
        access="rw",
        description="Argument, 0 where none is needed.",
    ),
    Register(
        name="command.key",
        address=132,
        type="u32",
        access="rw",
        description="Session key of the host; any will do for QUICK_STOP.",
    ),
    Register(
        name="session.release",
        address=142,
        type="u32",
        access="rw",
        description="A host that writes its key here lets go of the board; another key changes nothing.",
    ),
    Register(
        name="session.key",
        address=144,
        type="u32",
        access="rw",
        description="A host that writes a key here holds the board, for 5 s each time; refused (exception 6) while another host holds it. What an earlier host armed is armed no longer. During a motion it is the heartbeat. Reads as the holder's key, 0 when there is none.",
    ),
    Register(
        name="capture.pages_acknowledged",
        address=146,
        type="u32",
        access="rw",
        description="Pages that the host holds: their slots may be overwritten. Never more than were written, and never fewer than before: a smaller number changes nothing.",
    ),
    Register(
        name="watchdog.timeout",
        address=160,
        type="u16",
        scale=0.001,
        unit="s",
        access="rw",
        minimum=0.1,
        maximum=5.0,
        description="Longest silence, during a motion, of the host that started it: what feeds the watchdog is its key. Cannot be changed from ARM to the end of the motion (exception 6).",
    ),
    Register(
        name="watchdog.action",
        address=161,
        type="u16",
        access="rw",
        enum="WatchdogAction",
        description="What the board does then. Cannot be changed from ARM to the end of the motion (exception 6).",
    ),
    Register(
        name="trajectory.kind",
        address=256,
        type="u16",
        access="rw",
        enum="TrajectoryKind",
        description="Which table is followed.",
    ),
    Register(
        name="trajectory.lead_in_samples",
        address=257,
        type="u32",
        access="rw",
        minimum=40,
        maximum=240000,
        description="Samples between START and capture, in which the motion is blended in.",
    ),
    Register(
        name="trajectory.capture_samples",
        address=259,
        type="u32",
        access="rw",
        minimum=1,
        maximum=8640000,
        description="Samples captured.",
    ),
    Register(
        name="trajectory.x.components",
        address=272,
        type="u16",
        access="rw",
        minimum=0,
        maximum=8,
        description="Sine components in use.",
    ),
    Register(
        name="trajectory.x.levels",
        address=273,
        type="u16",
        access="rw",
        minimum=0,
        maximum=12,
        description="Staircase levels in use.",
    ),
    Register(
        name="trajectory.x.amplitude",
        address=274,
        type="f32",
        count=8,
        unit="rad",
        access="rw",
        description="Amplitude of each component.",
    ),
    Register(
        name="trajectory.x.angular_frequency",
        address=290,
        type="f32",
        count=8,
        unit="rad/s",
        access="rw",
        description="Angular frequency of each component; below pi / sample period.",
    ),
    Register(
        name="trajectory.x.phase",
        address=306,
        type="f32",
        count=8,
        unit="rad",
        access="rw",
        description="Phase of each component at the first captured sample.",
    ),
    Register(
        name="trajectory.x.level_speed",
        address=322,
        type="f32",
        count=12,
        unit="rad/s",
        access="rw",
        description="Speed of each level, signed.",
    ),
    Register(
        name="trajectory.x.dwell",
        address=346,
        type="f32",
        unit="s",
        access="rw",
        description="Time at each level.",
    ),
    Register(
        name="trajectory.x.acceleration",
        address=348,
        type="f32",
        unit="rad/s^2",
        access="rw",
        description="Acceleration between levels.",
    ),
    Register(
        name="trajectory.z.components",
        address=368,
        type="u16",
        access="rw",
        minimum=0,
        maximum=8,
        description="Sine components in use.",
    ),
    Register(
        name="trajectory.z.levels",
        address=369,
        type="u16",
        access="rw",
        minimum=0,
        maximum=12,
        description="Staircase levels in use.",
    ),
    Register(
        name="trajectory.z.amplitude",
        address=370,
        type="f32",
        count=8,
        unit="rad",
        access="rw",
        description="Amplitude of each component.",
    ),
    Register(
        name="trajectory.z.angular_frequency",
        address=386,
        type="f32",
        count=8,
        unit="rad/s",
        access="rw",
        description="Angular frequency of each component; below pi / sample period.",
    ),
    Register(
        name="trajectory.z.phase",
        address=402,
        type="f32",
        count=8,
        unit="rad",
        access="rw",
        description="Phase of each component at the first captured sample.",
    ),
    Register(
        name="trajectory.z.level_speed",
        address=418,
        type="f32",
        count=12,
        unit="rad/s",
        access="rw",
        description="Speed of each level, signed.",
    ),
    Register(
        name="trajectory.z.dwell",
        address=442,
        type="f32",
        unit="s",
        access="rw",
        description="Time at each level.",
    ),
    Register(
        name="trajectory.z.acceleration",
        address=444,
        type="f32",
        unit="rad/s^2",
        access="rw",
        description="Acceleration between levels.",
    ),
    Register(
        name="limits.x.travel",
        address=512,
        type="f32",
        unit="rad",
        minimum=0,
        maximum=1000000.0,
        description="Largest distance from zero.",
    ),
    Register(
        name="limits.x.speed",
        address=514,
        type="f32",
        unit="rad/s",
        minimum=0,
        maximum=10000.0,
        description="Largest speed.",
    ),
    Register(
        name="limits.x.effort",
        address=516,
        type="f32",
        unit="N*m",
        minimum=0,
        maximum=1000000.0,
        description="Largest effort; more is clipped, and a trajectory whose feed-forward asks for more is refused.",
    ),
    Register(
        name="limits.x.following_error",
        address=518,
        type="f32",
        unit="rad",
        minimum=0,
        maximum=1000000.0,
        description="Largest distance between reference and position.",
    ),
    Register(
        name="limits.x.gain_step",
        address=520,
        type="f32",
        minimum=0,
        maximum=1,
        description="Largest change of a gain in one COMMIT, as a share of its maximum.",
    ),
    Register(
        name="limits.x.acceleration",
        address=522,
        type="f32",
        unit="rad/s^2",
        minimum=0,
        maximum=1000000.0,
        description="Largest acceleration of a trajectory.",
    ),
    Register(
        name="gain_maximum.x.proportional",
        address=524,
        type="f32",
        unit="N*m/rad",
        description="Effort per position error.",
    ),
    Register(
        name="gain_maximum.x.derivative",
        address=526,
        type="f32",
        unit="N*m*s/rad",
        description="Effort per velocity error.",
    ),
    Register(
        name="gain_maximum.x.integral",
        address=528,
        type="f32",
        unit="N*m/(rad*s)",
        description="Effort per integrated position error.",
    ),
    Register(
        name="gain_maximum.x.velocity_filter",
        address=530,
        type="f32",
        unit="s",
        description="Time constant of the velocity filter.",
    ),
    Register(
        name="gain_maximum.x.inertia_feedforward",
        address=532,
        type="f32",
        unit="kg*m^2",
        description="Effort per reference acceleration.",
    ),
    Register(
        name="gain_maximum.x.viscous_feedforward",
        address=534,
        type="f32",
        unit="N*m*s/rad",
        description="Effort per reference velocity.",
    ),
    Register(
        name="gain_maximum.x.coulomb_feedforward",
        address=536,
        type="f32",
        unit="N*m",
        description="Effort in the direction of the reference velocity.",
    ),
    Register(
        name="gain_maximum.x.coulomb_smoothing",
        address=538,
        type="f32",
        unit="rad/s",
        description="Speed over which that effort changes sign.",
    ),
    Register(
        name="gain_maximum.x.offset_feedforward",
        address=540,
        type="f32",
        unit="N*m",
        description="Constant effort.",
    ),
    Register(
        name="gain_maximum.x.stribeck_feedforward",
        address=542,
        type="f32",
        unit="N*m",
        description="Effort above Coulomb's at rest, in the direction of the reference velocity.",
    ),
    Register(
        name="gain_maximum.x.stribeck_speed",
        address=544,
        type="f32",
        unit="rad/s",
        description="Speed at which 1/e of that effort is left.",
    ),
    Register(
        name="gain_maximum.x.viscous_difference_feedforward",
        address=546,
        type="f32",
        unit="N*m*s/rad",
        description="Effort per reference speed, the same sign both ways.",
    ),
    Register(
        name="gain_maximum.x.ripple_cosine",
        address=548,
        type="f32",
        count=4,
        unit="N*m",
        description="Amplitude of each ripple in phase with position zero.",
    ),
    Register(
        name="gain_maximum.x.ripple_sine",
        address=556,
        type="f32",
        count=4,
        unit="N*m",
        description="Amplitude of each ripple a quarter period later.",
    ),
    Register(
        name="gain_maximum.x.ripple_period",
        address=564,
        type="f32",
        count=4,
        unit="rad",
        description="Travel after which each ripple repeats.",
    ),
    Register(
        name="limits.z.travel",
        address=576,
        type="f32",
        unit="rad",
        minimum=0,
        maximum=1000000.0,
        description="Largest distance from zero.",
    ),
    Register(
        name="limits.z.speed",
        address=578,
        type="f32",
        unit="rad/s",
        minimum=0,
        maximum=10000.0,
        description="Largest speed.",
    ),
    Register(
        name="limits.z.effort",
        address=580,
        type="f32",
        unit="N*m",
        minimum=0,
        maximum=1000000.0,
        description="Largest effort; more is clipped, and a trajectory whose feed-forward asks for more is refused.",
    ),
    Register(
        name="limits.z.following_error",
        address=582,
        type="f32",
        unit="rad",
        minimum=0,
        maximum=1000000.0,
        description="Largest distance between reference and position.",
    ),
    Register(
        name="limits.z.gain_step",
        address=584,
        type="f32",
        minimum=0,
        maximum=1,
        description="Largest change of a gain in one COMMIT, as a share of its maximum.",
    ),
    Register(
        name="limits.z.acceleration",
        address=586,
        type="f32",
        unit="rad/s^2",
        minimum=0,
        maximum=1000000.0,
        description="Largest acceleration of a trajectory.",
    ),
    Register(
        name="gain_maximum.z.proportional",
        address=588,
        type="f32",
        unit="N*m/rad",
        description="Effort per position error.",
    ),
    Register(
        name="gain_maximum.z.derivative",
        address=590,
        type="f32",
        unit="N*m*s/rad",
        description="Effort per velocity error.",
    ),
    Register(
        name="gain_maximum.z.integral",
        address=592,
        type="f32",
        unit="N*m/(rad*s)",
        description="Effort per integrated position error.",
    ),
    Register(
        name="gain_maximum.z.velocity_filter",
        address=594,
        type="f32",
        unit="s",
        description="Time constant of the velocity filter.",
    ),
    Register(
        name="gain_maximum.z.inertia_feedforward",
        address=596,
        type="f32",
        unit="kg*m^2",
        description="Effort per reference acceleration.",
    ),
    Register(
        name="gain_maximum.z.viscous_feedforward",
        address=598,
        type="f32",
        unit="N*m*s/rad",
        description="Effort per reference velocity.",
    ),
    Register(
        name="gain_maximum.z.coulomb_feedforward",
        address=600,
        type="f32",
        unit="N*m",
        description="Effort in the direction of the reference velocity.",
    ),
    Register(
        name="gain_maximum.z.coulomb_smoothing",
        address=602,
        type="f32",
        unit="rad/s",
        description="Speed over which that effort changes sign.",
    ),
    Register(
        name="gain_maximum.z.offset_feedforward",
        address=604,
        type="f32",
        unit="N*m",
        description="Constant effort.",
    ),
    Register(
        name="gain_maximum.z.stribeck_feedforward",
        address=606,
        type="f32",
        unit="N*m",
        description="Effort above Coulomb's at rest, in the direction of the reference velocity.",
    ),
    Register(
        name="gain_maximum.z.stribeck_speed",
        address=608,
        type="f32",
        unit="rad/s",
        description="Speed at which 1/e of that effort is left.",
    ),
    Register(
        name="gain_maximum.z.viscous_difference_feedforward",
        address=610,
        type="f32",
        unit="N*m*s/rad",
        description="Effort per reference speed, the same sign both ways.",
    ),
    Register(
        name="gain_maximum.z.ripple_cosine",
        address=612,
        type="f32",
        count=4,
        unit="N*m",
        description="Amplitude of each ripple in phase with position zero.",
    ),
    Register(
        name="gain_maximum.z.ripple_sine",
        address=620,
        type="f32",
        count=4,
        unit="N*m",
        description="Amplitude of each ripple a quarter period later.",
    ),
    Register(
        name="gain_maximum.z.ripple_period",
        address=628,
        type="f32",
        count=4,
        unit="rad",
        description="Travel after which each ripple repeats.",
    ),
    Register(
        name="active.x.proportional",
        address=768,
        type="f32",
        unit="N*m/rad",
        description="Effort per position error.",
    ),
    Register(
        name="active.x.derivative",
        address=770,
        type="f32",
        unit="N*m*s/rad",
        description="Effort per velocity error.",
    ),
    Register(
        name="active.x.integral",
        address=772,
        type="f32",
        unit="N*m/(rad*s)",
        description="Effort per integrated position error.",
    ),
    Register(
        name="active.x.velocity_filter",
        address=774,
        type="f32",
        unit="s",
        description="Time constant of the velocity filter.",
    ),
    Register(
        name="active.x.inertia_feedforward",
        address=776,
        type="f32",
        unit="kg*m^2",
        description="Effort per reference acceleration.",
    ),
    Register(
        name="active.x.viscous_feedforward",
        address=778,
        type="f32",
        unit="N*m*s/rad",
        description="Effort per reference velocity.",
    ),
    Register(
        name="active.x.coulomb_feedforward",
        address=780,
        type="f32",
        unit="N*m",
        description="Effort in the direction of the reference velocity.",
    ),
    Register(
        name="active.x.coulomb_smoothing",
        address=782,
        type="f32",
        unit="rad/s",
        description="Speed over which that effort changes sign.",
    ),
    Register(
        name="active.x.offset_feedforward",
        address=784,
        type="f32",
        unit="N*m",
        description="Constant effort.",
    ),
    Register(
        name="active.x.stribeck_feedforward",
        address=786,
        type="f32",
        unit="N*m",
        description="Effort above Coulomb's at rest, in the direction of the reference velocity.",
    ),
    Register(
        name="active.x.stribeck_speed",
        address=788,
        type="f32",
        unit="rad/s",
        description="Speed at which 1/e of that effort is left.",
    ),
    Register(
        name="active.x.viscous_difference_feedforward",
        address=790,
        type="f32",
        unit="N*m*s/rad",
        description="Effort per reference speed, the same sign both ways.",
    ),
    Register(
        name="active.x.ripple_cosine",
        address=792,
        type="f32",
        count=4,
        unit="N*m",
        description="Amplitude of each ripple in phase with position zero.",
    ),
    Register(
        name="active.x.ripple_sine",
        address=800,
        type="f32",
        count=4,
        unit="N*m",
        description="Amplitude of each ripple a quarter period later.",
    ),
    Register(
        name="active.x.ripple_period",
        address=808,
        type="f32",
        count=4,
        unit="rad",
        description="Travel after which each ripple repeats.",
    ),
    Register(
        name="active.z.proportional",
        address=816,
        type="f32",
        unit="N*m/rad",
        description="Effort per position error.",
    ),
    Register(
        name="active.z.derivative",
        address=818,
        type="f32",
        unit="N*m*s/rad",
        description="Effort per velocity error.",
    ),
    Register(
        name="active.z.integral",
        address=820,
        type="f32",
        unit="N*m/(rad*s)",
        description="Effort per integrated position error.",
    ),
    Register(
        name="active.z.velocity_filter",
        address=822,
        type="f32",
        unit="s",
        description="Time constant of the velocity filter.",
    ),
    Register(
        name="active.z.inertia_feedforward",
        address=824,
        type="f32",
        unit="kg*m^2",
        description="Effort per reference acceleration.",
    ),
    Register(
        name="active.z.viscous_feedforward",
        address=826,
        type="f32",
        unit="N*m*s/rad",
        description="Effort per reference velocity.",
    ),
    Register(
        name="active.z.coulomb_feedforward",
        address=828,
        type="f32",
        unit="N*m",
        description="Effort in the direction of the reference velocity.",
    ),
    Register(
        name="active.z.coulomb_smoothing",
        address=830,
        type="f32",
        unit="rad/s",
        description="Speed over which that effort changes sign.",
    ),
    Register(
        name="active.z.offset_feedforward",
        address=832,
        type="f32",
        unit="N*m",
        description="Constant effort.",
    ),
    Register(
        name="active.z.stribeck_feedforward",
        address=834,
        type="f32",
        unit="N*m",
        description="Effort above Coulomb's at rest, in the direction of the reference velocity.",
    ),
    Register(
        name="active.z.stribeck_speed",
        address=836,
        type="f32",
        unit="rad/s",
        description="Speed at which 1/e of that effort is left.",
    ),
    Register(
        name="active.z.viscous_difference_feedforward",
        address=838,
        type="f32",
        unit="N*m*s/rad",
        description="Effort per reference speed, the same sign both ways.",
    ),
    Register(
        name="active.z.ripple_cosine",
        address=840,
        type="f32",
        count=4,
        unit="N*m",
        description="Amplitude of each ripple in phase with position zero.",
    ),
    Register(
        name="active.z.ripple_sine",
        address=848,
        type="f32",
        count=4,
        unit="N*m",
        description="Amplitude of each ripple a quarter period later.",
    ),
    Register(
        name="active.z.ripple_period",
        address=856,
        type="f32",
        count=4,
        unit="rad",
        description="Travel after which each ripple repeats.",
    ),
    Register(
        name="shadow.x.proportional",
        address=896,
        type="f32",
        unit="N*m/rad",
        access="rw",
        description="Effort per position error.",
    ),
    Register(
        name="shadow.x.derivative",
        address=898,
        type="f32",
        unit="N*m*s/rad",
        access="rw",
        description="Effort per velocity error.",
    ),
    Register(
        name="shadow.x.integral",
        address=900,
        type="f32",
        unit="N*m/(rad*s)",
        access="rw",
        description="Effort per integrated position error.",
    ),
    Register(
        name="shadow.x.velocity_filter",
        address=902,
        type="f32",
        unit="s",
        access="rw",
        description="Time constant of the velocity filter.",
    ),
    Register(
        name="shadow.x.inertia_feedforward",
        address=904,
        type="f32",
        unit="kg*m^2",
        access="rw",
        description="Effort per reference acceleration.",
    ),
    Register(
        name="shadow.x.viscous_feedforward",
        address=906,
        type="f32",
        unit="N*m*s/rad",
        access="rw",
        description="Effort per reference velocity.",
    ),
    Register(
        name="shadow.x.coulomb_feedforward",
        address=908,
        type="f32",
        unit="N*m",
        access="rw",
        description="Effort in the direction of the reference velocity.",
    ),
    Register(
        name="shadow.x.coulomb_smoothing",
        address=910,
        type="f32",
        unit="rad/s",
        access="rw",
        description="Speed over which that effort changes sign.",
    ),
    Register(
        name="shadow.x.offset_feedforward",
        address=912,
        type="f32",
        unit="N*m",
        access="rw",
        description="Constant effort.",
    ),
    Register(
        name="shadow.x.stribeck_feedforward",
        address=914,
        type="f32",
        unit="N*m",
        access="rw",
        description="Effort above Coulomb's at rest, in the direction of the reference velocity.",
    ),
    Register(
        name="shadow.x.stribeck_speed",
        address=916,
        type="f32",
        unit="rad/s",
        access="rw",
        description="Speed at which 1/e of that effort is left.",
    ),
    Register(
        name="shadow.x.viscous_difference_feedforward",
        address=918,
        type="f32",
        unit="N*m*s/rad",
        access="rw",
        description="Effort per reference speed, the same sign both ways.",
    ),
    Register(
        name="shadow.x.ripple_cosine",
        address=920,
        type="f32",
        count=4,
        unit="N*m",
        access="rw",
        description="Amplitude of each ripple in phase with position zero.",
    ),
    Register(
        name="shadow.x.ripple_sine",
        address=928,
        type="f32",
        count=4,
        unit="N*m",
        access="rw",
        description="Amplitude of each ripple a quarter period later.",
    ),
    Register(
        name="shadow.x.ripple_period",
        address=936,
        type="f32",
        count=4,
        unit="rad",
        access="rw",
        description="Travel after which each ripple repeats.",
    ),
    Register(
        name="shadow.z.proportional",
        address=944,
        type="f32",
        unit="N*m/rad",
        access="rw",
        description="Effort per position error.",
    ),
    Register(
        name="shadow.z.derivative",
        address=946,
        type="f32",
        unit="N*m*s/rad",
        access="rw",
        description="Effort per velocity error.",
    ),
    Register(
        name="shadow.z.integral",
        address=948,
        type="f32",
        unit="N*m/(rad*s)",
        access="rw",
        description="Effort per integrated position error.",
    ),
    Register(
        name="shadow.z.velocity_filter",
        address=950,
        type="f32",
        unit="s",
        access="rw",
        description="Time constant of the velocity filter.",
    ),
    Register(
        name="shadow.z.inertia_feedforward",
        address=952,
        type="f32",
        unit="kg*m^2",
        access="rw",
        description="Effort per reference acceleration.",
    ),
    Register(
        name="shadow.z.viscous_feedforward",
        address=954,
        type="f32",
        unit="N*m*s/rad",
        access="rw",
        description="Effort per reference velocity.",
    ),
    Register(
        name="shadow.z.coulomb_feedforward",
        address=956,
        type="f32",
        unit="N*m",
        access="rw",
        description="Effort in the direction of the reference velocity.",
    ),
    Register(
        name="shadow.z.coulomb_smoothing",
        address=958,
        type="f32",
        unit="rad/s",
        access="rw",
        description="Speed over which that effort changes sign.",
    ),
    Register(
        name="shadow.z.offset_feedforward",
        address=960,
        type="f32",
        unit="N*m",
        access="rw",
        description="Constant effort.",
    ),
    Register(
        name="shadow.z.stribeck_feedforward",
        address=962,
        type="f32",
        unit="N*m",
        access="rw",
        description="Effort above Coulomb's at rest, in the direction of the reference velocity.",
    ),
    Register(
        name="shadow.z.stribeck_speed",
        address=964,
        type="f32",
        unit="rad/s",
        access="rw",
        description="Speed at which 1/e of that effort is left.",
    ),
    Register(
        name="shadow.z.viscous_difference_feedforward",
        address=966,
        type="f32",
        unit="N*m*s/rad",
        access="rw",
        description="Effort per reference speed, the same sign both ways.",
    ),
    Register(
        name="shadow.z.ripple_cosine",
        address=968,
        type="f32",
        count=4,
        unit="N*m",
        access="rw",
        description="Amplitude of each ripple in phase with position zero.",
    ),
    Register(
        name="shadow.z.ripple_sine",
        address=976,
        type="f32",
        count=4,
        unit="N*m",
        access="rw",
        description="Amplitude of each ripple a quarter period later.",
    ),
    Register(
        name="shadow.z.ripple_period",
        address=984,
        type="f32",
        count=4,
        unit="rad",
        access="rw",
        description="Travel after which each ripple repeats.",
    ),
    Register(
        name="shadow.crc",
        address=992,
        type="u32",
        access="rw",
        description="CRC-32 of the shadow bank's words, big-endian, all axes.",
    ),
)
REGISTERS: Final = {register.name: register for register in _ALL}
