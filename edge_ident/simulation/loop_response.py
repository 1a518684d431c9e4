"""How far a position loop is from its path, for many drives at once, in milliseconds.

All but dry friction is linear, so one axis needs no stepping through time. Its error is the
response of the closed loop to the effort that the path needs and the law does not feed forward::

    error = axis / (1 + axis·law) · (effort needed - effort fed forward + law · encoder noise)

with the sampled law and the continuous axis as in `edge_ident.control.position_loop`. Dry friction
depends on the direction in which the axis goes, and that depends on the error. Both are found
together, sticking included, by splitting: in turn, the speed that the linear loop has under a
friction, and the friction that belongs to a speed.

Effort beyond the limit is lacking: it is taken off, and the loop is asked again.

A stepped simulation (`edge_ident.simulation.loop`) knows more: effects whose course depends on the
error. It takes far longer.
Sources: Franklin, Powell and Workman, Digital Control of Dynamic Systems, ch. 4; Lions and Mercier,
Splitting algorithms for the sum of two nonlinear operators, SIAM J. Numer. Anal. 16 (1979).
"""

from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from edge_ident.control.position_loop import Complex, LoopHardware, law_response
from edge_ident.signals.filters import Array, fast_length
from firmware_interface.control_law import NOTHING, deadband_nm, feedforward_nm
from firmware_interface.gains import AxisGains
from firmware_interface.motion import Reference

_REPETITIONS: Final = 12
_FOLLOWING: Final = 3  # repetitions where a loop changed little
# Largest number of looks at a clipped effort. What it lacks asks for more later on, so each look
# tells the truth for about one response time more.
_CLIPPINGS: Final = 100
_ALIKE: Final = 1e-3  # share of the effort limit that decides nothing
# Share of the top speed in which friction turns round at once; a jump converges badly.
_AT_ONCE: Final = 0.0005
# Time in which the end of a path leads back to its begin: a loop forgets within that.
_CLOSING_S: Final = 0.5
_LOWEST_RAD_S: Final = 1e-3
# Drives that are looked at together: what that takes stays in a processor's cache.
_TOGETHER: Final = 5


@dataclass(frozen=True)
class Path:
    """Where one axis should be, evenly sampled.

    Attributes
    ----------
    reference : Reference
        (N,) arrays.
    period_s : float
        Between its samples; the law's own may be shorter.
    begin : int
        Samples of the lead-in, of which the error is not asked. The law's memory begins empty
        with it.
    other : Reference or None
        That of the other axis, for the law's cross terms.
    """

    reference: Reference
    period_s: float
    begin: int = 0
    other: Reference | None = None


@dataclass(frozen=True)
class Loads:
    """What D drives need along a path.

    Attributes
    ----------
    base : (D, 4) array
        Parameters of the base model.
    beside : (D, N) array
        Effort beyond the base model's.
    turning : (D,) array
        Distance in which dry friction turns round after a reversal: it then acts through a spring.
    noise : (D, N) array
        What the encoder reads too much.
    """

    base: Array
    beside: Array
    turning: Array
    noise: Array


def tracking_errors(path: Path, loads: Loads, gains: AxisGains, hardware: LoopHardware) -> Array:
    """Reference less position, (D, N), from the begin of the motion on.

    The loop must be stable, which nothing here checks.

    Parameters
    ----------
    path : Path
    loads : Loads
    gains : AxisGains
    hardware : LoopHardware
    """
    spectra = _Spectra.of(path)
    forward = spectra.of_rows(_fed_forward(path, gains, spectra, hardware.sample_period_s))
    found = np.empty((len(loads.beside), spectra.samples - path.begin))
    for at in range(0, len(found), _TOGETHER):
        part = slice(at, at + _TOGETHER)
        some = Loads(loads.base[part], loads.beside[part], loads.turning[part], loads.noise[part])
        loop = _Loop.of(spectra, some, gains, hardware)
        errors = _errors(path.reference, some, loop, forward, hardware.effort_limit_nm)
        found[part] = errors[:, path.begin :]
    return found


def _errors(
    reference: Reference, loads: Loads, loop: "_Loop", forward: Complex, limit_nm: float
) -> Array:
    """Reference less position, (D, N), along a whole path."""
    spectra, (inertia, viscous, _, offset) = loop.spectra, loads.base.T[..., None]
    needed = (
        loads.beside
        + inertia * reference.acceleration_rad_s2
        + viscous * reference.velocity_rad_s
        + offset
    )
    linear = loop.compliance * (spectra.of_rows(needed) - loop.late * forward)
    start = np.broadcast_to(reference.velocity_rad_s, loads.beside.shape)
    error, state = loop.with_friction(linear, reference.velocity_rad_s, start, _REPETITIONS)
    lacking = np.zeros(())
    for _ in range(_CLIPPINGS):
        command = spectra.back(forward + loop.law * error)
        beyond = command - np.clip(command, -limit_nm, limit_nm)
        if np.max(np.abs(beyond - lacking)) <= _ALIKE * limit_nm:
            break
        lacking = beyond
        less = loop.compliance * loop.late * spectra.of_rows(lacking)
        error, state = loop.with_friction(
            linear + less, reference.velocity_rad_s, state, _FOLLOWING
        )
    read = loop.compliance * loop.late * loop.law * spectra.of_rows(loads.noise)
    return spectra.back(error + read)


