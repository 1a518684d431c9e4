"""In which of several recordings each cause of the common model shows."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from edge_ident.diagnosis.fit.block_gain import gain_of
from edge_ident.diagnosis.fit.candidates import cached_effort
from edge_ident.diagnosis.fit.fitting import FittedModel, fit
from edge_ident.diagnosis.prepare.axis_data import AxisData
from edge_ident.diagnosis.result import Cause
from edge_ident.signals.recording import Recording


def with_sources(
    found: Sequence[Cause], data: AxisData, model: FittedModel, recordings: Sequence[Recording]
) -> list[Cause]:
    """Causes with the recordings in which each acts and certainly reduces the residual.

    Parameters
    ----------
    found : sequence of Cause
        In the order of the model's terms.
    data : AxisData
        Of all recordings together.
    model : FittedModel
        Fitted to them.
    recordings : sequence of Recording
    """
    sources = tuple(recording.source for recording in recordings)
    if len(sources) == 1:
        return [replace(cause, shown_in=sources) for cause in found]
    shown = []
    for k, cause in enumerate(found):
        less = fit(data, model.template, model.base, model.without(k))
        acting = cached_effort(data, model.axis) != cached_effort(data, model.axis_without([k]))
        shows = []
        for number, source in enumerate(sources):
            here = data.valid & (data.recording == number)
            if not np.any(acting[here]):
                continue  # what happens once moves the base parameters of all recordings
            before, after = ((data.effort - m.predicted)[here] for m in (less, model))
            if gain_of(data.block[here], before, after).certain:
                shows.append(source)
        shown.append(replace(cause, shown_in=tuple(shows)))
    return shown
