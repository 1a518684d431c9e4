"""The work of one worker: read a recording, identify it, diagnose it where that is needed.

What goes in and what comes out are JSON documents, so that a worker may be another process or
another computer, and a result that is kept is what came back.
"""

import ast
import json
import math
import os
import sys
import tempfile
import threading
import time
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from types import ModuleType
from typing import Any, Final

from edge_ident.diagnosis.result import AxisDiagnosis, Cause, Kind
from edge_ident.errors import EdgeIdentError, ModelError
from edge_ident.fleet.result import Failed, SurveyedAxis, SurveyedCause, Value
from edge_ident.identification.identify import identify
from edge_ident.identification.result import AxisIdentification
from edge_ident.model.effects import named, registered
from edge_ident.model.model import NORMAL_95, PARAMETERS, AxisModel, Model, Term
from edge_ident.model.model_files import model_document, model_of, values_document
from edge_ident.signals.read_columns import ReadOptions
from edge_ident.signals.recording import Recording
from edge_ident.signals.recording_files import load_recording
from edge_ident.support.documents import finite


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
        """The options as JSON.

        Raises
        ------
        ModelError
            An effect was registered where no other process can load it from.
        """
        model = None if self.model is None else model_document(self.model)
        return {
            "read": asdict(self.read),
            "model": model,
            "diagnose": self.diagnose,
            "effects": effect_files(),
        }

    @classmethod
    def of(cls, document: Mapping[str, Any]) -> "Options":
        """The options from JSON; effects that the caller registered are registered here, too."""
        load_effects(document["effects"])
        model = None if document["model"] is None else model_of(document["model"], "the model")
        return cls(ReadOptions(**document["read"]), model, document["diagnose"])


# Effects of a user's own are objects of a program; another process gets them by carrying out the
# file that registers them. It stops there: what follows, such as the survey itself, is the
# program's own.

_loaded: Final[dict[str, str]] = {}
"""Files that were carried out here, with their content."""
_loading: Final = threading.Lock()
"""A worker of a cluster may have several threads."""


def effect_files() -> list[dict[str, Any]]:
    """Files that registered effects, with what each registered and its content.

    Raises
    ------
    ModelError
        One was registered at a prompt or in a notebook.
    """
    names: dict[str, list[str]] = {}
    for name, (_, file) in registered().items():
        if not Path(file).is_file():
            raise ModelError(
                f"effect {name} was registered at a prompt or in a notebook, from where the "
                "processes of a survey cannot load it",
                "write its class and register_effect into a file, own_effects.py, and "
                "import own_effects in its place",
            )
        names.setdefault(str(Path(file).resolve()), []).append(name)
    return [
        {"file": file, "names": sorted(of), "source": Path(file).read_text("utf-8")}
        for file, of in names.items()
    ]


def load_effects(files: Sequence[Mapping[str, Any]]) -> None:
    """Register here what files of another process register.

    Parameters
    ----------
    files : sequence of mapping
        Of `effect_files`.

    Raises
    ------
    ModelError
        A file does not register here what it registered there.
    """
    with _loading:
        for one in files:
            known = set(one["names"]) <= set(registered())
            if not known or _loaded.get(one["file"], one["source"]) != one["source"]:
                _carry_out(one["file"], one["source"], one["names"])
                _loaded[one["file"]] = one["source"]


def _carry_out(file: str, source: str, names: Sequence[str]) -> None:
    def missing() -> list[str]:
        now = registered()
        return [name for name in names if now.get(name) is before.get(name)]

    before = registered()
    module = ModuleType(f"own_effects_of_{Path(file).stem}")
    module.__file__ = file
    sys.modules[module.__name__] = module  # dataclasses look their module up
    sys.path.append(str(Path(file).parent))  # what lies beside it, as where it is the program
    try:
        body = ast.parse(source, file).body
        future = [s for s in body if isinstance(s, ast.ImportFrom) and s.module == "__future__"]
        for statement in body:
            part = ast.Module([*future, statement], [])
            own_code = compile(part, file, "exec", dont_inherit=True)
            exec(own_code, vars(module))  # of the person who runs the survey; no recording has any
            if not missing():
                return
    except (Exception, SystemExit) as error:
        why = f"{type(error).__name__}: {error}"
    else:
        why = f"nothing outside of functions and of __main__ registers {', '.join(missing())}"
    raise ModelError(
        f"a process of the survey cannot load the effects of {file}: {why}",
        "write the classes and register_effect into a file of their own, own_effects.py, and "
        "import own_effects in its place",
    )


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
    kinds = diagnosis.by_kind.items()
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


# A process that analyses recordings: a task a line on stdin, its result a line on stdout.
#
# It ends when its stdin is closed.


def answer_stdin() -> None:
    """Analyse until there is nothing more to do."""
    answers = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)  # what a library prints is no answer
    for line in sys.stdin:
        task = json.loads(line)
        print(json.dumps(analyse(task["file"], task["options"])), file=answers, flush=True)


if __name__ == "__main__":
    answer_stdin()
