"""Whether each of several recordings has friction of its own.

Friction changes with the temperature, by some percent from day to day. A model with one friction
would have to explain the difference: by a payload that changes, for example.
"""

from dataclasses import replace
from typing import Final

import numpy as np

from edge_ident.diagnosis.fit.fitting import fit
from edge_ident.diagnosis.fit.own_columns import own_parameters
from edge_ident.diagnosis.prepare.axis_data import AxisData
from edge_ident.diagnosis.select.hidden_delay import causes_in_turn
from edge_ident.diagnosis.select.physics import FRICTION
from edge_ident.diagnosis.select.selection import Selected, fitted_base
from edge_ident.diagnosis.select.thresholds import DECISIVE
from edge_ident.diagnosis.tolerance import TOLERANCE
from edge_ident.model.effects import named
from edge_ident.signals.metrics import rms

OWN: Final = ("offset", *FRICTION)


def own_friction_data(selected: Selected) -> AxisData | None:
    """The data of an axis with friction of their own for its recordings.

    Parameters
    ----------
    selected : Selected

    Returns
    -------
    AxisData or None
        None where that, with a part of the causes, explains no more than the selected model, or
        a friction is negative that is no share of one.
    """
    selected = without_massless_payloads(selected)
    search, start, data = selected.search, selected.start, selected.search.data
    _, *others = data.segments
    if not others:
        return None
    moved = replace(data, own=OWN, cache={})
    criterion = replace(search.criterion, data=moved, start=fitted_base(moved, start.template))
    least = search.criterion.value(selected.supported.model) - DECISIVE.value
    for beside in causes_in_turn(selected, none=True):
        model = fit(moved, start.template, start.base, beside)
        if criterion.value(model) < least:
            each = own_parameters(moved, model.base, model.own)
            shared = any(named(t.candidate.effect).search.shares_friction for t in beside)
            physical = all(np.all(each[name] >= 0.0) for name in FRICTION)
            return moved if physical or shared else None
    return None


def without_massless_payloads(selected: Selected) -> Selected:
    """What was selected without payloads whose mass is not worth naming: they are friction."""
    search, model = selected.search, selected.supported.model
    valid = search.data.valid
    least = TOLERANCE * rms(search.data.effort[valid])
    kept = []
    for place, t in enumerate(model.terms):
        mass = t.linear.get("inertia") if named(t.candidate.effect).changes_base else None
        columns = model.jacobian[valid, model.columns_of(place)]
        if mass is None or abs(mass) * rms(columns[:, [*t.linear].index("inertia")]) > least:
            kept.append(place)
    if len(kept) == len(model.terms):
        return selected
    fitted = search.fit(model.base, tuple(model.terms[place] for place in kept))
    return replace(selected, supported=selected.supported.of(fitted, kept))
