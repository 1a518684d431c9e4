"""The base model of an axis at one time of the recording that its model was made from.

Some effects change nothing but base parameters, and do so in time: a payload, a lubricant that
warms, an amplifier that drifts. The hooks of such an effect say by how much at any time.
"""

from dataclasses import replace

import numpy as np

from edge_ident.model.effect import Effect, Values
from edge_ident.model.effects import named
from edge_ident.model.model import PARAMETERS, AxisModel
from edge_ident.model.motion import Motion


def base_at(axis: AxisModel, time_s: float) -> AxisModel:
    """The axis with the base parameters of a time; all of its terms are still there.

    Parameters
    ----------
    axis : AxisModel
        Of one drive.
    time_s : float
        From the first sample of the recording on.
    """
    base = axis.terms[0]
    parameters, scale = axis.parameters.copy(), 1.0
    for term in axis.terms[1:]:
        effect = named(term.effect)
        if effect.changes_base:
            values = {
                name: np.full(1, value) for name, value in effect.complete(term.values).items()
            }
            parameters += _added(effect, values, time_s)
            scale *= float(effect.command(np.ones(1), np.full(1, time_s), values)[0])
    values_then = dict(zip(PARAMETERS, (scale * parameters).tolist(), strict=True))
    return replace(axis, terms=(replace(base, values=values_then), *axis.terms[1:]))


def _added(effect: Effect, values: Values, time_s: float) -> np.ndarray:
    """What an effect adds to the base parameters (4,), from its hooks at three speeds."""
    speed, still = np.array([-1.0, 0.0, 1.0]), np.zeros(3)
    motion = Motion.known(np.full(3, time_s), still, speed, still)
    load, friction, inertia = (
        np.broadcast_to(hook(motion, values), 3)
        for hook in (effect.load, effect.friction, effect.inertia)
    )
    return np.array([inertia[1], 0.5 * (load[2] - load[0]), friction[1], load[1]])
