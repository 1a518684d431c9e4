"""What a recording cannot show: effects that, in this motion, look like the base model."""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.diagnosis.fit.candidates import Candidate
from edge_ident.diagnosis.fit.fitting import Fitted
from edge_ident.diagnosis.result import NotTestable
from edge_ident.diagnosis.select.search import DECISIVE, Search
from edge_ident.model.effects import catalogue, named

Array = NDArray[np.float64]

_LARGE: Final = 0.1
"""Share of the effort; an effect that could hide that much is not tested."""
_TINY: Final = float(np.finfo(float).tiny)


def not_testable(search: Search, model: Fitted, noise: float) -> tuple[NotTestable, ...]:
    """Effects that are not in a model and of which a tenth of the effort could go unseen.

    Parameters
    ----------
    search : Search
    model : Fitted
    noise : float
        Rms of what the model leaves at the clear samples.
    """
    view = search.view
    effort = float(np.sqrt(np.mean(view.effort[view.clear] ** 2)))
    found = {f.candidate.effect for f in model.found}
    missing = []
    for name in catalogue():
        if name in found:
            continue
        experiment = named(name).search.experiment
        if named(name).needs_source and not view.other_axes:
            reason = "no other axis moves in this recording"
            missing.append(NotTestable(name, reason, experiment))
            continue
        hidden = min(
            (
                _hidden(search, model, candidate, noise)
                for candidate in search.candidates
                if candidate.effect == name
            ),
            default=0.0,
        )
        if hidden > _LARGE * effort:
            missing.append(NotTestable(name, _reason(hidden / effort), experiment))
    return tuple(missing)


def _hidden(search: Search, model: Fitted, candidate: Candidate, noise: float) -> float:
    """Rms effort that a candidate of typical shape may have without being noticed."""
    samples = search.samples
    cost = search.penalty(candidate) + DECISIVE
    noticed = noise * np.sqrt(np.expm1(cost / samples))
    share = float(np.median(search.own_shares(candidate, model)))
    return float(noticed / max(share, _TINY))


def _reason(hidden: float) -> str:
    if hidden > 10.0:
        return "in this motion it looks exactly like the base model's terms"
    return f"in this motion it could make up {hidden:.0%} of the effort and not be noticed"
