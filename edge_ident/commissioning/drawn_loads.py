"""Drives like the identified one, and what they need along a motion that was recorded.

They differ in all that is not known, as `edge_ident.commissioning.tracking_forecast` says.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Final

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from edge_ident.control.position_loop import LoopHardware
from edge_ident.diagnosis.prepare.bandwidth import run_in
from edge_ident.errors import DataError
from edge_ident.estimation.compensation import compensate_effects
from edge_ident.estimation.known_effects import without_delay
from edge_ident.identification.result import Identification
from edge_ident.model.effects import named
from edge_ident.model.inverse import along_motion, base_at, inverse_effort, remembers
from edge_ident.model.model import PARAMETERS, AxisModel, Model, Term
from edge_ident.model.motion import NO_SHIFT, Array, Motion, Timing
from edge_ident.model.repeating import OVER_POSITION, OVER_SPEED, Repeating
from edge_ident.signals.conditioning import Signals, choose_cutoff, filtered_regressor
from edge_ident.signals.filters import differentiate, lowpass
from edge_ident.signals.recording import AxisRecord, Recording
from edge_ident.simulation.loop_response import Loads
from firmware_interface.motion import Multisine, Reference, Staircase, Trajectory, reference

_REMEMBERED_S: Final = 2.0  # last part of the lead-in that a loop may remember


@dataclass(frozen=True)
class RecordedMotion:
    """A motion that was recorded, and where its axes should have been.

    Attributes
    ----------
    recording : Recording
    references : mapping of axis name to Reference
        Where each axis should be: in the last part of the lead-in, then at the recording's samples.
    begin : int
        Samples of the lead-in.
    """

    recording: Recording
    references: Mapping[str, Reference]
    begin: int = 0

    @classmethod
    def along(cls, recording: Recording, trajectory: Trajectory) -> "RecordedMotion":
        """The beginning of a recording, as long as the trajectory that it follows."""
        wanted_s = trajectory.duration_s
        part = recording.time_s - recording.time_s[0] < wanted_s - 1e-9
        record = beginning(recording, int(np.sum(part)))
        period_s = _period_s(record)
        begin = int(min(trajectory.lead_in_s, _REMEMBERED_S) / period_s)
        time_s = period_s * np.arange(-begin, len(record.time_s))
        references = {
            name: reference(motion, time_s, trajectory.lead_in_s, _rest_rad(motion, axis))
            for name, motion in trajectory.axes.items()
            for axis in (record.axes[name],)
        }
        return cls(record, references, begin)

    @classmethod
    def of(cls, recording: Recording, axes: Sequence[str]) -> "RecordedMotion":
        """A recording whose trajectory is not known: its references, filtered.

        Raises
        ------
        DataError
            The recording lacks an axis.
        """
        references = {}
        for name in axes:
            if name not in recording.axes:
                raise DataError(
                    f"{recording.source}: it has axes {', '.join(recording.axes)}, not {name}",
                    "give a recording of this drive, or rename columns with --column",
                )
            axis, period_s = recording.axes[name], _period_s(recording)
            cutoff_hz = choose_cutoff(axis.position, period_s)
            references[name] = Reference(*differentiate(_wanted(axis), cutoff_hz, period_s))
        return cls(recording, references)

    @property
    def period_s(self) -> float:
        """Sampling period."""
        return _period_s(self.recording)

    def errors(self, name: str) -> Array:
        """Reference less position as recorded, (N,)."""
        axis = self.recording.axes[name]
        return np.asarray(_wanted(axis) - axis.position)

    def motions(self, cutoff_hz: float) -> dict[str, Motion]:
        """As the axes went, filtered, at the recording's samples."""
        period_s = _period_s(self.recording)
        return {
            name: Motion.known(
                self.recording.time_s, *differentiate(axis.position, cutoff_hz, period_s)
            )
            for name, axis in self.recording.axes.items()
        }

    def wanted_motions(self) -> dict[str, Motion]:
        """As the axes should go, the last part of the lead-in included."""
        period_s = _period_s(self.recording)
        return {
            name: Motion.known(
                np.asarray(
                    period_s * (np.arange(len(wanted.position_rad)) - self.begin), np.float64
                ),
                wanted.position_rad,
                wanted.velocity_rad_s,
                wanted.acceleration_rad_s2,
            )
            for name, wanted in self.references.items()
        }


