"""One drive on one motion, from model to recording."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.control.position_loop import LoopHardware
from edge_ident.errors import ModelError
from edge_ident.model.model import AxisModel, Model
from edge_ident.signals.recording import AxisRecord, Recording
from edge_ident.simulation.feedback import peak_effort, soft_gains, stiff_gains
from edge_ident.simulation.flexible import DELAY_SHARE, FlexibleMachine
from edge_ident.simulation.loop import Plant, Sampling, Simulation, simulate
from edge_ident.simulation.machine import Machine
from edge_ident.simulation.references import References
from firmware_interface.gains import AxisGains

Array = NDArray[np.float64]

_COUNTS: Final = {"rad": 8400.0 / (2.0 * math.pi), "m": 1e6}
"""Encoder counts per rad or m, unless told otherwise."""
_EFFORT_COUNT: Final = {"N*m": 0.004}
"""Effort of one count, unless told otherwise; exact in other units."""
_RUNAWAY: Final = 2.0
"""Distance from the reference, in travels of the motion, that no working drive reaches."""
_EFFORT_RESERVE: Final = 4.0
"""Effort limit of the drive for which stiff gains are designed, over the motion's peak effort."""


@dataclass(frozen=True)
class Scenario:
    """How a drive is moved and recorded.

    Attributes
    ----------
    references : References
    encoder_counts : float or None
        Per turn or metre; 0 for an exact encoder, None for the default.
    effort_resolution : float or None
        Effort of one count; 0 for an exact one, None for the default.
    noise : float
        White noise of the effort column over its rms value.
    stiff : bool
        Gains as designed for the drive instead of soft ones.
    seed : int
    """

    references: References
    encoder_counts: float | None = None
    effort_resolution: float | None = None
    noise: float = 0.0
    stiff: bool = False
    seed: int = 0

    def __post_init__(self) -> None:
        sizes = (self.noise, self.encoder_counts or 0.0, self.effort_resolution or 0.0)
        if not all(0.0 <= size < math.inf for size in sizes):
            raise ModelError(
                "noise, encoder counts and resolution of the effort: {}, {} and {}".format(*sizes),
                "give finite numbers that are not negative",
            )


def record(
    model: Model,
    scenario: Scenario,
    source: str,
    *,
    flexible: bool = False,
    on_progress: Callable[[int, int], None] = lambda done, total: None,
) -> Recording:
    """One drive, as a board records it.

    Parameters
    ----------
    model : Model
        Its axes are those of the references. Gains follow from its base terms.
    scenario : Scenario
    source : str
        Of the recording, for messages.
    flexible : bool
        Move the built-in drive's full flexible model instead.

    Raises
    ------
    ModelError, GainError
        The model cannot be simulated or runs away; no stiff gains keep their margins.
    """
    simulation = simulate_drives(model.axes, scenario, flexible=flexible, on_progress=on_progress)
    _check_followed(model, scenario.references, simulation)
    references = scenario.references.recorded
    axes = {
        name: AxisRecord(
            simulation.position[i, 0],
            simulation.effort[i, 0],
            axis.position_unit,
            axis.effort_unit,
            references[i],
        )
        for i, (name, axis) in enumerate(model.axes.items())
    }
    shift_s = (DELAY_SHARE + 0.5) * scenario.references.period_s
    return Recording(simulation.time_s, axes, source, shift_s)


def simulate_drives(
    axes: Mapping[str, AxisModel],
    scenario: Scenario,
    *,
    flexible: bool = False,
    on_progress: Callable[[int, int], None] = lambda done, total: None,
) -> Simulation:
    """D drives of one structure at once, in closed loop.

    Parameters
    ----------
    axes : mapping of axis name to AxisModel
        Values are floats, or arrays (D,).
    scenario : Scenario
    flexible : bool
        Move the built-in drive's full flexible model instead; D is one.

    Raises
    ------
    ModelError, GainError
    """
    encoder = [_resolution(axis.position_unit, scenario.encoder_counts) for axis in axes.values()]
    effort = [_effort_count(axis, scenario.effort_resolution) for axis in axes.values()]
    return simulate(
        _plant(axes, scenario.references, flexible),
        scenario.references,
        _gains(axes, scenario),
        Sampling(np.array(encoder), np.array(effort), scenario.noise),
        seed=scenario.seed,
        on_progress=on_progress,
    )


def _plant(axes: Mapping[str, AxisModel], references: References, flexible: bool) -> Plant:
    period_s = references.period_s
    if flexible:
        return FlexibleMachine(period_s)
    drives = max(np.atleast_2d(axis.parameters).shape[0] for axis in axes.values())
    start = np.repeat(references.position[:, :1], drives, axis=1)
    top_speed = np.max(np.abs(references.velocity), axis=1)
    return Machine(axes, start, top_speed, period_s, DELAY_SHARE * period_s)


def _check_followed(model: Model, references: References, simulation: Simulation) -> None:
    miss = np.max(np.abs(simulation.true_position[:, 0] - references.recorded), axis=-1)
    for name, farthest, travel in zip(
        model.axes, miss, np.ptp(references.recorded, axis=-1), strict=True
    ):
        if not farthest <= _RUNAWAY * travel:
            raise ModelError(
                f"axis {name}: the simulated drive does not follow; it ends up {farthest:.2g} "
                f"{model.axes[name].position_unit} off its reference",
                "choose the other gains (--stiff or --soft), or weaken the model's effects",
            )


def _gains(axes: Mapping[str, AxisModel], scenario: Scenario) -> dict[str, list[AxisGains]]:
    references, found = scenario.references, {}
    for i, (name, axis) in enumerate(axes.items()):
        motion = references.motion(i)
        if scenario.stiff:
            hardware = LoopHardware(
                references.period_s,
                DELAY_SHARE * references.period_s,
                _resolution(axis.position_unit, scenario.encoder_counts or None),
                _EFFORT_RESERVE * float(np.max(peak_effort(axis.parameters, motion))),
            )
            found[name] = stiff_gains(axis, hardware)
        else:
            found[name] = soft_gains(axis, motion, references.period_s)
    return found


def _resolution(position_unit: str, counts: float | None) -> float:
    """Position of one count."""
    if counts is None:
        return 1.0 / _COUNTS[position_unit]
    turn = {"rad": 2.0 * math.pi, "m": 1.0}[position_unit]
    return turn / counts if counts else 0.0


def _effort_count(axis: AxisModel, resolution: float | None) -> float:
    return _EFFORT_COUNT.get(axis.effort_unit, 0.0) if resolution is None else resolution
