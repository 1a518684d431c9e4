"""The work of one worker: read a recording, identify it, diagnose it where that is needed.

What goes in and what comes out are JSON documents, so that a worker may be another process or
another computer, and a result that is kept is what came back.
"""

import math
import tempfile
import time
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from edge_ident.diagnosis.result import AxisDiagnosis, Cause
from edge_ident.errors import EdgeIdentError
from edge_ident.fleet.result import (
    Failed,
    Kind,
    SurveyedAxis,
    SurveyedCause,
    Value,
)
from edge_ident.identification.identify import identify
from edge_ident.identification.result import AxisIdentification
from edge_ident.model.effects import named
from edge_ident.model.model import NORMAL_95, PARAMETERS, AxisModel, Model, Term
from edge_ident.model.model_files import model_document, values_document
from edge_ident.model.model_reading import model_of
from edge_ident.signals.read_options import ReadOptions
from edge_ident.signals.recording import Recording
from edge_ident.signals.recording_files import load_recording
from edge_ident.support.json_text import finite


@dataclass(frozen=True)
class Options:
    """What all recordings of a survey have in common.

    Attributes
    ----------
    read : ReadOptions
    model : Model or None
        Known effects.
    diagnose : bool
        Whether an axis whose base model is not adequate is diagnosed.
    """

    read: ReadOptions
    model: Model | None
    diagnose: bool

    def document(self) -> dict[str, Any]:
        """The options as JSON."""
        model = None if self.model is None else model_document(self.model)
        return {"read": asdict(self.read), "model": model, "diagnose": self.diagnose}

    @classmethod
    def of(cls, document: Mapping[str, Any]) -> "Options":
        """The options from JSON."""
        model = None if document["model"] is None else model_of(document["model"], "the model")
        return cls(ReadOptions(**document["read"]), model, document["diagnose"])


def analyse_content(name: str, content: bytes, options: Mapping[str, Any]) -> dict[str, Any]:
    """Analyse a recording on a computer that may not have its file."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / Path(name).name
        file.write_bytes(content)
        document = analyse(str(file), options)
        if document["failed"]:
            cause = document["failed"]["cause"].replace(str(file), name)
            document["failed"] |= {"cause": cause}
        return document


def analyse(file: str, options: Mapping[str, Any]) -> dict[str, Any]:
    """Analyse a recording; whatever is wrong with it becomes part of the result.

    Parameters
    ----------
    file : str
    options : mapping
        `Options.document`.

    Returns
    -------
    mapping
        "axes", "failed" and "duration_s" of a `SurveyedRecording`.
    """
    began_s = time.monotonic()
    axes: dict[str, SurveyedAxis] = {}
    failed = None
    try:
        axes = _analysed(Path(file), options)
    except Exception as error:
        failed = failure_of(error)
    return {
        "axes": {name: asdict(axis) for name, axis in axes.items()},
        "failed": failed and asdict(failed),
        "duration_s": round(time.monotonic() - began_s, 3),
    }


def failure_of(error: Exception) -> Failed:
    """What to say of an error, whatever it is: one recording never stops the others."""
    if isinstance(error, EdgeIdentError):
        return Failed(error.code, error.cause, error.next_step)
    if isinstance(error, OSError):
        return Failed("file", str(error), "check the path and your rights to it")
    if isinstance(error, MemoryError):
        return Failed("memory", "there is not enough memory", "use fewer --jobs, or cut the file")
    return Failed("internal", f"{type(error).__name__}: {error}", "report this as a defect")


def _analysed(file: Path, options: Mapping[str, Any]) -> dict[str, SurveyedAxis]:
    given = Options.of(options)
    return analyse_recording(load_recording(file, options=given.read), given)


def analyse_recording(recording: Recording, options: Options) -> dict[str, SurveyedAxis]:
    """Identify a recording, and diagnose the axes that need it.

    Raises
    ------
    DataError, ModelError
        As `edge_ident.identify`.
    """
    found = identify(recording, model=options.model, diagnose=options.diagnose)
    return {name: _axis(axis) for name, axis in found.axes.items()}


def _axis(axis: AxisIdentification) -> SurveyedAxis:
    diagnosis = axis.diagnosis
    verdict = diagnosis.verdict.value if diagnosis else None
    if axis.adequacy.adequate:
        verdict = "adequate"
    # friction as a line: of one kind in all units, whichever of its parts each model names
    best = axis.effective
    estimate = zip(best.parameters, best.std, axis.units, strict=True)
    return SurveyedAxis(
        parameters={
            name: Value(float(value), finite(float(std)), unit)
            for name, (value, std, unit) in zip(PARAMETERS, estimate, strict=True)
        },
        source=axis.source.value,
        trusted=axis.trusted,
        verdict=verdict if axis.consistent else None,
        relative_residual=axis.metric.relative_residual,
        causes=_causes(diagnosis) if diagnosis else (),
        not_testable=tuple(e.effect for e in diagnosis.not_testable) if diagnosis else (),
        warnings={  # what forbids to trust it first
            f.code: (f.message, f.next_step)
            for f in sorted(axis.findings, key=lambda found: not found.blocks)
        },
    )


def _causes(diagnosis: AxisDiagnosis) -> tuple[SurveyedCause, ...]:
    kinds: tuple[tuple[Kind, tuple[Cause, ...]], ...] = (
        ("supported", diagnosis.causes),
        ("suspected", diagnosis.suspected),
        ("minor", diagnosis.minor),
    )
    return tuple(_cause(cause, kind, diagnosis.model) for kind, of in kinds for cause in of)


def _cause(cause: Cause, kind: Kind, axis: AxisModel) -> SurveyedCause:
    term = cause.term
    values = values_document(term, axis)
    return SurveyedCause(
        effect=term.effect,
        kind=kind,
        share=cause.share,
        share_std=share_std(cause),
        parameters={name: Value(**value) for name, value in values.items()},
        alternatives=tuple(other.effect for other in cause.inseparable),
        evidence=cause.evidence,
    )


def share_std(cause: Cause) -> float:
    """Standard deviation of a cause's share of the effort, cautiously the largest of three.

    The share is the rms of what the cause removes from the residual, so the lower end of the gain's
    interval gives that of the share. The others are the model discrepancy of the effect, and the
    relative deviation of the parameter that is known best.
    """
    relative = [named(cause.term.effect).search.discrepancy, _least_relative_std(cause.term)]
    gain, low = cause.held_out_gain, cause.held_out_gain_interval[0]
    if not math.isfinite(gain) or gain <= 0.0 or not math.isfinite(low):
        relative.append(1.0 / NORMAL_95)
    else:
        relative.append((1.0 - _taken(min(low, gain)) / _taken(gain)) / NORMAL_95)
    return cause.share * max(relative)


def _taken(gain: float) -> float:
    """What leaves a residual, relative to it, where its rms falls by a share."""
    return math.sqrt(1.0 - (1.0 - min(max(gain, 0.0), 1.0)) ** 2)


def _least_relative_std(term: Term) -> float:
    relative = [
        term.std[name] / abs(float(value))
        for name, value in term.values.items()
        if name in term.std and float(value) != 0.0
    ]
    return min((one for one in relative if one > 0.0 and math.isfinite(one)), default=0.0)
