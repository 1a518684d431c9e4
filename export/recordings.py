"""Recordings of random drives, as the signal chain hands them to the image.

A training run makes a few thousand recordings once. Their motions are near the nominal one, as an
encoder reads them. The run mixes its examples from them: any drive on any of these motions, with
the efforts that effects of the catalogue add to drives of their own.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.estimation.image import effort_scale
from edge_ident.model.effect import scale_of
from edge_ident.model.effects import catalogue, named, random_term
from edge_ident.model.inverse import inverse_effort
from edge_ident.model.model import BASE, PARAMETERS, AxisModel, Term, regressor
from edge_ident.model.motion import Motion
from edge_ident.signals.conditioning import condition
from edge_ident.signals.metrics import subsample
from export.drives import as_shares, efforts, mixture
from export.motion import TrainingMotion, measured_position, perturbed

Array = NDArray[np.float64]

KNOWN_DRIVES: Final = 48
"""Drives with the effects that are known of the machine, on each motion."""
_SOURCE: Final = "other"  # name of the axis that may act on the one that is identified


@dataclass(frozen=True)
class Recordings:
    """Subsampled recordings; regressors over the motion's scales, parameters as shares.

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
    known_parameters : (M, K, 4) array
        Base parameters of drives with the effects that are known of the machine, as above; K is
        zero where none are.
    known_added : (M, K, points) array
        What these add.
    """

    measured: Array
    true: Array
    effects: tuple[str, ...]
    parameters: Array
    added: Array
    known_parameters: Array = field(default_factory=lambda: np.empty((0, 0)))
    known_added: Array = field(default_factory=lambda: np.empty((0, 0)))

    def known_drives(
        self, rng: np.random.Generator, index: NDArray[np.intp]
    ) -> tuple[Array, Array] | None:
        """Random drives with the known effects, on the motions (n,), if there are any.

        Returns
        -------
        parameters, added : (n, 4) and (n, points) arrays
        """
        count = self.known_parameters.shape[1]
        if not count:
            return None
        drive = rng.integers(count, size=len(index))
        return self.known_parameters[index, drive], self.known_added[index, drive]


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
    for number, moved in enumerate(perturbed(motion, rng, motions)):
        made.append(_record(motion, moved, points, rng, names, drives))
        on_progress(number + 1, motions)
    measured, true, *drives_made = (np.stack(part) for part in zip(*made, strict=True))
    return Recordings(measured, true, names, *drives_made)


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
) -> tuple[Array, ...]:
    """What `Recordings` holds of one motion, its arrays in their order."""
    scaled = regressor(true.velocity, true.acceleration) / motion.column_scales
    shares, added = [], []
    for name in names:
        raw = mixture(rng, drives)
        shares.append(as_shares(scaled, raw, "effort-scale"))
        added.append(_added_effort(name, shares[-1] / motion.column_scales, true, rng))
    known_shares, known_added = _known_drives(motion, true, scaled, rng)
    signals = condition(
        motion.time_s,
        measured_position(motion, true.position, rng),
        np.vstack([scaled.T, *added, known_added]),
    )
    filtered = subsample(signals.effort.T, points)
    measured = subsample(signals.regressor, points) / motion.column_scales
    random, known = np.split(filtered[:, 4:].T, [len(names) * drives])
    return (
        measured,
        filtered[:, :4],
        np.reshape(shares, (len(names), drives, len(PARAMETERS))),
        random.reshape(len(names), drives, points),
        known_shares,
        known,
    )


def _known_drives(
    motion: TrainingMotion, true: Motion, scaled: Array, rng: np.random.Generator
) -> tuple[Array, Array]:
    """Shares (K, 4) of random drives of the known machine's size, and what its effects add (K, N).

    The effects have the model's values, each within its standard deviation; the drives need an
    effort of the same scale as the model's base term does.
    """
    if motion.known is None:
        return np.empty((0, len(PARAMETERS))), np.empty((0, len(scaled)))
    effort = motion.known.parameters * motion.column_scales @ scaled.T
    scale = float(effort_scale(effort[None], "effort-scale")[0])
    shares = as_shares(scaled, mixture(rng, KNOWN_DRIVES), "effort-scale")
    terms = [_varied(term, rng) for term in motion.known.terms[1:]]
    parameters = scale * shares / motion.column_scales
    return shares, _effort_of(terms, parameters, true) / scale


def _varied(term: Term, rng: np.random.Generator) -> Term:
    """An effect of each known drive: its values within their deviations and physical bounds."""
    effect = named(term.effect)
    known = effect.complete(term.values)
    values = {
        p.name: np.clip(
            rng.normal(float(known[p.name]), term.std.get(p.name, 0.0), KNOWN_DRIVES),
            p.low,
            p.high,
        )
        for p in effect.parameters
    }
    coupled = effect.needs_source or term.source_axis is not None
    return Term(term.effect, values, source_axis=_SOURCE if coupled else None)


def _added_effort(name: str, parameters: Array, true: Motion, rng: np.random.Generator) -> Array:
    """What an effect of random strength adds to the efforts of drives, (D, N)."""
    arrays = (true.time_s, true.position, true.velocity, true.acceleration)
    term = random_term(name, rng, scale_of(parameters, *arrays), source_axis=_SOURCE)
    values = {key: np.reshape(value, -1) for key, value in term.values.items()}
    return _effort_of([Term(name, values, source_axis=term.source_axis)], parameters, true)


def _effort_of(terms: Sequence[Term], parameters: Array, true: Motion) -> Array:
    """What effects add to the efforts of drives with these base parameters (D, 4), (D, N)."""
    base = Term(BASE, dict(zip(PARAMETERS, parameters.T, strict=True)))
    changed = AxisModel((base, *terms))
    others = {} if true.source is None else {_SOURCE: true.source}
    bare = Motion.known(true.time_s, true.position, true.velocity, true.acceleration)
    total = inverse_effort(changed, bare, others)
    return np.asarray(total - efforts(regressor(true.velocity, true.acceleration), parameters))
