"""The motions beside the first: the one on which new gains must hold too, and a livelier one."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from edge_ident.commissioning.identification_motions import IdentificationMotion, Study
from edge_ident.diagnosis.measures import Verdict
from edge_ident.diagnosis.wording import spoken_line
from edge_ident.drive.description import Drive
from edge_ident.drive.motions import MotionName, named_trajectory, scaled
from edge_ident.errors import BoardError
from edge_ident.estimation import trust
from edge_ident.experiment.open_causes import structure_in_band, tied_to_time
from edge_ident.identification.result import AxisIdentification, Identification
from edge_ident.model.model import PARAMETERS, AxisModel, Model
from edge_ident.support.words import listed
from firmware_interface.board import AxisLimits
from firmware_interface.control_law import feedforward_nm
from firmware_interface.gains import AxisGains, Bank
from firmware_interface.motion import Trajectory, reference

# The motion beside the one of the identification, on which new gains must hold too.
#
# Gains that fit one motion may fail on another. So they are judged on a second one, of which
# nothing was identified: the multisine, or the sinusoid where the multisine came first. It is
# short. It is made smaller where the drive would need more effort, or fall further behind its path,
# than is wise.

LONGEST_S: Final = 8.0
_SHORTEST_S: Final = 4.0
# Share of effort and following error for a motion: feedback and lead-in need the rest.
_SHARE: Final = 0.6
_SMALLER: Final = 0.8
_MOST_STEPS: Final = 8
_STOPPING_S: Final = 2.0  # allowance for coming to rest and for the commands around a motion
_LOOKS_PER_S: Final = 100


@dataclass(frozen=True)
class NamedMotion:
    """A motion and what people call it."""

    name: str
    trajectory: Trajectory

    @property
    def needed_s(self) -> float:
        """Time for it on the board."""
        return self.trajectory.lead_in_s + self.trajectory.duration_s + _STOPPING_S


def second_motion(drive: Drive, first: MotionName) -> NamedMotion:
    """The other motion, at its full size; at most `LONGEST_S`."""
    name: MotionName = "sinusoid" if first == "multisine" else "multisine"
    whole = named_trajectory(drive, name, 1)
    return NamedMotion(name, replace(whole, duration_s=min(whole.duration_s, LONGEST_S)))


def within_limits(
    motion: NamedMotion, model: Model, gains: Bank, limits: Mapping[str, AxisLimits]
) -> NamedMotion:
    """The motion, smaller where the drive would use too much effort or fall behind too far.

    It is a fifth of its size at least: dry friction does not get less. The board watches its own
    limits on every motion.

    Parameters
    ----------
    motion : NamedMotion
    model : Model
        The base terms count.
    gains : mapping of axis name to AxisGains
        In force; softer ones fall further behind.
    limits : mapping of axis name to AxisLimits
    """
    size = 1.0
    for _ in range(_MOST_STEPS):
        axes = {name: scaled(of, size) for name, of in motion.trajectory.axes.items()}
        smaller = replace(motion.trajectory, axes=axes)  # type: ignore[arg-type]
        if all(_fits(smaller, axis, model, gains[axis], limits[axis]) for axis in smaller.axes):
            break
        size *= _SMALLER
    return replace(motion, trajectory=smaller)


def inside_window(first: NamedMotion, second: NamedMotion, window_s: float) -> NamedMotion:
    """The second motion, shortened as far as the board's window to confirm asks for.

    The first is not: a part of the cycle would not tell how the rest is followed.

    Raises
    ------
    BoardError
        The window is too short for both.
    """
    spare_s = window_s - first.needed_s - second.needed_s
    left_s = min(second.trajectory.duration_s + spare_s, second.trajectory.duration_s)
    if left_s < min(_SHORTEST_S, second.trajectory.duration_s):
        needed_s = first.needed_s + second.needed_s - second.trajectory.duration_s + _SHORTEST_S
        raise BoardError(
            f"the verification motions take {needed_s:.0f} s, but the board waits {window_s:.0f} s "
            "for new gains to be confirmed; nothing was written",
            "describe a shorter motion in the drive description, or lengthen the window in the "
            "board's firmware",
        )
    return replace(second, trajectory=replace(second.trajectory, duration_s=left_s))


def _fits(
    trajectory: Trajectory, name: str, model: Model, gains: AxisGains, limits: AxisLimits
) -> bool:
    samples = max(int(trajectory.duration_s * _LOOKS_PER_S), 2)
    time_s = np.linspace(0.0, trajectory.duration_s, samples)
    way = reference(trajectory.axes[name], time_s, trajectory.lead_in_s, 0.0)
    inertia, viscous, coulomb, offset = model.axes[name].parameters
    velocity, direction = way.velocity_rad_s, np.sign(way.velocity_rad_s)
    needed = inertia * way.acceleration_rad_s2 + viscous * velocity + coulomb * direction + offset
    behind = (needed - feedforward_nm(gains, way, np)) / max(gains.proportional, 1e-12)
    effort, error = (float(np.max(np.abs(values))) for values in (needed, behind))
    return effort <= _SHARE * limits.effort_nm and error <= _SHARE * limits.following_error_rad


# The motion that shows parameters which the first one could not.
#
# On one sinusoid a spring is exactly a negative inertia. So a base model can fit all of the effort
# and still have parameters that no machine has. A livelier motion tells them apart. What is known
# of the machine then is no ground to design one on, so the drive's own multisine is made, as when a
# user asks for it.
#
# It also tells a vibration from outside, which any motion shows, from what the controller answers
# to friction at the reversals of the first motion. And what changes with time goes on during it,
# while the motion is another: that tells a drift from what depends on the motion, and one drift
# from another.

_TOLD: Final = 2  # lines that a sentence names, the strongest first


def not_shown(found: Identification) -> dict[str, tuple[str, ...]]:
    """What the motion could not show of each axis whose base model is enough, and not trusted.

    Returns
    -------
    mapping of axis name to tuple of str
        Sentences; axes without any are left out.
    """
    every = {
        name: trust.not_shown(axis.findings)
        for name, axis in found.axes.items()
        if _base_is_enough(axis)
    }
    return {name: reasons for name, reasons in every.items() if reasons}


def lines_in_doubt(found: Identification) -> dict[str, tuple[str, ...]]:
    """Lines above the band that alone keep an axis from being explained: sentences by axis."""
    said: dict[str, tuple[str, ...]] = {}
    for name, axis in found.axes.items():
        diagnosis = axis.diagnosis
        if diagnosis is None or diagnosis.verdict.complete:
            continue
        if diagnosis.external_vibrations or structure_in_band(diagnosis):
            continue
        strongest = sorted(diagnosis.lines, key=lambda line: -line.amplitude)[:_TOLD]
        if strongest:
            unit = diagnosis.model.effort_unit
            lines = listed(spoken_line(line, unit) for line in strongest)
            said[name] = (f"the origin of {lines}",)
    return said


def changes_in_doubt(found: Identification) -> dict[str, tuple[str, ...]]:
    """Changes with time that one motion leaves open: sentences by axis."""
    said: dict[str, tuple[str, ...]] = {}
    for name, axis in found.axes.items():
        diagnosis = axis.diagnosis
        if diagnosis is None or not tied_to_time(diagnosis):
            continue
        if any(cause.inseparable for cause in diagnosis.causes) or structure_in_band(diagnosis):
            said[name] = ("what changes with time",)
    return said


def _base_is_enough(axis: AxisIdentification) -> bool:
    if axis.diagnosis is None:
        return axis.adequacy.adequate
    return axis.diagnosis.verdict is Verdict.ADEQUATE


def livelier_motion(study: Study, first: IdentificationMotion) -> Trajectory | None:
    """The drive's own multisine, smaller where it would need too much effort.

    The drive's description holds its travel and speed. For the effort, a parameter counts with its
    amount and two standard deviations, whatever its sign. The board's own limits still hold.

    Returns
    -------
    Trajectory or None
        None where the first motion was this one.
    """
    whole = named_trajectory(study.drive, "multisine")
    if first.trajectory.axes == whole.axes:
        return None
    board = study.board
    careful = Model({name: _at_most(axis) for name, axis in first.found.axes.items()})
    motion = NamedMotion("multisine", whole)
    return within_limits(motion, careful, board.active_gains(), board.limits()).trajectory


def _at_most(axis: AxisIdentification) -> AxisModel:
    """The base model of an axis with the largest parameters that it may have."""
    model, estimate = axis.model, axis.estimate
    largest = abs(estimate.parameters) + 2.0 * estimate.std
    values = dict(zip(PARAMETERS, largest.tolist(), strict=True))
    return replace(model, terms=(replace(model.terms[0], values=values),))