def _rest_rad(motion: Multisine | Staircase, axis: AxisRecord) -> float:
    """Where the axis stood before: zero, unless the motion counts from there."""
    return float(_wanted(axis)[0]) if isinstance(motion, Staircase) else 0.0


def _wanted(axis: AxisRecord) -> Array:
    """Commanded position; where none was recorded, the axis is taken to have followed."""
    return axis.position if axis.reference is None else axis.reference


def _period_s(recording: Recording) -> float:
    return float(recording.time_s[-1] - recording.time_s[0]) / (len(recording.time_s) - 1)


def beginning(recording: Recording, samples: int) -> Recording:
    """The first samples of a board's recording."""
    axes = {
        name: replace(
            axis,
            position=axis.position[:samples],
            effort=axis.effort[:samples],
            reference=None if axis.reference is None else axis.reference[:samples],
            velocity=None,
            temperature_c=None,
        )
        for name, axis in recording.axes.items()
    }
    return replace(recording, time_s=recording.time_s[:samples], axes=axes)


_BASE: Final = len(PARAMETERS)
_ENTRIES: Final = OVER_SPEED + OVER_POSITION
_LEAST_FRICTION: Final = 0.1  # least share of its dry friction that an axis keeps
# Encoder counts within which friction turns round at once, as far as a loop feels it.
_AT_ONCE: Final = 0.01


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
    end_s : mapping of axis name to float
        When the recording that the model was made from ended, since its first sample: in the state
        that it had then, the drive goes on.
    repeating : mapping of axis name to Repeating
        Effort beside the model's that comes back over speed and stroke.
    spread : mapping of axis name to (B, 4 + R) array
        How base parameters and entries of what repeats may be off together
        (`edge_ident.identification.effective`); without it, the terms' deviations say it.
    drift : mapping of axis name to (2,) array
        Deviation of Coulomb friction and offset from one motion to the next.
    """

    model: Model
    timing: Mapping[str, Timing]
    diagnosed: Mapping[str, tuple[str, ...]]
    end_s: Mapping[str, float] = field(default_factory=dict)
    repeating: Mapping[str, Repeating] = field(default_factory=dict)
    spread: Mapping[str, Array] = field(default_factory=dict)
    drift: Mapping[str, Array] = field(default_factory=dict)

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
            {name: axis.end_s for name, axis in found.axes.items()},
        )

    def moved(self, name: str, rng: np.random.Generator) -> Array | None:
        """By how much base parameters and entries of drawn axes differ, (1 + DRAWS, 4 + R)."""
        spread = self.spread.get(name)
        if spread is None:
            return None
        draws = rng.normal(size=(DRAWS, len(spread))) @ spread
        return np.concatenate([np.zeros((1, draws.shape[1])), draws])


def drawn_loads(
    name: str, moved: RecordedMotion, grounds: Grounds, hardware: LoopHardware, every: int
) -> tuple[Loads, Loads]:
    """What the drawn drives of one axis need, at every so many samples.

    Parameters
    ----------
    name : str
        Of the axis.
    moved : RecordedMotion
    grounds : Grounds
    hardware : LoopHardware
    every : int
        Samples from one to the next.

    Returns
    -------
    recorded, then : Loads
        In the course of the recording; and later, in the state in which the drive goes on, or with
        what belonged to the time of the recording once more.

    Raises
    ------
    ModelError
        The model does not fit the recording.
    """
    rng = np.random.default_rng(0)
    delay_s, acting = without_delay(grounds.model.axes[name].terms[1:])
    recording = _as_given(moved.recording, name, acting)
    timing = grounds.timing.get(name, NO_SHIFT)
    signals = compensate_effects(recording, name, None, late_s=timing.shift_s + delay_s).signals
    off = grounds.moved(name, rng)
    drawn = drawn_axis(_unlimited(grounds.model.axes[name], acting), rng, off)
    repeating = _drawn_repeating(grounds.repeating.get(name), off)
    lasting = from_then_on(drawn, grounds.end_s.get(name))
    during = then = _Need.of(drawn, repeating, moved, signals, name, every)
    if lasting is not drawn:
        then = _Need.of(lasting, repeating, moved, signals, name, every)
    position = signals.grid.resampled(recording.axes[name].position)
    known = _known(signals, position, drawn, hardware.encoder_resolution_rad)
    # a motion after that of the identification begins in the state in which that one ended
    recorded = min((during, then), key=lambda need: need.misses(signals.effort, known))
    # a row for each drive is large: none has a name that is not needed any more
    unexplained = drawn_unexplained(
        _late(signals, timing.std_samples * hardware.sample_period_s, rng, every)
        - recorded.made[0],
        known[::every],
        encoder_replicas(recorded.axis.parameters[0], signals, position, rng, every),
        rng,
    )
    # what deviations of the parameters explain is no noise: it comes back
    unexplained += np.where(known[::every], recorded.made[0] - recorded.made[1:], 0.0)
    unexplained = np.pad(unexplained, ((0, 0), (moved.begin // every, 0)))
    turning, encoder = _unseen(hardware, every, unexplained.shape, rng)

    def loads(need: _Need) -> Loads:
        beside = need.wanted[1:, moved.begin % every :: every] + unexplained
        return Loads(need.axis.parameters[1:], beside, turning, encoder)

    in_recording = loads(recorded)
    later = in_recording if during is then else _either(loads(during), loads(then))
    return in_recording, _drifted(later, grounds.drift.get(name), rng)


def _unseen(
    hardware: LoopHardware, every: int, shape: tuple[int, ...], rng: np.random.Generator
) -> tuple[Array, Array]:
    """Distance in which friction turns round, and what the encoder reads too much."""
    # no encoder shows how friction turns round within a count: a length of unknown order
    turning = hardware.encoder_resolution_rad * _AT_ONCE ** rng.uniform(size=DRAWS)
    # fewer samples span a narrower band, in which the noise must have the same density
    count = hardware.encoder_resolution_rad / math.sqrt(every)
    return turning, count * rng.uniform(-0.5, 0.5, shape)


def _drifted(loads: Loads, drift: Array | None, rng: np.random.Generator) -> Loads:
    """Loads with the friction and offset of another motion."""
    if drift is None:
        return loads
    base = loads.base.copy()
    base[:, 2:] += drift * rng.normal(size=(len(base), 2))
    base[:, 2] = np.maximum(base[:, 2], _LEAST_FRICTION * loads.base[:, 2])
    return replace(loads, base=base)


def _drawn_repeating(repeating: Repeating | None, off: Array | None) -> Repeating | None:
    """What repeats, of (1 + DRAWS) drives, its own entries first."""
    if repeating is None:
        return None
    entries = repeating.entries if off is None else repeating.entries + off[:, _BASE:]
    return replace(repeating, entries=np.broadcast_to(entries, (1 + DRAWS, _ENTRIES)))


def _late(signals: Signals, std_s: float, rng: np.random.Generator, every: int) -> Array:
    """Effort (DRAWS, K) with as many shifts, at every so many samples."""
    by_s = std_s * rng.normal(size=(DRAWS, 1))
    rate = np.gradient(signals.effort, signals.period_s)[::every]
    return np.asarray(signals.effort[::every] + by_s * rate)


def _known(
    signals: Signals, position: Array, axis: AxisModel, count_rad: float
) -> NDArray[np.bool_]:
    """Samples (N,) at which the direction of friction is known, and what effects remember.

    Slower than a count in half a period of the filter, no encoder shows a direction.
    """
    known = signals.moving & (np.abs(signals.regressor[:, 1]) > 2.0 * signals.cutoff_hz * count_rad)
    if remembers(axis.terms):
        known[: run_in(position)] = False
    return known


def _either(again: Loads, over: Loads) -> Loads:
    """Every second draw of each: nobody knows whether what belongs to time comes again."""
    odd = (np.arange(DRAWS) % 2 == 1)[:, np.newaxis]
    return replace(
        over,
        base=np.where(odd, again.base, over.base),
        beside=np.where(odd, again.beside, over.beside),
    )


@dataclass(frozen=True)
class _Need:
    """Effort that drawn axes need for a motion.

    Attributes
    ----------
    axis : AxisModel
        Drawn.
    own : (N,) array
        Of the model's own values, along the motion that was made, filtered.
    made : (1 + DRAWS, K) array
        The same of all, at every so many samples.
    wanted : (1 + DRAWS, M) array
        Of the effects alone, along the motion that was to be made, the way into it included.
    """

    axis: AxisModel
    own: Array
    made: Array
    wanted: Array

    @classmethod
    def of(
        cls,
        axis: AxisModel,
        repeating: Repeating | None,
        moved: RecordedMotion,
        signals: Signals,
        name: str,
        every: int,
    ) -> "_Need":
        made = np.asarray(axis.parameters @ signals.regressor.T)
        samples = len(moved.references[name].position_rad)
        wanted: Array = np.broadcast_to(0.0, (len(made), samples))
        if len(axis.terms) > 1:
            along = _effects(axis, moved.motions(signals.cutoff_hz), name)
            made += lowpass(along, signals.cutoff_hz, signals.period_s)
            wanted = _effects(axis, moved.wanted_motions(), name)
        if repeating is not None:
            _, velocity, direction, _ = signals.regressor.T
            position = moved.motions(signals.cutoff_hz)[name].position
            made += repeating.effort(position, velocity, direction)
            way = moved.references[name]
            asked = way.position_rad, way.velocity_rad_s, np.sign(way.velocity_rad_s)
            wanted = wanted + repeating.effort(*asked)
        return cls(axis, made[0].copy(), made[:, ::every].copy(), wanted)

    def misses(self, effort: Array, known: NDArray[np.bool_]) -> float:
        """How far the model's own values are from an effort (N,)."""
        return float(np.sum((effort - self.own)[known] ** 2))


