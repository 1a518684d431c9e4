"""What a selected model and its parts are measured by."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from typing import Self

import numpy as np

from edge_ident.diagnosis.budget.agreement import curves_beside, with_curves_known
from edge_ident.diagnosis.fit.external_vibrations import VIBRATION
from edge_ident.diagnosis.fit.fitting import FittedModel
from edge_ident.diagnosis.fit.linear import orthonormal
from edge_ident.diagnosis.fit.noise_floor import NoiseFloor
from edge_ident.diagnosis.fit.summary import (
    Array,
    base_space,
    nonzero_rms,
    own_efforts,
    recorded_sizes,
)
from edge_ident.diagnosis.judge.causes_in_time import held_travel, may_be_held
from edge_ident.diagnosis.select.acceptance import (
    beyond,
    nearly_none,
    noise_limit,
    structure_left,
)
from edge_ident.diagnosis.select.cross_validation import near_zero, unsized
from edge_ident.diagnosis.select.physics import unphysical
from edge_ident.diagnosis.select.search import Search
from edge_ident.diagnosis.select.selection import polished
from edge_ident.diagnosis.select.thresholds import STIFF_CHAIN, TAKEN_BACK
from edge_ident.model.effects import named
from edge_ident.model.model import PARAMETERS
from edge_ident.signals.conditioning import unit_length
from edge_ident.signals.metrics import rms


@dataclass(frozen=True)
class Assessment:
    """The selected model, and what its parts are measured by; all rms over the valid samples."""

    search: Search
    model: FittedModel
    space: Array
    floor: NoiseFloor
    scale: float
    tolerance: float
    cache: dict[tuple[int, ...], FittedModel] = field(default_factory=dict, compare=False)

    @classmethod
    def of(
        cls,
        search: Search,
        model: FittedModel,
        floor: NoiseFloor,
        tolerance: float,
    ) -> Self:
        scale = nonzero_rms(search.data.effort[search.data.valid])
        space = base_space(search.data, search.start)
        return cls(search, model, space, floor, scale, tolerance * scale)

    def beside_curves(self, model: FittedModel) -> Self:
        """The same, with what a model leaves that curves describe in every part of the recordings:
        what is left unexplained is less than without."""
        if not self.structure(model):
            return self
        curves = curves_beside(self.search.data, model, self.floor)
        if not curves:
            return self
        template = with_curves_known(self.search.template, curves)
        search = replace(self.search, template=template)
        whole = search.fit(self.model.base, self.model.terms)
        return replace(self, search=search, model=whole, cache={})

    def fitted(self, kept: Sequence[int]) -> FittedModel:
        """The model with a part of its terms, fitted again with their nonlinear parameters.

        What left may have bent them.
        """
        if len(kept) == len(self.model.terms):
            return self.model
        key = tuple(kept)
        if key not in self.cache:
            terms = tuple(self.model.terms[k] for k in kept)
            self.cache[key] = polished(self.search, self.search.fit(self.search.start.base, terms))
        return self.cache[key]

    def left(self, model: FittedModel) -> float:
        """Rms of a model's residual."""
        return float(np.sqrt(model.error / np.count_nonzero(self.search.data.valid)))

    def shares(self, model: FittedModel) -> list[float]:
        """Rms of each term's own effort over the rms of the measured effort."""
        efforts = own_efforts(self.search.data, model, self.space)
        return [rms(effort) / self.scale for effort in efforts]

    def sizes(self, model: FittedModel, *, recorded_alone: bool) -> list[float]:
        """Size of each term, with the others of its law, over the rms of the measured effort.

        What it takes off the recorded effort, or its own effort in the band if that is more.

        Parameters
        ----------
        recorded_alone : bool
            Whether the recorded effort alone counts, because the band holds nothing to explain.
        """
        recorded = recorded_sizes(self.search.data, model)
        if recorded_alone:
            return recorded
        return [max(pair) for pair in zip(recorded, self._together(model), strict=True)]

    def taken_back(self, model: FittedModel) -> dict[int, str]:
        """Reasons against terms of which others take back more than half.

        All together explain no more than the base model leaves.

        Returns
        -------
        mapping of place to str
            Places are those of `model.terms`.
        """
        left = self.left(self.search.start) / self.scale
        return {
            k: f"its own effort, {share:.1%}, is mostly taken back by the other causes: the base "
            f"model leaves {left:.1%}"
            for k, share in enumerate(self._together(model))
            if share > TAKEN_BACK * left
        }

    def _together(self, model: FittedModel) -> list[float]:
        """Rms of each term's own effort, with the others of its law, over that of the effort."""
        efforts = own_efforts(self.search.data, model, self.space)
        parts = (efforts[list(model.of_law(t))] for t in model.terms)
        return [rms(np.sum(part, axis=0)) / self.scale for part in parts]

    def against_all(self, kept: Sequence[int]) -> str | None:
        """Why no cause is named beside a part of the terms; None where nothing is against it."""
        return unphysical(self.search.data, self.search.start, self.fitted(kept), self.tolerance)

    def information_kept(self, kept: Sequence[int]) -> float:
        """Least share of what the motion says of a base parameter that it says beside vibrations.

        Without vibrations it is one.
        """
        model, valid = self.fitted(kept), self.search.data.valid
        columns = model.derivatives[valid]
        base = unit_length(columns[:, : len(PARAMETERS)])[0]
        waves = [
            columns[:, model.columns_of(k)]
            for k, t in enumerate(model.terms)
            if t.candidate == VIBRATION
        ]
        if not waves:
            return 1.0
        basis = orthonormal(np.hstack(waves))
        beside = base - basis @ (basis.T @ base)
        alone, left = (np.diag(np.linalg.pinv(part.T @ part)) for part in (base, beside))
        return float(np.min(alone / left))

    def of_a_chain(self, kept: Sequence[int]) -> list[int]:
        """Those of some terms, by their places, that say no more than a sound drive's chain does.

        Their own efforts count, but for where friction winds up any chain: reversals, and all that
        is no farther from a stop than a sound chain gives way. Where the model leaves more than
        noise, they may be traces of something else, whatever their size.
        """
        stiff = [k for k in kept if self.sound(k)]
        if not stiff or self.structure(model := self.fitted(kept)):
            return stiff
        data, travel = self.search.data, held_travel(model)
        held = [may_be_held(s, travel)[s.sample_index] for s in data.segments]
        efforts = own_efforts(data, model, self.space) * ~np.concatenate(held)[data.valid]
        sizes = dict(zip(kept, map(rms, efforts), strict=True))
        return [k for k in stiff if sizes[k] < STIFF_CHAIN * self.tolerance]

    def sound(self, place: int) -> bool:
        """Whether the chain that a term of the model says is as stiff as that of a sound drive.

        Without the terms, the base parameters may be far off: an inertia of zero beside hysteresis.
        """
        t = self.model.terms[place]
        if t.candidate == VIBRATION:
            return False
        excitation = replace(self.search.excitation, base=self.model.base)
        return named(t.candidate.effect).search.sound(t.values, excitation)

    def degenerate(self, place: int) -> str:
        """Why a term of the model is another effect, or no part of the axis; nothing where it is
        neither."""
        t = self.model.terms[place]
        if t.candidate == VIBRATION:
            return ""
        return named(t.candidate.effect).search.degenerate(t.values, float(self.model.base[0]))

    def phases(self, kept: Sequence[int]) -> dict[int, str]:
        """Reasons against delays along one sinusoid beside which more than noise is left."""
        delays = [k for k in kept if self.model.terms[k].candidate.delays]
        if not delays or self.search.data.several_speeds or self.rest(self.fitted(kept)) == 0.0:
            return {}
        reason = "along one sinusoid, all that answers with a phase looks like a delay"
        return dict.fromkeys(delays, reason)

    def doubtful_sizes(self, kept: Sequence[int]) -> dict[int, str]:
        """Reasons against terms that have no certain or no possible size beside those kept, or have
        essential parameters near zero.

        What stood beside them in the search may have left.
        """
        data, model = self.search.data, self.fitted(kept)
        bounded = (_at_bounds(model, place) for place in range(len(kept)))
        found = zip(kept, near_zero(data, model), bounded, unsized(data, model), strict=True)
        doubts = {}
        for k, near, most, unknown in found:
            if near:
                doubts[k] = nearly_none(near)
            elif most:
                doubts[k] = f"its {', '.join(most)} would be larger than any machine's"
            elif unknown:
                doubts[k] = "its size is as uncertain as it is large"
        return doubts

    def rest(self, model: FittedModel) -> float:
        """Share of the effort that a model leaves beyond noise."""
        noise = noise_limit(self.floor.rms, self.floor.uncertainty)
        return beyond(self.left(model), noise) / self.scale

    def outweighed(self, model: FittedModel, doubts: Iterable[int]) -> bool:
        """Whether one of the doubtful causes, by their places in the selected model, is worth
        naming, and larger than what a model without them leaves."""
        least, shares = max(self.rest(model), self.tolerance / self.scale), self.shares(self.model)
        doubtful = (k for k in doubts if self.model.terms[k].candidate != VIBRATION)
        return any(shares[k] > least for k in doubtful)

    def structure(self, model: FittedModel) -> bool:
        """Whether a model leaves more than noise, discrepancy and tolerance allow."""
        samples = np.count_nonzero(self.search.data.valid)
        discrepancy = float(np.sqrt(self.search.discrepancy(model) / samples))
        left = self.left(model)
        floor = self.floor
        return structure_left(
            left, floor.rms, floor.uncertainty, discrepancy, self.tolerance, self.scale
        )


def _at_bounds(model: FittedModel, place: int) -> list[str]:
    """Linear parameters of one term that a bound other than zero holds."""
    linear, free = model.terms[place].linear, model.free[model.columns_of(place)]
    of_each = zip(linear.items(), free, strict=True)
    return [name for (name, value), moves in of_each if value and not moves]
