"""Entry point of the simulation: from a model and a motion to a recording."""

from collections.abc import Callable

from edge_ident.drive.motions import MotionName
from edge_ident.model.given_model import GivenModel, given_model
from edge_ident.signals.array_checks import check_arrays
from edge_ident.signals.recording import Recording
from edge_ident.simulation.flexible import reduced_model
from edge_ident.simulation.references import (
    designed_references,
    named_references,
    recorded_references,
)
from edge_ident.simulation.scenario import Scenario, record
from edge_ident.support.given import number
from firmware_interface.motion import Trajectory


def simulate(
    model: GivenModel | None = None,
    motion: MotionName | Recording | Trajectory = "sinusoid",
    *,
    cycles: int | None = None,
    encoder_counts: float | None = None,
    effort_resolution: float | None = None,
    noise: float = 0.0,
    stiff: bool = False,
    seed: int = 0,
    on_progress: Callable[[int, int], None] = lambda done, total: None,
) -> Recording:
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
    if cycles is not None:
        number("cycles", cycles, 1, 10_000, "give a whole number of periods, or leave it out")
    exact = {"encoder_counts": encoder_counts, "effort_resolution": effort_resolution}
    for name, value in exact.items():
        if value is not None:
            number(name, value, 0.0, 1e12, "give 0 for an exact one, or leave it out")
    followed = reduced_model() if model is None else given_model(model)
    units = {name: axis.position_unit for name, axis in followed.axes.items()}
    if isinstance(motion, Recording):
        check_arrays(motion)
        references = recorded_references(motion, units)
    elif isinstance(motion, Trajectory):
        references = designed_references(units, motion)
    else:
        references = named_references(units, motion, cycles)
    scenario = Scenario(references, encoder_counts, effort_resolution, noise, stiff, seed)
    return record(followed, scenario, "simulation", flexible=model is None, on_progress=on_progress)