def _as_given(recording: Recording, name: str, effects: Sequence[Term]) -> Recording:
    """The recording without what was commanded beyond a limit of the actuator."""
    axis, given = recording.axes[name], recording.axes[name].effort
    for term in effects:
        if named(term.effect).compensation.limit:
            given = given - named(term.effect).withheld(axis.effort, along_motion(term))
    return replace(recording, axes={**recording.axes, name: replace(axis, effort=given)})


def _unlimited(axis: AxisModel, effects: Sequence[Term]) -> AxisModel:
    """The axis with these effects, but without limits, which are the loop's."""
    kept = (term for term in effects if not named(term.effect).compensation.limit)
    return replace(axis, terms=(axis.terms[0], *kept))


def _effects(axis: AxisModel, motions: Mapping[str, Motion], name: str) -> Array:
    """Effort (1 + DRAWS, N) of all but the base term."""
    others = {other: motion for other, motion in motions.items() if other != name}
    base = replace(axis, terms=axis.terms[:1])
    return inverse_effort(axis, motions[name], others) - inverse_effort(base, motions[name])


# An axis with many values of its uncertain parameters, as recorded and from then on.

DRAWS: Final = 19
"""A twentieth equal draw lies between the smallest and the largest in 18 of 20 cases."""
# Least share of an inertia or friction that a draw leaves: they are positive.
_LEAST_SHARE: Final = 0.1


