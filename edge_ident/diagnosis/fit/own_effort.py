"""A cause's own effort: the part of its contribution that the base model cannot express.

Friction that bends, for example, mostly takes the place of viscous friction. Only what is
orthogonal to the base model's columns is new. Shares, ranks and comparisons of causes use it.
"""

import numpy as np
from numpy.typing import NDArray

from edge_ident.diagnosis.fit.fitting import FittedModel, jacobian_of
from edge_ident.diagnosis.fit.projection import orthonormal
from edge_ident.diagnosis.fit.summary import nonzero_rms
from edge_ident.diagnosis.fit.term_effort import contributions
from edge_ident.diagnosis.prepare.axis_data import AxisData
from edge_ident.model.model import PARAMETERS
from edge_ident.signals.metrics import rms

Array = NDArray[np.float64]


def base_space(data: AxisData, start: FittedModel) -> Array:
    """Orthonormal basis (n, K) of the columns of the base parameters, and of each recording's own
    offset, at the valid samples.

    Timing is none of them: it is a property of the record, known to a part of a sample.
    """
    timing = len(PARAMETERS) + np.arange(len(data.segments))
    columns = jacobian_of(data, start)[data.valid, start.base_columns]
    return orthonormal(np.delete(columns, timing, axis=1))


def own_efforts(data: AxisData, model: FittedModel, space: Array) -> Array:
    """Own effort (T, n) of each added term at the valid samples.

    Parameters
    ----------
    space : (n, R) array
        Of the base model's columns (`base_space`).
    """
    parts = contributions(data, model)
    efforts = np.array(parts).reshape(len(parts), len(data.effort))[:, data.valid]
    return np.asarray(efforts - (efforts @ space) @ space.T)


def own_shares(data: AxisData, model: FittedModel, space: Array) -> list[float]:
    """Rms of each term's own effort over the rms of the measured effort."""
    scale = nonzero_rms(data.effort[data.valid])
    return [rms(effort) / scale for effort in own_efforts(data, model, space)]
