"""What gains promise before they are in force: margins, and tracking on a recorded motion."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from edge_ident.control.gain_design import worst_margins
from edge_ident.control.position_loop import LoopHardware
from edge_ident.errors import DataError, GainError, ModelError
from edge_ident.identification.identify import identify
from edge_ident.model.model import Model
from edge_ident.signals.recording import Recording
from edge_ident.simulation.loop import Sampling, simulate
from edge_ident.simulation.machine import Machine
from edge_ident.simulation.references import References, recorded_references
from firmware_interface.board import AxisLimits, BoardIdentity
from firmware_interface.gains import Bank

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Forecast:
    """Of one axis under one set of gains.

    Attributes
    ----------
    phase_margin_rad, gain_margin : float
        Smallest over the interval of the inertia; no phase margin stands for an unstable loop.
    tracking_rms_rad : float or None
        Simulated, once the lead-in is over; infinite where the simulated drive runs away, None
        where no motion is known.
    """

    phase_margin_rad: float
    gain_margin: float
    tracking_rms_rad: float | None = None

    @property
    def stable(self) -> bool:
        """Whether the loop settles at all."""
        return self.phase_margin_rad > 0.0 and self.gain_margin > 1.0

    @property
    def phase_margin_deg(self) -> float:
        """Phase margin in degrees, for people."""
        return math.degrees(self.phase_margin_rad)


Forecasts = tuple[Mapping[str, Forecast], ...]
"""Of several banks, by axis; none where nothing is known of the drive."""


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
        if recording is not None:
            model = _identified(recording, model)
        if model is None:
            raise ValueError("a model or a recording is needed")
        self._model = _checked(model, tuple(limits))
        self._references = _references(recording, self._model, identity)
        self._identity = identity
        self._hardware = {
            axis: LoopHardware.of_board(identity, of_axis) for axis, of_axis in limits.items()
        }

    def forecast(self, banks: Sequence[Bank], on_progress: Callable[[int, int], None]) -> Forecasts:
        """Of every bank, by axis."""
        tracking = None
        if self._references is not None:
            tracking = self._tracking_rms(self._references, banks, on_progress)
        return tuple(
            {
                axis: Forecast(
                    *worst_margins(bank[axis], self._model.axes[axis], hardware),
                    None if tracking is None else float(tracking[i, n]),
                )
                for i, (axis, hardware) in enumerate(self._hardware.items())
            }
            for n, bank in enumerate(banks)
        )

    def _tracking_rms(
        self,
        references: References,
        banks: Sequence[Bank],
        on_progress: Callable[[int, int], None],
    ) -> Array:
        """Simulate the drive once per bank, all side by side: (axes, banks)."""
        axes, identity = self._model.axes, self._identity
        plant = Machine(
            axes,
            np.repeat(references.position[:, :1], len(banks), axis=1),
            np.max(np.abs(references.velocity), axis=1),
            identity.sample_period_s,
            identity.control_delay_s,
        )
        sampling = Sampling(
            np.full(len(axes), identity.encoder_resolution_rad),
            np.full(len(axes), identity.effort_per_count_nm),
        )
        gains = {axis: [bank[axis] for bank in banks] for axis in axes}
        with np.errstate(all="ignore"):  # an unstable loop ends in infinity, and that is the answer
            found = simulate(plant, references, gains, sampling, on_progress=on_progress)
            error = references.recorded[:, None] - found.true_position
            rms: Array = np.sqrt(np.mean(error**2, axis=-1))
        return np.where(np.isfinite(rms), rms, np.inf)


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


def _identified(recording: Recording, known: Model | None) -> Model:
    found = identify(recording, None, model=known)
    if not found.trusted:
        raise GainError(
            f"{recording.source}: the drive cannot be identified from it",
            "run edge-ident identify on it to see why, or give a --model instead",
        )
    return Model({name: axis.model for name, axis in found.axes.items()})


def _checked(model: Model, axes: tuple[str, ...]) -> Model:
    for name in axes:
        axis = model.axes.get(name)
        if axis is None or (axis.position_unit, axis.effort_unit) != ("rad", "N*m"):
            raise ModelError(
                f"the board's axis {name} is not in the model, or not in rad and N*m",
                "give a model or recording of the drive of this board",
            )
        inertia, std = float(axis.parameters[0]), axis.terms[0].std.get("inertia", 0.0)
        if inertia <= 2.0 * std:
            raise GainError(
                f"axis {name}: the inertia {inertia:.3g} ± {std:.2g} is too uncertain",
                "record a motion that excites it: edge-ident capture --motion multisine",
            )
    return Model({name: model.axes[name] for name in axes})


def _references(
    recording: Recording | None, model: Model, identity: BoardIdentity
) -> References | None:
    if recording is None:
        return None
    references = recorded_references(
        recording, {name: axis.position_unit for name, axis in model.axes.items()}
    )
    if not math.isclose(references.period_s, identity.sample_period_s, rel_tol=1e-3):
        raise DataError(
            f"{recording.source}: sampled every {references.period_s:g} s, the board's loop runs "
            f"every {identity.sample_period_s:g} s",
            "give a recording made on this board with edge-ident capture",
        )
    return references
