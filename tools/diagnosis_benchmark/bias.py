"""How far base parameters are from the truth of the plant."""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.model.effects import named
from edge_ident.model.model import PARAMETERS, AxisModel
from edge_ident.model.motion import Motion

Array = NDArray[np.float64]

JUDGED: Final = ("inertia", "viscous_friction", "coulomb_friction")
"""Parameters whose bias is judged; the offset may be anything."""


def mean_parameters(model: AxisModel, duration_s: float) -> Array:
    """Base parameters (4,) with what effects that change them in time add on average.

    The truth of the plant is such a mean. An extended model has the parameters of the start of the
    record and, for warm-up, of its end.
    """
    time_s = np.linspace(0.0, duration_s, 2001)
    ones = np.ones_like(time_s)
    motion = Motion.known(time_s, ones, ones, ones)
    values, scale = model.parameters.astype(np.float64), ones
    for term in model.terms[1:]:
        effect, of = named(term.effect), {n: np.atleast_1d(v) for n, v in term.values.items()}
        if effect.overrides("command") and effect.changes_base:
            scale = effect.command(ones, time_s, of)
            continue
        # at unit speed and acceleration, forward
        hooks = (effect.inertia, effect.load, effect.friction, effect.load)
        for i, (name, hook) in enumerate(zip(PARAMETERS, hooks, strict=True)):
            if name in effect.changes_base:
                values[i] += np.mean(hook(motion, of))
    return np.asarray(values * np.mean(scale))


def relative_errors(found: Array, truth: Array) -> tuple[float, ...]:
    """Of `JUDGED`, from base parameters (4,) and their truth."""
    part = slice(len(JUDGED))
    return tuple((np.abs(found - truth)[part] / np.abs(truth[part])).tolist())
