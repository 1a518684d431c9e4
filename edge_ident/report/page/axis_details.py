"""All about one axis of a diagnosis: causes, charts and tables below the first screen."""

from dataclasses import dataclass, field
from typing import Any, Final

from markupsafe import Markup

from edge_ident.diagnosis import measures, result
from edge_ident.diagnosis import wording as terms
from edge_ident.diagnosis.wording import distinct_causes
from edge_ident.model.effects import named
from edge_ident.model.model import PARAMETERS, AxisModel
from edge_ident.model.model_files import values_document
from edge_ident.report import chart, error_budget, numbers
from edge_ident.report.page import diagnosis_charts, rendering
from edge_ident.report.view import Grid, Row
from edge_ident.support.words import spoken

_AN_ORDER: Final = " (repetitions per turn, or per metre)"

# Causes of an axis as a ranked list with bars, with what speaks for and against each.


@dataclass(frozen=True)
class Bar:
    """One line of the ranking.

    Attributes
    ----------
    kind : str
        Class of the style sheet: supported, suspected, minor or rest.
    title, term : str
        Everyday words, and the field's term.
    share : str
        Of the effort.
    bar : Markup
        The picture.
    facts : list of str
        Sentences below it.
    tests : list of str
        Why it was accepted, and what other effects do in its place; folded away.
    """

    kind: str
    title: str
    term: str
    share: str
    bar: Markup
    facts: list[str] = field(default_factory=list)
    tests: list[str] = field(default_factory=list)


def cause_bars(axis: result.AxisDiagnosis) -> list[Bar]:
    """Supported causes, strongest first, then suspected and minor ones, and what is left."""
    shares = [cause.share for causes in axis.by_kind.values() for cause in causes]
    longest = max([*shares, axis.extended.fitted]) or 1.0
    bars = [
        _bar(kind, cause, axis, longest)
        for kind, causes in axis.by_kind.items()
        for cause in causes
    ]
    rest = axis.extended.fitted
    noise = f"noise alone would leave {numbers.digits(100 * axis.noise_floor, 2)} %"
    return [
        *bars,
        Bar(
            "rest",
            "What is left over",
            noise,
            _share(rest, axis),
            _picture("rest", rest, longest, f"Left over: {_share(rest, axis)}; {noise}."),
        ),
    ]


def _bar(kind: str, cause: result.Cause, axis: result.AxisDiagnosis, longest: float) -> Bar:
    share, term = _share(cause.share, axis), spoken(cause.term.effect)
    facts = [numbers.sentence(cause.evidence)] if cause.evidence else []
    if kind == "supported":
        gain, interval = terms.gain(cause)
        facts.append(
            f"On kept-back parts it takes away {gain} of the error (95 % interval: {interval})."
        )
    else:
        facts.append(f"{kind.capitalize()}: {cause.decision}.")
    if shown_in := terms.recordings_of(cause, axis):
        facts.append(f"Seen in {shown_in}.")
    values = ", ".join(map(numbers.unit_text, terms.values(cause.term, axis.model)))
    return Bar(
        kind,
        numbers.sentence(named(cause.term.effect).advice.in_words).removesuffix("."),
        term,
        share,
        _picture(kind, cause.share, longest, f"{term}: {share}."),
        [*facts, f"Values ± one standard deviation: {values}." if values else ""],
        [
            *([numbers.sentence(f"accepted: {cause.decision}")] if kind == "supported" else []),
            *(numbers.sentence(terms.alternative_sentence(other)) for other in cause.alternatives),
        ],
    )


def other_remarks(axis: result.AxisDiagnosis) -> list[str]:
    """Effects that were tried and refused, external vibrations, and lines above the band."""
    said = [numbers.sentence(terms.refused_sentence(refused)) for refused in axis.refused]
    unit = numbers.unit_text(axis.model.effort_unit)
    said += [
        f"A vibration from outside acts on the axis: {one}. It is no property of the machine."
        for one in map(numbers.unit_text, terms.spoken_vibrations(axis))
    ]
    said += [
        f"Above the compared band, nothing explains {numbers.digits(line.amplitude, 3)} {unit} at "
        f"{terms.spoken_place(line)}{_AN_ORDER if line.order is not None else ''}."
        for line in axis.lines
    ]
    return said + [f"{numbers.sentence(f.message)} Next: {f.next_step}." for f in axis.findings]


def _share(share: float, axis: result.AxisDiagnosis) -> str:
    return (
        f"{numbers.digits(100 * share, 2)} % of the {numbers.effort_word(axis.model.effort_unit)}"
    )


def _picture(kind: str, share: float, longest: float, title: str) -> Markup:
    return rendering.picture("bar", kind, max(0.3, 100.0 * share / longest), title)


@dataclass(frozen=True)
class AxisDetails:
    """What the page says of an axis below the first screen.

    Attributes
    ----------
    key : str
        Prefix of ids, unique in the page.
    name : str
        Of the axis.
    budget : dict
        What `budget_picture` gives.
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
    parameters, quality, follows, conditions : Grid
    validation, not_testable : Grid or None
    """

    key: str
    name: str
    budget: dict[str, Any]
    bars: list[Bar]
    remarks: list[str]
    cause_charts: list[chart.Chart]
    detail: chart.Chart | None
    time_charts: list[chart.Chart]
    maps: list[tuple[chart.Chart, ...]]
    spectrum: chart.Chart
    parameters: Grid
    quality: Grid
    follows: Grid
    conditions: Grid
    validation: Grid | None
    not_testable: Grid | None


