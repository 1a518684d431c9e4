"""A board, the host's verbs for it, and time that passes without the host."""

from dataclasses import replace

from firmware_interface.board import Board
from firmware_interface.codec import encode
from firmware_interface.gains import CONSERVATIVE_GAINS, AxisGains
from firmware_interface.motion import Multisine, SineComponent, Trajectory
from firmware_interface.registers import REGISTERS, Result
from firmware_interface.virtual.board import RequestClock, VirtualBoard
from firmware_interface.virtual.drive import SAMPLE_PERIOD_S
from firmware_interface.virtual.settings import BoardSettings

# values that a 32-bit float holds exactly, so that what is read back can be compared
BETTER = AxisGains(
    *(128.0, 16.0, 0.0, 0.0078125, 0.375, 0.75, 1.25, 0.5, 0.0625),
    stribeck_feedforward=0.25,
    stribeck_speed_rad_s=0.125,
    viscous_difference_feedforward=-0.0625,
    ripple_cosine=(0.5, 0.0, -0.25, 0.0),
    ripple_sine=(-0.125, 0.0, 0.0, 0.0),
    ripple_period_rad=(6.25, 1.0, 0.0625, 1.0),
    friction_top_speed_rad_s=4.0,
    friction_forward=tuple(0.03125 * k for k in range(12)),
    friction_backward=tuple(-0.015625 * k for k in range(12)),
    table_start_rad=-2.0,
    table_step_rad=0.125,
    load_table=tuple(0.0078125 * (k - 12) for k in range(24)),
    local_friction_table=tuple(0.0078125 * k for k in range(24)),
    table_fade_speed_rad_s=2.0,
    ripple_fade_speed_rad_s=(1.0, 0.0, 0.5, 0.0),
    presliding_feedforward=0.125,
    presliding_distance_rad=0.015625,
    backlash_offset_rad=0.0009765625,
    backlash_distance_rad=0.0078125,
    deadband_inverse=0.03125,
    deadband_smoothing=0.25,
    cross_inertia_feedforward=-0.03125,
    cross_viscous_feedforward=0.0625,
    cross_coulomb_feedforward=0.03125,
    transmission_loss=0.0625,
    transmitted_inertia=0.25,
    transmitted_friction=0.5,
)
OLD = dict.fromkeys(
    "xz", replace(CONSERVATIVE_GAINS, velocity_filter_s=1 / 128, coulomb_smoothing_rad_s=0.125)
)
NEW = {"x": BETTER, "z": replace(BETTER, proportional=112.0)}


class Bench:
    """A board, the host's verbs for it, and time that passes without the host."""

    def __init__(self, **changed: object) -> None:
        self.clock = RequestClock()
        self.virtual = VirtualBoard(BoardSettings(gains=OLD, **changed), self.clock)  # type: ignore[arg-type]
        self.board = Board.connect(self.virtual)

    def wait(self, seconds: float) -> None:
        """Nobody asks the board anything for so long."""
        self.clock.let_pass(self.virtual.machine, round(seconds / SAMPLE_PERIOD_S))

    def arm(self, motion: Trajectory) -> None:
        """Have a motion checked, with the effort on."""
        self.board.enable()
        self.board.write_trajectory(motion)
        self.board.arm()

    def start(self, motion: Trajectory) -> None:
        """Start a motion."""
        self.arm(motion)
        self.board.start()

    def commit(self) -> None:
        """Put other gains in force, without a confirmation."""
        self.board.stage_gains(NEW)
        self.board.commit()

    def command(self, opcode: int, token: int, argument: int = 0, key: int | None = None) -> Result:
        """Write a command as it is, once, by the host that holds the board or another one.

        The host's own tokens start below 1,000, at random: take one from 30,000 on.
        """
        self.board._session._own_tokens.add(token)
        words = encode("command.opcode", opcode) + encode("command.token", token)
        words += encode("command.argument", argument)
        words += encode("command.key", self.key if key is None else key)
        self.virtual.write(REGISTERS["command.opcode"].address, words)
        return self.board.status().last_result

    @property
    def key(self) -> int:
        """The session key of this bench's host."""
        return self.board._session._key


def long_motion(amplitude_rad: float = 1.0) -> Trajectory:
    sine = Multisine((SineComponent(amplitude_rad, 0.5, 0.0),))
    return Trajectory({"x": sine, "z": sine}, duration_s=60.0, lead_in_s=0.5)
