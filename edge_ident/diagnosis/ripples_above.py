"""Whether the effort above the band holds the ripples that were found inside it.

Inside the band an axis passes a ripple only where it is slow, such as near the ends of its stroke.
What is seen at a few places fits waves of many periods. The same wave goes on where the axis is
fast, above the band.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.diagnosis.above_band.accounts import accounts
from edge_ident.diagnosis.above_band.full_bandwidth import WideSignals
from edge_ident.diagnosis.above_band.line_again import may_hold_order
from edge_ident.diagnosis.above_band.sinusoid_search import ABOVE
from edge_ident.diagnosis.axis_search import AxisSearch
from edge_ident.diagnosis.fit.fitting import fit
from edge_ident.diagnosis.fit.held_out import standard_deviations
from edge_ident.diagnosis.fit.own_effort import base_space, own_shares
from edge_ident.diagnosis.judge.causes import causes, strongest_first
from edge_ident.diagnosis.structure_elsewhere import leaves_structure
from edge_ident.diagnosis.verdict import Verdict
from edge_ident.model.model import Model
from edge_ident.signals.recording import Recording

Array = NDArray[np.float64]

_RIPPLE: Final = "torque_ripple"
_MISSING: Final = "above the band, where the axis passes it faster, less than half of it is there"


def with_ripples_everywhere(
    found: AxisSearch, recordings: Sequence[Recording], name: str, tolerance: float
) -> AxisSearch:
    """The search without ripples that are not there above the band; these are suspected.

    Parameters
    ----------
    found : AxisSearch
    recordings : sequence of Recording
    name : str
        Of the axis.
    tolerance : float
        Smallest share of the rms effort that is worth naming.
    """
    data, judged = found.data, found.judged
    supported, model = judged.supported, judged.supported.model
    missing = _missing(found, recordings, name)
    if not missing:
        return found
    shares = own_shares(data, model, base_space(data, found.selected.start))
    every = causes(supported, shares, standard_deviations(data, model))
    kept = [k for k in range(len(model.terms)) if k not in missing]
    less = fit(data, model.template, model.base, tuple(model.terms[k] for k in kept))
    left = leaves_structure(data, found.selected.start, less, tolerance)
    suspected = [replace(every[k], decision=_MISSING) for k in missing]
    judgement = replace(
        judged,
        verdict=Verdict.UNEXPLAINED if left else judged.verdict,
        supported=supported.of(less, kept),
        suspected=strongest_first((*judged.suspected, *suspected)),
    )
    return replace(found, judged=judgement)


def _missing(found: AxisSearch, recordings: Sequence[Recording], name: str) -> list[int]:
    """Places of the ripples of which every recording holds less than half above the band."""
    model = found.judged.supported.model
    places = [k for k, t in enumerate(model.terms) if t.candidate.effect == _RIPPLE]
    if not places:
        return []
    others = tuple(t.model_term for k, t in enumerate(model.terms) if k not in places)
    axis = replace(model.axis, terms=(*model.template.terms, *others))
    for recording, segment in zip(recordings, found.data.segments, strict=True):
        wide = WideSignals.of(recording, name, segment, Model({name: axis}))
        waves = [wide.waves(wide.position, _rate(model.terms[k].values)) for k in places]
        mass = max(float(model.base[0]), 0.0)
        whole = accounts(wide, mass, np.concatenate([np.empty((0, len(wide.effort))), *waves]))[1]
        places = [k for k in places if not _may_hold(wide, whole, model.terms[k].values)]
    return places


def _rate(values: Mapping[str, Array]) -> float:
    """In rad per unit of position."""
    return math.tau / float(values["period"])


def _may_hold(wide: WideSignals, above: Array, values: Mapping[str, Array]) -> bool:
    """Whether the effort above the band (N,) may hold half of a ripple, or too little of the ripple
    is there to tell."""
    rate, amplitude = _rate(values), float(np.hypot(values["cosine"], values["sine"]))
    if wide.energy_above(np.array([rate]), white=False)[0] < ABOVE:
        return True
    return may_hold_order(wide, above, rate, amplitude)
