"""Closed loop of sampled control and a continuous machine."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Any, Final, Protocol

import numpy as np
from numpy.typing import NDArray

from edge_ident.simulation.references import References
from firmware_interface.control_law import deadband_nm, feedforward_nm
from firmware_interface.gains import AxisGains
from firmware_interface.law_memory import NOTHING
from firmware_interface.motion import Reference

Array = NDArray[np.float64]

_PROGRESS_SAMPLES: Final = 200


class Plant(Protocol):
    """What is controlled: A axes of D drives."""

    @property
    def position(self) -> Array:
        """True positions (A, D)."""

    @property
    def velocity(self) -> Array:
        """True velocities (A, D)."""

    @property
    def reading(self) -> Array:
        """What the encoders read (A, D), before they count."""

    def set_time(self, time_s: float) -> None:
        """Set the clock."""

    def advance(self, before: Array, command: Array) -> None:
        """Let a sample pass: first under the command (A, D) before, then under the new one."""

    def recorded(self, command: Array, time_s: Array) -> Array:
        """Effort columns (A, D, N) of the commands."""


@dataclass(frozen=True)
class Sampling:
    """What lies between machine and record.

    Attributes
    ----------
    encoder_resolution : (A,) array
        Position of one count, 0 for an exact encoder.
    effort_resolution : (A,) array
        Effort of one count, 0 for an exact one.
    noise : float
        White noise of the effort column over its rms value.
    """

    encoder_resolution: Array
    effort_resolution: Array
    noise: float = 0.0


@dataclass(frozen=True)
class Simulation:
    """What was recorded, and what truly happened; time zero is the first sample.

    Attributes
    ----------
    time_s : (N,) array
    position, effort : (A, D, N) arrays
        Columns as a board records them. The effort is the command, which acts from the control
        delay after its sample to that after the next, and its noise.
    true_position, true_velocity : (A, D, N) arrays
    """

    time_s: Array
    position: Array
    effort: Array
    true_position: Array
    true_velocity: Array


def simulate(
    plant: Plant,
    references: References,
    gains: Mapping[str, Sequence[AxisGains]],
    sampling: Sampling,
    *,
    seed: int = 0,
    on_progress: Callable[[int, int], None] = lambda done, total: None,
) -> Simulation:
    """Let drives follow a motion.

    Parameters
    ----------
    plant : Plant
        Standing where the references begin.
    references : References
    gains : mapping of axis name to sequence of AxisGains
        One for all drives, or one for each.
    sampling : Sampling
    seed : int
        Of the noise.
    on_progress : callable
        Called with samples done and samples in all.
    """
    columns = _followed(plant, references, gains, sampling, on_progress)
    recorded = references.time_s > -0.5 * references.period_s
    effort = plant.recorded(columns[3], references.time_s)[..., recorded]
    with np.errstate(over="ignore"):  # the caller says so where a drive runs away
        rms = np.sqrt(np.mean(effort**2, axis=-1, keepdims=True))
    noise = np.random.default_rng(seed).normal(size=effort.shape)
    read, position, velocity = columns[:3, ..., recorded]
    return Simulation(
        time_s=references.time_s[recorded],
        position=read,
        effort=effort + sampling.noise * rms * noise,
        true_position=position,
        true_velocity=velocity,
    )


def _followed(
    plant: Plant,
    references: References,
    gains: Mapping[str, Sequence[AxisGains]],
    sampling: Sampling,
    on_progress: Callable[[int, int], None],
) -> Array:
    """What is read, true positions and velocities, and commands: (4, A, D, N)."""
    period_s, total = references.period_s, len(references.time_s)
    encoder, converter = (
        Counting(r[:, None]) for r in (sampling.encoder_resolution, sampling.effort_resolution)
    )
    controllers = Controllers(gains, period_s, encoder.counted(plant.reading))
    samples = np.empty((total, 4, *plant.position.shape))
    command = np.zeros(plant.position.shape)
    plant.set_time(float(references.time_s[0]))
    for k, reference in enumerate(references.samples):
        read = encoder.counted(plant.reading)
        before, wanted = command, controllers.effort(reference, read)
        command = converter.counted(wanted)
        samples[k] = read, plant.position, plant.velocity, command
        plant.advance(before, command)
        if k % _PROGRESS_SAMPLES == 0:
            on_progress(k, total)
    on_progress(total, total)
    return np.ascontiguousarray(np.moveaxis(samples, 0, -1))


class Counting:
    """Rounding to whole counts.

    Parameters
    ----------
    resolution : array
        One count; a resolution of zero leaves a value as it is.
    """

    def __init__(self, resolution: Array) -> None:
        self._counts = resolution > 0.0
        self._all, self._none = bool(self._counts.all()), not self._counts.any()
        self._step = np.where(self._counts, resolution, 1.0)

    def counted(self, values: Array) -> Array:
        """Round values that broadcast with the resolution."""
        if self._none:
            return values
        rounded = np.rint(values / self._step) * self._step
        return np.asarray(rounded if self._all else np.where(self._counts, rounded, values))


# The control law of the board (`firmware_interface.control_law`), many drives at once.

_COUPLED: Final = 2
"""Axes among which each has one other."""


class Controllers:
    """What the laws remember: last position and reference, filtered velocity, and states.

    Parameters
    ----------
    gains : mapping of axis name to sequence of AxisGains
        One for all drives, or one for each.
    period_s : float
    position : (A, D) array
        Where the axes stand.
    """

    def __init__(
        self, gains: Mapping[str, Sequence[AxisGains]], period_s: float, position: Array
    ) -> None:
        stacked: dict[str, Any] = {
            field.name: _stacked(field.name, gains.values(), position.shape[1])
            for field in fields(AxisGains)
        }
        self._gains = AxisGains(**stacked)
        self._period_s = period_s
        self._last = position.copy()
        self._velocity = np.zeros(position.shape)
        self._integral = np.zeros(position.shape)
        self._memory = NOTHING
        self._reference: Array | None = None

    def effort(self, reference: Array, position: Array) -> Array:
        """Efforts (A, D) for the positions just read.

        Parameters
        ----------
        reference : (3, A) array
            Position, velocity and acceleration wanted now.
        position : (A, D) array
        """
        gains, period_s = self._gains, self._period_s
        setpoint, other = Reference(*reference[:, :, None]), None
        if "cross" in gains.terms and len(position) == _COUPLED:
            other = Reference(*reference[:, ::-1, None])
        difference = (position - self._last) / period_s
        self._last = position.copy()
        share = period_s / (gains.velocity_filter_s + period_s)
        self._velocity += share * (difference - self._velocity)
        error = self._followed(setpoint.position_rad) - position
        self._integral += gains.integral * error * period_s
        feedback = (
            gains.proportional * error
            + gains.derivative * (setpoint.velocity_rad_s - self._velocity)
            + self._integral
        )
        effort = feedforward_nm(gains, setpoint, np, other, self._memory, feedback)
        return np.asarray(deadband_nm(gains, effort, np))

    def _followed(self, reference: Array) -> Array:
        """The reference with the way across the backlash."""
        if not self._gains.terms & {"presliding", "backlash"}:
            return reference
        before = reference if self._reference is None else self._reference
        self._memory = self._memory.after(self._gains, reference - before, np)
        self._reference = reference
        return np.asarray(reference + self._memory.backlash_rad)


def _stacked(name: str, gains: Iterable[Sequence[AxisGains]], drives: int) -> Array:
    """One number of the law (A, D), or one table (K, A, D)."""
    rows = [np.array([getattr(g, name) for g in of_axis]).T for of_axis in gains]
    return np.stack([np.broadcast_to(r, (*r.shape[:-1], drives)) for r in rows], axis=-2)
