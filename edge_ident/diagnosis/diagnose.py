"""Diagnose recordings of one machine: the whole procedure."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.diagnosis.fit.fitting import Fitted, deviations, fit
from edge_ident.diagnosis.fit.noise_floor import noise_floor
from edge_ident.diagnosis.motion_check import with_motion_errors
from edge_ident.diagnosis.prepare.preparing import view_of
from edge_ident.diagnosis.prepare.quality import data_findings
from edge_ident.diagnosis.prepare.view import View
from edge_ident.diagnosis.result import (
    AxisDiagnosis,
    Cause,
    Diagnosis,
    Fit,
    Rival,
    Traces,
    Validation,
    Verdict,
)
from edge_ident.diagnosis.select.judging import Gain, residuals_held_out
from edge_ident.diagnosis.select.peeling import peel
from edge_ident.diagnosis.select.search import Search
from edge_ident.diagnosis.select.settling import Settled, settle
from edge_ident.diagnosis.select.testability import not_testable
from edge_ident.errors import DataError
from edge_ident.model.effects import named
from edge_ident.model.model import BASE, PARAMETERS, AxisModel, Estimate, Model, Term
from edge_ident.signals.metrics import compare
from edge_ident.signals.recording import Recording

Array = NDArray[np.float64]
Progress = Callable[[str, int, int], None]

CLEARLY_ABOVE: Final = 1.2
"""Residual over noise floor from which there is structure: an encoder's rounding is not white."""
_TINY: Final = float(np.finfo(float).tiny)


def diagnose(
    recordings: Sequence[Recording],
    *,
    model: Model | None = None,
    validate: Recording | None = None,
    on_progress: Progress = lambda stage, done, of: None,
) -> Diagnosis:
    """Find what the base model gets wrong, name the cause, and extend the model.

    Parameters
    ----------
    recordings : sequence of Recording
        Of the same axes; fitted together.
    model : Model, optional
        Effects to start from.
    validate : Recording, optional
        Scored with the models that were fitted to the others.
    on_progress : callable
        Told the stage, and how much of it is done.

    Returns
    -------
    Diagnosis

    Raises
    ------
    DataError
        An axis moves too little to say anything, or is not in every recording.

    Examples
    --------
    >>> import edge_ident
    >>> found = edge_ident.diagnose([edge_ident.simulate()])
    >>> found.axes["x"].verdict.value
    'adequate'
    """
    names = list(recordings[0].axes)
    for other in [*recordings[1:], *([validate] if validate else [])]:
        if set(other.axes) != set(names):
            raise DataError(
                f"{other.source} has axes {', '.join(other.axes)}, {recordings[0].source} has "
                f"{', '.join(names)}",
                "give recordings of the same machine, or rename columns with --column",
            )
    axes, validation = {}, {}
    for done, name in enumerate(names):
        on_progress("diagnosis", done, len(names))
        template = _template(recordings[0], name, model)
        axes[name] = _axis(view_of(recordings, name), template)
        if validate is not None:
            validation[name] = _validated(view_of([validate], name), axes[name], template)
    on_progress("diagnosis", len(names), len(names))
    on_progress("simulated motion", 0, 1)
    found = Diagnosis(axes, data_findings(recordings, axes), validation)
    return with_motion_errors(found, recordings)


def _template(recording: Recording, name: str, model: Model | None) -> AxisModel:
    """The axis with the effects that it is known to have."""
    axis = recording.axes[name]
    known: tuple[Term, ...] = ()
    if model is not None and name in model.axes:
        known = model.axes[name].terms[1:]
    base = Term(BASE, dict.fromkeys(PARAMETERS, 0.0))
    return AxisModel((base, *known), axis.position_unit, axis.effort_unit)


def _axis(view: View, template: AxisModel) -> AxisDiagnosis:
    search, start, settled = _searched(view, template)
    beyond = view.beyond_beats(view.effort - settled.model.predicted, float(start.base[0]))
    if np.any(beyond):
        # something happened while the encoder's counts were beating
        view = view.cleared(beyond)
        search, start, settled = _searched(view, template)
    model, rivals, gained = settled.inside(view)
    floor = noise_floor(view, start, float(model.base[0]))
    samples = np.count_nonzero(view.clear)
    left = float(np.sqrt(model.error / samples))
    noise = CLEARLY_ABOVE * (1.0 + 2.0 * floor.uncertainty) * floor.rms
    allowed = np.hypot(noise, np.sqrt(search.doubt(model) / samples))
    verdict = Verdict.EXPLAINED if model.found else Verdict.ADEQUATE
    if left > allowed:
        verdict = Verdict.UNEXPLAINED
    base_fit, _ = _summary(view, start)
    extended_fit, std = _summary(view, model)
    contributions = [_contribution(view, model, k) for k in range(len(model.found))]
    causes = _causes(view, model, contributions, rivals, gained, std)
    terms = (*template.terms[1:], *(cause.term for cause in causes))
    # where nothing opposes the motion a fitted friction can be negative, which no model file may be
    lowest = [named(BASE).bounds[name][0] for name in PARAMETERS]
    values = dict(zip(PARAMETERS, np.maximum(model.base, lowest).tolist(), strict=True))
    certainty = dict(zip(PARAMETERS, extended_fit.estimate.std.tolist(), strict=True))
    return AxisDiagnosis(
        verdict=verdict,
        causes=causes,
        vibrations=settled.vibrations,
        not_testable=not_testable(search, model, left),
        base=base_fit,
        extended=extended_fit,
        noise_floor=floor.rms / _rms(view.effort[view.clear]),
        noise_floor_source=floor.source,
        model=replace(template, terms=(Term(BASE, values, certainty), *terms)),
        cutoff_hz=max(s.cutoff_hz for s in view.stretches),
        knee_hz=max(s.band.knee_hz for s in view.stretches),
        traces=_traces(view, start, model, contributions),
    )


