"""A diagnosis as one HTML page, and as Markdown with its pictures as SVG files."""

import re
import shlex
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Final

import numpy as np
from markupsafe import Markup, escape

from edge_ident.diagnosis.measures import Verdict
from edge_ident.diagnosis.result import AxisDiagnosis, Diagnosis
from edge_ident.diagnosis.wording import distinct_causes, in_words, only_elsewhere, parts_of
from edge_ident.estimation.trust import off_reference
from edge_ident.model.effects import named
from edge_ident.model.model_files import unit_of
from edge_ident.report.chart import Chart, reach
from edge_ident.report.diagnosis import axis_parts, diagnosis_document
from edge_ident.report.findings import blocking_steps
from edge_ident.report.numbers import digits, effort_word, sentence, unit_text
from edge_ident.report.page import diagnosis_charts as charts
from edge_ident.report.page import rendering as page
from edge_ident.report.page.axis_details import axis_details
from edge_ident.report.view import Grid, Line
from edge_ident.support.documents import NOT_TEXT, atomic_write
from edge_ident.support.words import listed, on_a_line, spoken, visible

_STATUS: Final[dict[Verdict, tuple[page.Status, str]]] = {
    Verdict.ADEQUATE: ("good", "model fits"),
    Verdict.EXPLAINED: ("found", "cause found"),
    Verdict.PARTLY_EXPLAINED: ("open", "partly explained"),
    Verdict.UNEXPLAINED: ("open", "not understood"),
}
# Where to look, by the quantity that an error without a cause follows.
_FOLLOWS: Final = {
    "position": "what changes along the stroke: screw, guides, belt, cables",
    "velocity": "what changes with speed: lubricant, seals, bearings",
    "distance_since_reversal": "what happens where the axis turns back: play, coupling, guides",
    "time": "what changes with time, or comes from outside: electronics, warming, people",
}


def diagnosis_card(key: str, name: str, diagnosis: Diagnosis) -> page.Card:
    """What the first screen says of an axis.

    Parameters
    ----------
    key : str
        Unique in the page.
    name : str
        Of the axis.
    diagnosis : Diagnosis
    """
    axis = diagnosis.axes[name]
    status, label = _STATUS[axis.verdict]
    if axis.verdict is Verdict.ADEQUATE and off_reference(axis.findings):
        status, label = "found", "off its reference"
    follows = charts.followed(
        name, diagnosis.axes, axis.traces.effort - axis.traces.extended_effort
    )
    card = page.Card(
        axis=name,
        status=status,
        label=label,
        verdict=Markup(" ").join([*_sizes(name, axis), _verdict(name, axis)]),
        terms=_terms(axis),
        sure=[_in_short(name, diagnosis), *_sure(name, axis), *_elsewhere(name, diagnosis)],
        part=_part(axis, follows),
        action=_action(name, diagnosis),
        chart=replace(_picture(key, name, diagnosis.axes, follows), height=page.PICTURE_HEIGHT),
    )
    return of_recordings(card, diagnosis)


def _sizes(name: str, axis: AxisDiagnosis) -> list[Markup]:
    """How large each fault is, with its unit, the strongest first; a sentence each."""
    said = []
    for cause in distinct_causes(axis.causes)[:2]:
        place = next(n for n, one in enumerate(axis.causes) if one is cause)
        at = ("axes", name, "causes", place)
        effect = named(cause.term.effect)
        parameters = {parameter.name: parameter for parameter in effect.parameters}
        shown = {
            key: _with_unit(float(value), unit_of(parameters[key], *axis.model.units), *at, key)
            for key, value in cause.term.values.items()
        }
        if effect.advice.size:
            size = effect.advice.size
            said.append(Markup(f"{size[0].upper()}{size[1:]}.").format(**shown))
        else:
            effort = effort_word(axis.model.effort_unit)
            title = spoken(cause.term.effect).capitalize()
            share = page.percent(cause.share, *at, "share")
            said.append(Markup("{}, {} of the {}.").format(title, share, effort))
    return said


def _with_unit(value: float, unit: str, *place: str | int) -> Markup:
    *at, name = place
    return page.number(
        value, f"{digits(value, 2)}\u00a0{unit_text(unit)}", *at, "parameters", name, "value"
    )


