"""The shift of an effort, found beside the causes.

An effort is moved into step before any cause is known. A dead band asks for a shift of its own
there, and what it lacks is then in the model to first order only: the rest looks like a spring
with much damping. So an effort is moved again beside the causes that were found.
"""

from collections.abc import Sequence
from dataclasses import replace
from operator import is_

import numpy as np

from edge_ident.diagnosis.fit.fitting import FittedModel, FittedTerm, delayed, fit
from edge_ident.diagnosis.prepare.axis_data import AxisData
from edge_ident.diagnosis.prepare.timing import MOST_MOVES, moved_beside
from edge_ident.diagnosis.select.hidden_delay import delay_like_last
from edge_ident.diagnosis.select.selection import Selected
from edge_ident.diagnosis.select.thresholds import DECISIVE


def data_in_step(selected: Selected) -> AxisData | None:
    """The data of an axis with its effort in step beside its causes, or beside the first of them.

    A few causes are asked first: the others may be what the shift was taken for.

    Parameters
    ----------
    selected : Selected

    Returns
    -------
    AxisData or None
        None where no other shift explains decidedly more than the selected model.
    """
    search, start, data = selected.search, selected.start, selected.search.data
    if data.late or delayed(selected.supported.model.axis):
        return None
    best, found = search.criterion.value(selected.supported.model) - DECISIVE.value, None
    vibrations, causes = delay_like_last(selected)
    for count in range(1, len(causes) + 1):
        moved, model = _moved(data, start, (*vibrations, *causes[:count]))
        value = replace(search.criterion, data=moved).value(model)
        if moved is not data and value < best:
            best, found = value, moved
    return found


def _moved(
    data: AxisData, start: FittedModel, beside: Sequence[FittedTerm]
) -> tuple[AxisData, FittedModel]:
    """The data with every effort in step beside some causes, and the model of these."""
    terms = tuple(beside)
    model = fit(data, start.template, start.base, terms)
    for _ in range(MOST_MOVES):
        own = np.concatenate([model.base, model.timing])
        others = model.predicted - model.derivatives[:, model.base_columns] @ own
        segments = tuple(map(moved_beside, data.segments, data.by_segment(others)))
        if all(map(is_, segments, data.segments)):
            break
        effort = np.concatenate([s.effort[s.sample_index] for s in segments])
        data = replace(data, segments=segments, effort=effort, cache={})
        model = fit(data, start.template, model.base, terms)
    return data, model