def drawn_axis(axis: AxisModel, rng: np.random.Generator, moved: Array | None = None) -> AxisModel:
    """The axis with (1 + DRAWS,) values of every parameter, its own first.

    Parameters
    ----------
    axis : AxisModel
    rng : Generator
    moved : (1 + DRAWS, 4) array, optional
        By how much the base parameters differ, where that is known of all together.
    """
    base, *others = axis.terms
    if moved is None:
        base = _drawn_term(base, rng)
    else:
        drawn = {name: float(base.values[name]) + moved[:, n] for n, name in enumerate(PARAMETERS)}
        base = replace(base, values=_within_bounds(base, drawn))
    return replace(axis, terms=(base, *(_drawn_term(term, rng) for term in others)))


def from_then_on(drawn: AxisModel, end_s: float | None) -> AxisModel:
    """Drawn axes after the recording that the model was made from.

    What belongs to the time of the recording will not be the same again. Where it changes base
    parameters, they stay as they are at its end.

    Parameters
    ----------
    drawn : AxisModel
    end_s : float or None
        End of the recording, where it is known, from its first sample on.
    """
    lasting = tuple(term for term in drawn.terms if not named(term.effect).tied_to_time)
    if len(lasting) == len(drawn.terms):
        return drawn
    if end_s is not None:
        each = [base_at(_one(drawn, n), end_s).parameters for n in range(1 + DRAWS)]
        values = dict(zip(PARAMETERS, np.array(each).T, strict=True))
        lasting = (replace(lasting[0], values=values), *lasting[1:])
    return replace(drawn, terms=lasting)


def _drawn_term(term: Term, rng: np.random.Generator) -> Term:
    values = {
        name: float(value) + term.std.get(name, 0.0) * np.append(0.0, rng.normal(size=DRAWS))
        for name, value in named(term.effect).complete(term.values).items()
    }
    return replace(term, values=_within_bounds(term, values))


