"""A delay that larger causes hide.

An effort is late where the delay is most of what the base model leaves (`prepare.timing`). Beside a
ripple, say, it is little of that, and only timing up to its limit is in the model. What timing
lacks then looks like a dead band or like friction that follows the load. So the question is asked
again beside the causes that were found.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from edge_ident.diagnosis.fit.external_vibrations import VIBRATION
from edge_ident.diagnosis.fit.fitting import delayed
from edge_ident.diagnosis.fit.term_effort import contributions
from edge_ident.diagnosis.prepare.axis_data import AxisData
from edge_ident.diagnosis.prepare.timing import late_beside, out_of_step, whole_shift
from edge_ident.diagnosis.select.own_effort import base_space, own_shares
from edge_ident.diagnosis.select.selection import Selected

Array = NDArray[np.float64]


def delayed_data(selected: Selected) -> AxisData | None:
    """The data of an axis as it was recorded, where its causes hid that the effort is late.

    The strongest causes alone are asked first: the weakest may be what the delay was taken for.

    Parameters
    ----------
    selected : Selected

    Returns
    -------
    AxisData or None
        None where the effort is in time, or was late before.
    """
    search, start, model = selected.search, selected.start, selected.supported.model
    data = search.data
    if data.late or delayed(start.template):
        return None
    shares = own_shares(data, model, base_space(data, start))
    ranked = sorted(zip(shares, model.terms, strict=True), key=lambda pair: -pair[0])
    terms = [term for _, term in ranked if term.candidate != VIBRATION]
    for count in range(1, len(terms) + 1):
        model = search.fit(start.base, tuple(terms[:count]))
        others = data.by_segment(np.sum(contributions(data, model), axis=0))
        if any(map(late_beside, data.segments, others)):
            return _out_of_step(data, others)
    return None


def _out_of_step(data: AxisData, others: list[Array]) -> AxisData:
    """The same data, with every effort where it was recorded."""
    shifts = map(whole_shift, data.segments, others)
    segments = tuple(map(out_of_step, data.segments, shifts))
    effort = np.concatenate([s.effort[s.sample_index] for s in segments])
    return replace(data, segments=segments, effort=effort, late=True, cache={})
