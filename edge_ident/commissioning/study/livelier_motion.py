"""The motion that shows parameters which the first one could not.

On one sinusoid a spring is exactly a negative inertia. So a base model can fit all of the effort
and still have parameters that no machine has. A livelier motion tells them apart. What is known of
the machine then is no ground to design one on, so the drive's own multisine is made, as when a user
asks for it.

It also tells a vibration from outside, which any motion shows, from what the controller answers to
friction at the reversals of the first motion. And what changes with time goes on during it, while
the motion is another: that tells a drift from what depends on the motion, and one drift from
another.
"""

from dataclasses import replace
from typing import Final

from edge_ident.commissioning.motion.second_motion import NamedMotion, within_limits
from edge_ident.commissioning.study.identification_motions import IdentificationMotion, Study
from edge_ident.diagnosis.present.wording import spoken_line
from edge_ident.diagnosis.verdict import Verdict
from edge_ident.drive.motions import named_trajectory
from edge_ident.estimation import trust
from edge_ident.experiment.open_causes import structure_in_band, tied_to_time
from edge_ident.identification.result import AxisIdentification, Identification
from edge_ident.model.model import PARAMETERS, AxisModel, Model
from edge_ident.support.words import listed
from firmware_interface.motion import Trajectory

_TOLD: Final = 2
"""Lines that a sentence names, the strongest first."""


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
        if diagnosis is None or diagnosis.verdict is not Verdict.UNEXPLAINED:
            continue
        if diagnosis.external_vibrations or structure_in_band(diagnosis):
            continue
        strongest = sorted(diagnosis.lines, key=lambda line: -line.amplitude)[:_TOLD]
        if strongest:
            said[name] = (f"the origin of {listed(list(map(spoken_line, strongest)))}",)
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