def axis_details(key: str, name: str, diagnosis: result.Diagnosis) -> AxisDetails:
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
    shown = [c for c in distinct_causes(axis.causes) if c.term.effect in axis.traces.contributions]
    validation = diagnosis.validation.get(name)
    return AxisDetails(
        key=key,
        name=name,
        budget=error_budget.budget_picture(f"{key}-budget", axis.budget),
        bars=cause_bars(axis),
        remarks=other_remarks(axis),
        cause_charts=[
            diagnosis_charts.cause_chart(f"{key}-cause{n}", name, axes, cause)
            for n, cause in enumerate(shown)
        ][1:],
        detail=_detail(f"{key}-detail", axis),
        time_charts=[
            diagnosis_charts.effort_chart(f"{key}-effort", axis),
            diagnosis_charts.residual_chart(f"{key}-residual", axis),
        ],
        maps=diagnosis_charts.residual_charts(f"{key}-map", name, axes),
        spectrum=diagnosis_charts.spectrum_chart(f"{key}-spectrum", axis),
        parameters=_parameters(axis),
        quality=_quality(axis, validation),
        follows=_follows(name, diagnosis),
        conditions=_conditions(axis),
        validation=_validation(validation),
        not_testable=_not_testable(axis),
    )


def _detail(key: str, axis: result.AxisDiagnosis) -> chart.Chart | None:
    part = diagnosis_charts.busiest(axis)
    short = 2 * (part.stop - part.start) < len(axis.traces.effort)
    return diagnosis_charts.effort_chart(key, axis, part) if short else None


def _models(axis: result.AxisDiagnosis) -> dict[str, measures.ModelFit]:
    simple = {"simple model": axis.base}
    return {**simple, "with the causes": axis.extended} if axis.causes else simple


def _parameters(axis: result.AxisDiagnosis) -> Grid:
    models, units = _models(axis), _units(axis.model)
    rows = numbers.estimate_rows(
        [fit.estimate for fit in models.values()], units, numbers.with_interval
    )
    title = "Parameters, with 95 % intervals"
    if axis.causes and axis.extended.effective is not None:
        # the simple model's friction is a line already
        lines = [axis.base.estimate, axis.extended.effective]
        rows += numbers.effective_rows(lines, units, numbers.with_interval)
        title += f" ({numbers.EFFECTIVE})"
    return Grid(title, ("", *models, "unit"), rows)


def _units(model: AxisModel) -> list[str]:
    return [
        numbers.unit_text(entry["unit"])
        for entry in values_document(model.terms[0], model).values()
    ]


def _quality(axis: result.AxisDiagnosis, validation: measures.Validation | None) -> Grid:
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
    return Grid("How well the models fit", ("", *_models(axis)), rows)


def _follows(name: str, diagnosis: result.Diagnosis) -> Grid:
    found = diagnosis_charts.explained_variance(name, diagnosis.axes)
    kinds = ("base", "extended")[: len(_models(diagnosis.axes[name]))]
    rows: list[Row] = [
        (spoken(of), *(f"{100 * found[kind][of]:.0f} %" for kind in kinds)) for of in found["base"]
    ]
    return Grid(
        "How much of the error follows each quantity (share of its variance)",
        ("", *_models(diagnosis.axes[name])),
        rows,
    )


def _conditions(axis: result.AxisDiagnosis) -> Grid:
    valid = axis.traces.valid
    rows: list[Row] = [
        ("Noise floor", f"{terms.percent(axis.noise_floor)}, {axis.noise_floor_source}"),
        ("Compared up to", f"{numbers.digits(axis.cutoff_hz, 3)} Hz, which holds "
         f"{terms.percent(axis.share_in_band)} of the variance of the effort"),
        ("Encoder noise dominates from", f"{numbers.digits(axis.knee_hz, 3)} Hz"
         if axis.knee_hz < axis.cutoff_hz else "nowhere in this band"),
        ("Timing", numbers.sentence(terms.timing_sentence(axis.timing))),
        ("Samples that count", f"{int(valid.sum())} of {len(valid)}"),
    ]  # fmt: skip
    return Grid("How it was compared", ("", ""), rows)


def _validation(validation: measures.Validation | None) -> Grid | None:
    if validation is None or not validation.causes:
        return None
    verdicts = {True: "yes", False: "no", None: "not asked"}
    rows: list[Row] = [
        (
            spoken(cause.effect),
            "–" if cause.without is None else terms.percent(cause.without),
            "–" if cause.gain is None else f"{100 * cause.gain:.0f} %",
            verdicts[cause.carries_over],
            numbers.sentence(cause.reason) if cause.reason else "",
        )
        for cause in validation.causes
    ]
    headings = ("cause", "error without it", "takes away", "carries over", "why")
    return Grid("Each cause on the other recording", headings, rows)


def _not_testable(axis: result.AxisDiagnosis) -> Grid | None:
    if not axis.not_testable:
        return None
    rows: list[Row] = [
        (spoken(effect.effect), effect.reason, effect.experiment) for effect in axis.not_testable
    ]
    return Grid("What this motion cannot show", ("effect", "why", "motion that shows it"), rows)