def _verdict(name: str, axis: AxisDiagnosis) -> Markup:
    found = in_words(axis.causes)
    off = off_reference(axis.findings)
    if axis.verdict is Verdict.ADEQUATE and off is not None:
        return Markup("The effort is that of the motion, but {}.").format(off.message)
    if axis.verdict is Verdict.ADEQUATE:
        return Markup("Nothing is wrong that this recording can show.")
    causes = _listed(found)
    if axis.verdict is Verdict.EXPLAINED:
        return Markup("{} This explains what the simple model gets wrong.").format(causes)
    if axis.verdict is Verdict.PARTLY_EXPLAINED:
        return Markup(" ").join(
            filter(None, [causes, *_curves(name, axis), _part_of_it(name, axis)])
        )
    suspected = in_words(axis.suspected)
    doubt = f" Suspected only: {suspected[0]}." if suspected else ""
    return Markup("Something acts on this axis, and no known cause explains it.{}").format(doubt)


def _curves(name: str, axis: AxisDiagnosis) -> list[Markup]:
    """What comes back without a name, with the ends of each curve."""
    said = []
    for n, curve in enumerate(axis.curves):
        values, unit = curve.curve.values, unit_text(curve.curve.unit)
        at = ("axes", name, "curves", n, "values")
        low, high = (
            page.number(float(values[place]), digits(float(values[place]), 2), *at, int(place))
            for place in (np.argmin(values), np.argmax(values))
        )
        what = Markup("{} {} to {}\u00a0{} over {}")
        said.append(what.format(curve.curve.what, low, high, unit, curve.curve.over))
    if not said:
        return []
    return [Markup("No law describes this, but it comes back: {}.").format(Markup("; ").join(said))]


def _part_of_it(name: str, axis: AxisDiagnosis) -> Markup:
    share = page.percent(axis.explained_share, "axes", name, "explained_share")
    return Markup("That is {} of what the simple model gets wrong; the rest is open.").format(share)


def _listed(found: Sequence[str]) -> Markup:
    if len(found) <= 1:
        return Markup("").join(sentence(words) for words in found)
    return Markup("{} causes act on this axis: {}.").format(
        page.counted(len(found)).capitalize(), Markup("; ").join(found)
    )


def _terms(axis: AxisDiagnosis) -> str:
    causes = [spoken(cause.term.effect) for cause in distinct_causes(axis.causes)]
    suspected = [f"{spoken(c.term.effect)} (suspected)" for c in distinct_causes(axis.suspected)]
    return "; ".join([axis.verdict.value, *causes, *suspected])


def _sure(name: str, axis: AxisDiagnosis) -> list[Markup]:
    """The numbers behind it."""
    at = ("axes", name)
    word = effort_word(axis.model.effort_unit)
    left = page.percent(axis.extended.fitted, *at, "extended", "relative_residual", "fitted")
    floor = page.percent(axis.noise_floor, *at, "noise_floor")
    before = page.percent(axis.base.fitted, *at, "base", "relative_residual", "fitted")
    if axis.extends_base:
        first = Markup("The error of the model falls from {} to {} of the {}.")
        said = [first.format(before, left, word)]
    else:
        said = [Markup("The model misses {} of the {}.").format(before, word)]
    said.append(Markup("Noise alone would leave {}.").format(floor))
    if axis.causes:
        said += _cause_sure(name, axis)
    if axis.lines:
        vibrations = "vibration is" if len(axis.lines) == 1 else "vibrations are"
        said.append(
            Markup("Above the compared frequencies, {} {} left that no cause explains.").format(
                page.counted(len(axis.lines)), vibrations
            )
        )
    if not axis.converged:
        said.append(Markup("The search for causes did not settle: read them with caution."))
    return said


def _in_short(name: str, diagnosis: Diagnosis) -> Markup:
    axis = diagnosis.axes[name]
    alike = any(cause.inseparable for cause in axis.causes[:1])
    if axis.verdict is Verdict.ADEQUATE:
        said = "Sure, for what this motion can show."
    elif not axis.causes:
        said = "Sure that the model lacks something. Not sure what causes it."
    elif alike:
        said = "Sure that something acts. Not sure which cause it is."
    elif _carried(name, diagnosis):
        said = "This data and another recording support the strongest cause."
    elif not axis.verdict.complete:
        said = "This data supports the named causes well. The rest is open."
    else:
        said = "This data supports the named causes well."
    return Markup("<b>{}</b>").format(said)


