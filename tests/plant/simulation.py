"""The drive in closed loop with encoder, controller and noise: what a board would record."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tests.plant.drives import COUNT_RAD, Array, Control, Drives
from tests.plant.effect import Effect, Scales
from tests.plant.mechanism import Mechanism, overriding
from tests.plant.motions import LEAD, SAMPLE_S, Motion
from tests.plant.timed_effects import lagged

# Found by convergence (tests/test_plant.py): finer steps change efforts by less than the noise.
STEPS_PER_SAMPLE = 10
# A new command acts so long after the encoder was read: 0.5 ms.
_CONTROL_DELAY_PERIODS = 0.2


@dataclass(frozen=True)
class Electronics:
    """Resolution of encoder (rad) and effort (N·m), 0 for ideal, and the largest command."""

    count_rad: float = COUNT_RAD
    effort_step_nm: float = 0.004
    effort_limit_nm: float = 25.0


@dataclass(frozen=True)
class Noise:
    """Noise of the recorded effort, in shares of its rms; white, or a first-order lag's."""

    share: float = 0.02
    correlation_s: float = 0.0


@dataclass(frozen=True)
class Recordings:
    """What B boards recorded.

    Attributes
    ----------
    time_s : (N,) array
    position, effort, reference : (B, A, N) arrays
        Encoder angle, commanded torque with the noise of its measurement, and commanded angle.
        A row's effort acts over one period that begins 0.5 ms after its stamp.
    effort_shift_s : float
        From a stamp to the middle of that period.
    true_angle, true_velocity : (B, A, N) arrays
        Of the gearbox output, at the stamps.
    true_command : (B, A, N) array
        The command without noise.
    base, truth : (B, A, 4) arrays
        Inertia, viscous friction, Coulomb friction and offset. `base`: of the drive without its
        effects. `truth`: with what an effect changes in these four themselves, as the mean over
        the recording (payload, warm-up, gain, drifting offset; Coulomb friction by direction
        adds to the offset). What an effect adds beside them is in neither.
    """

    time_s: Array
    position: Array
    effort: Array
    reference: Array
    effort_shift_s: float
    true_angle: Array
    true_velocity: Array
    true_command: Array
    base: Array
    truth: Array


def simulate(
    drives: Drives,
    motion: Motion,
    *,
    effects: Sequence[Effect] = (),
    noise: Noise | None = None,
    seed: int = 0,
    electronics: Electronics | None = None,
    steps_per_sample: int = STEPS_PER_SAMPLE,
) -> Recordings:
    """Run all drives through a motion at once.

    Parameters
    ----------
    effects : sequence of Effect
        From `draw`, for the same drives and motion.
    noise : Noise or None
        None for a perfect measurement of effort.
    seed : int
        Of the noise alone.
    steps_per_sample : int
        A multiple of 5.
    """
    electronics = electronics or Electronics()
    command, angle, velocity = _run(drives, motion, effects, electronics, steps_per_sample)
    recorded = command
    for effect in overriding(effects, "recorded"):
        recorded = effect.recorded(recorded)
    if noise is not None:
        recorded = recorded + _noise(noise, recorded, seed)
    shown = angle
    for effect in overriding(effects, "encoder"):
        shown = effect.encoder(shown)
    base = truth = drives.chain.rigid_body
    scales = Scales.of(drives, motion)
    for effect in effects:
        truth = effect.truth(truth, scales)

    def part(rows: Array) -> Array:
        return np.ascontiguousarray(np.moveaxis(rows[motion.recorded], 0, -1))

    return Recordings(
        time_s=motion.clock_s[motion.recorded],
        position=part(_quantized(shown, electronics.count_rad)),
        effort=part(recorded),
        reference=part(np.broadcast_to(motion.position, angle.shape)),
        effort_shift_s=(0.5 + _CONTROL_DELAY_PERIODS) * SAMPLE_S,
        true_angle=part(angle),
        true_velocity=part(velocity),
        true_command=part(command),
        base=base,
        truth=truth,
    )


def _run(
    drives: Drives,
    motion: Motion,
    effects: Sequence[Effect],
    electronics: Electronics,
    steps: int,
) -> tuple[Array, Array, Array]:
    """Commands, angles and velocities at every stamp, (LEAD + N + TAIL, B, A)."""
    whole = np.ones(drives.shape)
    start, speed = motion.position[0] * whole, motion.velocity[0] * whole
    mechanism = Mechanism(drives.chain, effects, SAMPLE_S / steps, start, speed)
    encoders = [e.encoder for e in overriding(effects, "encoder")]
    amplifiers = [e.applied for e in overriding(effects, "applied")]
    controller = _Controller(drives.control, motion, electronics)
    late = round(_CONTROL_DELAY_PERIODS * steps)
    commands, angles, velocities = np.empty((3, len(motion.position), *drives.shape))
    torque = np.zeros(drives.shape)
    for row, time_s in enumerate(motion.clock_s):
        mechanism.at(time_s)
        angles[row], velocities[row] = mechanism.angle[0], mechanism.velocity[0]
        shown = angles[row]
        for encoder in encoders:
            shown = encoder(shown)
        commands[row] = acting = controller.command(row, shown)
        for amplifier in amplifiers:
            acting = amplifier(acting, time_s)
        for step in range(steps):
            if step == late:
                torque = acting
            mechanism.advance(torque)
    return commands, angles, velocities


class _Controller:
    """The control law of one batch, with its velocity filter's memory."""

    def __init__(self, control: Control, motion: Motion, electronics: Electronics) -> None:
        self._control, self._motion, self._electronics = control, motion, electronics
        self._share = SAMPLE_S / (SAMPLE_S + control.filter_s)
        self._last = motion.position[0] - SAMPLE_S * motion.velocity[0]
        self._velocity = motion.velocity[0]
        inertia, viscous, coulomb, offset = np.moveaxis(control.feedforward, -1, 0)
        # a controller's smooth sign: it must not chatter where the reference rests
        direction = np.tanh(motion.velocity / 0.02)
        self._forward = (
            inertia * motion.acceleration + viscous * motion.velocity + coulomb * direction + offset
        )

    def command(self, row: int, shown: Array) -> Array:
        """Torque for the angle that the encoder shows."""
        motion, control, electronics = self._motion, self._control, self._electronics
        measured = _quantized(shown, electronics.count_rad)
        rate = (measured - self._last) / SAMPLE_S
        self._velocity = self._velocity + self._share * (rate - self._velocity)
        self._last = measured
        torque = (
            self._forward[row]
            + control.position_gain * (motion.position[row] - measured)
            + control.velocity_gain * (motion.velocity[row] - self._velocity)
        )
        limit = electronics.effort_limit_nm
        return _quantized(np.clip(torque, -limit, limit), electronics.effort_step_nm)


def _quantized(values: Array, step: float) -> Array:
    return np.round(values / step) * step if step else values


def _noise(noise: Noise, effort: Array, seed: int) -> Array:
    """Noise for efforts (LEAD + N + TAIL, B, A), each axis on its own rms."""
    values = np.random.default_rng([seed, 4]).standard_normal(effort.shape)
    if noise.correlation_s:
        keep = np.exp(-SAMPLE_S / noise.correlation_s)
        values = lagged(values, keep) * np.sqrt((1 + keep) / (1 - keep))
    recorded = effort[LEAD:]
    return np.asarray(noise.share * np.sqrt((recorded**2).mean(axis=0)) * values)
