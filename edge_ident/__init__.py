"""Identify a feed drive, diagnose what its model gets wrong, and design its gains.

This is the public API. What is not named in `__all__` is private and free to change. Names load
their module when they are first used, so that importing the package is fast.

>>> import edge_ident
>>> recording = edge_ident.simulate()
>>> found = edge_ident.identify(recording)
>>> found.trusted
True
"""

from edge_ident.support.lazy import lazy_names
from edge_ident.support.version import VERSION

__version__ = VERSION

TYPE_CHECKING = False  # loading typing takes longer than all that a script's start needs
if TYPE_CHECKING:
    from edge_ident.baselines.comparison import Comparison, compare, comparison_methods
    from edge_ident.commissioning.link.connect import connect
    from edge_ident.control.drive_gains import GainDesigns, design_gains
    from edge_ident.control.gain_design import GainDesign
    from edge_ident.diagnosis.diagnose import diagnose
    from edge_ident.diagnosis.result import AxisDiagnosis, Diagnosis
    from edge_ident.diagnosis.tolerance import TOLERANCE
    from edge_ident.drive.description import Drive, DriveAxis, load_drive
    from edge_ident.drive.motions import load_motion, save_motion
    from edge_ident.errors import (
        BoardError,
        DataError,
        EdgeIdentError,
        GainError,
        LinkError,
        ModelError,
    )
    from edge_ident.estimation.network import Network, load_network
    from edge_ident.estimation.outside_support import outside_support
    from edge_ident.experiment.plan import plan_motion
    from edge_ident.experiment.result import MotionPlan
    from edge_ident.fleet.result import Survey, SurveyedRecording
    from edge_ident.fleet.survey import survey
    from edge_ident.identification.identify import identify
    from edge_ident.identification.result import AxisIdentification, Identification
    from edge_ident.model.advice import Advice
    from edge_ident.model.compensation import Compensation
    from edge_ident.model.effect import Effect, Parameter
    from edge_ident.model.effects import register_effect
    from edge_ident.model.model import PARAMETERS, AxisModel, Estimate, Model, Term
    from edge_ident.model.model_files import load_model, save_model, sourced_model
    from edge_ident.model.search import Form, SearchSpec
    from edge_ident.signals.read_options import ReadOptions
    from edge_ident.signals.recording import AxisRecord, PassiveAxis, Recording
    from edge_ident.signals.recording_files import (
        Inspection,
        inspect_recording,
        load_recording,
        save_recording,
    )
    from edge_ident.simulation.flexible import reduced_model
    from edge_ident.simulation.simulate import simulate
    from edge_ident.support.stopwatch import Stopwatch
    from firmware_interface.board import Board
    from firmware_interface.motion import Trajectory

__all__ = [
    "PARAMETERS",
    "TOLERANCE",
    "Advice",
    "AxisDiagnosis",
    "AxisIdentification",
    "AxisModel",
    "AxisRecord",
    "Board",
    "BoardError",
    "Comparison",
    "Compensation",
    "DataError",
    "Diagnosis",
    "Drive",
    "DriveAxis",
    "EdgeIdentError",
    "Effect",
    "Estimate",
    "Form",
    "GainDesign",
    "GainDesigns",
    "GainError",
    "Identification",
    "Inspection",
    "LinkError",
    "Model",
    "ModelError",
    "MotionPlan",
    "Network",
    "Parameter",
    "PassiveAxis",
    "ReadOptions",
    "Recording",
    "SearchSpec",
    "Stopwatch",
    "Survey",
    "SurveyedRecording",
    "Term",
    "Trajectory",
    "__version__",
    "compare",
    "comparison_methods",
    "connect",
    "design_gains",
    "diagnose",
    "identify",
    "inspect_recording",
    "load_drive",
    "load_model",
    "load_motion",
    "load_network",
    "load_recording",
    "outside_support",
    "plan_motion",
    "reduced_model",
    "register_effect",
    "save_model",
    "save_motion",
    "save_recording",
    "simulate",
    "sourced_model",
    "survey",
]

__getattr__ = lazy_names(
    __name__,
    {
        "Advice": "edge_ident.model.advice",
        "AxisDiagnosis": "edge_ident.diagnosis.result",
        "AxisIdentification": "edge_ident.identification.result",
        "AxisModel": "edge_ident.model.model",
        "AxisRecord": "edge_ident.signals.recording",
        "Board": "firmware_interface.board",
        "BoardError": "edge_ident.errors",
        "Comparison": "edge_ident.baselines.comparison",
        "Compensation": "edge_ident.model.compensation",
        "DataError": "edge_ident.errors",
        "Diagnosis": "edge_ident.diagnosis.result",
        "Drive": "edge_ident.drive.description",
        "DriveAxis": "edge_ident.drive.description",
        "EdgeIdentError": "edge_ident.errors",
        "Effect": "edge_ident.model.effect",
        "Estimate": "edge_ident.model.model",
        "Form": "edge_ident.model.search",
        "GainDesign": "edge_ident.control.gain_design",
        "GainDesigns": "edge_ident.control.drive_gains",
        "GainError": "edge_ident.errors",
        "Identification": "edge_ident.identification.result",
        "Inspection": "edge_ident.signals.recording_files",
        "LinkError": "edge_ident.errors",
        "Model": "edge_ident.model.model",
        "ModelError": "edge_ident.errors",
        "MotionPlan": "edge_ident.experiment.result",
        "Network": "edge_ident.estimation.network",
        "PARAMETERS": "edge_ident.model.model",
        "Parameter": "edge_ident.model.effect",
        "PassiveAxis": "edge_ident.signals.recording",
        "ReadOptions": "edge_ident.signals.read_options",
        "Recording": "edge_ident.signals.recording",
        "SearchSpec": "edge_ident.model.search",
        "Stopwatch": "edge_ident.support.stopwatch",
        "Survey": "edge_ident.fleet.result",
        "SurveyedRecording": "edge_ident.fleet.result",
        "TOLERANCE": "edge_ident.diagnosis.tolerance",
        "Term": "edge_ident.model.model",
        "Trajectory": "firmware_interface.motion",
        "compare": "edge_ident.baselines.comparison",
        "comparison_methods": "edge_ident.baselines.comparison",
        "connect": "edge_ident.commissioning.link.connect",
        "design_gains": "edge_ident.control.drive_gains",
        "diagnose": "edge_ident.diagnosis.diagnose",
        "identify": "edge_ident.identification.identify",
        "inspect_recording": "edge_ident.signals.recording_files",
        "load_drive": "edge_ident.drive.description",
        "load_model": "edge_ident.model.model_files",
        "load_motion": "edge_ident.drive.motions",
        "load_network": "edge_ident.estimation.network",
        "load_recording": "edge_ident.signals.recording_files",
        "outside_support": "edge_ident.estimation.outside_support",
        "plan_motion": "edge_ident.experiment.plan",
        "reduced_model": "edge_ident.simulation.flexible",
        "register_effect": "edge_ident.model.effects",
        "save_model": "edge_ident.model.model_files",
        "save_motion": "edge_ident.drive.motions",
        "save_recording": "edge_ident.signals.recording_files",
        "simulate": "edge_ident.simulation.simulate",
        "sourced_model": "edge_ident.model.model_files",
        "survey": "edge_ident.fleet.survey",
    },
)


def __dir__() -> list[str]:
    return __all__