def _cause_sure(name: str, axis: AxisDiagnosis) -> list[Markup]:
    cause, at = axis.causes[0], ("axes", name, "causes", 0)
    low, high = cause.held_out_gain_interval
    said = []
    if np.isfinite([cause.held_out_gain, low, high]).all():
        said.append(
            Markup(
                "On parts of the recording that were kept back, the strongest cause takes away {} "
                "of the error (95\u00a0% interval: {} to {})."
            ).format(
                page.percent(cause.held_out_gain, *at, "held_out_gain"),
                page.percent(low, *at, "held_out_gain_interval", 0),
                page.percent(high, *at, "held_out_gain_interval", 1),
            )
        )
    alike = [spoken(other.effect) for other in cause.inseparable]
    if alike:
        said.append(Markup("This motion cannot tell it from {}.").format(page.all_of(alike)))
    return said


def _carried(name: str, diagnosis: Diagnosis) -> bool:
    """Whether another recording confirms the strongest cause."""
    found, causes = diagnosis.validation.get(name), diagnosis.axes[name].causes
    carried = {cause.effect for cause in found.causes if cause.carries_over} if found else set()
    return bool(causes) and causes[0].term.effect in carried


def _elsewhere(name: str, diagnosis: Diagnosis) -> list[Markup]:
    """What another recording says."""
    found = diagnosis.validation.get(name)
    if found is None:
        return []
    at = ("validation", name)
    base = page.percent(found.base, *at, "base", "relative_residual")
    extended = page.percent(found.extended, *at, "extended", "relative_residual")
    if not diagnosis.axes[name].causes:
        return [Markup("On another recording it misses {}.").format(base)]
    return [Markup("On another recording the error goes from {} to {}.").format(base, extended)]


def _part(axis: AxisDiagnosis, follows: str | None) -> list[Markup]:
    if axis.causes:
        return _places(parts_of(axis.causes)[:3])
    if axis.verdict is Verdict.ADEQUATE:
        return [Markup("No part stands out.")]
    if axis.suspected:
        return _places(parts_of(axis.suspected)[:2])
    if follows is None:
        return [Markup("No part stands out: the error follows no position, speed or time.")]
    return [escape(sentence(_FOLLOWS.get(follows, "the structure that the axes share")))]


def _places(parts: Sequence[str]) -> list[Markup]:
    return [escape(sentence(part)) for part in parts]


def _action(name: str, diagnosis: Diagnosis) -> list[Markup]:
    axis = diagnosis.axes[name]
    off = off_reference(axis.findings)
    if axis.verdict is Verdict.ADEQUATE and off is not None:
        return [escape(sentence(off.next_step))]
    if axis.verdict is Verdict.ADEQUATE:
        said = [Markup("Nothing. Keep this recording, to compare with later ones.")]
        if axis.not_testable:
            said.append(Markup("Some effects this motion cannot show: they are listed below."))
        return said
    steps = [
        escape(named(cause.term.effect).advice.action) for cause in distinct_causes(axis.causes)[:2]
    ]
    motion = _clearing_motion(axis)
    if motion:
        steps.append(Markup("To be sure, record {}.").format(page.recorded(motion)))
    elif axis.causes and name not in diagnosis.validation:
        command = f"edge-ident diagnose {TOGETHER} --validate OTHER"
        confirm = Markup('To confirm it, record again, and: <code class="long">{}</code>')
        steps.append(confirm.format(command))
    return steps or [
        Markup(
            "Look at the picture: it shows where the error is largest. Check units and sign of "
            "the recording. Then record several speeds, both ways, over the whole stroke."
        )
    ]


def _clearing_motion(axis: AxisDiagnosis) -> str | None:
    """A motion that tells the strongest cause from another, or confirms the first suspicion."""
    if axis.causes:
        alike = axis.causes[0].inseparable
        return alike[0].experiment if alike else None
    return named(axis.suspected[0].term.effect).search.experiment if axis.suspected else None


