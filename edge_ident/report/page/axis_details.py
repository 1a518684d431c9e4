"""All about one axis of a diagnosis: causes, charts and tables below the first screen."""

from dataclasses import dataclass

from edge_ident.diagnosis.measures import ModelFit, Validation
from edge_ident.diagnosis.present import wording as terms
from edge_ident.diagnosis.present.document import explained_variance
from edge_ident.diagnosis.result import AxisDiagnosis, Diagnosis
from edge_ident.model.model import PARAMETERS, AxisModel, Estimate, base_axis
from edge_ident.model.model_files import values_document
from edge_ident.report.page.budget_charts import BudgetPicture, budget_picture
from edge_ident.report.page.card import Row, Table
from edge_ident.report.page.cause_list import Bar, cause_bars, other_remarks
from edge_ident.report.page.chart import Chart
from edge_ident.report.page.diagnosis_card import distinct
from edge_ident.report.page.map_charts import cause_chart, residual_charts
from edge_ident.report.page.spectrum_chart import spectrum_chart
from edge_ident.report.page.time_charts import busiest, effort_chart, residual_chart
from edge_ident.report.page.wording import digits, sentence, unit_text, with_interval
from edge_ident.report.parameter_table import EFFECTIVE
from edge_ident.support.words import spoken


@dataclass(frozen=True)
class AxisDetails:
    """What the page says of an axis below the first screen.

    Attributes
    ----------
    key : str
        Prefix of ids, unique in the page.
    name : str
        Of the axis.
    budget : BudgetPicture
    bars : list of Bar
    remarks : list of str
    cause_charts : list of Chart
        One for each cause but the first, which the first screen shows.
    time_charts : list of Chart
        Over the whole recording.
    maps : list of tuple of Chart
        For each quantity, the base model's residual and the extended model's.
    detail : Chart or None
        The busiest part of the recording; None where that is half of it or more.
    spectrum : Chart
    parameters, quality, follows, conditions : Table
    validation, not_testable : Table or None
    """

    key: str
    name: str
    budget: BudgetPicture
    bars: list[Bar]
    remarks: list[str]
    cause_charts: list[Chart]
    detail: Chart | None
    time_charts: list[Chart]
    maps: list[tuple[Chart, ...]]
    spectrum: Chart
    parameters: Table
    quality: Table
    follows: Table
    conditions: Table
    validation: Table | None
    not_testable: Table | None


def axis_details(key: str, name: str, diagnosis: Diagnosis) -> AxisDetails:
    """Collect what the page says of an axis below the first screen.

    Parameters
    ----------
    key : str
        Unique in the page.
    name : str
        Of the axis.
    diagnosis : Diagnosis
    """
    axis, axes = diagnosis.axes[name], diagnosis.axes
    shown = [c for c in distinct(axis.causes) if c.term.effect in axis.traces.contributions]
    validation = diagnosis.validation.get(name)
    return AxisDetails(
        key=key,
        name=name,
        budget=budget_picture(f"{key}-budget", axis.budget),
        bars=cause_bars(axis),
        remarks=other_remarks(axis),
        cause_charts=[
            cause_chart(f"{key}-cause{n}", name, axes, cause) for n, cause in enumerate(shown)
        ][1:],
        detail=_detail(f"{key}-detail", axis),
        time_charts=[effort_chart(f"{key}-effort", axis), residual_chart(f"{key}-residual", axis)],
        maps=residual_charts(f"{key}-map", name, axes),
        spectrum=spectrum_chart(f"{key}-spectrum", axis),
        parameters=_parameters(axis),
        quality=_quality(axis, validation),
        follows=_follows(name, diagnosis),
        conditions=_conditions(axis),
        validation=_validation(validation),
        not_testable=_not_testable(axis),
    )


def _detail(key: str, axis: AxisDiagnosis) -> Chart | None:
    part = busiest(axis)
    short = 2 * (part.stop - part.start) < len(axis.traces.effort)
    return effort_chart(key, axis, part) if short else None


def _models(axis: AxisDiagnosis) -> dict[str, ModelFit]:
    simple = {"simple model": axis.base}
    return {**simple, "with the causes": axis.extended} if axis.causes else simple


