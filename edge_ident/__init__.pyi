"""Names of the public API: what a type checker sees, and what `__init__.py` loads by need."""

from edge_ident.baselines.comparison import Comparison as Comparison
from edge_ident.baselines.comparison import compare as compare
from edge_ident.baselines.comparison import comparison_methods as comparison_methods
from edge_ident.commissioning.ports import connect as connect
from edge_ident.control.gain_design import GainDesign as GainDesign
from edge_ident.control.gain_design import GainDesigns as GainDesigns
from edge_ident.control.gain_design import design_gains as design_gains
from edge_ident.diagnosis.diagnose import diagnose as diagnose
from edge_ident.diagnosis.error_budget import ErrorBudget as ErrorBudget
from edge_ident.diagnosis.measures import TOLERANCE as TOLERANCE
from edge_ident.diagnosis.result import AxisDiagnosis as AxisDiagnosis
from edge_ident.diagnosis.result import Diagnosis as Diagnosis
from edge_ident.drive.description import Drive as Drive
from edge_ident.drive.description import DriveAxis as DriveAxis
from edge_ident.drive.description import load_drive as load_drive
from edge_ident.drive.motions import load_motion as load_motion
from edge_ident.drive.motions import save_motion as save_motion
from edge_ident.errors import BoardError as BoardError
from edge_ident.errors import DataError as DataError
from edge_ident.errors import EdgeIdentError as EdgeIdentError
from edge_ident.errors import GainError as GainError
from edge_ident.errors import LinkError as LinkError
from edge_ident.errors import ModelError as ModelError
from edge_ident.estimation.network import Network as Network
from edge_ident.estimation.network import load_network as load_network
from edge_ident.estimation.trust import outside_support as outside_support
from edge_ident.experiment.plan import plan_motion as plan_motion
from edge_ident.experiment.result import MotionPlan as MotionPlan
from edge_ident.fleet.result import Survey as Survey
from edge_ident.fleet.result import SurveyedRecording as SurveyedRecording
from edge_ident.fleet.survey import survey as survey
from edge_ident.identification.identify import identify as identify
from edge_ident.identification.result import AxisIdentification as AxisIdentification
from edge_ident.identification.result import Identification as Identification
from edge_ident.model.effect import Advice as Advice
from edge_ident.model.effect import Compensation as Compensation
from edge_ident.model.effect import Effect as Effect
from edge_ident.model.effect import Parameter as Parameter
from edge_ident.model.effects import register_effect as register_effect
from edge_ident.model.model import PARAMETERS as PARAMETERS
from edge_ident.model.model import AxisModel as AxisModel
from edge_ident.model.model import Estimate as Estimate
from edge_ident.model.model import Model as Model
from edge_ident.model.model import Term as Term
from edge_ident.model.model_files import load_model as load_model
from edge_ident.model.model_files import save_model as save_model
from edge_ident.model.model_files import sourced_model as sourced_model
from edge_ident.model.search import Form as Form
from edge_ident.model.search import SearchSpec as SearchSpec
from edge_ident.signals.read_columns import ReadOptions as ReadOptions
from edge_ident.signals.recording import AxisRecord as AxisRecord
from edge_ident.signals.recording import PassiveAxis as PassiveAxis
from edge_ident.signals.recording import Recording as Recording
from edge_ident.signals.recording_files import Inspection as Inspection
from edge_ident.signals.recording_files import inspect_recording as inspect_recording
from edge_ident.signals.recording_files import load_recording as load_recording
from edge_ident.signals.recording_files import save_recording as save_recording
from edge_ident.simulation.simulate import reduced_model as reduced_model
from edge_ident.simulation.simulate import simulate as simulate
from edge_ident.support.stopwatch import Stopwatch as Stopwatch
from firmware_interface.board import Board as Board
from firmware_interface.motion import Trajectory as Trajectory

__version__: str

def __dir__() -> list[str]: ...