def _within_bounds(term: Term, drawn: Mapping[str, Array]) -> dict[str, float | Array]:
    """Drawn values as far as physics allows them."""
    bounds = named(term.effect).bounds
    found: dict[str, float | Array] = {}
    for name, values in drawn.items():
        low, high = bounds[name]
        least = _LEAST_SHARE * float(values[0]) if low >= 0.0 else low
        found[name] = np.clip(values, max(low, least), high)
    return found


def _one(drawn: AxisModel, n: int) -> AxisModel:
    """One of the drawn axes."""
    terms = (
        replace(term, values={name: np.asarray(value)[n] for name, value in term.values.items()})
        for term in drawn.terms
    )
    return replace(drawn, terms=tuple(terms))


# Effort that a model leaves unexplained, and how much of it another motion will meet.
#
# Most of it may be nothing but the encoder's noise: differentiated twice and multiplied by the
# inertia, it looks like effort. No drive needs that. So the encoder's noise is taken out as Wiener
# does, frequency by frequency. Its spectrum is that of replicas: the same motion, read with counts
# that lie elsewhere. What stays may belong to the place in the motion and come back, or be new each
# time.
#
# An axis that stands takes any effort up to its friction, so nothing is seen there. Noise of the
# same spectrum stands in for it.
# Source: Wiener, Extrapolation, Interpolation, and Smoothing of Stationary Time Series (1949).

_NEIGHBOURS: Final = 4  # frequencies on either side over which a spectrum is averaged
_TINY: Final = 1e-30


def encoder_replicas(
    parameters: Array, signals: Signals, position: Array, rng: np.random.Generator, every: int = 1
) -> Array:
    """What noise of the encoder alone would leave unexplained by a base model, (DRAWS, M).

    The motion is read again with counts that lie elsewhere.

    Parameters
    ----------
    parameters : (4,) array
        Of the base model.
    signals : Signals
        Of the axis.
    position : (N,) array
        As recorded, evenly sampled.
    rng : Generator
    every : int
        Of the N samples, every so many are wanted.
    """
    cutoff_hz, period_s = signals.cutoff_hz, signals.period_s
    (true,) = differentiate(position, cutoff_hz, period_s, orders=[0])
    count = signals.encoder_count
    beyond = math.sqrt(max(signals.position_noise**2 - count**2 / 12.0, 0.0))
    of_true = (filtered_regressor(true, cutoff_hz, period_s) @ parameters)[::every]
    found = np.empty((DRAWS, len(of_true)))
    for row, lies in zip(found, rng.uniform(size=DRAWS), strict=True):
        read = true + beyond * rng.normal(size=len(true))
        if count:
            read = count * (np.round(read / count + lies) - lies)
        row[:] = (filtered_regressor(read, cutoff_hz, period_s) @ parameters)[::every] - of_true
    return found


def drawn_unexplained(
    left: Array, known: NDArray[np.bool_], replicas: Array, rng: np.random.Generator
) -> Array:
    """Effort (D, N) that drives like this one need beyond what the model explains.

    Parameters
    ----------
    left : (D, N) array
        Effort that the model leaves, where it is known.
    known : (N,) array of bool
    replicas : (D, N) array
        Of what the encoder's noise has in it. How strong that is by chance, each drive takes from
        one of them.
    rng : Generator
    """
    drives, samples = left.shape
    share = max(float(np.mean(known)), 1.0 / samples)
    turns = rng.uniform(size=(drives, samples // 2 + 1))
    back = np.cos(rng.uniform(0.0, 0.5 * np.pi, drives))
    found = np.empty(left.shape)
    for row, of_left, replica, turn, comes in zip(found, left, replicas, turns, back, strict=True):
        # one after the other: the spectra of all are large
        seen, noise = (np.fft.rfft(np.where(known, of, 0.0)) for of in (of_left, replica))
        strength = np.maximum(_smooth(np.abs(seen) ** 2), _TINY)
        true = np.clip(1.0 - _smooth(np.abs(noise) ** 2) / strength, 0.0, 1.0)
        turned = seen / math.sqrt(share) * np.exp(2j * np.pi * turn)
        mixed = comes * true * seen + np.sqrt(true - (comes * true) ** 2) * turned
        both = np.fft.irfft(np.stack([mixed, np.sqrt(true) * turned]), samples)
        row[:] = np.where(known, *both)
    return found


def _smooth(power: Array) -> Array:
    """Mean over neighbouring frequencies."""
    around = np.pad(power, _NEIGHBOURS, mode="reflect")
    return np.asarray(np.mean(sliding_window_view(around, 2 * _NEIGHBOURS + 1, axis=-1), axis=-1))
