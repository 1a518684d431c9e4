"""Entry point of the simulation: from a model and a motion to a recording."""

import math
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, replace
from typing import Final

import numpy as np

from edge_ident.control import gain_design, position_loop
from edge_ident.drive.motions import MotionName
from edge_ident.errors import ModelError
from edge_ident.model.effects import named
from edge_ident.model.model import BASE, Array, AxisModel, Estimate, Model, Term, base_axis
from edge_ident.model.model_files import GivenModel, given_model
from edge_ident.signals import data_checks, recording
from edge_ident.simulation import loop, machine
from edge_ident.support.given import number
from edge_ident.support.given import seed as check_seed
from firmware_interface.gains import AxisGains
from firmware_interface.motion import Trajectory
from firmware_interface.plant.feed_drive import FEED_DRIVE, feed_drive
from firmware_interface.plant.plant import Plant as BoardPlant


def simulate(
    model: GivenModel | None = None,
    motion: MotionName | recording.Recording | Trajectory = "sinusoid",
    *,
    cycles: int | None = None,
    encoder_counts: float | None = None,
    effort_resolution: float | None = None,
    noise: float = 0.0,
    stiff: bool = False,
    seed: int = 0,
    on_progress: Callable[[int, int], None] = lambda done, total: None,
) -> recording.Recording:
    """Let a drive follow a motion in closed loop, and record it as a board does.

    Parameters
    ----------
    model : Model, result with a model, str or Path, optional
        Without one, the built-in drive with everything in it that bends.
    motion : {"sinusoid", "multisine", "staircase"}, Recording or Trajectory
        The motion of a recording is followed at its own sampling.
    cycles : int, optional
        Periods of a sinusoid or multisine; default from the built-in drive.
    encoder_counts : float, optional
        Per turn or metre; 0 for an exact encoder. Default: 8400, or a million per metre.
    effort_resolution : float, optional
        Effort of one count; 0 for an exact one. Default: 0.004 N·m, exact in other units.
    noise : float
        White noise of the effort column, relative to its rms value.
    stiff : bool
        Use gains designed for the drive instead of soft start-up gains.
    seed : int
        Random seed of the noise.
    on_progress : callable
        Called with the samples done and the samples in all.

    Returns
    -------
    Recording

    Raises
    ------
    DataError
        The motion lacks an axis of the model, has it in another unit, or is no recording that
        can be used.
    ModelError
        The model cannot be simulated, or does not follow the motion.
    GainError
        No stiff gains keep their margins.

    Examples
    --------
    >>> import edge_ident
    >>> recording = edge_ident.simulate(noise=0.01)
    >>> list(recording.axes)
    ['x', 'z']
    >>> len(recording.time_s)
    8742
    """
    number("noise", noise, 0.0, 10.0, "give a share of the rms effort, such as 0.01")
    check_seed(seed)
    if cycles is not None:
        number("cycles", cycles, 1, 10_000, "give a whole number of periods, or leave it out")
    exact = {"encoder_counts": encoder_counts, "effort_resolution": effort_resolution}
    for name, value in exact.items():
        if value is not None:
            number(name, value, 0.0, 1e12, "give 0 for an exact one, or leave it out")
    followed = reduced_model() if model is None else given_model(model)
    units = {name: axis.position_unit for name, axis in followed.axes.items()}
    if isinstance(motion, recording.Recording):
        data_checks.check_arrays(motion)
        references = loop.recorded_references(motion, units)
    elif isinstance(motion, Trajectory):
        references = loop.designed_references(units, motion)
    else:
        references = loop.named_references(units, motion, cycles)
    scenario = Scenario(references, encoder_counts, effort_resolution, noise, stiff, seed)
    return record(followed, scenario, "simulation", flexible=model is None, on_progress=on_progress)


# One drive on one motion, from model to recording.

