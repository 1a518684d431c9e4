"""Entry point of gain design: from a model of a drive to the gains of all its axes."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from os import PathLike
from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.control.compensation import loop_delay_s, plant_of
from edge_ident.control.gain_design import GainDesign, design
from edge_ident.control.position_loop import LoopHardware, open_loop
from edge_ident.drive.description import Drive, given_drive
from edge_ident.errors import GainError
from edge_ident.model.model import AxisModel
from edge_ident.model.model_files import GivenModel, given_model
from edge_ident.support.given import number
from edge_ident.support.rows import Drawable
from edge_ident.support.words import listed

CONTROL_DELAY_S: Final = 0.0005
"""Time from the encoder latch to the new effort, where no board is there to say it."""


@dataclass(frozen=True)
class OpenLoop:
    """Frequency response of a designed loop, opened at the effort, with the nominal inertia.

    Attributes
    ----------
    omega_rad_s : (N,) array
        Frequencies, increasing, up to nearly the Nyquist frequency.
    response : (N,) complex array
    """

    omega_rad_s: NDArray[np.float64]
    response: NDArray[np.complex128]


@dataclass(frozen=True, repr=False)
class GainDesigns(Drawable):
    """The gains of a drive.

    `table` has a row for each number of each axis: bandwidth, margins, gains. `plot` draws the open
    loop of every axis, with its margins.

    Attributes
    ----------
    axes : mapping of axis name to GainDesign
    loops : mapping of axis name to OpenLoop

    Examples
    --------
    >>> import edge_ident
    >>> designs = edge_ident.design_gains(edge_ident.reduced_model())
    >>> print(designs)  # doctest: +ELLIPSIS
    gains, in N·m, rad and s
    ...
    """

    axes: Mapping[str, GainDesign]
    loops: Mapping[str, OpenLoop]


def design_gains(
    model: GivenModel,
    drive: Drive | str | PathLike[str] | None = None,
    *,
    bandwidth_rad_s: float | None = None,
    control_delay_s: float = CONTROL_DELAY_S,
    at_s: float | None = None,
) -> GainDesigns:
    """Design the controller gains of every axis of a model; nothing is written to a board.

    Design gains from an identification only where that is `trusted`.

    Parameters
    ----------
    model : Model, result with a model, str or Path
    drive : Drive, str or Path, optional
        Tells sampling, encoders and effort limits; without one, the built-in drive's.
    bandwidth_rad_s : float, optional
        Of the closed loop; without it, the highest that keeps the margins.
    control_delay_s : float
        Time from the encoder latch to the new effort.
    at_s : float, optional
        Time of the model's recording that the gains are to fit: its end, for the machine as it is
        now. Without it, effects that change base parameters in time are left out.

    Returns
    -------
    GainDesigns

    Raises
    ------
    DataError
        The drive description lacks an axis.
    GainError
        An axis that no drive moves acts on one; the parameters are not physical or not known well
        enough, or the margins are not kept.

    Examples
    --------
    >>> import edge_ident
    >>> found = edge_ident.identify(edge_ident.simulate())
    >>> designs = edge_ident.design_gains(found.model, bandwidth_rad_s=12.0)
    >>> designs.axes["x"].phase_margin_deg > 50.0
    True
    """
    model = given_model(model)
    if bandwidth_rad_s is not None:
        number("bandwidth_rad_s", bandwidth_rad_s, 1e-3, 1e5, "give rad/s, or leave it out")
    number("control_delay_s", control_delay_s, 0.0, 1.0, "give seconds, such as 0.0005")
    if model.passive:
        raise GainError(
            f"the axes carry {listed(model.passive)}, which no drive moves: how that swings in the "
            "loop is not known",
            "hold it fast, record that, and design gains from the new recording",
        )
    described = given_drive(drive)
    designs, loops = {}, {}
    for name, axis in model.axes.items():
        hardware = _hardware(described, name, control_delay_s)
        designs[name] = design(axis, hardware, bandwidth_rad_s, at_s)
        loops[name] = _open_loop(designs[name], axis, hardware)
    return GainDesigns(designs, loops)


def _hardware(drive: Drive, axis: str, control_delay_s: float) -> LoopHardware:
    drive.check_axes([axis])
    described = drive.axes[axis]
    return LoopHardware(
        drive.sampling_period_s,
        control_delay_s,
        described.encoder_resolution_rad,
        described.effort_limit_nm,
    )


def _open_loop(found: GainDesign, axis: AxisModel, hardware: LoopHardware) -> OpenLoop:
    delayed = replace(hardware, control_delay_s=hardware.control_delay_s + loop_delay_s(axis))
    return OpenLoop(*open_loop(found.gains, plant_of(axis), delayed))
