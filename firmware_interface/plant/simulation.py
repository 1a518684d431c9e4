"""The drive in closed loop with encoder, controller and noise: what a board would record."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from firmware_interface.plant.drives import (
    COUNT_RAD,
    LEAD,
    SAMPLE_S,
    Array,
    Control,
    Drives,
    Motion,
    log_uniform,
)
from firmware_interface.plant.effect import Effect, Scales
from firmware_interface.plant.plant import STEPS_PER_SAMPLE, Mechanism, overriding
from firmware_interface.plant.timed_effects import lagged

# A sound drive that moves as a faulty one does: what the same motion would have taken of it.

_NUDGE_RAD = 1e-6


class Twin:
    """The drives without their effects, with motors that move as the encoders say.

    Give it to `simulate`. Inverse dynamics by simulation: the encoder sits on the motor, so the
    motor's motion is given, the other masses follow it, and the torque on the motor results.

    Parameters
    ----------
    drives, motion, effects
        As `simulate` gets them.
    axis : (B,) array of int
        The one of every drive to be remembered.

    Attributes
    ----------
    torque : (T, B) array
        In every step, `STEPS_PER_SAMPLE` a row of the motion, N·m.
    velocity : (T + 1, B) array
        Of the angle that the encoder shows, before each step and after the last one, rad/s.
    """

    def __init__(
        self, drives: Drives, motion: Motion, effects: Sequence[Effect], axis: NDArray[np.intp]
    ) -> None:
        whole = np.ones(drives.shape)
        start, speed = motion.position[0] * whole, motion.velocity[0] * whole
        self._sound = Mechanism(drives.chain, (), SAMPLE_S / STEPS_PER_SAMPLE, start, speed)
        self._encoders = [e.encoder for e in overriding(effects, "encoder")]
        self._of = np.arange(len(axis)), axis
        steps = STEPS_PER_SAMPLE * len(motion.position)
        self.torque = np.empty((steps, len(axis)))
        self.velocity = np.empty((steps + 1, len(axis)))
        self.velocity[0] = speed[self._of]
        self._step = 0

    def follow(self, drive: Mechanism) -> None:
        """Go one step along with a drive that has just made it."""
        velocity = drive.velocity[0] * self._slope(drive.angle[0])
        needed = self._sound.follow(velocity)
        self.torque[self._step] = needed[self._of]
        self._step += 1
        self.velocity[self._step] = velocity[self._of]

    def _slope(self, angle: Array) -> Array:
        """Shown angle per true angle."""
        if not self._encoders:
            return np.ones_like(angle)
        high, low = angle + _NUDGE_RAD, angle - _NUDGE_RAD
        for encoder in self._encoders:
            high, low = encoder(high), encoder(low)
        return np.asarray((high - low) / (2 * _NUDGE_RAD))


# Encoder, sampling and measurement: what a board adds to a drive, one for all or drawn for each.
#
# A command is held over a sampling period. It begins to act some periods after the encoder was
# read: a board computes for so long. In the record it stands at the stamp of that reading.

_DELAYS = np.arange(11) / 10  # periods until a command acts; half a period more is its middle
_GEAR_RATIOS = (5.0, 50.0)
_NOISE = (0.005, 0.04)  # noise over the rms effort


@dataclass(frozen=True)
class Electronics:
    """Resolution of encoder (rad) and effort (N·m), 0 for ideal, the largest command, the delay.

    Attributes
    ----------
    count_rad : float or (B, A) array
    effort_step_nm, effort_limit_nm : float
    delay_periods : float or (B, 1) array
        Sampling periods from a stamp until its command acts, 0 to 2: 0.5 ms where not given.
    """

    count_rad: float | Array = COUNT_RAD
    effort_step_nm: float = 0.004
    effort_limit_nm: float = 25.0
    delay_periods: float | Array = 0.2

    @property
    def effort_shift_s(self) -> float | Array:
        """Time from a stamp to the middle of the period in which its command acts."""
        return (0.5 + self.delay_periods) * SAMPLE_S


@dataclass(frozen=True)
class Noise:
    """Noise of the recorded effort, in shares of its rms; white, or a first-order lag's.

    Attributes
    ----------
    share : float or (B, 1) array
    correlation_s : float
    """

    share: float | Array = 0.02
    correlation_s: float = 0.0

    def added_to(self, effort: Array, seed: int) -> Array:
        """Noise for efforts (LEAD + N + TAIL, B, A), each axis on its own rms."""
        values = np.random.default_rng([seed, 4]).standard_normal(effort.shape)
        if self.correlation_s:
            keep = np.exp(-SAMPLE_S / self.correlation_s)
            values = lagged(values, keep) * np.sqrt((1 + keep) / (1 - keep))
        recorded = effort[LEAD:]
        return np.asarray(self.share * np.sqrt((recorded**2).mean(axis=0)) * values)


def draw_electronics(shape: tuple[int, int], seed: int) -> Electronics:
    """Boards of B drives of A axes.

    A command begins to act 0 to 1 period after its stamp, so the middle of its action is 0.5 to 1.5
    periods after the stamp. Half of the encoders sit at the gearbox output, half at the motor; all
    have 8400 counts a turn.
    """
    rng = np.random.default_rng([seed, 8])
    count = shape[0]
    ratio = np.where(rng.random(count) < 0.5, 1.0, log_uniform(rng, *_GEAR_RATIOS, (count,)))
    delay = rng.choice(_DELAYS, count)
    return Electronics(
        count_rad=np.ones(shape) * COUNT_RAD / ratio[:, None], delay_periods=delay[:, None]
    )


def draw_noise(count: int, seed: int) -> Noise:
    """White effort noise of B drives, 0.5 to 4 % of the rms effort, even in the logarithm."""
    rng = np.random.default_rng([seed, 9])
    return Noise(log_uniform(rng, *_NOISE, (count, 1)))


@dataclass(frozen=True)
class Recordings:
    """What B boards recorded.

    Attributes
    ----------
    time_s : (N,) array
    position, effort, reference : (B, A, N) arrays
        Encoder angle, commanded torque with the noise of its measurement, and commanded angle.
        A row's effort acts over one period, that begins when the board has computed it.
    effort_shift_s : (B,) array
        From a stamp to the middle of that period.
    true_angle, true_velocity : (B, A, N) arrays
        Of the gearbox output, at the stamps.
    true_command : (B, A, N) array
        As the controller gave it.
    quiet_effort : (B, A, N) array
        What would be recorded without noise: an effect may change it.
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
    effort_shift_s: Array
    true_angle: Array
    true_velocity: Array
    true_command: Array
    quiet_effort: Array
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
    twin: Twin | None = None,
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
    twin : Twin, optional
    """
    electronics = electronics or Electronics()
    command, angle, velocity = _run(drives, motion, effects, electronics, steps_per_sample, twin)
    recorded = command
    for effect in overriding(effects, "recorded"):
        recorded = effect.recorded(recorded, motion.clock_s)
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
        effort=part(recorded if noise is None else recorded + noise.added_to(recorded, seed)),
        reference=part(np.broadcast_to(motion.position, angle.shape)),
        effort_shift_s=(electronics.effort_shift_s * np.ones((len(base), 1)))[:, 0],
        true_angle=part(angle),
        true_velocity=part(velocity),
        true_command=part(command),
        quiet_effort=part(recorded),
        base=base,
        truth=truth,
    )


def _run(
    drives: Drives,
    motion: Motion,
    effects: Sequence[Effect],
    electronics: Electronics,
    steps: int,
    twin: Twin | None,
) -> tuple[Array, Array, Array]:
    """Commands, angles and velocities at every stamp, (LEAD + N + TAIL, B, A)."""
    whole = np.ones(drives.shape)
    start, speed = motion.position[0] * whole, motion.velocity[0] * whole
    mechanism = Mechanism(drives.chain, effects, SAMPLE_S / steps, start, speed)
    encoders = [e.encoder for e in overriding(effects, "encoder")]
    amplifiers = [e.applied for e in overriding(effects, "applied")]
    controller = _Controller(drives.control, motion, electronics)
    amplifier = _Hold(electronics.delay_periods, steps, drives.shape)
    commands, angles, velocities = np.empty((3, len(motion.position), *drives.shape))
    for row, time_s in enumerate(motion.clock_s):
        mechanism.at(time_s)
        angles[row], velocities[row] = mechanism.angle[0], mechanism.velocity[0]
        shown = angles[row]
        for encoder in encoders:
            shown = encoder(shown)
        commands[row] = acting = controller.command(row, shown)
        for made_of in amplifiers:
            acting = made_of(acting, time_s)
        amplifier.take(acting)
        for step in range(steps):
            mechanism.advance(amplifier.torque(step))
            if twin is not None:
                twin.follow(mechanism)
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


class _Hold:
    """Holds every command over a period that begins its delay after the stamp."""

    def __init__(self, delay_periods: float | Array, steps: int, shape: tuple[int, int]) -> None:
        late = np.round(delay_periods * steps).astype(int) * np.ones(shape, dtype=int)
        self._ages = {
            step: np.maximum((late - step + steps - 1) // steps, 0)
            for step in np.unique(late % steps).tolist()
        }
        self._last = [np.zeros(shape)] * (2 + int(late.max()) // steps)
        self._torque = np.zeros(shape)

    def take(self, command: Array) -> None:
        """The command of a new stamp."""
        self._last = [command, *self._last[:-1]]

    def torque(self, step: int) -> Array:
        """What acts in a step after the newest stamp."""
        if step in self._ages:
            self._torque = self._ages[step].choose(self._last)
        return self._torque


def _quantized(values: Array, step: float | Array) -> Array:
    return np.round(values / step) * step if np.any(step) else values
