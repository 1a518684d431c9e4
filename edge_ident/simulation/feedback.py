"""Gains for simulated drives: soft as at a board's start-up, or stiff as designed for the drive."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.control.gain_design import design
from edge_ident.control.position_loop import LoopHardware
from edge_ident.model.effects import named
from edge_ident.model.model import AxisModel, Estimate, base_axis
from firmware_interface.gains import AxisGains

Array = NDArray[np.float64]

_SOFT_LAG: Final = 1.0 / 60.0
"""Part of the motion's amplitude by which the peak effort makes a soft axis lag."""
_DAMPING_RATIO: Final = 0.7
_SAMPLES_PER_RADIAN: Final = 10.0
"""Fewest samples per radian at the loop's natural frequency."""


def soft_gains(axis: AxisModel, motion: Array, period_s: float) -> list[AxisGains]:
    """Feedback alone, which lags far behind; on the built-in drive much like its start-up gains.

    Parameters
    ----------
    axis : AxisModel
    motion : (3, N) array
        Position, velocity and acceleration of the reference.
    period_s : float

    Returns
    -------
    list of AxisGains
        One for every drive of the model.
    """
    amplitude = 0.5 * float(np.ptp(motion[0]))
    fastest = 1.0 / (_SAMPLES_PER_RADIAN * period_s)
    gains = []
    parameters = np.atleast_2d(axis.parameters)
    for (inertia, viscous, _, _), peak in zip(
        parameters, peak_effort(parameters, motion), strict=True
    ):
        stiffness = min(peak / (_SOFT_LAG * amplitude), fastest * (viscous + fastest * inertia))
        damping = 2.0 * _DAMPING_RATIO * np.sqrt(inertia * stiffness)
        gains.append(
            AxisGains(
                proportional=float(stiffness),
                derivative=float(max(damping - viscous, 0.0)),
                integral=0.0,
                velocity_filter_s=4.0 * period_s,
                inertia_feedforward=0.0,
                viscous_feedforward=0.0,
                coulomb_feedforward=0.0,
                coulomb_smoothing_rad_s=1.0,
                offset_feedforward=0.0,
            )
        )
    return gains


def peak_effort(parameters: Array, motion: Array) -> Array:
    """Largest effort of base models (..., 4) along a motion (3, N), at most."""
    _, velocity, acceleration = motion
    smooth = parameters[..., [0]] * acceleration + parameters[..., [1]] * velocity
    return np.asarray(
        np.max(np.abs(smooth), axis=-1) + parameters[..., 2] + abs(parameters[..., 3])
    )


def stiff_gains(axis: AxisModel, hardware: LoopHardware) -> list[AxisGains]:
    """Gains that `edge_ident.control.gain_design` gives the base model, with its feed-forward.

    A spring before the encoder counts as well: no stiff loop closes around it.

    Raises
    ------
    GainError
        No gains keep the margins.
    """
    springs = [t for t in axis.terms if named(t.effect).compensation.series_resonance]
    found = []
    for drive, parameters in enumerate(np.atleast_2d(axis.parameters)):
        base = base_axis(Estimate(parameters, np.zeros(4)))
        own = (replace(t, values=_of_drive(t.values, drive)) for t in springs)
        found.append(design(replace(base, terms=(*base.terms, *own)), hardware).gains)
    return found


def _of_drive(values: Mapping[str, float | Array], drive: int) -> dict[str, float]:
    return {name: float(np.atleast_1d(x)[drive * (np.size(x) > 1)]) for name, x in values.items()}
