"""A survey as one HTML page."""

import shlex
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

import numpy as np
from markupsafe import Markup

from edge_ident.fleet.result import Comparison, StandsOut, Survey, SurveyedAxis, UnitValue
from edge_ident.model.effects import named
from edge_ident.model.model import NORMAL_95
from edge_ident.report.chart import Scale, around
from edge_ident.report.numbers import digits, minus, sentence, to_its_std, unit_text
from edge_ident.report.page import rendering
from edge_ident.report.survey import (
    JUDGED,
    by_interest,
    causes_words,
    conclusion,
    difference_words,
    quantity_words,
    verdict_words,
)
from edge_ident.report.view import Grid, Row
from edge_ident.support.next_step import Done, whole_step

_PARTS: Final = {
    "inertia": "What the axis carries, and what couples the motor to it.",
    "viscous_friction": "Grease, seals and bearings.",
    "coulomb_friction": "Guides, covers, and the preload of nut and bearings.",
    "offset": "What pulls at the axis: weight, its counterbalance, cables and covers.",
}
_MOST: Final = 5  # lines of the first screen
_ROWS: Final = 12  # recordings that a page shows before the others, which are folded away


def write_survey_page(
    survey: Survey,
    document: dict[str, Any],
    folder: Path,
    machine: str = "",
    source: Path | None = None,
) -> Path:
    """Write the page.

    Parameters
    ----------
    survey : Survey
    document : JSON object
        Of schema edge-ident/survey/1.
    folder : Path
    machine : str
        What the machine is called.
    source : Path, optional
        Folder of the recordings.

    Returns
    -------
    Path
        The page.
    """
    axes = dict.fromkeys(comparison.axis for comparison in survey.comparisons)
    table, rest = _folded(_table(survey))
    content = {
        "title": f"How {len(survey.units)} units compare",
        "card": _card(survey, source),
        "failed": [(recording.file, recording.failed) for recording in survey.failed],
        "untrusted": _untrusted(survey, source),
        "axes": [(f"a{n}", name, _pictures(f"a{n}", name, survey)) for n, name in enumerate(axes)],
        "table": table,
        "rest": rest,
        "judged": JUDGED,
        "left_out": survey.left_out,
        "provenance": replace(rendering.Provenance.of(()), machine=machine),
    }
    return rendering.write_html("survey.html.jinja", content, document, folder)


def _card(survey: Survey, source: Path | None) -> dict[str, Any]:
    """The first screen."""
    out = survey.standing_out
    judged = any(comparison.centre is not None for comparison in survey.comparisons)
    status: rendering.Status = "found" if out else "good" if judged else "open"
    more = len(out) - _MOST
    found = [_found(place, one) for place, one in enumerate(out[:_MOST])]
    return {
        "status": status,
        "label": {"found": "stands out", "good": "alike", "open": "too few units"}[status],
        "verdict": conclusion(survey),
        "found": [*found, *([Markup("And {} more below.").format(more)] if more > 0 else [])],
        "part": list(dict.fromkeys(part for one in out for part in _parts(one)))[:_MOST],
        "action": _action(survey, source),
        "picture": interval_picture("c0", out[0].comparison) if out else None,
    }


def _found(place: int, one: StandsOut) -> Markup:
    def shown(value: float, text: str, key: str) -> Markup:
        return rendering.number(value, text, "standing_out", place, key)

    words = difference_words(one, shown, Markup)
    return Markup('<b class="name">{}</b>: {}.').format(one.unit, words)


def _parts(one: StandsOut) -> list[str]:
    if not one.comparison.of_effect:
        return [_PARTS[one.comparison.quantity]]
    return [sentence(named(effect).advice.part) for effect in one.comparison.quantity.split("/")]


def _action(survey: Survey, source: Path | None) -> list[Markup]:
    names = list(dict.fromkeys(one.unit for one in survey.standing_out))
    if names:
        files = shlex.join(_path(source, r.file) for r in survey.recordings if r.unit == names[0])
        command = f"edge-ident diagnose {files} --output diagnosis"
        again = Markup('Record <span class="name">{}</span> again. Does it still stand out?')
        page = Markup('Read its own page: <code class="long">{}</code>')
        return [again.format(names[0]), page.format(command)]
    if survey.failed:
        return [Markup("Correct the recordings without a result, and run the survey again.")]
    return [Markup("Nothing.") if survey.trusted else Markup("See which results are not trusted.")]


def _path(source: Path | None, file: str) -> str:
    """A recording as a command names it."""
    return file if source is None else str(source / file)


