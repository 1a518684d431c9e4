"""What the base model of a diagnosis misses, from its prepared data."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from edge_ident.diagnosis.budget.account import Missed
from edge_ident.diagnosis.budget.curves import Stretch
from edge_ident.diagnosis.fit.fitting import FittedModel
from edge_ident.diagnosis.fit.noise_floor import NoiseFloor, kept_period
from edge_ident.diagnosis.prepare.axis_data import AxisData
from edge_ident.diagnosis.prepare.segment import Segment

Array = NDArray[np.float64]


def missed(
    data: AxisData,
    base: FittedModel,
    floor: NoiseFloor,
    units: tuple[str, str],
    laws: Mapping[str, Array],
    above: float = 0.0,
) -> Missed:
    """What a base model misses of prepared recordings.

    Parameters
    ----------
    data : AxisData
    base : FittedModel
        The base model, fitted to it.
    floor : NoiseFloor
    units : (str, str)
        Of position and effort.
    laws : mapping of effect to (n,) array
        What the effects of a diagnosis contribute.
    above : float
        Rms of what is missed above the band.
    """
    valid = data.valid
    return Missed(
        residual=(data.effort - base.predicted)[valid],
        base=base.jacobian[valid],
        effort=data.effort[valid],
        block=data.block[valid],
        stretches=[_stretch(s) for s in data.segments],
        noise=floor.rms,
        above=above,
        laws={name: part[valid] for name, part in laws.items()},
        turning=bool(data.turning),
        units=units,
        cutoff_hz=max(s.cutoff_hz for s in data.segments),
    )


def _stretch(s: Segment) -> Stretch:
    return Stretch(
        motion=s.motion,
        others=s.others,
        at=s.sample_index[s.valid],
        filter=lambda rows: s.filter(rows)[..., s.valid],
        lap=kept_period(s),
    )
