"""All effects by name, and how one or several are drawn at random."""

from collections.abc import Sequence

import numpy as np

from tests.plant import electric_effects as electric
from tests.plant import friction_effects as friction
from tests.plant import load_effects as load
from tests.plant import timed_effects as timed
from tests.plant.drives import Array, Drives
from tests.plant.effect import Effect, Scales
from tests.plant.motions import Motion

_KNOWN: tuple[type[Effect], ...] = (
    friction.Stribeck,
    friction.Asymmetry,
    friction.Presliding,
    load.Backlash,
    load.Ripple,
    friction.PositionFriction,
    load.PositionLoad,
    friction.NonlinearViscous,
    friction.LoadFriction,
    friction.WarmUp,
    electric.GainDrift,
    timed.OffsetDrift,
    electric.RecordDelay,
    load.Compliance,
    load.CrossCoupling,
    electric.Deadband,
    electric.Saturation,
    electric.Eccentricity,
    load.Payload,
    timed.Push,
)
_STRANGE: tuple[type[Effect], ...] = (timed.Wander, timed.Vibration, timed.RandomSteps)

# The twenty effects of the catalogue, and disturbances that are in no catalogue.
EFFECTS = tuple(kind.name for kind in _KNOWN)
UNKNOWN = tuple(kind.name for kind in _STRANGE)

_BY_NAME = {kind.name: kind for kind in (*_KNOWN, *_STRANGE)}


def draw(
    names: Sequence[str],
    drives: Drives,
    motion: Motion,
    seed: int,
    *,
    strength: float | Array | None = None,
    one_axis: bool = False,
) -> tuple[Effect, ...]:
    """Effects of random size and kind for every drive; none for no names.

    Parameters
    ----------
    names : sequence of str
        From `EFFECTS` or `UNKNOWN`; several act together.
    strength : float, (B, A) array or None
        0, the faintest (below the noise), to 1, the strongest (in clear need of repair), even in
        the logarithm of size; None: at random.
    one_axis : bool
        One axis of each drive, the same for all effects, chosen at random; otherwise all axes.
        What couples axes always hits one.
    """
    rng = np.random.default_rng([seed, 3])
    count, axes = drives.shape
    alone = rng.integers(0, axes, (count, 1)) == np.arange(axes)
    scales = Scales.of(drives, motion)
    effects = []
    for name in names:
        kind = _BY_NAME[name]
        rank = rng.random(drives.shape) if strength is None else strength
        faint, strong = kind.span
        size = faint * (strong / faint) ** (rank * np.ones(drives.shape))
        sign = rng.choice([-1.0, 1.0], drives.shape) if kind.signed else 1.0
        hit = alone if one_axis or kind.one_way else np.ones(drives.shape, bool)
        effects.append(kind.draw(size * sign * hit, rng, scales))
    return tuple(effects)