def _searched(view: View, template: AxisModel) -> tuple[Search, Fitted, Settled]:
    """The search, the base model, and what was found."""
    start = fit(view, template, np.array([1.0, 0.0, 0.0, 0.0]), ())
    search = Search(view, template, start)
    return search, start, settle(search, peel(search, start))


def _summary(view: View, fitted: Fitted) -> tuple[Fit, Array]:
    """A model's figures, and the deviations of its base parameters, amplitudes and shapes."""
    std = deviations(view, fitted)
    residual = (view.effort - fitted.predicted)[view.clear]
    held_out = _rms(residuals_held_out(view, fitted)[view.clear]) / _rms(view.effort[view.clear])
    metric = compare(view.effort, fitted.predicted)
    fitted_share = _rms(residual) / _rms(view.effort[view.clear])
    estimate = Estimate(fitted.base, std[:4])
    return Fit(estimate, fitted_share, held_out, metric), std


def _causes(
    view: View,
    model: Fitted,
    contributions: list[Array],
    rivals: list[tuple[Rival, ...]],
    gained: list[Gain],
    std: Array,
) -> tuple[Cause, ...]:
    shape_at = len(model.linear)
    causes = []
    for k, f in enumerate(model.found):
        deviations = dict(zip(f.amplitudes, std[model.columns_of(k)].tolist(), strict=True))
        names = f.candidate.form.nonlinear
        deviations |= dict(zip(names, std[shape_at : shape_at + len(names)].tolist(), strict=True))
        shape_at += len(names)
        share = _rms(contributions[k][view.clear]) / _rms(view.effort[view.clear])
        values = {name: float(np.asarray(v)) for name, v in f.term.values.items()}
        term = replace(f.term, values=values, std=deviations)
        causes.append(
            Cause(
                term,
                gained[k].value,
                gained[k].interval,
                share,
                rivals[k],
                _evidence(f.term, gained[k], share),
            )
        )
    order = np.argsort([-cause.share for cause in causes], kind="stable")
    return tuple(causes[k] for k in order)


def _evidence(term: Term, found: Gain, share: float) -> str:
    where = "where it acts" if found.one_off else "in stretches that it was not fitted to"
    return (
        f"{named(term.effect).search.signature}; it makes up {share:.1%} of the effort and takes "
        f"{found.value:.0%} off the residual {where}"
    )


def _contribution(view: View, model: Fitted, index: int) -> Array:
    """What one term adds to the effort."""
    terms, at = model.axis.terms, len(model.template.terms) + index
    rest = replace(model.axis, terms=(*terms[:at], *terms[at + 1 :]))
    return view.predicted(model.axis) - view.predicted(rest)


def _traces(view: View, start: Fitted, model: Fitted, contributions: list[Array]) -> Traces:
    shares: dict[str, Array] = {}
    for f, contribution in zip(model.found, contributions, strict=True):
        effect = f.candidate.effect
        shares[effect] = shares.get(effect, 0.0) + contribution
    return Traces(
        time_s=view.of_motion("time_s"),
        position=view.of_motion("position"),
        velocity=view.of_motion("velocity"),
        acceleration=view.of_motion("acceleration"),
        effort=view.effort,
        base_effort=start.predicted,
        extended_effort=model.predicted,
        shares=shares,
        since_reversal=view.since_reversal,
        clear=view.clear,
        file=np.repeat(np.arange(len(view.stretches)), [len(s.picks) for s in view.stretches]),
    )


def _validated(view: View, found: AxisDiagnosis, template: AxisModel) -> Validation:
    """Both models, as they are, on another recording."""
    base = dict(zip(PARAMETERS, found.base.estimate.parameters, strict=True))
    plain = replace(template, terms=(Term(BASE, base), *template.terms[1:]))
    scale = _rms(view.effort)
    return Validation(
        base=_rms(view.effort - view.predicted(plain)) / scale,
        extended=_rms(view.effort - view.predicted(found.model)) / scale,
    )


def _rms(values: Array) -> float:
    return max(float(np.sqrt(np.mean(values**2))), _TINY)