def _picture(key: str, name: str, axes: charts.Axes, follows: str | None) -> Chart:
    """The strongest cause; without one the error over what it follows; else the effort."""
    axis = axes[name]
    if axis.causes and axis.causes[0].term.effect in axis.traces.contributions:
        effect = named(axis.causes[0].term.effect)
        loop = (
            charts.loop_chart(key, axis, axis.causes[0]) if effect.search.needs_reversals else None
        )
        return loop or charts.cause_chart(key, name, axes, axis.causes[0])
    if not axis.verdict.complete and follows == "time":
        return charts.residual_chart(key, axis)
    if not axis.verdict.complete and follows is not None:
        _, label, effort = charts.models(axis)[-1]
        shown = reach((axis.traces.effort - effort)[axis.traces.valid])
        return charts.residual_map(
            key, axis, charts.quantities(name, axes)[follows], label, effort, shown
        )
    return charts.effort_chart(
        key, axis, charts.busiest(axis) if axis.extends_base else slice(None)
    )


# The first screen of an axis where recordings are at fault, or differ.

TOGETHER: Final = "FIRST SECOND"
"""Stands for the names of the recordings, which the page knows."""


def of_recordings(card: page.Card, diagnosis: Diagnosis) -> page.Card:
    """The card with what forbids to name a cause in place of advice on the machine, and with what
    tells in what two recordings differ.

    Parameters
    ----------
    card : Card
    diagnosis : Diagnosis

    Returns
    -------
    Card
        The same where nothing forbids it.
    """
    findings = diagnosis.axes[card.axis].findings
    if forbid := [finding.message for finding in findings if finding.blocks]:
        return replace(
            card,
            verdict=Markup("No cause is named: {}").format(sentence(forbid[0])),
            sure=[Markup("<b>Sure that this recording can tell none.</b>"), *card.sure[1:]],
            part=[Markup("The recording and its columns, before the machine.")],
            action=[escape(sentence(step)) for step in blocking_steps(findings)],
        )
    if only_elsewhere(card.axis, diagnosis):
        together = Markup("Diagnose both recordings together: <code>{}</code>.").format(
            f"edge-ident diagnose {TOGETHER}"
        )
        if diagnosis.axes[card.axis].causes:
            return replace(card, action=[*card.action, together])
        return replace(
            card,
            verdict=Markup(
                "Inertia and friction explain this recording, and not the other one: the machine "
                "changed, or what was recorded of it."
            ),
            sure=[Markup("<b>Sure that the recordings differ. Not sure how.</b>"), *card.sure[1:]],
            part=[Markup("What was changed between the recordings: load, scale, sign, warmth.")],
            action=[together],
        )
    return card


# A diagnosis as one HTML page.


def write_page(
    diagnosis: Diagnosis, provenance: page.Provenance, folder: Path, model_file: Path | None = None
) -> Path:
    """Write the page.

    Parameters
    ----------
    diagnosis : Diagnosis
    provenance : Provenance
        With the recordings that it was made from.
    folder : Path
    model_file : Path or None
        Path of the extended model's file, if there is one.

    Returns
    -------
    Path
        The page.
    """
    names = listed(file for file, _ in provenance.files)
    says = "says" if len(provenance.files) == 1 else "say"
    content = {
        "title": f"What {names} {says} about the machine",
        "findings": _findings(diagnosis),
        "cards": [
            _named(diagnosis_card(f"c{n}", name, diagnosis), provenance)
            for n, name in enumerate(diagnosis.axes)
        ],
        "details": [
            axis_details(f"a{n}", name, diagnosis) for n, name in enumerate(diagnosis.axes)
        ],
        "provenance": provenance,
        "model_file": model_file,
    }
    document = diagnosis_document(diagnosis, model_file)
    return page.write_html("diagnosis.html.jinja", content, document, folder)


def _named(card: page.Card, provenance: page.Provenance) -> page.Card:
    """The card with the names of the recordings in its commands."""
    files = [*provenance.files, *([provenance.validation] if provenance.validation else [])]
    names = str(escape(shlex.join(name for name, _ in files)))
    action = [Markup(str(step).replace(TOGETHER, names)) for step in card.action]
    return replace(card, action=action)


