"""A model of one recording, scored on another of the same machine."""

import json
import sys
from collections.abc import Iterable
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any, Final, Self

import numpy as np

from edge_ident.diagnosis.diagnose import diagnose
from edge_ident.diagnosis.fit.candidates import base_regressor
from edge_ident.diagnosis.prepare.axis_data import AxisData
from edge_ident.diagnosis.prepare.preparation import as_diagnosed, prepare_axis
from edge_ident.diagnosis.result import AxisDiagnosis, Cause
from edge_ident.errors import EdgeIdentError
from edge_ident.model.effects import named
from edge_ident.model.model import PARAMETERS, AxisModel, Term
from edge_ident.signals.recording import Recording

HARMED: Final = 1.02
"""Ratio of residuals above which the extension harms the other recording."""

BETTER: Final = 0.9
"""Ratio of residuals up to which the extension is worth something on the other recording."""


@dataclass(frozen=True)
class Score:
    """One axis, fitted to one recording and scored on another.

    Attributes
    ----------
    pair, axis : str
    verdict : str
    causes, suspected, minor : tuple of str
        Effects with their main values, strongest first.
    base_own, extended_own : float
        Relative residuals on the recording that was fitted.
    base, extended : float
        Relative residuals on the other one, with the offset refitted and without terms that are
        tied to time (`lasting`); nan where that recording cannot be judged.
    note : str
        Why there is no figure.
    """

    pair: str
    axis: str
    verdict: str = ""
    causes: tuple[str, ...] = ()
    suspected: tuple[str, ...] = ()
    minor: tuple[str, ...] = ()
    base_own: float = np.nan
    extended_own: float = np.nan
    base: float = np.nan
    extended: float = np.nan
    note: str = ""

    @property
    def judged(self) -> bool:
        """Whether there are figures of the other recording."""
        return bool(np.isfinite(self.base) and np.isfinite(self.extended))

    @property
    def ratio(self) -> float:
        """Residual of the extended model over that of the base model, on the other recording."""
        return self.extended / self.base

    @property
    def harmed(self) -> bool:
        """Whether the extension makes the other recording worse."""
        return self.judged and self.ratio > HARMED

    @property
    def better(self) -> bool:
        """Whether the extension takes a tenth off what is left of the other recording."""
        return self.judged and self.ratio <= BETTER

    def line(self) -> str:
        """As one line of JSON."""
        return json.dumps(asdict(self))

    @classmethod
    def read(cls, line: str) -> Self:
        """From one line of JSON."""
        values: dict[str, Any] = json.loads(line)
        for key in ("causes", "suspected", "minor"):
            values[key] = tuple(values[key])
        return cls(**values)


def kept_scores(runs: Iterable[tuple[str, Recording, Recording]], output: Path) -> list[Score]:
    """Scores of labelled pairs of recordings; each is in the file as soon as it is known."""
    found = []
    output.parent.mkdir(parents=True, exist_ok=True)
    with output.open("w", encoding="utf-8") as file:
        for label, fitted, other in runs:
            for score in scores(label, fitted, other):
                found.append(score)
                print(score.line(), file=file, flush=True)
                print(f"{score.pair}, axis {score.axis}", file=sys.stderr)
    return found


def scores(label: str, fitted: Recording, other: Recording) -> list[Score]:
    """Diagnose one recording, and score base and extended model of each axis on the other."""
    try:
        found = diagnose([fitted])
    except EdgeIdentError as error:
        return [Score(label, name, note=str(error)) for name in fitted.axes]
    return [_scored(label, name, axis, fitted, other) for name, axis in found.axes.items()]


def _scored(
    label: str, name: str, axis: AxisDiagnosis, fitted: Recording, other: Recording
) -> Score:
    base, extended, note = np.nan, np.nan, ""
    try:
        own, data = (prepare_axis(as_diagnosed([r], name), name) for r in (fitted, other))
        models = (_base(axis), lasting(own, axis.model))
        base, extended = (residual(data, model) for model in models)
    except EdgeIdentError as error:
        note = str(error)
    return Score(
        label,
        name,
        str(axis.verdict),
        described(axis.causes),
        described(axis.suspected),
        described(axis.minor),
        float(axis.base.fitted),
        float(axis.extended.fitted),
        base,
        extended,
        note,
    )


def lasting(data: AxisData, model: AxisModel) -> AxisModel:
    """A model without what is tied to the time of its recording, which another one does not have.

    What that changes in the base parameters, as a warm-up does the friction, is as it is on average
    over the recording `data`, to which the model was fitted.
    """
    base, *added = model.terms
    kept = tuple(term for term in added if not named(term.effect).tied_to_time)
    without = replace(model, terms=(base, *kept))
    gone = [term for term in added if term not in kept]
    changed = sorted({name for term in gone for name in named(term.effect).changes_base})
    if not changed:
        return without
    columns = base_regressor(data)[:, [PARAMETERS.index(name) for name in changed]]
    change = (data.predicted(model) - data.predicted(without))[data.valid]
    steps = np.linalg.lstsq(columns[data.valid], change)[0]
    values = {name: base.values[name] + s for name, s in zip(changed, steps.tolist(), strict=True)}
    return replace(model, terms=(replace(base, values={**base.values, **values}), *kept))


def residual(data: AxisData, model: AxisModel) -> float:
    """Relative residual of a model as it is; its offset is refitted.

    The filter fades an offset out at reversals like everything else, so it is no constant.
    """
    base = model.terms[0]
    raised = replace(base, values={**base.values, "offset": base.values["offset"] + 1.0})
    predicted, higher = (
        data.predicted(replace(model, terms=(term, *model.terms[1:])))[data.valid]
        for term in (base, raised)
    )
    effort, column = data.effort[data.valid], higher - predicted
    left = effort - predicted
    left = left - column * (column @ left) / (column @ column)
    return float(np.sqrt(np.mean(np.square(left)) / np.mean(np.square(effort))))


def _base(axis: AxisDiagnosis) -> AxisModel:
    """The base model under the same physical bounds as the extended one."""
    names = axis.model.terms[0].values
    values = np.maximum(axis.base.estimate.parameters[:3], 0.0)
    found = dict(zip(names, (*values, axis.base.estimate.parameters[3]), strict=True))
    return AxisModel((Term(axis.model.terms[0].effect, found),), *axis.model.units)


def described(causes: tuple[Cause, ...]) -> tuple[str, ...]:
    """Causes in a few words each: the effect, its values and its share of the effort."""
    told = []
    for cause in causes:
        values = ", ".join(
            f"{name} {np.mean(value):.3g}"
            for name, value in cause.term.values.items()
            if name in cause.term.std
        )
        told.append(f"{cause.term.effect} ({values}; {cause.share:.1%})")
    return tuple(told)
