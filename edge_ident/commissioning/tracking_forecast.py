"""The tracking error that gains will have on a motion that was recorded, with its interval.

The record tells the effort that the motion needed, whatever the model says: what the model leaves
unexplained is replayed as a disturbance. So the model answers one question only, what other gains
make of the same need (`edge_ident.simulation.loop_response`). `DRAWS` drives do it side by side.
They differ in all that is not known:

- the base parameters and those of the effects, within their deviations, which hold the fit's noise
  and the spread between the regimes of the motion;
- the time by which effort and position are apart in the record, within its deviation;
- how friction turns round, which no encoder resolves: at once, or over a fiftieth of the top speed;
- whether what is unexplained belongs to the place in the motion and comes back, or is new each
  time: each drive has a mixture of what was seen and of other noise with the same spectrum;
- where the encoder's counts lie.

The errors are read as a board reports them, in whole counts. Of 19 equal draws a twentieth lies
between the smallest and the largest in 18 of 20 cases: this is the 90 % interval.

Terms that are tied to time (`Effect.tied_to_time`) are left to what is unexplained.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.control.gain_design import worst_margins
from edge_ident.control.position_loop import LoopHardware
from edge_ident.diagnosis.measures import NO_SHIFT, Timing
from edge_ident.estimation.compensation import compensate_effects
from edge_ident.identification.result import Identification
from edge_ident.model.effect import Motion
from edge_ident.model.effects import named
from edge_ident.model.inverse import inverse_effort
from edge_ident.model.model import AxisModel, Model, Term
from edge_ident.signals.conditioning import bridge
from edge_ident.signals.filters import differentiate, lowpass
from edge_ident.signals.recording import AxisRecord, Recording
from edge_ident.simulation.loop_response import Loads, Path, tracking_errors
from firmware_interface.gains import AxisGains
from firmware_interface.motion import Reference, Trajectory, reference

Array = NDArray[np.float64]

DRAWS: Final = 19
_TURNING: Final = (0.001, 0.02)
"""Share of the top speed over which friction turns round: from what the repetition bears to where
the board's own feed-forward turns."""
_LOOKS: Final = 4.0
"""In which the stiffest loop turns by one radian."""
_TINY: Final = 1e-12
_LEAST_SHARE: Final = 0.1
"""Of an inertia or friction that a draw leaves: they are positive."""


@dataclass(frozen=True)
class Grounds:
    """What a forecast knows of a drive.

    Attributes
    ----------
    model : Model
        Its terms carry their deviations.
    timing : mapping of axis name to Timing
        By which the effort is recorded late; an axis that is not named is in step.
    diagnosed : mapping of axis name to tuple of str
        Effects that a diagnosis put into the model.
    """

    model: Model
    timing: Mapping[str, Timing]
    diagnosed: Mapping[str, tuple[str, ...]]

    @classmethod
    def of(cls, found: Identification) -> "Grounds":
        """What an identification tells."""
        return cls(
            found.model,
            {name: axis.timing for name, axis in found.axes.items()},
            {
                name: axis.compensated_effects if axis.diagnosis is not None else ()
                for name, axis in found.axes.items()
            },
        )


@dataclass(frozen=True)
class Moved:
    """A motion that was recorded, and where its axes should have been.

    Attributes
    ----------
    recording : Recording
    ways : mapping of axis name to Reference
        At the recording's samples.
    """

    recording: Recording
    ways: Mapping[str, Reference]

    @classmethod
    def along(cls, recording: Recording, trajectory: Trajectory) -> "Moved":
        """The beginning of a recording, as long as the trajectory that it follows."""
        wanted_s = trajectory.duration_s
        part = recording.time_s - recording.time_s[0] < wanted_s - 1e-9
        record = _cut(recording, int(np.sum(part)))
        time_s = record.time_s - record.time_s[0]
        ways = {
            name: reference(motion, time_s, trajectory.lead_in_s, float(_wanted(axis)[0]))
            for name, motion in trajectory.axes.items()
            for axis in (record.axes[name],)
        }
        return cls(record, ways)

    @classmethod
    def of(cls, recording: Recording, cutoff_hz: float) -> "Moved":
        """A recording whose trajectory is not known: its reference, filtered."""
        period_s = _period_s(recording)
        return cls(
            recording,
            {
                name: Reference(*differentiate(_wanted(axis), cutoff_hz, period_s))
                for name, axis in recording.axes.items()
            },
        )

    def errors(self, name: str) -> Array:
        """Reference less position as recorded, (N,)."""
        axis = self.recording.axes[name]
        return np.asarray(_wanted(axis) - axis.position)


