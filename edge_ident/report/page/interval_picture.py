"""Values of many units with their intervals, a line each, before what units are like."""

from dataclasses import replace

import numpy as np
from markupsafe import Markup

from edge_ident.fleet.result import Comparison, UnitValue
from edge_ident.model.model import NORMAL_95
from edge_ident.report.page.card import IntervalPicture, IntervalRow
from edge_ident.report.page.scale import Scale, around
from edge_ident.report.page.wording import digits, minus, sentence, to_its_std, unit_text
from edge_ident.report.survey_wording import quantity_words


def interval_picture(key: str, comparison: Comparison) -> IntervalPicture:
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
    return IntervalPicture(
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


def _row(name: str, of: UnitValue, scale: Scale, band: tuple[float, ...], unit: str) -> IntervalRow:
    low, high = _interval(of)
    said = (
        f"{name}: {digits(of.value, 4)} {unit}, 95 % interval {digits(low, 4)} to {digits(high, 4)}"
    )
    if of.distance is not None:
        said += f", {digits(abs(of.distance), 2)} deviations from the others"
    at = [f"{100.0 * float(scale.fraction(np.array(v))):.2f}%" for v in (low, high, of.value)]
    return IntervalRow(
        name,
        " ± ".join(to_its_std(of.value, of.std)),
        Markup(
            '<svg class="interval" role="img" height="16" width="100%"><title>{}</title>{}'
            '<line x1="{}" x2="{}" y1="8" y2="8"/><circle cx="{}" cy="8" r="4"/></svg>'
        ).format(said, _shaded(scale, band), *at),
        of.stands_out,
    )


def _shaded(scale: Scale, band: tuple[float, ...]) -> Markup:
    if not band:
        return Markup("")
    low, high = (100.0 * float(scale.fraction(np.array(end))) for end in band)
    return Markup('<rect x="{:.2f}%" width="{:.2f}%" height="16"/>').format(
        low, max(0.4, high - low)
    )


def _spread(comparison: Comparison, unit: str) -> str:
    if comparison.centre is None or comparison.between is None:
        return "Too few units to say how they scatter."
    centre, between = (minus(f"{of:.3g}") for of in (comparison.centre, comparison.between))
    return f"Units that do not stand out: centre {centre} {unit}, between-unit spread {between}."
