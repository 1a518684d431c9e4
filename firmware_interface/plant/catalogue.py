"""All effects by name, found in the modules `*_effects`, and how one or several are drawn."""

import importlib
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from firmware_interface.plant.drives import Array, Drives
from firmware_interface.plant.effect import Effect, Scales
from firmware_interface.plant.motions import Motion

for _file in sorted(Path(__file__).parent.glob("*_effects.py")):
    if not _file.stem.startswith("test_"):
        importlib.import_module(f"firmware_interface.plant.{_file.stem}")


def names_of(*, in_catalogue: bool) -> tuple[str, ...]:
    """Effects that the library knows too, or disturbances that no catalogue holds."""
    kinds = [kind for kind in Effect.kinds.values() if kind.in_catalogue == in_catalogue]
    return tuple(kind.name for kind in sorted(kinds, key=lambda kind: (kind.number, kind.name)))


EFFECTS = names_of(in_catalogue=True)
UNKNOWN = names_of(in_catalogue=False)


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
        kind = Effect.kinds[name]
        rank = rng.random(drives.shape) if strength is None else strength
        faint, strong = kind.span
        size = faint * (strong / faint) ** (rank * np.ones(drives.shape))
        sign = rng.choice([-1.0, 1.0], drives.shape) if kind.signed else 1.0
        hit = alone if one_axis or kind.one_way else np.ones(drives.shape, bool)
        effects.append(kind.draw(size * sign * hit, rng, scales))
    return tuple(effects)
