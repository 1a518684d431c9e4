"""Checks of a diagnosed axis: what speaks against any cause, or limits what the recording shows."""

from collections.abc import Sequence

from edge_ident.diagnosis.fit.fitting import FittedModel
from edge_ident.diagnosis.prepare.axis_data import AxisData
from edge_ident.estimation.trust import Finding
from edge_ident.signals.recording import Recording


def findings(
    recordings: Sequence[Recording],
    name: str,
    data: AxisData,
    base: FittedModel,
    extended: FittedModel,
) -> tuple[Finding, ...]:
    """Check one axis.

    Parameters
    ----------
    recordings : sequence of Recording
    name : str
        Of the axis.
    data : AxisData
    base, extended : FittedModel
        The extended model is the one that the selection ends with.

    Returns
    -------
    tuple of Finding
        Where one has `blocks`, no cause may be named.
    """
    return ()