def _findings(diagnosis: Diagnosis) -> list[tuple[str, list[str], str]]:
    """Message, axes and code of each defect of the data."""
    axes: dict[tuple[str, str], list[str]] = {}
    for finding in diagnosis.data_quality:
        axes.setdefault((finding.message, finding.code), []).append(finding.axis)
    return [(sentence(message), names, code) for (message, code), names in axes.items()]


# A diagnosis as Markdown, for other documents, with its pictures as SVG files.

MARKDOWN_FILE: Final = "report.md"
# What Markdown reads as a mark wherever it stands.
_SIGNS: Final = re.compile(r"[\\`*\[\]~]|(?<![^\W_])_|_(?![^\W_])")
_ENTITIES: Final = {"&": "&amp;", "<": "&lt;", ">": "&gt;", "|": "&#124;"}


def write_markdown(diagnosis: Diagnosis, sources: Sequence[str], folder: Path) -> Path:
    """Write the page and draw its pictures.

    Parameters
    ----------
    diagnosis : Diagnosis
    sources : sequence of str
        Names of the recordings.
    folder : Path
        Receives the page and its pictures.

    Returns
    -------
    Path
        The page.
    """
    folder.mkdir(parents=True, exist_ok=True)
    file = folder / MARKDOWN_FILE
    text = "\n".join(_page(diagnosis, sources, folder)) + "\n"
    file.write_text(text, encoding="utf-8", errors=NOT_TEXT)
    return file


def _page(diagnosis: Diagnosis, sources: Sequence[str], folder: Path) -> Iterator[str]:
    yield f"# What the model gets wrong about {_plain(listed(sources))}"
    for finding in diagnosis.data_quality:
        yield f"- {_plain(f'{finding.code}, axis {finding.axis}: {finding.message}')}"
    for name in diagnosis.axes:
        details = axis_details("a", name, diagnosis)
        tables = (details.follows, details.conditions, details.not_testable)
        yield f"\n## Axis {_plain(name)}"
        for part in (*axis_parts(name, diagnosis), *filter(None, tables)):
            yield from _line(part) if isinstance(part, Line) else _table(part)
        pictures = [
            diagnosis_card("a-first", name, diagnosis).chart,
            *details.cause_charts,
            *details.time_charts,
            *(chart for pair in details.maps for chart in pair),
            details.spectrum,
        ]
        stem = re.sub(r"\W", "_", name)
        for place, chart in enumerate(pictures):
            yield from _saved(chart, folder / f"{stem}_{place}.svg")


def _line(line: Line) -> Iterator[str]:
    """An item of a list, as deep as the line is indented."""
    said = str(line)
    indent = " " * (len(said) - len(said.lstrip()))
    yield f"{indent}- {_plain(said.strip())}"


def _table(grid: Grid) -> Iterator[str]:
    yield f"\n{_plain(grid.caption)}\n" if grid.caption else ""
    for row in (grid.headings, ["---"] * len(grid.headings), *grid.rows):
        cells = (Markup("<br>").join(map(_plain, str(cell).split("\n"))) for cell in row)
        yield f"| {' | '.join(cells)} |"
    yield ""


def _saved(chart: Chart, file: Path) -> Iterator[str]:
    save_chart(chart, file)
    yield f"\n![{_plain(chart.title)}]({file.name})\n"
    yield _plain(f"{chart.description} {chart.caption}".strip())


def _plain(text: str) -> Markup:
    """Text that stays what it is, on one line: N*m, and whatever stands in a name.

    HTML would be taken as it is. An underscore inside a word is no mark.
    """
    signs = _SIGNS.sub(r"\\\g<0>", on_a_line(text))
    return Markup("".join(_ENTITIES.get(sign, sign) for sign in signs))


# A chart as an SVG file of its own, for documents that are no web pages.

_ALONE: Final = "svg.chart { width: 100%; margin: 0; }\n"
_LETTER: Final = 7  # mean width of a letter of the legend


def save_chart(chart: Chart, file: Path) -> None:
    """Write the chart with its title and legend; the style is that of the page."""
    widths = [32 + _LETTER * len(layer.label) + 20 for layer in chart.legend]
    legend = list(zip(np.cumsum([12, *widths]).tolist(), chart.legend, strict=False))
    text = page.picture("alone", chart, Markup(page.source("style.css") + _ALONE), legend)
    with atomic_write(file) as partial:
        partial.write_text(visible(text), encoding="utf-8")