def _parameters(axis: AxisDiagnosis) -> Table:
    models = _models(axis)
    columns = [_values(fit, axis.model) for fit in models.values()]
    rows: list[Row] = [
        (spoken(name), *(with_interval(*column[name]) for column in columns), unit)
        for name, unit in zip(PARAMETERS, _units(axis.model), strict=True)
    ]
    title = "Parameters, with 95 % intervals"
    if axis.causes and axis.extended.effective is not None:
        rows += _line_rows(axis.base.estimate, axis.extended.effective, _units(axis.model))
        title += f" ({EFFECTIVE})"
    return Table(title, ("", *models, "unit"), rows)


def _line_rows(base: Estimate, line: Estimate, units: list[str]) -> list[Row]:
    """The line through the friction curve, which the simple model's friction is already."""
    return [
        (
            f"effective {spoken(name)}",
            *(with_interval(float(e.parameters[i]), float(e.std[i])) for e in (base, line)),
            units[i],
        )
        for i, name in enumerate(PARAMETERS[1:], 1)
    ]


def _values(fit: ModelFit, model: AxisModel) -> dict[str, tuple[float, float | None]]:
    base = base_axis(fit.estimate, *model.units)
    entries = values_document(base.terms[0], base)
    return {name: (entry["value"], entry["std"]) for name, entry in entries.items()}


def _units(model: AxisModel) -> list[str]:
    return [unit_text(entry["unit"]) for entry in values_document(model.terms[0], model).values()]


def _quality(axis: AxisDiagnosis, validation: Validation | None) -> Table:
    labels = {
        "relative residual, fitted": "error on the recording",
        "relative residual, held out": "error on kept-back parts",
        "relative residual, validation": "error on another recording",
        "fit": "fit (1 is perfect)",
        "time-spectral metric": "time-spectral metric (1 is perfect)",
    }
    count = len(_models(axis))
    rows: list[Row] = [
        (labels.get(label, label), *cells[:count])
        for label, *cells in terms.before_and_after(axis, validation)
        if not label.startswith(tuple(spoken(name) for name in PARAMETERS))
    ]
    return Table("How well the models fit", ("", *_models(axis)), rows)


def _follows(name: str, diagnosis: Diagnosis) -> Table:
    found = explained_variance(name, diagnosis.axes)
    kinds = ("base", "extended")[: len(_models(diagnosis.axes[name]))]
    rows: list[Row] = [
        (spoken(of), *(f"{100 * found[kind][of]:.0f} %" for kind in kinds)) for of in found["base"]
    ]
    return Table(
        "How much of the error follows each quantity (share of its variance)",
        ("", *_models(diagnosis.axes[name])),
        rows,
    )


def _conditions(axis: AxisDiagnosis) -> Table:
    timing = axis.timing
    way = "late" if timing.shift_samples >= 0.0 else "early"
    valid = axis.traces.valid
    rows: list[Row] = [
        ("Noise floor", f"{terms.percent(axis.noise_floor)}, {axis.noise_floor_source}"),
        ("Compared up to", f"{digits(axis.cutoff_hz, 3)} Hz, which holds "
         f"{terms.percent(axis.share_in_band)} of the variance of the effort"),
        ("Encoder noise dominates from", f"{digits(axis.knee_hz, 3)} Hz"
         if axis.knee_hz < axis.cutoff_hz else "nowhere in this band"),
        ("Timing", f"effort is {abs(timing.shift_samples):.2f} ± {timing.std_samples:.2f} samples "
         f"{way} ({digits(1e3 * abs(timing.shift_s), 3)} ms); part of both models"),
        ("Samples that count", f"{int(valid.sum())} of {len(valid)}"),
    ]  # fmt: skip
    return Table("How it was compared", ("", ""), rows)


def _validation(validation: Validation | None) -> Table | None:
    if validation is None or not validation.causes:
        return None
    verdicts = {True: "yes", False: "no", None: "not asked"}
    rows: list[Row] = [
        (
            spoken(cause.effect),
            "–" if cause.without is None else terms.percent(cause.without),
            "–" if cause.gain is None else f"{100 * cause.gain:.0f} %",
            verdicts[cause.carries_over],
            sentence(cause.reason) if cause.reason else "",
        )
        for cause in validation.causes
    ]
    headings = ("cause", "error without it", "takes away", "carries over", "why")
    return Table("Each cause on the other recording", headings, rows)


def _not_testable(axis: AxisDiagnosis) -> Table | None:
    if not axis.not_testable:
        return None
    rows: list[Row] = [
        (spoken(effect.effect), effect.reason, effect.experiment) for effect in axis.not_testable
    ]
    return Table("What this motion cannot show", ("effect", "why", "motion that shows it"), rows)