# Encoder counts per rad or m, unless told otherwise.
_COUNTS: Final = {"rad": 8400.0 / (2.0 * math.pi), "m": 1e6}
# Effort of one count, unless told otherwise; exact in other units.
_EFFORT_COUNT: Final = {"N*m": 0.004}
# Distance from the reference, in travels of the motion, that no working drive reaches.
_RUNAWAY: Final = 2.0
# Effort limit of the drive for which stiff gains are designed, over the motion's peak effort.
_EFFORT_RESERVE: Final = 4.0


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

    references: loop.References
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
) -> recording.Recording:
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
        name: recording.AxisRecord(
            simulation.position[i, 0],
            simulation.effort[i, 0],
            axis.position_unit,
            axis.effort_unit,
            references[i],
        )
        for i, (name, axis) in enumerate(model.axes.items())
    }
    shift_s = (DELAY_SHARE + 0.5) * scenario.references.period_s
    return recording.Recording(simulation.time_s, axes, source, shift_s)


def simulate_drives(
    axes: Mapping[str, AxisModel],
    scenario: Scenario,
    *,
    flexible: bool = False,
    on_progress: Callable[[int, int], None] = lambda done, total: None,
) -> loop.Simulation:
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
    return loop.closed_loop(
        _plant(axes, scenario.references, flexible),
        scenario.references,
        _gains(axes, scenario),
        loop.Sampling(np.array(encoder), np.array(effort), scenario.noise),
        seed=scenario.seed,
        on_progress=on_progress,
    )


def _plant(
    axes: Mapping[str, AxisModel], references: loop.References, flexible: bool
) -> loop.Plant:
    period_s = references.period_s
    if flexible:
        return FlexibleMachine(period_s)
    drives = max(np.atleast_2d(axis.parameters).shape[0] for axis in axes.values())
    start = np.repeat(references.position[:, :1], drives, axis=1)
    top_speed = np.max(np.abs(references.velocity), axis=1)
    return machine.Machine(axes, start, top_speed, period_s, DELAY_SHARE * period_s)


def _check_followed(model: Model, references: loop.References, simulation: loop.Simulation) -> None:
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
            hardware = position_loop.LoopHardware(
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


# Gains for simulated drives: soft as at a board's start-up, or stiff as designed for the drive.

# Part of the motion's amplitude by which the peak effort makes a soft axis lag.
_SOFT_LAG: Final = 1.0 / 60.0
_DAMPING_RATIO: Final = 0.7
_SAMPLES_PER_RADIAN: Final = 10.0  # fewest samples per radian at the loop's natural frequency


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


def stiff_gains(axis: AxisModel, hardware: position_loop.LoopHardware) -> list[AxisGains]:
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
        found.append(gain_design.design(replace(base, terms=(*base.terms, *own)), hardware).gains)
    return found


def _of_drive(values: Mapping[str, float | Array], drive: int) -> dict[str, float]:
    return {name: float(np.atleast_1d(x)[drive * (np.size(x) > 1)]) for name, x in values.items()}


# The built-in drive: its full flexible model as a plant of the loop, and its reduced model.

DELAY_SHARE: Final = 0.2
"""Share of a sampling period from reading the encoders to the new effort: 0.5 of 2.5 ms."""


class FlexibleMachine:
    """The virtual board's drive; its control delay is `DELAY_SHARE` of the sampling period.

    Parameters
    ----------
    period_s : float
    """

    def __init__(self, period_s: float) -> None:
        self._plant = BoardPlant(feed_drive(), sample_s=period_s, delay=DELAY_SHARE)

    @property
    def position(self) -> Array:
        """Position at the gearbox output, (A, 1)."""
        return np.array(self._plant.output_rad)[:, None]

    @property
    def velocity(self) -> Array:
        """Velocity at the gearbox output, (A, 1)."""
        return np.array(self._plant.output_rad_s)[:, None]

    @property
    def reading(self) -> Array:
        """The encoders are true."""
        return self.position

    def set_time(self, time_s: float) -> None:
        """Nothing in it depends on time."""

    def advance(self, before: Array, command: Array) -> None:
        """Let a sample pass."""
        self._plant.advance(command[:, 0].tolist())

    def recorded(self, command: Array, time_s: Array) -> Array:
        """The board records what it commands."""
        return command


def reduced_model() -> Model:
    """The built-in drive when nothing deforms: the paper's four parameters an axis.

    Examples
    --------
    >>> import edge_ident
    >>> edge_ident.reduced_model().axes["x"].parameters.round(2).tolist()
    [0.43, 0.9, 1.4, 0.03]
    """
    return Model(
        {name: AxisModel((Term(BASE, asdict(body)),)) for name, body in FEED_DRIVE.items()}
    )
