"""The samples that a diagnosis would compare: of recordings, or of a motion that is still planned.

A planned motion goes through the same steps as a recording (`edge_ident.diagnosis.prepare`):
direction weights, the filter of the comparison, decimation, and the masks of reversals, run-in and
aliasing. So what hides an effect in a recording hides it in the plan, too.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from edge_ident.diagnosis.prepare import bandwidth, preparation
from edge_ident.diagnosis.prepare.axis_data import AxisData
from edge_ident.model.inverse import inverse_effort
from edge_ident.model.model import PARAMETERS, AxisModel, Term
from edge_ident.model.motion import Array, Motion
from edge_ident.signals import conditioning
from edge_ident.signals.metrics import rms
from firmware_interface.motion import Multisine, Staircase, reference

STEP_S: Final = 0.02
"""Sampling period of a planned motion. Its lines and what they cause lie below 10 Hz, and it has no
noise that could alias."""
_TINY: Final = float(np.finfo(float).tiny)


@dataclass(frozen=True)
class Compared:
    """What predictions are compared at.

    Attributes
    ----------
    raw : callable
        Efforts (N,) or (D, N) that a model predicts, before the filter.
    filtered : callable
        The same (..., N), filtered, at the n compared samples.
    timing : callable
        What shifts in time change about an effort (N,) there, (R, n) for R recordings.
    noise : float
        Noise floor.
    """

    raw: Callable[[AxisModel], Array]
    filtered: Callable[[Array], Array]
    timing: Callable[[Array], Array]
    noise: float

    @classmethod
    def of_recordings(cls, data: AxisData, noise: float) -> "Compared":
        """The valid samples of recordings; their efforts are predicted filtered."""

        def predicted(axis: AxisModel) -> Array:
            return data.predicted(axis)

        def valid(efforts: Array) -> Array:
            return np.asarray(efforts[..., data.valid])

        def shifted(effort: Array) -> Array:
            return valid(data.timing_columns.T)

        return cls(predicted, valid, shifted, noise)


@dataclass(frozen=True)
class Instruments:
    """How the recording of a motion would be taken and compared.

    Attributes
    ----------
    inertia : float
        Turns encoder noise into effort.
    density : float
        Power density of the effort noise, per Hz.
    position_noise : float
        Standard deviation of the encoder noise.
    count : float
        Encoder resolution.
    sampling_s : float
    floor_ratio : float
        Noise floor of the recordings over what the three numbers above make of it.
    """

    inertia: float
    density: float
    position_noise: float
    count: float
    sampling_s: float
    floor_ratio: float = 1.0

    @classmethod
    def of_recordings(
        cls, data: AxisData, inertia: float, floor: float, sampling_s: float, count: float
    ) -> "Instruments":
        """The noise of recordings; `floor` is their noise floor."""
        density = max(s.effort_noise**2 / s.band.cutoff_hz for s in data.segments)
        noise = max(s.position_noise for s in data.segments)
        plain = cls(inertia, density, noise, count, sampling_s)
        expected = max(plain.floor(s.band) for s in data.segments)
        return replace(plain, floor_ratio=floor / max(expected, _TINY))

    def band(self, motion: Motion) -> bandwidth.Band:
        """The band in which a motion would be compared, from its acceleration and the noise."""
        acceleration = float(np.std(motion.acceleration))
        duration_s = float(motion.time_s[-1])
        ceiling_hz = 1.0 / (conditioning.SAMPLED_PER_PERIOD * self.sampling_s)
        widest_hz = conditioning.resolving_cutoff_hz(
            acceleration, self.position_noise, self.sampling_s
        )
        widest_hz = min(max(widest_hz, conditioning.FEWEST_CUTOFF_PERIODS / duration_s), ceiling_hz)
        band = bandwidth.search_band(
            self.inertia, self.position_noise, self.density, widest_hz, self.sampling_s
        )
        return replace(band, cutoff_hz=min(band.cutoff_hz, preparation.most_hz(duration_s)))

    def floor(self, band: bandwidth.Band) -> float:
        """Noise floor in a band."""
        frequency_hz = np.linspace(0.0, 3.0 * band.cutoff_hz, 301)
        above = self.inertia * (2.0 * np.pi * frequency_hz) ** 2 * self.position_noise
        both = self.density + 2.0 * self.sampling_s * above**2
        power = float(np.trapezoid(both * band.power(frequency_hz), frequency_hz))
        return self.floor_ratio * math.sqrt(power)

    def motion(self, motion: Multisine | Staircase, duration_s: float) -> Motion:
        """The captured part of a motion, exactly as it is commanded."""
        times = np.arange(0.0, duration_s, STEP_S)
        wanted = reference(motion, times, 1.0, 0.0)
        return Motion.known(
            times, wanted.position_rad, wanted.velocity_rad_s, wanted.acceleration_rad_s2
        )

    def compared(self, motion: Motion, others: Mapping[str, Motion]) -> Compared | None:
        """The samples of a planned motion; None where hardly any shows the axis in motion."""
        band, period_s = self.band(motion), float(motion.time_s[1] - motion.time_s[0])
        turns, cutoff_hz = bandwidth.reversals(motion), band.cutoff_hz
        reversing, rests = bandwidth.unknown_directions(
            motion.position, turns, self.position_noise, rms(motion.velocity), cutoff_hz, period_s
        )
        weight = bandwidth.direction_weight(reversing | rests, cutoff_hz, period_s)
        smear = int(np.ceil(bandwidth.SMEAR_PERIODS / (band.cutoff_hz * period_s)))
        count = bandwidth.tone_count(self.count, self.position_noise)
        aliased = bandwidth.aliasing_mask(motion, count, band.cutoff_hz, self.sampling_s, smear)
        index = conditioning.decimated(len(weight), band.cutoff_hz, period_s)
        passed = band.lowpass(weight, period_s)
        usable = (passed[index] > bandwidth.LEAST_WEIGHT) & ~aliased[index]
        index = index[usable & (index >= bandwidth.run_in(motion.position))]
        if len(index) < preparation.FEWEST_SAMPLES:
            return None

        def predicted(axis: AxisModel) -> Array:
            return inverse_effort(axis, motion, others)

        def filtered(efforts: Array) -> Array:
            return np.asarray(band.lowpass(weight * efforts, period_s)[..., index])

        def shifted(effort: Array) -> Array:
            return filtered(np.gradient(effort)[None])

        return Compared(predicted, filtered, shifted, self.floor(band))


# What single terms add to the effort, and how it changes with their parameters.
#
# All is to first order: terms are taken on top of the base model alone, as if their efforts add up.

_STEP: Final = 1e-3  # relative step of derivatives: coarse enough for effects that act in jumps


Key = tuple[object, ...]
"""What tells a term from others: effect, other axis and values."""


@dataclass(frozen=True)
class Columns:
    """A term at the n compared samples.

    Attributes
    ----------
    effort : (n,) array
    derivatives : (P, n) array
        By its parameters that are not zero, per relative change.
    raw : (N,) array
        The effort before the filter.
    """

    effort: Array
    derivatives: Array
    raw: Array


@dataclass(frozen=True)
class BaseColumns:
    """The base model at the n compared samples.

    Attributes
    ----------
    effort : (n,) array
    columns : (4 + R, n) array
        Of the four parameters, and of a shift in time of each of R recordings.
    raw : (4, N) array
        Of the four parameters, before the filter.
    """

    effort: Array
    columns: Array
    raw: Array


def base_columns(compared: Compared, base: AxisModel) -> BaseColumns:
    """The base model; `base` has its term alone."""
    unit = dict(zip(PARAMETERS, np.eye(len(PARAMETERS)), strict=True))
    rows = compared.raw(replace(base, terms=(replace(base.terms[0], values=unit),)))
    filtered = compared.filtered(rows)
    columns = np.vstack([filtered, compared.timing(base.parameters @ rows)])
    return BaseColumns(base.parameters @ filtered, columns, rows)


def key(term: Term) -> Key:
    """The key of a term with plain values."""
    return (term.effect, term.source_axis, *(float(value) for value in term.values.values()))


def term_effort(compared: Compared, base: AxisModel, term: Term) -> Array:
    """Filtered effort (n,) that a term adds to the base model."""
    return compared.filtered(_added(compared, base, term))


def term_columns(compared: Compared, terms: Sequence[tuple[AxisModel, Term]]) -> list[Columns]:
    """Efforts and derivatives of terms, each on top of a base model, filtered together."""
    if not terms:
        return []
    rows = [np.atleast_2d(_added(compared, base, _moved(t))) for base, t in terms]
    ends = np.cumsum([len(part) for part in rows])[:-1]
    filtered = np.split(compared.filtered(np.vstack(rows)), ends)
    return [
        Columns(part[0], (part[1::2] - part[2::2]) / (2.0 * _STEP), raw[0])
        for part, raw in zip(filtered, rows, strict=True)
    ]


def _added(compared: Compared, base: AxisModel, term: Term) -> Array:
    """Effort (..., N) that a term adds to a base model, before the filter."""
    together = replace(base, terms=(base.terms[0], term))
    return np.asarray(compared.raw(together) - compared.raw(base))


def _moved(term: Term) -> Term:
    """A term with its values, and with each nonzero one a step higher and lower: D = 1 + 2·P."""
    names = [name for name, value in term.values.items() if float(value) != 0.0]
    values: Mapping[str, Array] = {
        name: np.full(1 + 2 * len(names), float(value)) for name, value in term.values.items()
    }
    for k, name in enumerate(names):
        values[name][1 + 2 * k] *= 1.0 + _STEP
        values[name][2 + 2 * k] *= 1.0 - _STEP
    return replace(term, values=values)
