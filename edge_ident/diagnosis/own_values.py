"""In what base parameters several recordings of an axis differ, in words."""

from collections.abc import Iterator, Sequence
from typing import Final

from edge_ident.diagnosis.fit.fitting import FittedModel
from edge_ident.diagnosis.fit.own_columns import one_way
from edge_ident.diagnosis.prepare.axis_data import AxisData
from edge_ident.diagnosis.select.own_scale import OwnScale
from edge_ident.diagnosis.tolerance import TOLERANCE
from edge_ident.estimation.least_squares import coloured_std
from edge_ident.estimation.trust import Finding
from edge_ident.model.model import PARAMETERS
from edge_ident.signals.conditioning import unit_length
from edge_ident.signals.metrics import rms
from edge_ident.signals.recording import Recording
from edge_ident.signals.timing import CERTAIN
from edge_ident.support.words import listed

_OF_COLUMN: Final = {
    "effort": ("a motion", "torque constant, rated torque and units"),
    "position": ("an effort", "gear ratio, resolution of the encoder and units"),
    "time": ("an effort", "sampling period and units"),
}
"""What is the same beside a column of another scale, and what to compare."""


_SHARED: Final = Finding(
    "offset_shared",
    "each recording moves one way, so one offset is taken for all: Coulomb friction is wrong by as "
    "much as their offsets differ",
    "record one motion that goes both ways, or do not tare the effort in between",
    blocks=False,
)


def own_values(
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
    if len(recordings) < 2:
        return []
    if one_way(data):
        return [_SHARED]
    offsets, frictions = [], []
    last, effort_unit = recordings[-1].source, recordings[-1].axes[name].effort_unit
    for parameter, source, value in _certain(recordings, data, model):
        if parameter == "offset":
            offsets.append(f"{value:+.3g} {effort_unit} in {source}")
        else:
            share = value / float(model.base[PARAMETERS.index(parameter)])
            frictions.append(f"{parameter.replace('_', ' ')} {share:+.1%} in {source}")
    found = []
    if offsets:
        found.append(
            Finding(
                "offsets_differ",
                "each recording was fitted with its own offset of the effort, because they differ: "
                f"{listed(offsets)}, relative to {last}",
                "let the machine warm up before each recording, and do not tare the effort in "
                "between",
                blocks=False,
            )
        )
    if frictions:
        found.append(
            Finding(
                "friction_differs",
                "each recording was fitted with its own friction, because they differ: "
                f"{listed(frictions)}, relative to {last}; the model has the mean",
                "let the machine warm up before each recording: friction falls as it does",
                blocks=False,
            )
        )
    return found


def scale_differs(source: str, scale: OwnScale) -> Finding:
    """What forbids to name causes that one factor of a recording's column explains as well.

    Parameters
    ----------
    source : str
        The recording.
    scale : OwnScale
    """
    such, compare = _OF_COLUMN[scale.column]
    return Finding(
        "scale_differs",
        f"the {scale.column} of {source} is {scale.factor:.3g} times what the other recordings "
        f"have for such {such}: with that factor, one model fits all",
        f"compare {compare} of the recordings; if they are the same, the machine is not",
        blocks=True,
    )


def _certain(
    recordings: Sequence[Recording], data: AxisData, model: FittedModel
) -> Iterator[tuple[str, str, float]]:
    """Own parameters that certainly differ by what is worth naming: name, recording and value."""
    first = len(PARAMETERS) + len(recordings)
    columns = model.jacobian[data.valid]
    unit, length = unit_length(columns)
    std = coloured_std(unit, (data.effort - model.predicted)[data.valid]) / length
    scale = rms(data.effort[data.valid])
    places = range(first, model.base_columns.stop)
    each = [(parameter, r.source) for parameter in data.own for r in recordings[:-1]]
    for place, (parameter, source) in zip(places, each, strict=True):
        value = float(model.linear_parameters[place])
        size = abs(value) * rms(columns[:, PARAMETERS.index(parameter)])
        if abs(value) > CERTAIN * std[place] and size > TOLERANCE * scale:
            yield parameter, source, value
