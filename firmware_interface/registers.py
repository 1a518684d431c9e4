"""The register map as data.

Generated from registers.toml by firmware_interface/generate.py; do not edit.
"""
# ruff: noqa: E501
# fmt: off

from enum import IntEnum
from typing import Final

from firmware_interface.register import Register

MAGIC: Final = 0x4D464453
MAP_VERSION: Final = 6
MAP_CRC: Final = 0xAAE95DBB
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
    OSCILLATION = 9
    STOP_OVERDUE = 10


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
    COMMIT_RUNNING = 12


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
    EFFORT_JUMP = 17
    UNSTABLE_FEEDBACK = 18


class TrajectoryKind(IntEnum):
    """Which of the two tables the board follows."""

    MULTISINE = 1
    STAIRCASE = 2


class WatchdogAction(IntEnum):
    """What the board does when the watchdog expires during a motion; then it is in FAULT."""

    QUICK_STOP = 1
    COAST = 2


class IdentificationState(IntEnum):
    """What the board's own identification does; only a board that has a network identifies."""

    NONE = 0
    CAPTURING = 1
    RUNNING = 2
    DONE = 3
    FAILED = 4


class IdentificationReason(IntEnum):
    """Why the board did not identify an axis."""

    NONE = 0
    STOPPED = 1
    TOO_SHORT = 2
    STANDSTILL = 3
    OTHER_MOTION = 4
    NO_EFFORT = 5
    UNEXPLAINED = 6


FAULT_TEXTS: Final = {
    Fault.NONE: ("no fault", "nothing to do"),
    Fault.SELF_TEST: ("the self-test after power-up failed", "switch the board off and on; if it comes back, have the board checked"),
    Fault.TRAVEL: ("an axis left its travel range", "move the axis back inside by hand, then run edge-ident clear-fault"),
    Fault.SPEED: ("an axis was faster than its speed limit", "choose a slower motion or softer gains, then run edge-ident clear-fault"),
    Fault.FOLLOWING_ERROR: ("an axis fell too far behind its reference", "look for an obstacle or a loose coupling, then run edge-ident clear-fault"),
    Fault.WATCHDOG: ("the host that started the motion fell silent", "check cable and host load, then run edge-ident clear-fault"),
    Fault.STO: ("the wired emergency stop cut the effort", "release the emergency stop, then run edge-ident clear-fault"),
    Fault.NOT_FINITE: ("a setpoint or an effort was not a finite number", "keep the trajectory and the gains for the maintainer of the firmware, then run edge-ident clear-fault"),
    Fault.LIMIT_SWITCH: ("an axis moved onto a limit switch", "run edge-ident clear-fault, then move away from the switch: edge-ident home"),
    Fault.OSCILLATION: ("the feedback kept an axis swinging to and fro", "look for a loose coupling or a changed load; if the gains are new, use softer feedback; then run edge-ident clear-fault"),
    Fault.STOP_OVERDUE: ("an axis did not come to rest in the time of a stop, so the effort was cut", "look at what moves the axis, and at its gains, then run edge-ident clear-fault"),
}

RESULT_TEXTS: Final = {
    Result.NONE: ("no command yet", "nothing to do"),
    Result.DONE: ("carried out", "nothing to do"),
    Result.UNKNOWN_COMMAND: ("the board does not know this command", "install the same release on board and host"),
    Result.WRONG_STATE: ("not allowed in the board's present state", "read the status; finish or stop the motion, or clear the fault first"),
    Result.WRONG_ARGUMENT: ("the argument is not the expected signature", "install the same release on board and host"),
    Result.BAD_TRAJECTORY: ("the trajectory is incomplete, not finite, faster than the sampling, or not the one that the host wrote", "make sure that no other host writes to the board, then write the whole trajectory again"),
    Result.TRAJECTORY_LIMITS: ("the trajectory would leave the limits of travel, speed, acceleration or effort", "use a smaller or slower motion, a longer lead-in, or start nearer to it: edge-ident home"),
    Result.GAIN_CRC: ("the shadow bank does not match its CRC, or is not the one that the host staged", "make sure that no other host writes to the board, then stage the gains again"),
    Result.GAIN_LIMITS: ("a staged gain is outside the board's limits or changes too much at once", "compare the staged gains with the limits; lower the bandwidth"),
    Result.UNCONFIRMED: ("gains committed before are not confirmed yet", "confirm or roll back first"),
    Result.NOTHING_COMMITTED: ("there are no unconfirmed gains; the window may have expired", "read the active gains; commit again if they are the old ones"),
    Result.STO_ACTIVE: ("the wired emergency stop is active", "release the emergency stop"),
    Result.NOT_AT_REST: ("an axis still moves", "wait until it stands still: DISABLE and ROLL_BACK have begun a stop, at the end of which the axes stand or the effort is off"),
    Result.STORE_FAILED: ("permanent memory did not take the gains", "have the board checked; until its next power-up the gains stay in force"),
    Result.PENDING: ("still being carried out", "wait for its end"),
    Result.NOT_ENABLED: ("the effort is off", "enable the axes first"),
    Result.NOT_HELD: ("the command came from a host that does not control the board", "wait until the other host is finished, or stop it with edge-ident stop; if somebody stopped this host, find out why"),
    Result.EFFORT_JUMP: ("the effort would jump too far under the staged gains; the old ones stay in force", "let the axes come to rest, then commit; at rest, enable the axes first, or change offset, tables and ripples in smaller steps"),
    Result.UNSTABLE_FEEDBACK: ("with the inertia and friction that the board states, the loop would be unstable under the staged gains", "use softer feedback; if the drive is another one than stated, correct inertia and friction in the settings of the firmware"),
}

IDENTIFICATIONREASON_TEXTS: Final = {
    IdentificationReason.NONE: ("it is identified, or not yet", "nothing to do"),
    IdentificationReason.STOPPED: ("the motion was stopped before the end of its capture", "repeat the motion"),
    IdentificationReason.TOO_SHORT: ("the capture is shorter than the motion that the network was trained for", "choose the motion of the network, one whole period of it"),
    IdentificationReason.STANDSTILL: ("the axis stood still", "look whether the axis is blocked, or choose a larger motion"),
    IdentificationReason.OTHER_MOTION: ("the axis moved otherwise than the network was trained for", "choose the motion of the network, or train one for this motion"),
    IdentificationReason.NO_EFFORT: ("the effort was below one PWM count", "have the board checked"),
    IdentificationReason.UNEXPLAINED: ("the parameters found leave more than 15 % of the effort", "trust what the host finds and says of this axis"),
}

