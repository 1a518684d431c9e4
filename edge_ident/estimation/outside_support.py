"""Where a motion leaves the range in which a model's terms were supported."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from edge_ident.estimation.trust import Finding
from edge_ident.model.model import Term
from edge_ident.model.supported_range import SupportedRange, quantity_unit
from edge_ident.signals.conditioning import Signals, condition
from edge_ident.signals.recording import AxisRecord

if TYPE_CHECKING:
    from edge_ident.model.given_model import GivenModel
    from edge_ident.signals.given_recordings import Given

Array = NDArray[np.float64]


def outside_support(model: "GivenModel", recording: "Given") -> dict[str, list[Finding]]:
    """Say where a recording leaves the range of a model's terms.

    Parameters
    ----------
    model : Model, result with a model, str or Path
    recording : Recording, str, Path or data frame
        Axes that the model does not know are passed over.

    Returns
    -------
    mapping of axis name to list of Finding
        The list is empty where the motion stays inside, or the ranges are not known.

    Examples
    --------
    >>> import edge_ident
    >>> recording = edge_ident.simulate()
    >>> model = edge_ident.identify(recording).model
    >>> edge_ident.outside_support(model, recording)
    {'x': [], 'z': []}
    """
    from edge_ident.model.given_model import given_model
    from edge_ident.signals.given_recordings import given_recording

    model, recording = given_model(model), given_recording(recording, "compare with a model")
    found = {}
    for name, axis in recording.axes.items():
        if name in model.axes:
            signals = condition(
                recording.time_s,
                axis.position,
                axis.effort,
                effort_shift_s=recording.effort_shift_s,
            )
            seen = range_of(signals, axis, signals.moving, signals.effort)
            found[name] = departures(model.axes[name].terms, seen, axis)
    return found


def range_of(
    signals: Signals, axis: AxisRecord, part: NDArray[np.bool_] | NDArray[np.intp], effort: Array
) -> SupportedRange:
    """The range of an axis at some samples.

    Parameters
    ----------
    signals : Signals
        Of N samples.
    axis : AxisRecord
        As recorded.
    part : (N,) array of bool, or array of int
        The samples.
    effort : (N,) array
        Filtered as the signals, with what was compensated.
    """
    position = signals.grid.resampled(axis.position)
    columns = (position, signals.regressor[:, 1], signals.regressor[:, 0], effort)
    return SupportedRange.of(*(column[part] for column in columns))


def departures(terms: Sequence[Term], seen: SupportedRange, axis: AxisRecord) -> list[Finding]:
    """One finding for each range that a motion leaves; terms of one range share it.

    Parameters
    ----------
    terms : sequence of Term
    seen : SupportedRange
        Of the motion.
    axis : AxisRecord
        Tells the units.
    """
    by_range: dict[SupportedRange, list[str]] = {}
    for term in terms:
        if term.supported is not None:
            by_range.setdefault(term.supported, []).append(term.effect)
    found = []
    for supported, effects in by_range.items():
        left = [
            departure.sentence(quantity_unit(departure.quantity, *axis.units))
            for departure in supported.left_by(seen)
        ]
        if left:
            found.append(
                Finding(
                    "outside_support",
                    f"the motion leaves the range in which {', '.join(dict.fromkeys(effects))} "
                    f"was supported: {', '.join(left)}",
                    "diagnose a recording of this motion; outside the range the model extrapolates",
                    blocks=False,
                )
            )
    return found
