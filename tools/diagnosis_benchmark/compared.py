"""How much of a hidden fault lies in what a diagnosis compares.

It compares the effort below a cut-off that the encoder's noise sets, weighted so that the noise is
white, and fades out reversals. What a fault adds, as the plant says, is treated likewise here, and
what the base model can express of that is taken out. An axis is adequate where what is left of the
effort by the same measure is within the tolerance.
"""

import numpy as np
from numpy.typing import NDArray

from edge_ident.diagnosis.fit.candidates import base_regressor
from edge_ident.diagnosis.fit.linear import orthonormal
from edge_ident.diagnosis.prepare.preparation import prepare_axis
from edge_ident.signals.metrics import rms
from edge_ident.signals.recording import Recording

Array = NDArray[np.float64]


def compared_shares(recording: Recording, name: str, added: Array) -> list[float]:
    """Rms of what each fault adds beyond the base model, over the rms effort, as compared.

    Parameters
    ----------
    recording : Recording
    name : str
        Of the axis with the faults.
    added : (K, M) array
        What each of them adds to the effort at every sample.

    Raises
    ------
    DataError
        Hardly any sample shows the axis in motion.
    """
    data = prepare_axis([recording], name)
    (segment,) = data.segments
    base = orthonormal(np.column_stack([base_regressor(data), data.timing_columns])[data.valid])
    seen = segment.sampled(added)[:, data.valid]
    left = seen - (seen @ base) @ base.T
    return [rms(each) / rms(data.effort[data.valid]) for each in left]