_ALL = (
    Register("identity.magic", 0, "u32", description="Tells this kind of board from any other Modbus device."),
    Register("identity.map_version", 2, "u16", description="Version of this map."),
    Register("identity.firmware_version", 3, "u16", description="Major version in the high byte, minor in the low one."),
    Register("identity.map_crc", 4, "u32", description="CRC-32 of the map that the firmware was built with; argument of START."),
    Register("identity.serial_number", 6, "u32", description="Serial number of the board."),
    Register("identity.float_test", 8, "f32", description="Always 3.1415927."),
    Register("identity.nonce", 10, "u32", description="Random, drawn at power-up: a match proves that a reply is no stale one."),
    Register("identity.sample_period", 12, "u32", scale=1e-09, unit="s", minimum=1e-05, maximum=0.1, description="Period of control loop and capture."),
    Register("identity.control_delay", 14, "u32", scale=1e-09, unit="s", minimum=0.0, maximum=0.1, description="Measured by the board: encoder latch to PWM update."),
    Register("identity.counts_per_turn", 16, "u32", minimum=4, maximum=1000000000.0, description="Encoder counts per turn of the gearbox output."),
    Register("identity.effort_per_count", 18, "f32", unit="N*m", minimum=1e-09, maximum=1000.0, description="Torque at the gearbox output of one PWM count."),
    Register("status.state", 64, "u16", enum="State", description="Present state."),
    Register("status.fault_code", 65, "u16", enum="Fault", description="First fault since the last CLEAR_FAULT; STO takes the place of WATCHDOG, which a host clears by itself."),
    Register("status.fault_sample", 66, "u32", description="Control sample, counted from power-up, of the fault."),
    Register("status.sto_active", 68, "u16", minimum=0, maximum=1, description="1 while the wired emergency stop cuts the effort."),
    Register("status.last_token", 69, "u16", description="Token of the last command carried out or refused."),
    Register("status.last_result", 70, "u16", enum="Result", description="What became of that command."),
    Register("status.staged_crc_ok", 71, "u16", minimum=0, maximum=1, description="1 when the shadow bank matches its CRC."),
    Register("status.unconfirmed", 72, "u16", minimum=0, maximum=1, description="1 between COMMIT and CONFIRM or roll back."),
    Register("status.confirm_remaining", 73, "u16", scale=0.01, unit="s", description="Time left for CONFIRM before the board rolls back by itself."),
    Register("status.board_clock", 74, "u32", description="Control samples since power-up."),
    Register("capture.pages_written", 76, "u32", description="Pages completed since START."),
    Register("capture.samples_captured", 78, "u32", description="Samples captured since START."),
    Register("capture.overflows", 80, "u32", description="Pages overwritten before they were acknowledged, since START."),
    Register("status.enabled", 82, "u16", minimum=0, maximum=1, description="1 while the control law may command effort; 0 after power-up and after every fault."),
    Register("status.homed", 83, "u16", minimum=0, maximum=3, description="Bit n: axis n counts from the machine's reference mark; else travel counts from where the axis stood at power-up."),
    Register("status.limit_switches", 84, "u16", minimum=0, maximum=15, description="Bits 2n and 2n + 1: the limit switch of axis n at its negative and its positive end is pressed."),
    Register("status.brake_released", 85, "u16", minimum=0, maximum=1, description="What the board asks of the brake: released while enabled."),
    Register("status.sto_latched", 86, "u16", minimum=0, maximum=1, description="1 from a pulse of the wired emergency stop, however short, until CLEAR_FAULT."),
    Register("status.samples_to_check", 87, "u32", description="Samples of the trajectory that ARM has still to check."),
    Register("status.stores", 89, "u32", description="Times that permanent memory was written, over the board's life."),
    Register("session.remaining", 91, "u16", scale=0.01, unit="s", description="Time for which a host still holds the board; 0 when none does. Does not run out while an axis moves."),
    Register("measured.x.position", 92, "f32", unit="rad", minimum=-1000000.0, maximum=1000000.0, description="Position latched last."),
    Register("measured.x.speed", 94, "f32", unit="rad/s", minimum=-100000.0, maximum=100000.0, description="Mean over the last 50 ms."),
    Register("measured.z.position", 96, "f32", unit="rad", minimum=-1000000.0, maximum=1000000.0, description="Position latched last."),
    Register("measured.z.speed", 98, "f32", unit="rad/s", minimum=-100000.0, maximum=100000.0, description="Mean over the last 50 ms."),
    Register("command.opcode", 128, "u16", access="rw", enum="Opcode", description="Command; opcode, token and argument are written in one write."),
    Register("command.token", 129, "u16", access="rw", description="Number of the command; a token seen before is ignored."),
    Register("command.argument", 130, "u32", access="rw", description="Argument, 0 where none is needed."),
    Register("command.key", 132, "u32", access="rw", description="Session key of the host; any will do for QUICK_STOP, which ends the hold of a host with another key."),
    Register("session.release", 142, "u32", access="rw", description="A host that writes its key here lets go of the board; another key changes nothing."),
    Register("session.key", 144, "u32", access="rw", description="A host that writes a key here holds the board, for 5 s each time; refused (exception 6) while another host holds it, for a key whose host another one has stopped by QUICK_STOP since it held the board and did not let go, and for a late heartbeat of the host that let go last: the key together with capture.pages_acknowledged. What an earlier host armed is armed no longer. During a motion it is the heartbeat. Reads as the holder's key, 0 when there is none."),
    Register("capture.pages_acknowledged", 146, "u32", access="rw", description="Pages that the host holds: their slots may be overwritten. Never more than were written, and never fewer than before: a smaller number changes nothing."),
    Register("watchdog.timeout", 160, "u16", scale=0.001, unit="s", access="rw", minimum=0.1, maximum=5.0, description="Longest silence, during a motion, of the host that started it: what feeds the watchdog is its key. Cannot be changed from ARM to the end of the motion (exception 6)."),
    Register("watchdog.action", 161, "u16", access="rw", enum="WatchdogAction", description="What the board does then. Cannot be changed from ARM to the end of the motion (exception 6)."),
    Register("bumpless.capable", 192, "u16", minimum=0, maximum=1, since=5, description="1 where the board takes COMMIT_RUNNING; 0 where it takes gains at rest alone."),
    Register("bumpless.x.jump_limit", 194, "f32", unit="N*m", minimum=0, maximum=1000000.0, since=5, description="Largest jump of the effort that COMMIT and COMMIT_RUNNING even out; 0 switches COMMIT_RUNNING off, and COMMIT then takes a fifth of the effort limit."),
    Register("bumpless.x.jump", 196, "f32", unit="N*m", minimum=-1000000.0, maximum=1000000.0, since=5, description="Effort of the staged gains less that of the gains in force, at the last COMMIT or COMMIT_RUNNING that came to be decided."),
    Register("bumpless.z.jump_limit", 198, "f32", unit="N*m", minimum=0, maximum=1000000.0, since=5, description="Largest jump of the effort that COMMIT and COMMIT_RUNNING even out; 0 switches COMMIT_RUNNING off, and COMMIT then takes a fifth of the effort limit."),
    Register("bumpless.z.jump", 200, "f32", unit="N*m", minimum=-1000000.0, maximum=1000000.0, since=5, description="Effort of the staged gains less that of the gains in force, at the last COMMIT or COMMIT_RUNNING that came to be decided."),
    Register("stated.x.inertia", 204, "f32", unit="kg*m^2", minimum=0, maximum=1000000.0, since=6, description="At the gearbox output. COMMIT and COMMIT_RUNNING refuse feedback that is unstable with it; 0: not stated, not checked."),
    Register("stated.x.viscous_friction", 206, "f32", unit="N*m*s/rad", minimum=0, maximum=1000000.0, since=6, description="At the gearbox output; for the same check."),
    Register("stated.z.inertia", 208, "f32", unit="kg*m^2", minimum=0, maximum=1000000.0, since=6, description="At the gearbox output. COMMIT and COMMIT_RUNNING refuse feedback that is unstable with it; 0: not stated, not checked."),
    Register("stated.z.viscous_friction", 210, "f32", unit="N*m*s/rad", minimum=0, maximum=1000000.0, since=6, description="At the gearbox output; for the same check."),
    Register("trajectory.kind", 256, "u16", access="rw", enum="TrajectoryKind", description="Which table is followed."),
    Register("trajectory.lead_in_samples", 257, "u32", access="rw", minimum=40, maximum=240000, description="Samples between START and capture, in which the motion is blended in."),
    Register("trajectory.capture_samples", 259, "u32", access="rw", minimum=1, maximum=8640000, description="Samples captured."),
    Register("trajectory.x.components", 272, "u16", access="rw", minimum=0, maximum=8, description="Sine components in use."),
    Register("trajectory.x.levels", 273, "u16", access="rw", minimum=0, maximum=12, description="Staircase levels in use."),
    Register("trajectory.x.amplitude", 274, "f32", count=8, unit="rad", access="rw", description="Amplitude of each component."),
    Register("trajectory.x.angular_frequency", 290, "f32", count=8, unit="rad/s", access="rw", description="Angular frequency of each component; below pi / sample period."),
    Register("trajectory.x.phase", 306, "f32", count=8, unit="rad", access="rw", description="Phase of each component at the first captured sample."),
    Register("trajectory.x.level_speed", 322, "f32", count=12, unit="rad/s", access="rw", description="Speed of each level, signed."),
    Register("trajectory.x.dwell", 346, "f32", unit="s", access="rw", description="Time at each level."),
    Register("trajectory.x.acceleration", 348, "f32", unit="rad/s^2", access="rw", description="Acceleration between levels."),
    Register("trajectory.z.components", 368, "u16", access="rw", minimum=0, maximum=8, description="Sine components in use."),
    Register("trajectory.z.levels", 369, "u16", access="rw", minimum=0, maximum=12, description="Staircase levels in use."),
    Register("trajectory.z.amplitude", 370, "f32", count=8, unit="rad", access="rw", description="Amplitude of each component."),
    Register("trajectory.z.angular_frequency", 386, "f32", count=8, unit="rad/s", access="rw", description="Angular frequency of each component; below pi / sample period."),
    Register("trajectory.z.phase", 402, "f32", count=8, unit="rad", access="rw", description="Phase of each component at the first captured sample."),
    Register("trajectory.z.level_speed", 418, "f32", count=12, unit="rad/s", access="rw", description="Speed of each level, signed."),
    Register("trajectory.z.dwell", 442, "f32", unit="s", access="rw", description="Time at each level."),
    Register("trajectory.z.acceleration", 444, "f32", unit="rad/s^2", access="rw", description="Acceleration between levels."),
    Register("limits.x.travel", 512, "f32", unit="rad", minimum=0, maximum=1000000.0, description="Largest distance from zero."),
    Register("limits.x.speed", 514, "f32", unit="rad/s", minimum=0, maximum=10000.0, description="Largest speed."),
    Register("limits.x.effort", 516, "f32", unit="N*m", minimum=0, maximum=1000000.0, description="Largest effort; more is clipped, and a trajectory whose feed-forward asks for more is refused."),
    Register("limits.x.following_error", 518, "f32", unit="rad", minimum=0, maximum=1000000.0, description="Largest distance between reference and position."),
    Register("limits.x.gain_step", 520, "f32", minimum=0, maximum=1, description="Largest change of a gain in one COMMIT, as a share of its maximum."),
    Register("limits.x.acceleration", 522, "f32", unit="rad/s^2", minimum=0, maximum=1000000.0, description="Largest acceleration of a trajectory."),
    Register("gain_maximum.x.proportional", 524, "f32", unit="N*m/rad", description="Effort per position error."),
    Register("gain_maximum.x.derivative", 526, "f32", unit="N*m*s/rad", description="Effort per velocity error."),
    Register("gain_maximum.x.integral", 528, "f32", unit="N*m/(rad*s)", description="Effort per integrated position error."),
    Register("gain_maximum.x.velocity_filter", 530, "f32", unit="s", description="Time constant of the velocity filter."),
    Register("gain_maximum.x.inertia_feedforward", 532, "f32", unit="kg*m^2", description="Effort per reference acceleration."),
    Register("gain_maximum.x.viscous_feedforward", 534, "f32", unit="N*m*s/rad", description="Effort per reference velocity."),
    Register("gain_maximum.x.coulomb_feedforward", 536, "f32", unit="N*m", description="Effort in the direction of the reference velocity."),
    Register("gain_maximum.x.coulomb_smoothing", 538, "f32", unit="rad/s", description="Speed over which that effort changes sign."),
    Register("gain_maximum.x.offset_feedforward", 540, "f32", unit="N*m", description="Constant effort."),
    Register("gain_maximum.x.stribeck_feedforward", 542, "f32", unit="N*m", description="Effort above Coulomb's at rest, in the direction of the reference velocity."),
    Register("gain_maximum.x.stribeck_speed", 544, "f32", unit="rad/s", description="Speed at which 1/e of that effort is left."),
    Register("gain_maximum.x.viscous_difference_feedforward", 546, "f32", unit="N*m*s/rad", description="Effort per reference speed, the same sign both ways."),
    Register("gain_maximum.x.ripple_cosine", 548, "f32", count=4, unit="N*m", description="Amplitude of each ripple in phase with position zero."),
    Register("gain_maximum.x.ripple_sine", 556, "f32", count=4, unit="N*m", description="Amplitude of each ripple a quarter period later."),
    Register("gain_maximum.x.ripple_period", 564, "f32", count=4, unit="rad", description="Travel after which each ripple repeats."),
    Register("limits.z.travel", 576, "f32", unit="rad", minimum=0, maximum=1000000.0, description="Largest distance from zero."),
    Register("limits.z.speed", 578, "f32", unit="rad/s", minimum=0, maximum=10000.0, description="Largest speed."),
    Register("limits.z.effort", 580, "f32", unit="N*m", minimum=0, maximum=1000000.0, description="Largest effort; more is clipped, and a trajectory whose feed-forward asks for more is refused."),
    Register("limits.z.following_error", 582, "f32", unit="rad", minimum=0, maximum=1000000.0, description="Largest distance between reference and position."),
    Register("limits.z.gain_step", 584, "f32", minimum=0, maximum=1, description="Largest change of a gain in one COMMIT, as a share of its maximum."),
    Register("limits.z.acceleration", 586, "f32", unit="rad/s^2", minimum=0, maximum=1000000.0, description="Largest acceleration of a trajectory."),
    Register("gain_maximum.z.proportional", 588, "f32", unit="N*m/rad", description="Effort per position error."),
    Register("gain_maximum.z.derivative", 590, "f32", unit="N*m*s/rad", description="Effort per velocity error."),
    Register("gain_maximum.z.integral", 592, "f32", unit="N*m/(rad*s)", description="Effort per integrated position error."),
    Register("gain_maximum.z.velocity_filter", 594, "f32", unit="s", description="Time constant of the velocity filter."),
    Register("gain_maximum.z.inertia_feedforward", 596, "f32", unit="kg*m^2", description="Effort per reference acceleration."),
    Register("gain_maximum.z.viscous_feedforward", 598, "f32", unit="N*m*s/rad", description="Effort per reference velocity."),
    Register("gain_maximum.z.coulomb_feedforward", 600, "f32", unit="N*m", description="Effort in the direction of the reference velocity."),
    Register("gain_maximum.z.coulomb_smoothing", 602, "f32", unit="rad/s", description="Speed over which that effort changes sign."),
    Register("gain_maximum.z.offset_feedforward", 604, "f32", unit="N*m", description="Constant effort."),
    Register("gain_maximum.z.stribeck_feedforward", 606, "f32", unit="N*m", description="Effort above Coulomb's at rest, in the direction of the reference velocity."),
    Register("gain_maximum.z.stribeck_speed", 608, "f32", unit="rad/s", description="Speed at which 1/e of that effort is left."),
    Register("gain_maximum.z.viscous_difference_feedforward", 610, "f32", unit="N*m*s/rad", description="Effort per reference speed, the same sign both ways."),
    Register("gain_maximum.z.ripple_cosine", 612, "f32", count=4, unit="N*m", description="Amplitude of each ripple in phase with position zero."),
    Register("gain_maximum.z.ripple_sine", 620, "f32", count=4, unit="N*m", description="Amplitude of each ripple a quarter period later."),
    Register("gain_maximum.z.ripple_period", 628, "f32", count=4, unit="rad", description="Travel after which each ripple repeats."),
    Register("active.x.proportional", 768, "f32", unit="N*m/rad", description="Effort per position error."),
    Register("active.x.derivative", 770, "f32", unit="N*m*s/rad", description="Effort per velocity error."),
    Register("active.x.integral", 772, "f32", unit="N*m/(rad*s)", description="Effort per integrated position error."),
    Register("active.x.velocity_filter", 774, "f32", unit="s", description="Time constant of the velocity filter."),
    Register("active.x.inertia_feedforward", 776, "f32", unit="kg*m^2", description="Effort per reference acceleration."),
    Register("active.x.viscous_feedforward", 778, "f32", unit="N*m*s/rad", description="Effort per reference velocity."),
    Register("active.x.coulomb_feedforward", 780, "f32", unit="N*m", description="Effort in the direction of the reference velocity."),
    Register("active.x.coulomb_smoothing", 782, "f32", unit="rad/s", description="Speed over which that effort changes sign."),
    Register("active.x.offset_feedforward", 784, "f32", unit="N*m", description="Constant effort."),
    Register("active.x.stribeck_feedforward", 786, "f32", unit="N*m", description="Effort above Coulomb's at rest, in the direction of the reference velocity."),
    Register("active.x.stribeck_speed", 788, "f32", unit="rad/s", description="Speed at which 1/e of that effort is left."),
    Register("active.x.viscous_difference_feedforward", 790, "f32", unit="N*m*s/rad", description="Effort per reference speed, the same sign both ways."),
    Register("active.x.ripple_cosine", 792, "f32", count=4, unit="N*m", description="Amplitude of each ripple in phase with position zero."),
    Register("active.x.ripple_sine", 800, "f32", count=4, unit="N*m", description="Amplitude of each ripple a quarter period later."),
    Register("active.x.ripple_period", 808, "f32", count=4, unit="rad", description="Travel after which each ripple repeats."),
    Register("active.z.proportional", 816, "f32", unit="N*m/rad", description="Effort per position error."),
    Register("active.z.derivative", 818, "f32", unit="N*m*s/rad", description="Effort per velocity error."),
    Register("active.z.integral", 820, "f32", unit="N*m/(rad*s)", description="Effort per integrated position error."),
    Register("active.z.velocity_filter", 822, "f32", unit="s", description="Time constant of the velocity filter."),
    Register("active.z.inertia_feedforward", 824, "f32", unit="kg*m^2", description="Effort per reference acceleration."),
    Register("active.z.viscous_feedforward", 826, "f32", unit="N*m*s/rad", description="Effort per reference velocity."),
    Register("active.z.coulomb_feedforward", 828, "f32", unit="N*m", description="Effort in the direction of the reference velocity."),
    Register("active.z.coulomb_smoothing", 830, "f32", unit="rad/s", description="Speed over which that effort changes sign."),
    Register("active.z.offset_feedforward", 832, "f32", unit="N*m", description="Constant effort."),
    Register("active.z.stribeck_feedforward", 834, "f32", unit="N*m", description="Effort above Coulomb's at rest, in the direction of the reference velocity."),
    Register("active.z.stribeck_speed", 836, "f32", unit="rad/s", description="Speed at which 1/e of that effort is left."),
    Register("active.z.viscous_difference_feedforward", 838, "f32", unit="N*m*s/rad", description="Effort per reference speed, the same sign both ways."),
    Register("active.z.ripple_cosine", 840, "f32", count=4, unit="N*m", description="Amplitude of each ripple in phase with position zero."),
    Register("active.z.ripple_sine", 848, "f32", count=4, unit="N*m", description="Amplitude of each ripple a quarter period later."),
    Register("active.z.ripple_period", 856, "f32", count=4, unit="rad", description="Travel after which each ripple repeats."),
    Register("shadow.x.proportional", 896, "f32", unit="N*m/rad", access="rw", description="Effort per position error."),
    Register("shadow.x.derivative", 898, "f32", unit="N*m*s/rad", access="rw", description="Effort per velocity error."),
    Register("shadow.x.integral", 900, "f32", unit="N*m/(rad*s)", access="rw", description="Effort per integrated position error."),
    Register("shadow.x.velocity_filter", 902, "f32", unit="s", access="rw", description="Time constant of the velocity filter."),
    Register("shadow.x.inertia_feedforward", 904, "f32", unit="kg*m^2", access="rw", description="Effort per reference acceleration."),
    Register("shadow.x.viscous_feedforward", 906, "f32", unit="N*m*s/rad", access="rw", description="Effort per reference velocity."),
    Register("shadow.x.coulomb_feedforward", 908, "f32", unit="N*m", access="rw", description="Effort in the direction of the reference velocity."),
    Register("shadow.x.coulomb_smoothing", 910, "f32", unit="rad/s", access="rw", description="Speed over which that effort changes sign."),
    Register("shadow.x.offset_feedforward", 912, "f32", unit="N*m", access="rw", description="Constant effort."),
    Register("shadow.x.stribeck_feedforward", 914, "f32", unit="N*m", access="rw", description="Effort above Coulomb's at rest, in the direction of the reference velocity."),
    Register("shadow.x.stribeck_speed", 916, "f32", unit="rad/s", access="rw", description="Speed at which 1/e of that effort is left."),
    Register("shadow.x.viscous_difference_feedforward", 918, "f32", unit="N*m*s/rad", access="rw", description="Effort per reference speed, the same sign both ways."),
    Register("shadow.x.ripple_cosine", 920, "f32", count=4, unit="N*m", access="rw", description="Amplitude of each ripple in phase with position zero."),
    Register("shadow.x.ripple_sine", 928, "f32", count=4, unit="N*m", access="rw", description="Amplitude of each ripple a quarter period later."),
    Register("shadow.x.ripple_period", 936, "f32", count=4, unit="rad", access="rw", description="Travel after which each ripple repeats."),
    Register("shadow.z.proportional", 944, "f32", unit="N*m/rad", access="rw", description="Effort per position error."),
    Register("shadow.z.derivative", 946, "f32", unit="N*m*s/rad", access="rw", description="Effort per velocity error."),
    Register("shadow.z.integral", 948, "f32", unit="N*m/(rad*s)", access="rw", description="Effort per integrated position error."),
    Register("shadow.z.velocity_filter", 950, "f32", unit="s", access="rw", description="Time constant of the velocity filter."),
    Register("shadow.z.inertia_feedforward", 952, "f32", unit="kg*m^2", access="rw", description="Effort per reference acceleration."),
    Register("shadow.z.viscous_feedforward", 954, "f32", unit="N*m*s/rad", access="rw", description="Effort per reference velocity."),
    Register("shadow.z.coulomb_feedforward", 956, "f32", unit="N*m", access="rw", description="Effort in the direction of the reference velocity."),
    Register("shadow.z.coulomb_smoothing", 958, "f32", unit="rad/s", access="rw", description="Speed over which that effort changes sign."),
    Register("shadow.z.offset_feedforward", 960, "f32", unit="N*m", access="rw", description="Constant effort."),
    Register("shadow.z.stribeck_feedforward", 962, "f32", unit="N*m", access="rw", description="Effort above Coulomb's at rest, in the direction of the reference velocity."),
    Register("shadow.z.stribeck_speed", 964, "f32", unit="rad/s", access="rw", description="Speed at which 1/e of that effort is left."),
    Register("shadow.z.viscous_difference_feedforward", 966, "f32", unit="N*m*s/rad", access="rw", description="Effort per reference speed, the same sign both ways."),
    Register("shadow.z.ripple_cosine", 968, "f32", count=4, unit="N*m", access="rw", description="Amplitude of each ripple in phase with position zero."),
    Register("shadow.z.ripple_sine", 976, "f32", count=4, unit="N*m", access="rw", description="Amplitude of each ripple a quarter period later."),
    Register("shadow.z.ripple_period", 984, "f32", count=4, unit="rad", access="rw", description="Travel after which each ripple repeats."),
    Register("shadow.crc", 992, "u32", access="rw", description="CRC-32 of the shadow bank's words in the order of their addresses, big-endian, all axes; those of map 4 included."),
    Register("active.x.friction_top_speed", 1024, "f32", unit="rad/s", since=4, description="End of both friction curves."),
    Register("active.x.friction_forward", 1026, "f32", count=12, unit="N*m", since=4, description="Friction beyond Coulomb's and Stribeck's at (k / 11)^2 of that speed, moving forward."),
    Register("active.x.friction_backward", 1050, "f32", count=12, unit="N*m", since=4, description="The same moving backward."),
    Register("active.x.table_start", 1074, "f32", unit="rad", since=4, description="Position of the first entry of both tables over position."),
    Register("active.x.table_step", 1076, "f32", unit="rad", since=4, description="From one entry to the next."),
    Register("active.x.load_table", 1078, "f32", count=24, unit="N*m", since=4, description="Effort over position."),
    Register("active.x.local_friction_table", 1126, "f32", count=24, unit="N*m", since=4, description="Friction over position, in the direction of the reference velocity."),
    Register("active.x.table_fade_speed", 1174, "f32", unit="rad/s", since=4, description="Up to which both tables act whole; gone at twice it; 0: at every speed."),
    Register("active.x.ripple_fade_speed", 1176, "f32", count=4, unit="rad/s", since=4, description="The same for each ripple."),
    Register("active.x.presliding_feedforward", 1184, "f32", unit="N*m", since=4, description="Friction that builds up over a distance after each reversal."),
    Register("active.x.presliding_distance", 1186, "f32", unit="rad", since=4, description="That distance: 1 - 1/e of the change is done."),
    Register("active.x.backlash_offset", 1188, "f32", unit="rad", since=4, description="Half the gap, by which the law leads the reference."),
    Register("active.x.backlash_distance", 1190, "f32", unit="rad", since=4, description="Travel over which it crosses the gap."),
    Register("active.x.deadband_inverse", 1192, "f32", unit="N*m", since=4, description="Effort added in the direction of the effort."),
    Register("active.x.deadband_smoothing", 1194, "f32", unit="N*m", since=4, description="Effort over which that changes sign."),
    Register("active.x.cross_inertia_feedforward", 1196, "f32", unit="kg*m^2", since=4, description="Effort per reference acceleration of the other axis."),
    Register("active.x.cross_viscous_feedforward", 1198, "f32", unit="N*m*s/rad", since=4, description="Effort per reference velocity of the other axis."),
    Register("active.x.cross_coulomb_feedforward", 1200, "f32", unit="N*m", since=4, description="Effort in the direction of the other axis's reference velocity."),
    Register("active.x.transmission_loss", 1202, "f32", since=4, description="Share of the transmitted effort that is lost, at most 0.9."),
    Register("active.x.transmitted_inertia", 1204, "f32", unit="kg*m^2", since=4, description="Inertia beyond the transmission."),
    Register("active.x.transmitted_friction", 1206, "f32", since=4, description="Share of viscous and Coulomb friction beyond the transmission."),
    Register("active.z.friction_top_speed", 1208, "f32", unit="rad/s", since=4, description="End of both friction curves."),
    Register("active.z.friction_forward", 1210, "f32", count=12, unit="N*m", since=4, description="Friction beyond Coulomb's and Stribeck's at (k / 11)^2 of that speed, moving forward."),
    Register("active.z.friction_backward", 1234, "f32", count=12, unit="N*m", since=4, description="The same moving backward."),
    Register("active.z.table_start", 1258, "f32", unit="rad", since=4, description="Position of the first entry of both tables over position."),
    Register("active.z.table_step", 1260, "f32", unit="rad", since=4, description="From one entry to the next."),
    Register("active.z.load_table", 1262, "f32", count=24, unit="N*m", since=4, description="Effort over position."),
    Register("active.z.local_friction_table", 1310, "f32", count=24, unit="N*m", since=4, description="Friction over position, in the direction of the reference velocity."),
    Register("active.z.table_fade_speed", 1358, "f32", unit="rad/s", since=4, description="Up to which both tables act whole; gone at twice it; 0: at every speed."),
    Register("active.z.ripple_fade_speed", 1360, "f32", count=4, unit="rad/s", since=4, description="The same for each ripple."),
    Register("active.z.presliding_feedforward", 1368, "f32", unit="N*m", since=4, description="Friction that builds up over a distance after each reversal."),
    Register("active.z.presliding_distance", 1370, "f32", unit="rad", since=4, description="That distance: 1 - 1/e of the change is done."),
    Register("active.z.backlash_offset", 1372, "f32", unit="rad", since=4, description="Half the gap, by which the law leads the reference."),
    Register("active.z.backlash_distance", 1374, "f32", unit="rad", since=4, description="Travel over which it crosses the gap."),
    Register("active.z.deadband_inverse", 1376, "f32", unit="N*m", since=4, description="Effort added in the direction of the effort."),
    Register("active.z.deadband_smoothing", 1378, "f32", unit="N*m", since=4, description="Effort over which that changes sign."),
    Register("active.z.cross_inertia_feedforward", 1380, "f32", unit="kg*m^2", since=4, description="Effort per reference acceleration of the other axis."),
    Register("active.z.cross_viscous_feedforward", 1382, "f32", unit="N*m*s/rad", since=4, description="Effort per reference velocity of the other axis."),
    Register("active.z.cross_coulomb_feedforward", 1384, "f32", unit="N*m", since=4, description="Effort in the direction of the other axis's reference velocity."),
    Register("active.z.transmission_loss", 1386, "f32", since=4, description="Share of the transmitted effort that is lost, at most 0.9."),
    Register("active.z.transmitted_inertia", 1388, "f32", unit="kg*m^2", since=4, description="Inertia beyond the transmission."),
    Register("active.z.transmitted_friction", 1390, "f32", since=4, description="Share of viscous and Coulomb friction beyond the transmission."),
    Register("active.crc", 1392, "u32", since=4, description="CRC-32 of the active bank's words, as of the shadow bank's: what was read in several pieces is of one bank where it matches."),
    Register("shadow.x.friction_top_speed", 1408, "f32", unit="rad/s", access="rw", since=4, description="End of both friction curves."),
    Register("shadow.x.friction_forward", 1410, "f32", count=12, unit="N*m", access="rw", since=4, description="Friction beyond Coulomb's and Stribeck's at (k / 11)^2 of that speed, moving forward."),
    Register("shadow.x.friction_backward", 1434, "f32", count=12, unit="N*m", access="rw", since=4, description="The same moving backward."),
    Register("shadow.x.table_start", 1458, "f32", unit="rad", access="rw", since=4, description="Position of the first entry of both tables over position."),
    Register("shadow.x.table_step", 1460, "f32", unit="rad", access="rw", since=4, description="From one entry to the next."),
    Register("shadow.x.load_table", 1462, "f32", count=24, unit="N*m", access="rw", since=4, description="Effort over position."),
    Register("shadow.x.local_friction_table", 1510, "f32", count=24, unit="N*m", access="rw", since=4, description="Friction over position, in the direction of the reference velocity."),
    Register("shadow.x.table_fade_speed", 1558, "f32", unit="rad/s", access="rw", since=4, description="Up to which both tables act whole; gone at twice it; 0: at every speed."),
    Register("shadow.x.ripple_fade_speed", 1560, "f32", count=4, unit="rad/s", access="rw", since=4, description="The same for each ripple."),
    Register("shadow.x.presliding_feedforward", 1568, "f32", unit="N*m", access="rw", since=4, description="Friction that builds up over a distance after each reversal."),
    Register("shadow.x.presliding_distance", 1570, "f32", unit="rad", access="rw", since=4, description="That distance: 1 - 1/e of the change is done."),
    Register("shadow.x.backlash_offset", 1572, "f32", unit="rad", access="rw", since=4, description="Half the gap, by which the law leads the reference."),
    Register("shadow.x.backlash_distance", 1574, "f32", unit="rad", access="rw", since=4, description="Travel over which it crosses the gap."),
    Register("shadow.x.deadband_inverse", 1576, "f32", unit="N*m", access="rw", since=4, description="Effort added in the direction of the effort."),
    Register("shadow.x.deadband_smoothing", 1578, "f32", unit="N*m", access="rw", since=4, description="Effort over which that changes sign."),
    Register("shadow.x.cross_inertia_feedforward", 1580, "f32", unit="kg*m^2", access="rw", since=4, description="Effort per reference acceleration of the other axis."),
    Register("shadow.x.cross_viscous_feedforward", 1582, "f32", unit="N*m*s/rad", access="rw", since=4, description="Effort per reference velocity of the other axis."),
    Register("shadow.x.cross_coulomb_feedforward", 1584, "f32", unit="N*m", access="rw", since=4, description="Effort in the direction of the other axis's reference velocity."),
    Register("shadow.x.transmission_loss", 1586, "f32", access="rw", since=4, description="Share of the transmitted effort that is lost, at most 0.9."),
    Register("shadow.x.transmitted_inertia", 1588, "f32", unit="kg*m^2", access="rw", since=4, description="Inertia beyond the transmission."),
    Register("shadow.x.transmitted_friction", 1590, "f32", access="rw", since=4, description="Share of viscous and Coulomb friction beyond the transmission."),
    Register("shadow.z.friction_top_speed", 1592, "f32", unit="rad/s", access="rw", since=4, description="End of both friction curves."),
    Register("shadow.z.friction_forward", 1594, "f32", count=12, unit="N*m", access="rw", since=4, description="Friction beyond Coulomb's and Stribeck's at (k / 11)^2 of that speed, moving forward."),
    Register("shadow.z.friction_backward", 1618, "f32", count=12, unit="N*m", access="rw", since=4, description="The same moving backward."),
    Register("shadow.z.table_start", 1642, "f32", unit="rad", access="rw", since=4, description="Position of the first entry of both tables over position."),
    Register("shadow.z.table_step", 1644, "f32", unit="rad", access="rw", since=4, description="From one entry to the next."),
    Register("shadow.z.load_table", 1646, "f32", count=24, unit="N*m", access="rw", since=4, description="Effort over position."),
    Register("shadow.z.local_friction_table", 1694, "f32", count=24, unit="N*m", access="rw", since=4, description="Friction over position, in the direction of the reference velocity."),
    Register("shadow.z.table_fade_speed", 1742, "f32", unit="rad/s", access="rw", since=4, description="Up to which both tables act whole; gone at twice it; 0: at every speed."),
    Register("shadow.z.ripple_fade_speed", 1744, "f32", count=4, unit="rad/s", access="rw", since=4, description="The same for each ripple."),
    Register("shadow.z.presliding_feedforward", 1752, "f32", unit="N*m", access="rw", since=4, description="Friction that builds up over a distance after each reversal."),
    Register("shadow.z.presliding_distance", 1754, "f32", unit="rad", access="rw", since=4, description="That distance: 1 - 1/e of the change is done."),
    Register("shadow.z.backlash_offset", 1756, "f32", unit="rad", access="rw", since=4, description="Half the gap, by which the law leads the reference."),
    Register("shadow.z.backlash_distance", 1758, "f32", unit="rad", access="rw", since=4, description="Travel over which it crosses the gap."),
    Register("shadow.z.deadband_inverse", 1760, "f32", unit="N*m", access="rw", since=4, description="Effort added in the direction of the effort."),
    Register("shadow.z.deadband_smoothing", 1762, "f32", unit="N*m", access="rw", since=4, description="Effort over which that changes sign."),
    Register("shadow.z.cross_inertia_feedforward", 1764, "f32", unit="kg*m^2", access="rw", since=4, description="Effort per reference acceleration of the other axis."),
    Register("shadow.z.cross_viscous_feedforward", 1766, "f32", unit="N*m*s/rad", access="rw", since=4, description="Effort per reference velocity of the other axis."),
    Register("shadow.z.cross_coulomb_feedforward", 1768, "f32", unit="N*m", access="rw", since=4, description="Effort in the direction of the other axis's reference velocity."),
    Register("shadow.z.transmission_loss", 1770, "f32", access="rw", since=4, description="Share of the transmitted effort that is lost, at most 0.9."),
    Register("shadow.z.transmitted_inertia", 1772, "f32", unit="kg*m^2", access="rw", since=4, description="Inertia beyond the transmission."),
    Register("shadow.z.transmitted_friction", 1774, "f32", access="rw", since=4, description="Share of viscous and Coulomb friction beyond the transmission."),
    Register("gain_maximum.x.friction_top_speed", 1792, "f32", unit="rad/s", since=4, description="End of both friction curves."),
    Register("gain_maximum.x.friction_forward", 1794, "f32", count=12, unit="N*m", since=4, description="Friction beyond Coulomb's and Stribeck's at (k / 11)^2 of that speed, moving forward."),
    Register("gain_maximum.x.friction_backward", 1818, "f32", count=12, unit="N*m", since=4, description="The same moving backward."),
    Register("gain_maximum.x.table_start", 1842, "f32", unit="rad", since=4, description="Position of the first entry of both tables over position."),
    Register("gain_maximum.x.table_step", 1844, "f32", unit="rad", since=4, description="From one entry to the next."),
    Register("gain_maximum.x.load_table", 1846, "f32", count=24, unit="N*m", since=4, description="Effort over position."),
    Register("gain_maximum.x.local_friction_table", 1894, "f32", count=24, unit="N*m", since=4, description="Friction over position, in the direction of the reference velocity."),
    Register("gain_maximum.x.table_fade_speed", 1942, "f32", unit="rad/s", since=4, description="Up to which both tables act whole; gone at twice it; 0: at every speed."),
    Register("gain_maximum.x.ripple_fade_speed", 1944, "f32", count=4, unit="rad/s", since=4, description="The same for each ripple."),
    Register("gain_maximum.x.presliding_feedforward", 1952, "f32", unit="N*m", since=4, description="Friction that builds up over a distance after each reversal."),
    Register("gain_maximum.x.presliding_distance", 1954, "f32", unit="rad", since=4, description="That distance: 1 - 1/e of the change is done."),
    Register("gain_maximum.x.backlash_offset", 1956, "f32", unit="rad", since=4, description="Half the gap, by which the law leads the reference."),
    Register("gain_maximum.x.backlash_distance", 1958, "f32", unit="rad", since=4, description="Travel over which it crosses the gap."),
    Register("gain_maximum.x.deadband_inverse", 1960, "f32", unit="N*m", since=4, description="Effort added in the direction of the effort."),
    Register("gain_maximum.x.deadband_smoothing", 1962, "f32", unit="N*m", since=4, description="Effort over which that changes sign."),
    Register("gain_maximum.x.cross_inertia_feedforward", 1964, "f32", unit="kg*m^2", since=4, description="Effort per reference acceleration of the other axis."),
    Register("gain_maximum.x.cross_viscous_feedforward", 1966, "f32", unit="N*m*s/rad", since=4, description="Effort per reference velocity of the other axis."),
    Register("gain_maximum.x.cross_coulomb_feedforward", 1968, "f32", unit="N*m", since=4, description="Effort in the direction of the other axis's reference velocity."),
    Register("gain_maximum.x.transmission_loss", 1970, "f32", since=4, description="Share of the transmitted effort that is lost, at most 0.9."),
    Register("gain_maximum.x.transmitted_inertia", 1972, "f32", unit="kg*m^2", since=4, description="Inertia beyond the transmission."),
    Register("gain_maximum.x.transmitted_friction", 1974, "f32", since=4, description="Share of viscous and Coulomb friction beyond the transmission."),
    Register("gain_maximum.z.friction_top_speed", 1976, "f32", unit="rad/s", since=4, description="End of both friction curves."),
    Register("gain_maximum.z.friction_forward", 1978, "f32", count=12, unit="N*m", since=4, description="Friction beyond Coulomb's and Stribeck's at (k / 11)^2 of that speed, moving forward."),
    Register("gain_maximum.z.friction_backward", 2002, "f32", count=12, unit="N*m", since=4, description="The same moving backward."),
    Register("gain_maximum.z.table_start", 2026, "f32", unit="rad", since=4, description="Position of the first entry of both tables over position."),
    Register("gain_maximum.z.table_step", 2028, "f32", unit="rad", since=4, description="From one entry to the next."),
    Register("gain_maximum.z.load_table", 2030, "f32", count=24, unit="N*m", since=4, description="Effort over position."),
    Register("gain_maximum.z.local_friction_table", 2078, "f32", count=24, unit="N*m", since=4, description="Friction over position, in the direction of the reference velocity."),
    Register("gain_maximum.z.table_fade_speed", 2126, "f32", unit="rad/s", since=4, description="Up to which both tables act whole; gone at twice it; 0: at every speed."),
    Register("gain_maximum.z.ripple_fade_speed", 2128, "f32", count=4, unit="rad/s", since=4, description="The same for each ripple."),
    Register("gain_maximum.z.presliding_feedforward", 2136, "f32", unit="N*m", since=4, description="Friction that builds up over a distance after each reversal."),
    Register("gain_maximum.z.presliding_distance", 2138, "f32", unit="rad", since=4, description="That distance: 1 - 1/e of the change is done."),
    Register("gain_maximum.z.backlash_offset", 2140, "f32", unit="rad", since=4, description="Half the gap, by which the law leads the reference."),
    Register("gain_maximum.z.backlash_distance", 2142, "f32", unit="rad", since=4, description="Travel over which it crosses the gap."),
    Register("gain_maximum.z.deadband_inverse", 2144, "f32", unit="N*m", since=4, description="Effort added in the direction of the effort."),
    Register("gain_maximum.z.deadband_smoothing", 2146, "f32", unit="N*m", since=4, description="Effort over which that changes sign."),
    Register("gain_maximum.z.cross_inertia_feedforward", 2148, "f32", unit="kg*m^2", since=4, description="Effort per reference acceleration of the other axis."),
    Register("gain_maximum.z.cross_viscous_feedforward", 2150, "f32", unit="N*m*s/rad", since=4, description="Effort per reference velocity of the other axis."),
    Register("gain_maximum.z.cross_coulomb_feedforward", 2152, "f32", unit="N*m", since=4, description="Effort in the direction of the other axis's reference velocity."),
    Register("gain_maximum.z.transmission_loss", 2154, "f32", since=4, description="Share of the transmitted effort that is lost, at most 0.9."),
    Register("gain_maximum.z.transmitted_inertia", 2156, "f32", unit="kg*m^2", since=4, description="Inertia beyond the transmission."),
    Register("gain_maximum.z.transmitted_friction", 2158, "f32", since=4, description="Share of viscous and Coulomb friction beyond the transmission."),
    Register("identification.state", 2304, "u16", enum="IdentificationState", since=5, description="What the board's own identification does."),
    Register("identification.motion", 2305, "u16", since=5, description="Token of the START whose motion it is of."),
    Register("identification.network", 2306, "u32", since=5, description="First four bytes of the SHA-256 of the network's ONNX file; 0 where the board has none."),
    Register("identification.x.reason", 2308, "u16", enum="IdentificationReason", since=5, description="Why the axis is not identified; then what follows is zero."),
    Register("identification.x.images", 2309, "u16", since=5, description="Images that the network was shown."),
    Register("identification.x.inertia", 2310, "f32", unit="kg*m^2", since=5, description="Inertia."),
    Register("identification.x.viscous_friction", 2312, "f32", unit="N*m*s/rad", since=5, description="Viscous friction."),
    Register("identification.x.coulomb_friction", 2314, "f32", unit="N*m", since=5, description="Coulomb friction."),
    Register("identification.x.offset", 2316, "f32", unit="N*m", since=5, description="Constant effort."),
    Register("identification.x.relative_residual", 2318, "f32", since=5, description="What these leave of the effort, as a share of it."),
    Register("identification.z.reason", 2320, "u16", enum="IdentificationReason", since=5, description="Why the axis is not identified; then what follows is zero."),
    Register("identification.z.images", 2321, "u16", since=5, description="Images that the network was shown."),
    Register("identification.z.inertia", 2322, "f32", unit="kg*m^2", since=5, description="Inertia."),
    Register("identification.z.viscous_friction", 2324, "f32", unit="N*m*s/rad", since=5, description="Viscous friction."),
    Register("identification.z.coulomb_friction", 2326, "f32", unit="N*m", since=5, description="Coulomb friction."),
    Register("identification.z.offset", 2328, "f32", unit="N*m", since=5, description="Constant effort."),
    Register("identification.z.relative_residual", 2330, "f32", since=5, description="What these leave of the effort, as a share of it."),
    Register("identification.crc", 2332, "u32", since=5, description="CRC-32 of the words of this group before it, big-endian: what was read in several pieces is of one moment where it matches."),
)
REGISTERS: Final = {register.name: register for register in _ALL}