def _untrusted(survey: Survey, source: Path | None) -> list[tuple[str, str, list[tuple[str, str]]]]:
    """Recording, axis, and what forbids to trust it with its next step."""
    return [
        (
            recording.file,
            name,
            [
                (sentence(message), sentence(step))
                for message, step in _told_once(axis, Done((_path(source, recording.file),)))
            ],
        )
        for recording in survey.recordings
        for name, axis in recording.axes.items()
        if not axis.trusted
    ]


def _told_once(axis: SurveyedAxis, done: Done) -> Iterator[tuple[str, str]]:
    """Each message with its next step, which is a whole command; no step twice."""
    told = set[str]()
    for message, step in axis.warnings.values():
        if step not in told:
            told.add(step)
            yield message, whole_step(step, done)


def _pictures(key: str, axis: str, survey: Survey) -> list[rendering.IntervalPicture]:
    of_axis = [one for one in survey.comparisons if one.axis == axis and one.units]
    return [interval_picture(f"{key}-{n}", one) for n, one in enumerate(of_axis)]


def _folded(table: Grid) -> tuple[Grid, Grid | None]:
    """The first rows, and the rest, which is folded away."""
    if len(table.rows) <= _ROWS:
        return table, None
    rest = replace(table, caption="The other recordings", rows=table.rows[_ROWS:])
    return replace(table, rows=table.rows[:_ROWS]), rest


def _table(survey: Survey) -> Grid:
    rows: list[Row] = [
        (
            recording.file,
            name,
            verdict_words(axis),
            "yes" if axis.trusted else "no",
            f"{axis.relative_residual:.1%}",
            causes_words(axis, "supported"),
            causes_words(axis, "suspected"),
            causes_words(axis, "minor"),
        )
        for recording, name, axis in by_interest(survey)
    ]
    headings = (
        "recording", "axis", "verdict", "trusted", "left over", "causes", "suspected", "minor",
    )  # fmt: skip
    return Grid("What each recording says; shares of the rms effort", headings, rows)


# Values of many units with their intervals, a line each, before what units are like.


def interval_picture(key: str, comparison: Comparison) -> rendering.IntervalPicture:
    """Draw a comparison; the units by name, so that one is found in every picture.

    Parameters
    ----------
    key : str
        Unique in the page.
    comparison : Comparison
    """
    unit = "% of the effort" if comparison.of_effect else unit_text(comparison.unit)
    shown = _in_percent(comparison) if comparison.of_effect else comparison
    band = _band(shown)
    every = [end for of in shown.units.values() for end in _interval(of)]
    scale = around(np.array([*every, *band]))
    title = sentence(quantity_words(comparison)).removesuffix(".")
    return rendering.IntervalPicture(
        key,
        f"{title} ({unit})" if unit else title,
        [_row(name, of, scale, band, unit) for name, of in sorted(shown.units.items())],
        (digits(scale.low, 3), digits(scale.high, 3)),
        _spread(shown, unit),
    )


def _in_percent(comparison: Comparison) -> Comparison:
    def percent(value: float | None) -> float | None:
        return None if value is None else 100.0 * value

    return replace(
        comparison,
        centre=percent(comparison.centre),
        between=percent(comparison.between),
        units={
            name: replace(of, value=100.0 * of.value, std=100.0 * of.std)
            for name, of in comparison.units.items()
        },
    )


def _interval(of: UnitValue) -> tuple[float, float]:
    return of.value - NORMAL_95 * of.std, of.value + NORMAL_95 * of.std


def _band(comparison: Comparison) -> tuple[float, ...]:
    """Where the true values of 95 % of such units lie; nothing with too few units."""
    if comparison.centre is None or comparison.between is None:
        return ()
    reach = NORMAL_95 * comparison.between
    return comparison.centre - reach, comparison.centre + reach


def _row(
    name: str, of: UnitValue, scale: Scale, band: tuple[float, ...], unit: str
) -> rendering.IntervalRow:
    low, high = _interval(of)
    said = (
        f"{name}: {digits(of.value, 4)} {unit}, 95 % interval {digits(low, 4)} to {digits(high, 4)}"
    )
    if of.distance is not None:
        said += f", {digits(abs(of.distance), 2)} deviations from the others"
    places = scale.fraction(np.array([low, high, of.value, *band]))
    left, right, middle, *shaded = (100.0 * places).tolist()
    picture_of = rendering.picture("interval", said, left, right, middle, shaded)
    return rendering.IntervalRow(
        name, " ± ".join(to_its_std(of.value, of.std)), picture_of, of.stands_out
    )


def _spread(comparison: Comparison, unit: str) -> str:
    if comparison.centre is None or comparison.between is None:
        return "Too few units to say how they scatter."
    centre, between = (minus(f"{of:.3g}") for of in (comparison.centre, comparison.between))
    return f"Units that do not stand out: centre {centre} {unit}, between-unit spread {between}."
