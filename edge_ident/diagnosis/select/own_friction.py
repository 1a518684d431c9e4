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
        a friction is negative.
    """
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
            physical = all(np.all(each[name] >= 0.0) for name in FRICTION)
            return moved if physical else None
    return None
