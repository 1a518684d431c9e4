"""Feed-forward of the base model in gains that leave terms of a model out.

The base parameters of a model are those beside all of its terms. Friction that bends with the
speed, say, leaves little for viscous friction. Gains that must do without that term follow better
if the base model takes what it can of it. That share is fitted along a made-up motion through the
supported range, on which the model itself says what the term takes.
"""

from collections.abc import Collection
from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.model.effects import named
from edge_ident.model.inverse import inverse_effort
from edge_ident.model.model import AxisModel, Term, regressor
from edge_ident.model.motion import Motion
from edge_ident.model.supported_range import SupportedRange
from firmware_interface.gains import AxisGains

Array = NDArray[np.float64]

_RATES: Final = np.array([1.0, np.sqrt(7.0), np.sqrt(41.0)])
"""Frequencies of the made-up motion, over the slowest: they never repeat together."""
_TURNS: Final = 12
"""Periods of the slowest sinusoid."""
_SAMPLES: Final = 6000


def gains_without(gains: AxisGains, axis: AxisModel, left_out: Collection[Term]) -> AxisGains:
    """Gains whose feed-forward of the base model takes what it can of terms that are left out.

    Parameters
    ----------
    gains : AxisGains
        For all other terms.
    axis : AxisModel
        With all of its terms.
    left_out : collection of Term
        Those that depend on another axis or on time change nothing, nor do any where nobody says
        in which range the model is supported.
    """
    supported = axis.terms[0].supported
    moving = [term for term in left_out if _acts_on_a_motion(term)]
    if supported is None or not moving:
        return gains
    motion = _made_up(supported)
    kept = tuple(term for term in axis.terms if _acts_on_a_motion(term) and term not in left_out)
    both = (replace(axis, terms=terms) for terms in ((*kept, *moving), kept))
    taken = np.subtract(*(inverse_effort(some, motion) for some in both))
    columns = regressor(motion.velocity, motion.acceleration)
    inertia, viscous, coulomb, offset = np.linalg.lstsq(columns, taken, rcond=None)[0].tolist()
    return replace(
        gains,
        inertia_feedforward=max(gains.inertia_feedforward + inertia, 0.0),
        viscous_feedforward=max(gains.viscous_feedforward + viscous, 0.0),
        coulomb_feedforward=max(gains.coulomb_feedforward + coulomb, 0.0),
        offset_feedforward=gains.offset_feedforward + offset,
    )


def _acts_on_a_motion(term: Term) -> bool:
    effect = named(term.effect)
    return not (effect.tied_to_time or effect.effort_delay or effect.has_source(term.source_axis))


def _made_up(supported: SupportedRange) -> Motion:
    """Three sinusoids of equal speed that stay inside the range of position and speed."""
    low, high = supported.position
    top_speed = max(abs(speed) for speed in supported.speed)
    speed = top_speed / len(_RATES)
    travel = 0.5 * (high - low)
    slowest = speed * float(np.sum(1.0 / _RATES)) / travel
    time_s = np.linspace(0.0, 2.0 * np.pi * _TURNS / slowest, _SAMPLES)
    rates = slowest * _RATES[:, None]
    sine, cosine = np.sin(rates * time_s), np.cos(rates * time_s)
    return Motion.known(
        time_s,
        0.5 * (low + high) + speed * np.sum(sine / rates, axis=0),
        speed * np.sum(cosine, axis=0),
        -speed * np.sum(rates * sine, axis=0),
    )