@dataclass(frozen=True)
class Drawn:
    """Tracking errors of one axis and bank, by drawn drive.

    Attributes
    ----------
    rms_rad, peak_rad : (DRAWS,) arrays
        Infinite for a loop that would be unstable.
    """

    rms_rad: Array
    peak_rad: Array


def drawn_errors(
    moved: Moved,
    grounds: Grounds,
    hardware: Mapping[str, LoopHardware],
    banks: Sequence[Mapping[str, AxisGains]],
) -> tuple[Mapping[str, Drawn], ...]:
    """Of every bank, by axis; the draws of all banks are the same drives.

    Parameters
    ----------
    moved : Moved
    grounds : Grounds
    hardware : mapping of axis name to LoopHardware
    banks : sequence of mapping of axis name to AxisGains

    Raises
    ------
    ModelError
        The model does not fit the recording.
    """
    found: tuple[dict[str, Drawn], ...] = tuple({} for _ in banks)
    for name, of in hardware.items():
        every = _every([bank[name] for bank in banks], grounds.model.axes[name], of)
        path = Path(_thinned(moved.ways[name], every), every * of.sample_period_s)
        loads = _loads(name, moved, grounds, of, every)
        for drawn, bank in zip(found, banks, strict=True):
            drawn[name] = _drawn(path, loads, bank[name], of, grounds.model.axes[name])
    return found


def _every(gains: Sequence[AxisGains], axis: AxisModel, hardware: LoopHardware) -> int:
    """Samples from one to the next that the forecast looks at."""
    stiffest = max(of_bank.proportional for of_bank in gains)
    fastest = math.sqrt(max(stiffest / float(axis.parameters[0]), _TINY))
    return max(1, int(1.0 / (_LOOKS * fastest * hardware.sample_period_s)))


def _thinned(way: Reference, every: int) -> Reference:
    return Reference(
        way.position_rad[::every], way.velocity_rad_s[::every], way.acceleration_rad_s2[::every]
    )


def _drawn(
    path: Path, loads: Loads, gains: AxisGains, hardware: LoopHardware, axis: AxisModel
) -> Drawn:
    phase_margin, gain_margin = worst_margins(gains, axis, hardware)
    if phase_margin <= 0.0 or gain_margin <= 1.0:
        return Drawn(np.full(DRAWS, np.inf), np.full(DRAWS, np.inf))
    errors, wanted = tracking_errors(path, loads, gains, hardware), path.way.position_rad
    if count := hardware.encoder_resolution_rad:
        errors = count * (np.round(wanted / count) - np.round((wanted - errors) / count))
    return Drawn(np.sqrt(np.mean(errors**2, axis=-1)), np.max(np.abs(errors), axis=-1))


def _loads(name: str, moved: Moved, grounds: Grounds, hardware: LoopHardware, every: int) -> Loads:
    """What the drawn drives of one axis need along the motion, every so many samples."""
    rng = np.random.default_rng(0)
    axis, timing = _lasting(grounds.model.axes[name]), grounds.timing.get(name, NO_SHIFT)
    recording, late_s = moved.recording, timing.shift_s + _delay_s(grounds.model.axes[name])
    drawn = _draws(axis, rng)
    signals = compensate_effects(recording, name, None, late_s=late_s).signals
    late_by_s = timing.std_samples * hardware.sample_period_s * rng.normal(size=(DRAWS, 1))
    effort = signals.effort + late_by_s * np.gradient(signals.effort, signals.period_s)
    left = effort - drawn.parameters @ signals.regressor.T
    wanted: Array = np.zeros(())
    if len(axis.terms) > 1:
        made = _effects(drawn, _motions(recording, signals.cutoff_hz), name)
        left = left - lowpass(made, signals.cutoff_hz, signals.period_s)
        wanted = _effects(drawn, _wanted_motions(moved), name)
        wanted = wanted[..., ::every]
    unexplained = _mixed(bridge(left, signals.moving)[..., ::every], rng)
    turning = _TURNING[0] * (_TURNING[1] / _TURNING[0]) ** rng.uniform(size=DRAWS)
    # fewer samples span a narrower band, and the noise has its density
    count = hardware.encoder_resolution_rad / math.sqrt(every)
    noise = count * rng.uniform(-0.5, 0.5, unexplained.shape)
    return Loads(drawn.parameters, wanted + unexplained, turning, noise)


