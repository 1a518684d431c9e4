"""The sentences of a survey, for the terminal and the page alike."""

from collections.abc import Callable
from typing import Final

from edge_ident.diagnosis.measures import TOLERANCE
from edge_ident.fleet.between_units import FALSE_ALARM, FEWEST_UNITS, LARGEST_SHARE
from edge_ident.fleet.result import Comparison, StandsOut, Survey, SurveyedAxis, SurveyedRecording
from edge_ident.report.numbers import unit_text
from edge_ident.support.words import spoken

JUDGED: Final = (
    "Each quantity of a unit has a value and a 95 % interval. The true values of sound units "
    "scatter, too: by the between-unit spread, which is estimated from the other units with their "
    "intervals (random-effects model). A unit stands out where its distance from the others is "
    "more than spread and intervals explain.",
    "All quantities and units of a survey share one probability of a false alarm: at most in "
    f"{100 * FALSE_ALARM:.0f} % of surveys of equal units, one is named by chance. So the more is "
    "compared, the farther away a unit has to be.",
    f"At most {100 * LARGEST_SHARE:.0f} % of the units can stand out: the others are what units "
    f"are like. With fewer than {FEWEST_UNITS} units nothing is said.",
    "An effect is compared by its share of the rms effort. Where it was not found, its share is "
    f"zero within {100 * TOLERANCE:.0f} %. Effects that a recording does not separate are compared "
    "together. Where an effect is only suspected, or the motion could not show it, the unit is "
    "left out.",
    "An axis that is not trusted is not compared. Units that all have the same fault do not stand "
    "out.",
)


def quantity_words(comparison: Comparison) -> str:
    """What is compared, in words."""
    words = comparison.quantity.replace("_", " ").replace("/", " or ")
    return words.replace("coulomb", "Coulomb")


def plain(value: float, text: str, key: str) -> str:
    """A number as it is shown where nothing else is known of it."""
    return text


def difference_words(
    one: StandsOut, shown: Callable[[float, str, str], str] = plain, kind: type[str] = str
) -> str:
    """How a unit differs from the others, as a part of a sentence.

    Parameters
    ----------
    one : StandsOut
    shown : callable
        Gets each number, its text, and its name in the document of what stands out.
    kind : type
        str or Markup.
    """
    comparison, value = one.comparison, one.found.value
    centre = comparison.centre or 0.0
    what = f"{quantity_words(comparison)} on axis {comparison.axis}"
    ratio = ratio_to_others(one)
    how: list[str] = [kind("{}").format(what)]
    if comparison.of_effect:
        mine, others = (
            shown(share, f"{100 * share:.1f}\u00a0%", key)
            for share, key in ((value, "value"), (centre, "centre"))
        )
        how.append(kind(" takes {} of its effort, {} in the others").format(mine, others))
    else:
        if ratio is not None:
            times = shown(ratio, f"{ratio:.2f}", "ratio")
            how.append(kind(" is {} times that of the others").format(times))
        mine, others = (
            shown(number, f"{number:.4g}".replace("-", "−"), key)
            for number, key in ((value, "value"), (centre, "centre"))
        )
        how.append(kind(": {} against {} {}").format(mine, others, unit_text(comparison.unit)))
    deviations = shown(one.deviations, f"{one.deviations:.1f}", "deviations")
    how.append(kind("; {} deviations away").format(deviations))
    return kind("").join(how)


def ratio_to_others(one: StandsOut) -> float | None:
    """Value over that of the others; None where that says little, because they are around zero."""
    comparison, centre = one.comparison, one.comparison.centre or 0.0
    if comparison.of_effect or abs(centre) < 3.0 * (comparison.between or 0.0) or not centre:
        return None
    ratio = one.found.value / centre
    return ratio if ratio > 0.0 else None


def conclusion(survey: Survey) -> str:
    """Whether a unit stands out, in one sentence."""
    names = list(dict.fromkeys(one.unit for one in survey.standing_out))
    count = len(survey.units)
    if len(names) > 1:
        return f"{len(names)} of {count} units stand out: {', '.join(names)}."
    if names:
        return f"One of {count} units stands out: {names[0]}."
    if not any(comparison.centre is not None for comparison in survey.comparisons):
        return (
            f"{count} {'unit is' if count == 1 else 'units are'} too few to say which stands out; "
            f"{FEWEST_UNITS} with trusted results are needed."
        )
    return f"None of {count} units stands out."


def causes_words(axis: SurveyedAxis, kind: str) -> str:
    """Causes of a kind with their shares; nothing of an axis that is not trusted."""
    if not axis.trusted:
        return ""
    return ", ".join(
        f"{cause.effect.replace('_', ' ')} {100 * cause.share:.2g} %"
        for cause in axis.causes
        if cause.kind == kind
    )


def verdict_words(axis: SurveyedAxis) -> str:
    """The verdict on an axis, or why there is none."""
    why = "not diagnosed" if axis.trusted else f"none: {next(iter(axis.warnings), 'not trusted')}"
    return spoken(axis.verdict) if axis.verdict else why


def by_interest(survey: Survey) -> list[tuple[SurveyedRecording, str, SurveyedAxis]]:
    """Every axis of every recording: what stands out first, then what is not trusted."""
    out = {(one.unit, one.comparison.axis) for one in survey.standing_out}

    def place(row: tuple[SurveyedRecording, str, SurveyedAxis]) -> int:
        recording, name, axis = row
        return 0 if (recording.unit, name) in out else 2 if axis.trusted else 1

    rows = [
        (recording, name, axis)
        for recording in survey.recordings
        for name, axis in recording.axes.items()
    ]
    return sorted(rows, key=place)
