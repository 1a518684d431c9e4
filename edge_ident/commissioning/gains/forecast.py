"""What gains promise before they are in force: margins, and tracking on a recorded motion."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from edge_ident.commissioning.gains.drawn_loads import Grounds
from edge_ident.commissioning.gains.promise import Expected
from edge_ident.commissioning.gains.tracking_forecast import drawn_errors
from edge_ident.commissioning.motion.recorded_motion import RecordedMotion
from edge_ident.control.gain_design import worst_margins
from edge_ident.control.position_loop import LoopHardware
from edge_ident.errors import DataError, GainError, ModelError
from edge_ident.identification.identify import identify
from edge_ident.identification.result import Identification
from edge_ident.model.model import BOARD_UNITS, Model
from edge_ident.signals.recording import Recording
from firmware_interface.board import AxisLimits, BoardIdentity
from firmware_interface.gains import Bank


@dataclass(frozen=True)
class Forecast:
    """Margins and tracking error of one axis under one set of gains.

    Attributes
    ----------
    phase_margin_rad, gain_margin : float
        Smallest over the interval of the inertia; no phase margin stands for an unstable loop.
    tracking_rms, tracking_peak : Expected or None
        On the recorded motion; infinite for an unstable loop, None where no motion is known.
    """

    phase_margin_rad: float
    gain_margin: float
    tracking_rms: Expected | None = None
    tracking_peak: Expected | None = None

    @property
    def stable(self) -> bool:
        """Whether the loop settles at all."""
        return self.phase_margin_rad > 0.0 and self.gain_margin > 1.0

    @property
    def phase_margin_deg(self) -> float:
        """Phase margin in degrees, for people."""
        return math.degrees(self.phase_margin_rad)


Forecasts = tuple[Mapping[str, Forecast], ...]
"""Forecasts of several banks, by axis; none where nothing is known of the drive."""


class Forecaster:
    """Knows the drive behind a board from a model, a recording, or both.

    Parameters
    ----------
    identity, limits
        Of the board.
    model : Model or None
        Effects that are known; without a recording, inertia and friction too.
    recording : Recording or None
        What inertia and friction are identified from, and the motion to be followed.

    Raises
    ------
    ModelError
        The model lacks an axis of the board, or is in other units.
    GainError
        The recording does not identify the drive, or the inertia is known too poorly.
    """

    def __init__(
        self,
        identity: BoardIdentity,
        limits: Mapping[str, AxisLimits],
        model: Model | None,
        recording: Recording | None,
    ) -> None:
        grounds = None if model is None else Grounds(model, {}, {})
        if recording is not None:
            grounds = Grounds.of(_identified(recording, model))
        if grounds is None:
            raise ValueError("a model or a recording is needed")
        self._grounds = replace(grounds, model=_checked(grounds.model, tuple(limits)))
        self._moved = None if recording is None else _moved(recording, tuple(limits), identity)
        self._hardware = LoopHardware.of_axes(identity, limits)

    def forecast(self, banks: Sequence[Bank]) -> Forecasts:
        """Forecast margins and tracking errors for every bank, by axis."""
        margins = [
            {
                axis: Forecast(*worst_margins(bank[axis], self._grounds.model.axes[axis], hardware))
                for axis, hardware in self._hardware.items()
            }
            for bank in banks
        ]
        if self._moved is None:
            return tuple(margins)
        errors = drawn_errors(self._moved, self._grounds, self._hardware, (), banks)
        return tuple(
            {
                axis: replace(
                    of_axis,
                    tracking_rms=Expected.of(drawn[axis].rms_rad),
                    tracking_peak=Expected.of(drawn[axis].peak_rad),
                )
                for axis, of_axis in of_bank.items()
            }
            for of_bank, drawn in zip(margins, errors, strict=True)
        )


def check_stable(forecast: Mapping[str, Forecast]) -> None:
    """Refuse gains that cannot work.

    Raises
    ------
    GainError
    """
    for axis, of_axis in forecast.items():
        if not of_axis.stable:
            raise GainError(
                f"axis {axis}: the loop would be unstable (phase margin "
                f"{of_axis.phase_margin_deg:.0f}°, gain margin {of_axis.gain_margin:.2g})",
                "design gains from a recording of this drive: edge-ident gains FILE",
            )


def _identified(recording: Recording, known: Model | None) -> Identification:
    found = identify(recording, None, model=known)
    if not found.trusted:
        raise GainError(
            f"{recording.source}: the drive cannot be identified from it",
            "run edge-ident identify on it to see why, or give a --model instead",
        )
    return found


def _checked(model: Model, axes: tuple[str, ...]) -> Model:
    for name in axes:
        axis = model.axes.get(name)
        if axis is None or axis.units != BOARD_UNITS:
            raise ModelError(
                f"the board has axis {name} in rad and N*m; the model or recording has "
                + ", ".join(f"{n} ({' and '.join(of.units)})" for n, of in model.axes.items()),
                "give a model or recording of the drive of this board, with the board's names",
            )
        inertia, std = float(axis.parameters[0]), axis.terms[0].std.get("inertia", 0.0)
        if inertia <= 2.0 * std:
            raise GainError(
                f"axis {name}: the inertia {inertia:.3g} ± {std:.2g} is too uncertain",
                "record a motion that excites it: edge-ident capture --motion multisine",
            )
    return Model({name: model.axes[name] for name in axes})


def _moved(recording: Recording, axes: tuple[str, ...], identity: BoardIdentity) -> RecordedMotion:
    moved = RecordedMotion.of(recording, axes)
    if not math.isclose(moved.period_s, identity.sample_period_s, rel_tol=1e-3):
        raise DataError(
            f"{recording.source}: sampled every {moved.period_s:g} s, the board's loop runs "
            f"every {identity.sample_period_s:g} s",
            "give a recording made on this board with edge-ident capture",
        )
    return moved