def _lasting(axis: AxisModel) -> AxisModel:
    """The axis with what will be the same at another time, and acts on it."""
    terms = (
        term
        for term in axis.terms[1:]
        if not (named(term.effect).tied_to_time or named(term.effect).effort_delay)
    )
    return replace(axis, terms=(axis.terms[0], *terms))


def _delay_s(axis: AxisModel) -> float:
    delays = ((term, named(term.effect).effort_delay) for term in axis.terms)
    return sum(float(term.values[delay]) for term, delay in delays if delay)


def _draws(axis: AxisModel, rng: np.random.Generator) -> AxisModel:
    """The axis with (DRAWS,) values of every parameter."""
    return replace(axis, terms=tuple(_drawn_term(term, rng) for term in axis.terms))


def _drawn_term(term: Term, rng: np.random.Generator) -> Term:
    bounds = named(term.effect).bounds
    values = {}
    for name, value in named(term.effect).complete(term.values).items():
        drawn = float(value) + term.std.get(name, 0.0) * rng.normal(size=DRAWS)
        low, high = bounds[name]
        least = _LEAST_SHARE * float(value) if low >= 0.0 else low
        values[name] = np.clip(drawn, max(low, least), high)
    return replace(term, values=values)


def _effects(axis: AxisModel, motions: Mapping[str, Motion], name: str) -> Array:
    """Effort (DRAWS, N) of all but the base term."""
    others = {other: motion for other, motion in motions.items() if other != name}
    base = replace(axis, terms=axis.terms[:1])
    return inverse_effort(axis, motions[name], others) - inverse_effort(base, motions[name])


def _motions(recording: Recording, cutoff_hz: float) -> dict[str, Motion]:
    period_s = _period_s(recording)
    return {
        name: Motion.known(recording.time_s, *differentiate(axis.position, cutoff_hz, period_s))
        for name, axis in recording.axes.items()
    }


def _wanted_motions(moved: Moved) -> dict[str, Motion]:
    return {
        name: Motion.known(
            moved.recording.time_s, way.position_rad, way.velocity_rad_s, way.acceleration_rad_s2
        )
        for name, way in moved.ways.items()
    }


def _mixed(left: Array, rng: np.random.Generator) -> Array:
    """Part of what was seen, and part of other noise of the same spectrum, (DRAWS, N)."""
    mean = left.mean(axis=-1, keepdims=True)
    spectrum = np.fft.rfft(left - mean)
    other = np.fft.irfft(
        spectrum * np.exp(2j * np.pi * rng.uniform(size=spectrum.shape)), left.shape[-1]
    )
    part = rng.uniform(0.0, 0.5 * np.pi, (len(left), 1))
    return np.asarray(mean + np.cos(part) * (left - mean) + np.sin(part) * other)


def _wanted(axis: AxisRecord) -> Array:
    """Commanded position; where none was recorded, the axis is taken to have followed."""
    return axis.position if axis.reference is None else axis.reference


def _period_s(recording: Recording) -> float:
    return float(recording.time_s[-1] - recording.time_s[0]) / (len(recording.time_s) - 1)


def _cut(recording: Recording, samples: int) -> Recording:
    axes = {
        name: replace(
            axis,
            position=axis.position[:samples],
            effort=axis.effort[:samples],
            reference=None if axis.reference is None else axis.reference[:samples],
        )
        for name, axis in recording.axes.items()
    }
    return replace(recording, time_s=recording.time_s[:samples], axes=axes)