@dataclass(frozen=True)
class _Loop:
    """Responses (D, K) of the closed loops of D drives.

    Attributes
    ----------
    compliance : (D, K) array
        Error by effort that the axis needs.
    law : (K,) array
        Effort that the law commands by error.
    late : (K,) array
        Effort that acts by effort that is commanded.
    base : (D, 4) array
    turning : (D,) array
        As of the loads.
    step : (D, 1) array
        Of the splitting, speed over effort.
    """

    spectra: "_Spectra"
    compliance: Complex
    law: Complex
    late: Complex
    base: Array
    turning: Array
    step: Array

    @classmethod
    def of(
        cls, spectra: "_Spectra", loads: Loads, gains: AxisGains, hardware: LoopHardware
    ) -> "_Loop":
        s = 1j * spectra.omega
        inertia, viscous, *_ = loads.base.T[..., None]
        axis = 1.0 / (s * (inertia * s + viscous))
        late = np.exp(-s * (hardware.control_delay_s + 0.5 * hardware.sample_period_s))
        law = law_response(gains, spectra.omega, hardware.sample_period_s)
        step = 1.0 / (gains.derivative + viscous)
        compliance = axis / (1.0 + axis * law * late)
        return cls(spectra, compliance, law, late, loads.base, loads.turning, step)

    def with_friction(
        self, linear: Complex, velocity: Array, state: Array, repetitions: int
    ) -> tuple[Complex, Array]:
        """Spectra (D, K) of the error, from those without dry friction, and the splitting's state.

        Where the splitting begins is where it ended for nearly the same loop, else the reference's
        speed.
        """
        s, spectra, step = 1j * self.spectra.omega, self.spectra, self.step
        coulomb = self.base[:, 2:3]
        at_once = _AT_ONCE * float(np.max(np.abs(velocity)))
        # velocity(friction) = free - mobility · friction, and friction = coulomb · sign(velocity)
        mobility = s * (self.compliance + self.turning[:, None] / (2.0 * coulomb))
        free = spectra.of_rows(velocity) - s * linear
        friction: Array = np.zeros(())
        for _ in range(repetitions):
            both = mobility * spectra.of_rows(state) + step * free
            follows = spectra.back(both / (mobility + step))
            friction = _friction(2.0 * follows - state, step, coulomb, at_once)
            state = follows - step * friction
        return np.asarray(linear + self.compliance * spectra.of_rows(friction)), state


@dataclass(frozen=True)
class _Spectra:
    """Spectra of signals along a path, which is closed by an arc so that it repeats.

    Attributes
    ----------
    omega : (K,) array
        rad/s; that of the mean is a little above zero, where an axis that is not held drifts away.
    samples, arc : int
        Of the path, and of what closes it.
    """

    omega: Array
    samples: int
    arc: int

    @classmethod
    def of(cls, path: Path) -> "_Spectra":
        samples = len(path.reference.velocity_rad_s)
        whole = fast_length(samples + int(_CLOSING_S / path.period_s))
        omega = 2.0 * np.pi * np.fft.rfftfreq(whole, path.period_s)
        return cls(np.maximum(omega, _LOWEST_RAD_S), samples, whole - samples)

    def of_rows(self, signals: Array) -> Complex:
        """Spectra (..., K) of signals (..., N)."""
        share = 0.5 - 0.5 * np.cos(np.pi * np.arange(1, self.arc + 1) / (self.arc + 1))
        first, last = signals[..., :1], signals[..., -1:]
        return np.fft.rfft(np.concatenate([signals, last + (first - last) * share], axis=-1))

    def back(self, spectra: Complex) -> Array:
        """Signals (..., N) of spectra (..., K)."""
        found = np.fft.irfft(spectra, self.samples + self.arc)[..., : self.samples]
        return np.asarray(found, dtype=np.float64)


def _friction(pushed: Array, step: Array, coulomb: Array, turning: float) -> Array:
    """Friction f of the speed v that obeys v + step · f = pushed."""
    return np.clip(coulomb * pushed / (turning + step * coulomb), -coulomb, coulomb)


def _fed_forward(path: Path, gains: AxisGains, spectra: _Spectra, period_s: float) -> Array:
    """What the law gives beyond its feedback of the error, (N,).

    Its damping acts on the reference's speed as it is, less the encoder's, which is filtered. It
    leads the reference across the backlash. The inverse of the dead band is taken at the effort
    without feedback, of which little is left in a loop that follows.
    """
    reference, s = path.reference, 1j * spectra.omega
    memory = NOTHING.along(
        gains, np.concatenate([reference.position_rad[:1], reference.position_rad])
    )
    forward = deadband_nm(gains, feedforward_nm(gains, reference, np, path.other, memory), np)
    damping = replace(gains, proportional=0.0, integral=0.0)
    filtered = law_response(damping, spectra.omega, period_s) / s
    beyond = spectra.of_rows(reference.velocity_rad_s) * (gains.derivative - filtered)
    if "backlash" in gains.terms:
        holding = law_response(replace(gains, derivative=0.0), spectra.omega, period_s)
        beyond = beyond + holding * spectra.of_rows(memory.backlash_rad)
    return np.asarray(forward + spectra.back(beyond))
