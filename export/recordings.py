"""Recordings of random drives, as the signal chain hands them to the image.

A training run makes a few thousand recordings once, along motions near the nominal one as an
encoder reads them, and mixes its examples from them: any drive on any of these motions, with the
efforts that the effects of the catalogue add to drives of their own.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.dct import subsample
from edge_ident.effect import Motion
from edge_ident.effects import catalogue, random_term
from edge_ident.inverse import inverse_effort
from edge_ident.model import BASE, PARAMETERS, AxisModel, Term, regressor
from edge_ident.signals import condition
from edge_ident.strengths import scale_of
from export.drives import as_shares, efforts, mixture
from export.motion import TrainingMotion, measured_position, perturbed

Array = NDArray[np.float64]

_SOURCE: Final = "other"
"""Name of the axis that may act on the one that is identified."""


@dataclass(frozen=True)
class Recordings:
    """Subsampled recordings; columns over the motion's scales, parameters as shares.

    Attributes
    ----------
    measured : (M, points, 4) array
        Regressor of each motion, from what the encoder reads.
    true : (M, points, 4) array
        Regressor of the motion itself, filtered alike.
    effects : tuple of str
    parameters : (M, E, D, 4) array
        Base parameters of the drives that have an effect; their efforts have scale one.
    added : (M, E, D, points) array
        What the effect adds to the effort.
    """

    measured: Array
    true: Array
    effects: tuple[str, ...]
    parameters: Array
    added: Array


def make_recordings(
    motion: TrainingMotion,
    points: int,
    rng: np.random.Generator,
    *,
    motions: int,
    drives: int,
    on_progress: Callable[[int, int], None] = lambda done, total: None,
) -> Recordings:
    """Record random drives.

    Parameters
    ----------
    motion : TrainingMotion
    points : int
        That signals are subsampled to.
    rng : numpy Generator
    motions : int
    drives : int
        With each effect on each motion; 0 leaves effects out.
    on_progress : callable
        Called with the motions done and their number.
    """
    names = _testable_effects(motion) if drives else ()
    made = []
    for number, true in enumerate(perturbed(motion, rng, motions)):
        made.append(_record(motion, true, points, rng, names, drives))
        on_progress(number + 1, motions)
    measured, columns, parameters, added = (np.stack(part) for part in zip(*made, strict=True))
    return Recordings(measured, columns, names, parameters, added)


def _testable_effects(motion: TrainingMotion) -> tuple[str, ...]:
    """All of the catalogue, but for those that need another axis where there is none."""
    alone = motion.partner is None
    return tuple(
        name for name, effect in catalogue().items() if not (alone and effect.needs_source)
    )


def _record(
    motion: TrainingMotion,
    true: Motion,
    points: int,
    rng: np.random.Generator,
    names: tuple[str, ...],
    drives: int,
) -> tuple[Array, Array, Array, Array]:
    """Measured and true columns, parameters and added efforts of one motion."""
    columns = regressor(true.velocity, true.acceleration) / motion.column_scales
    shares, added = [], []
    for name in names:
        raw = mixture(rng, drives)
        shares.append(as_shares(columns, raw, "effort-scale"))
        added.append(_added_effort(name, shares[-1] / motion.column_scales, true, rng))
    signals = condition(
        motion.time_s,
        measured_position(motion, true.position, rng),
        np.vstack([columns.T, *added]),
    )
    filtered = subsample(signals.effort.T, points)
    measured = subsample(signals.regressor, points) / motion.column_scales
    return (
        measured,
        filtered[:, :4],
        np.reshape(shares, (len(names), drives, len(PARAMETERS))),
        filtered[:, 4:].T.reshape(len(names), drives, points),
    )


def _added_effort(name: str, parameters: Array, true: Motion, rng: np.random.Generator) -> Array:
    """What an effect of random strength adds to the efforts of drives, (D, N)."""
    arrays = (true.time_s, true.position, true.velocity, true.acceleration)
    base = Term(BASE, dict(zip(PARAMETERS, parameters.T, strict=True)))
    term = random_term(name, rng, scale_of(parameters, *arrays), source_axis=_SOURCE)
    values = {key: np.reshape(value, -1) for key, value in term.values.items()}
    changed = AxisModel((base, Term(name, values, source_axis=term.source_axis)))
    others = {} if true.source is None else {_SOURCE: true.source}
    bare = Motion.known(*arrays)
    total = inverse_effort(changed, bare, others)
    return np.asarray(total - efforts(regressor(true.velocity, true.acceleration), parameters))
