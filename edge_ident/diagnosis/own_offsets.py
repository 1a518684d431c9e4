"""Whether the effort of an axis has another offset in each of several recordings."""

from collections.abc import Sequence

import numpy as np

from edge_ident.diagnosis.fit.fitting import FittedModel
from edge_ident.diagnosis.prepare.axis_data import AxisData
from edge_ident.diagnosis.tolerance import TOLERANCE
from edge_ident.estimation.columns import unit_length
from edge_ident.estimation.covariance import coloured_std
from edge_ident.estimation.trust import Finding
from edge_ident.model.model import PARAMETERS
from edge_ident.signals.metrics import rms
from edge_ident.signals.recording import Recording
from edge_ident.signals.timing import CERTAIN
from edge_ident.support.words import listed


def own_offsets(
    recordings: Sequence[Recording], name: str, data: AxisData, model: FittedModel
) -> list[Finding]:
    """Say by how much, where that is certain and worth naming; nothing otherwise.

    Parameters
    ----------
    recordings : sequence of Recording
    name : str
        Of the axis.
    data : AxisData
    model : FittedModel
        Fitted to all of them.
    """
    first = len(PARAMETERS) + len(recordings)
    apart = model.linear_parameters[first : model.base_columns.stop]
    if not len(apart):
        return []
    unit, length = unit_length(model.jacobian[data.valid])
    std = coloured_std(unit, (data.effort - model.predicted)[data.valid]) / length
    least = TOLERANCE * rms(data.effort[data.valid])
    certain = np.abs(apart) > np.maximum(least, CERTAIN * std[first : first + len(apart)])
    effort_unit = recordings[-1].axes[name].effort_unit
    differ = [
        f"{offset:+.3g} {effort_unit} in {recording.source}"
        for recording, offset, differs in zip(recordings[:-1], apart, certain, strict=True)
        if differs
    ]
    if not differ:
        return []
    return [
        Finding(
            "offsets_differ",
            "each recording was fitted with its own offset of the effort, because they differ: "
            f"{listed(differ)}, relative to {recordings[-1].source}",
            "let the machine warm up before each recording, and do not tare the effort in between",
            blocks=False,
        )
    ]
