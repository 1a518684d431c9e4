"""The search for causes on one axis, and what it is worth."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.diagnosis.above_band.held import may_hold_order
from edge_ident.diagnosis.above_band.sinusoid_search import ABOVE
from edge_ident.diagnosis.above_band.spectrum import WideSignals, accounts
from edge_ident.diagnosis.elsewhere import leaves_structure
from edge_ident.diagnosis.fit.fitting import fit
from edge_ident.diagnosis.fit.held_out import standard_deviations
from edge_ident.diagnosis.fit.noise_floor import NoiseFloor, noise_floor, rms_left
from edge_ident.diagnosis.fit.summary import base_space, own_shares
from edge_ident.diagnosis.judge.causes import causes, strongest_first
from edge_ident.diagnosis.judge.judgement import Judgement, judge
from edge_ident.diagnosis.measures import Verdict
from edge_ident.diagnosis.nuisances import differences, instead_of_causes, own_values
from edge_ident.diagnosis.prepare.axis_data import AxisData
from edge_ident.diagnosis.recording_checks import controllers_laws, findings
from edge_ident.diagnosis.select.second_looks import (
    adequate_data,
    data_beside_causes,
    delayed_data,
    own_friction_data,
    without_massless_payloads,
)
from edge_ident.diagnosis.select.selection import (
    Selected,
    grown_model,
    moved_model,
    selected_model,
    settled_model,
    unsearched,
)
from edge_ident.estimation.trust import Finding
from edge_ident.model.model import AxisModel, Model
from edge_ident.signals.recording import Recording

Array = NDArray[np.float64]


@dataclass(frozen=True)
class AxisSearch:
    """What the search on prepared data found, and what it is worth.

    Attributes
    ----------
    checks : tuple of Finding
        On the recordings; those that block forbid every cause.
    """

    selected: Selected
    floor: NoiseFloor
    checks: tuple[Finding, ...]
    judged: Judgement

    @property
    def data(self) -> AxisData:
        """The data, with the samples that were compared in the end."""
        return self.selected.search.data

    @property
    def blocked(self) -> str | None:
        """Why the recordings forbid every cause, if they do."""
        return _blocked(self.checks)


def search_axis(
    recordings: Sequence[Recording],
    name: str,
    efforts: Sequence[Sequence[Finding]],
    tolerance: float,
    data: AxisData,
    known: AxisModel,
) -> AxisSearch:
    """Search for causes, and judge them; where they hid how the effort is shifted, or that it is
    late, search again.

    Parameters
    ----------
    efforts : sequence of sequence of Finding
        On the effort of each recording.
    """
    data = adequate_data(data, known, tolerance)
    laws = controllers_laws(recordings, name, data)
    # what such a loop makes of the motion has no cause that is worth a search
    selected = unsearched(data, known) if laws else _selected(data, known, tolerance)
    said = [finding for each in (*efforts, laws) for finding in each]
    return _judged(recordings, name, said, tolerance, selected)


def _selected(data: AxisData, known: AxisModel, tolerance: float) -> Selected:
    """What is selected where the effort is shifted as it is beside the first causes, and where
    recordings may have friction of their own."""
    grown = grown_model(data, known)
    moved = data_beside_causes(grown)
    selected = settled_model(grown if moved is None else moved_model(moved, grown))
    for other in (own_friction_data, delayed_data):
        moved = other(selected)
        if moved is not None:
            again = selected_model(moved, known, selected)
            timed = _is_late(again, tolerance) or not moved.late
            rival = without_massless_payloads(selected) if other is own_friction_data else selected
            selected = again if timed and again.better_than(rival) else selected
    return selected


def _is_late(selected: Selected, tolerance: float) -> bool:
    """Whether a delay is among what was selected. Along one sinusoid it has to leave nothing: any
    phase of what goes on in the loop is a delay there."""
    data, model = selected.search.data, selected.supported.model
    if not selected.late or data.several_speeds:
        return selected.late
    return not leaves_structure(data, selected.start, model, tolerance)


def _judged(
    recordings: Sequence[Recording],
    name: str,
    said: Sequence[Finding],
    tolerance: float,
    selected: Selected,
) -> AxisSearch:
    """What was selected, judged beside what was said of the recordings."""
    search, start, model = selected.search, selected.start, selected.supported.model
    floor = noise_floor(search.data, start, float(model.base[0]))
    floor = floor.at_most(rms_left(search.data, model, search.samples))
    checks = findings(recordings, name, search.data, model, said)
    judged = judge(search, selected.supported, floor, tolerance, _blocked(checks))
    if _blocked(checks) is None:
        checks = (
            *checks,
            *_of_their_own(recordings, name, selected, judged.verdict, tolerance),
        )
        if _blocked(checks) is not None:
            judged = judge(search, selected.supported, floor, tolerance, _blocked(checks))
    return AxisSearch(selected, floor, checks, judged)


def _of_their_own(
    recordings: Sequence[Recording],
    name: str,
    selected: Selected,
    verdict: Verdict,
    tolerance: float,
) -> list[Finding]:
    """What the recordings have of their own and is no cause."""
    if verdict is not Verdict.ADEQUATE:
        anew = verdict is Verdict.UNEXPLAINED
        differ = differences(recordings, name, selected, tolerance, anew=anew)
        if differ:
            return differ
        instead = instead_of_causes(selected, tolerance)
        if instead is not None:
            return [instead]
    return own_values(recordings, name, selected.search.data, selected.supported.model)


def _blocked(checks: Sequence[Finding]) -> str | None:
    return next((check.message for check in checks if check.blocks), None)


# Whether the effort above the band holds the ripples that were found inside it.
#
# Inside the band an axis passes a ripple only where it is slow, such as near the ends of its
# stroke. What is seen at a few places fits waves of many periods. The same wave goes on where the
# axis is fast, above the band.

_RIPPLE: Final = "torque_ripple"
_MISSING: Final = "above the band, where the axis passes it faster, less than half of it is there"


def with_ripples_everywhere(
    found: AxisSearch, recordings: Sequence[Recording], name: str, tolerance: float
) -> AxisSearch:
    """The search without ripples that are not there above the band; these are suspected."""
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
