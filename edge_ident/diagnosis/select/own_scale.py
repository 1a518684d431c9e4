"""Whether one of several recordings has its effort in another scale.

A torque constant, a rated torque or a gain that differs makes inertia and all friction differ by
one factor. A payload and friction of their own for the recordings explain that, too, and need more
parameters for it.
"""

import math
from dataclasses import replace

import numpy as np
import scipy.optimize

from edge_ident.diagnosis.fit.fitting import fit
from edge_ident.diagnosis.select.selection import Selected
from edge_ident.diagnosis.select.thresholds import DECISIVE
from edge_ident.model.effects import named


def scale_instead(selected: Selected) -> tuple[int, float] | None:
    """A factor of one recording's effort that explains about as much as a changed base model.

    Parameters
    ----------
    selected : Selected

    Returns
    -------
    tuple of int and float, or None
        Place of the recording, and by what its effort is larger than in the others. None where no
        base parameter differs between the recordings, or a factor explains decidedly less.
    """
    search, model = selected.search, selected.supported.model
    data, criterion = search.data, search.criterion
    others = tuple(t for t in model.terms if not named(t.candidate.effect).changes_base)
    last = len(data.segments) - 1
    if not last or (len(others) == len(model.terms) and len(data.own) == 1):
        return None
    same = replace(data, own=("offset",), cache={})

    def left(logarithm: float, place: int) -> float:
        scale = np.where(data.recording == place, math.exp(logarithm), 1.0)
        scaled = replace(same, effort=data.effort / scale)
        fitted = fit(scaled, search.template, model.base, others)
        return float(np.sum(np.square((scale * (scaled.effort - fitted.predicted))[data.valid])))

    # of two recordings, either one may be it
    places = range(last + 1) if last > 1 else (last,)
    found = {place: scipy.optimize.minimize_scalar(left, args=(place,)) for place in places}
    place, best = min(found.items(), key=lambda pair: pair[1].fun)
    penalties = sum(criterion.penalty(t.candidate) for t in others) + math.log(criterion.samples)
    if criterion.misfit(best.fun) + penalties > criterion.value(model) + DECISIVE.value:
        return None
    return place, math.exp(best.x)
