"""Identify a feed drive, diagnose what its model gets wrong, and design its gains.

This is the public API. What is not named in `__all__` is private and free to change. Names load
their module when they are first used, so that importing the package is fast.

Results are plain data. How one is shown, as text, table or picture, is its view; which function
makes that of which class is said here, so that results know nothing of the package `report`. This
module is imported before any other of the package, so no result is there before it is said.

>>> import edge_ident
>>> recording = edge_ident.simulate()
>>> found = edge_ident.identify(recording)
>>> found.trusted
True
"""

from edge_ident.support.lazy import lazy_names, shown_by
from edge_ident.support.version import VERSION

__version__ = VERSION

TYPE_CHECKING = False  # loading typing takes longer than all that a script's start needs
if TYPE_CHECKING:
    from edge_ident.baselines.comparison import Comparison, compare, comparison_methods
    from edge_ident.commissioning.ports import connect
    from edge_ident.control.drive_gains import GainDesigns, design_gains
    from edge_ident.control.gain_design import GainDesign
    from edge_ident.diagnosis.diagnose import diagnose
    from edge_ident.diagnosis.error_budget import ErrorBudget
    from edge_ident.diagnosis.measures import TOLERANCE
    from edge_ident.diagnosis.result import AxisDiagnosis, Diagnosis
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
    from edge_ident.estimation.trust import outside_support
    from edge_ident.experiment.plan import plan_motion
    from edge_ident.experiment.result import MotionPlan
    from edge_ident.fleet.result import Survey, SurveyedRecording
    from edge_ident.fleet.survey import survey
    from edge_ident.identification.identify import identify
    from edge_ident.identification.result import AxisIdentification, Identification
    from edge_ident.model.effect import Advice, Compensation, Effect, Parameter
    from edge_ident.model.effects import register_effect
    from edge_ident.model.model import PARAMETERS, AxisModel, Estimate, Model, Term
    from edge_ident.model.model_files import load_model, save_model, sourced_model
    from edge_ident.model.search import Form, SearchSpec
    from edge_ident.signals.read_columns import ReadOptions
    from edge_ident.signals.recording import AxisRecord, PassiveAxis, Recording
    from edge_ident.signals.recording_files import (
        Inspection,
        inspect_recording,
        load_recording,
        save_recording,
    )
    from edge_ident.simulation.simulate import reduced_model, simulate
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
    "ErrorBudget",
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
        "edge_ident.baselines.comparison": "Comparison compare comparison_methods",
        "edge_ident.commissioning.ports": "connect",
        "edge_ident.control.drive_gains": "GainDesigns design_gains",
        "edge_ident.control.gain_design": "GainDesign",
        "edge_ident.diagnosis.diagnose": "diagnose",
        "edge_ident.diagnosis.error_budget": "ErrorBudget",
        "edge_ident.diagnosis.result": "AxisDiagnosis Diagnosis",
        "edge_ident.diagnosis.measures": "TOLERANCE",
        "edge_ident.drive.description": "Drive DriveAxis load_drive",
        "edge_ident.drive.motions": "load_motion save_motion",
        "edge_ident.errors": "BoardError DataError EdgeIdentError GainError LinkError ModelError",
        "edge_ident.estimation.network": "Network load_network",
        "edge_ident.estimation.trust": "outside_support",
        "edge_ident.experiment.plan": "plan_motion",
        "edge_ident.experiment.result": "MotionPlan",
        "edge_ident.fleet.result": "Survey SurveyedRecording",
        "edge_ident.fleet.survey": "survey",
        "edge_ident.identification.identify": "identify",
        "edge_ident.identification.result": "AxisIdentification Identification",
        "edge_ident.model.effect": "Advice Compensation Effect Parameter",
        "edge_ident.model.effects": "register_effect",
        "edge_ident.model.model": "AxisModel Estimate Model PARAMETERS Term",
        "edge_ident.model.model_files": "load_model save_model sourced_model",
        "edge_ident.model.search": "Form SearchSpec",
        "edge_ident.signals.read_columns": "ReadOptions",
        "edge_ident.signals.recording": "AxisRecord PassiveAxis Recording",
        "edge_ident.signals.recording_files": (
            "Inspection inspect_recording load_recording save_recording"
        ),
        "edge_ident.simulation.simulate": "reduced_model simulate",
        "edge_ident.support.stopwatch": "Stopwatch",
        "firmware_interface.board": "Board",
        "firmware_interface.motion": "Trajectory",
    },
)

shown_by(
    {
        "edge_ident.report.gains": "GainDesigns=designs_view",
        "edge_ident.report.identification": "Identification=identification_view",
        "edge_ident.report.comparison": "Comparison=comparison_view",
        "edge_ident.report.diagnosis": "Diagnosis=diagnosis_view",
        "edge_ident.report.error_budget": "ErrorBudget=budget_view",
        "edge_ident.report.plan": "MotionPlan=plan_view",
        "edge_ident.report.numbers": "Model=model_view",
        "edge_ident.report.recordings": "Recording=recording_view",
        "edge_ident.report.survey": "Survey=survey_view",
    }
)


def __dir__() -> list[str]:
    return __all__
