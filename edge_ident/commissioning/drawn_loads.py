"""Drives like the identified one, and what they need along a motion that was recorded.

They differ in all that is not known; `edge_ident.commissioning.tracking_forecast` says in what.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.commissioning.recorded_motion import Moved
from edge_ident.control.position_loop import LoopHardware
from edge_ident.diagnosis.measures import NO_SHIFT, Timing
from edge_ident.estimation.compensation import compensate_effects, without_delay
from edge_ident.identification.result import Identification
from edge_ident.model.effect import Motion
from edge_ident.model.effects import named
from edge_ident.model.inverse import inverse_effort
from edge_ident.model.model import AxisModel, Model, Term
from edge_ident.signals.filters import lowpass
from edge_ident.simulation.loop_response import Loads

Array = NDArray[np.float64]

DRAWS: Final = 19
"""A twentieth equal draw lies between the smallest and the largest in 18 of 20 cases."""
_AT_ONCE: Final = 0.01
"""Encoder counts within which friction turns round at once, as far as a loop feels it."""
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


def drawn_loads(
    name: str, moved: Moved, grounds: Grounds, hardware: LoopHardware, every: int
) -> Loads:
    """What the drawn drives of one axis need, at every so many samples.

    Parameters
    ----------
    name : str
        Of the axis.
    moved : Moved
    grounds : Grounds
    hardware : LoopHardware
    every : int
        Samples from one to the next.

    Raises
    ------
    ModelError
        The model does not fit the recording.
    """
    rng, whole = np.random.default_rng(0), grounds.model.axes[name]
    timing = grounds.timing.get(name, NO_SHIFT)
    delay_s, acting = without_delay(whole.terms[1:])
    # what belongs to the time of the recording will not be the same again
    lasting = (term for term in acting if not named(term.effect).tied_to_time)
    axis = replace(whole, terms=(whole.terms[0], *lasting))
    drawn = _draws(axis, rng)
    late_s = timing.shift_s + delay_s
    signals = compensate_effects(moved.recording, name, None, late_s=late_s).signals
    late_by_s = timing.std_samples * hardware.sample_period_s * rng.normal(size=(DRAWS, 1))
    effort = signals.effort + late_by_s * np.gradient(signals.effort, signals.period_s)
    left = effort - drawn.parameters @ signals.regressor.T
    wanted: Array = np.zeros(())
    if len(axis.terms) > 1:
        made = _effects(drawn, moved.motions(signals.cutoff_hz), name)
        left = left - lowpass(made, signals.cutoff_hz, signals.period_s)
        wanted = _effects(drawn, moved.wanted_motions(), name)[..., moved.begin % every :: every]
    # slower than a count in half a period of the filter, the direction of friction is not known
    slow = 2.0 * signals.cutoff_hz * hardware.encoder_resolution_rad
    known = signals.moving & (np.abs(signals.regressor[:, 1]) > slow)
    unexplained = _mixed(left[..., ::every], known[::every], rng)
    unexplained = np.pad(unexplained, ((0, 0), (moved.begin // every, 0)))
    # no encoder shows how friction turns round within a count: a length of unknown order
    turning = hardware.encoder_resolution_rad * _AT_ONCE ** rng.uniform(size=DRAWS)
    # fewer samples span a narrower band, in which the noise must have the same density
    count = hardware.encoder_resolution_rad / math.sqrt(every)
    noise = count * rng.uniform(-0.5, 0.5, unexplained.shape)
    return Loads(drawn.parameters, wanted + unexplained, turning, noise)


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


def _mixed(left: Array, moving: NDArray[np.bool_], rng: np.random.Generator) -> Array:
    """Part of what was seen, and part of other noise of the same spectrum, (DRAWS, N).

    An axis that stands takes any effort up to its friction, so nothing was seen there.
    """
    share = max(float(np.mean(moving)), 1.0 / len(moving))
    mean = np.sum(left * moving, axis=-1, keepdims=True) / (share * len(moving))
    seen = np.where(moving, left - mean, 0.0)
    spectrum = np.fft.rfft(seen) / math.sqrt(share)
    turned = spectrum * np.exp(2j * np.pi * rng.uniform(size=spectrum.shape))
    other = np.fft.irfft(turned, left.shape[-1])
    part = rng.uniform(0.0, 0.5 * np.pi, (len(left), 1))
    return np.asarray(mean + np.where(moving, np.cos(part) * seen + np.sin(part) * other, other))
