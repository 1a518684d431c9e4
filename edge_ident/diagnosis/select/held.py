"""Where friction may hold the axis: at a stop, and as far from it as a sound chain winds up.

While the table sticks, its chain winds up, and an encoder on the motor sees it creep; so does one
on a guide with presliding.
"""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.diagnosis.fit.fitting import FittedModel
from edge_ident.diagnosis.prepare.segment import Segment
from edge_ident.model.effects import named
from edge_ident.model.search import SOUND_RESONANCE_HZ

_TINY: Final = float(np.finfo(float).tiny)


def most_friction(model: FittedModel) -> float:
    """Largest change of the friction at a stop: from one direction to the other."""
    return 2.0 * max(float(model.axis.parameters[2]), _TINY)


def held_travel(model: FittedModel) -> float:
    """Travel from a stop on within which friction may hold the axis."""
    inertia = max(float(model.axis.parameters[0]), _TINY)
    wound_up = most_friction(model) / (inertia * (2.0 * np.pi * SOUND_RESONANCE_HZ) ** 2)
    presliding = (named(t.candidate.effect).held_travel(t.values) for t in model.terms)
    return wound_up + sum(map(float, presliding))


def may_be_held(segment: Segment, travel: float) -> NDArray[np.bool_]:
    """Samples (N,) no farther from a stop than some travel, or than the encoder resolves.

    Smoothing over a time τ changes a speed by its second derivative times τ²/2. An axis that is
    slower than that may have stopped.
    """
    motion = segment.motion
    step_s = float(motion.time_s[1] - motion.time_s[0])
    smoothed_s = 1.0 / (2.0 * np.pi * segment.motion_hz)
    hidden = 0.5 * np.abs(np.gradient(motion.acceleration, step_s)) * smoothed_s**2
    backwards = np.signbit(motion.velocity)
    turned = np.diff(backwards, prepend=backwards[:1])
    stops = np.flatnonzero((np.abs(motion.velocity) < hidden) | turned)
    if not len(stops):
        return np.zeros(len(motion.velocity), dtype=bool)
    after = np.minimum(np.searchsorted(stops, np.arange(len(turned))), len(stops) - 1)
    neighbours = motion.position[stops[[after, np.maximum(after - 1, 0)]]]
    near = np.min(np.abs(motion.position - neighbours), axis=0)
    resolved = segment.position_noise * np.sqrt(12.0)
    return np.asarray(near <= max(travel, resolved))
