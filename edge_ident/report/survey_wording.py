"""The sentences of a survey, for the terminal and the page alike."""

from typing import Final

from edge_ident.diagnosis.tolerance import TOLERANCE
from edge_ident.fleet.between_units import FALSE_ALARM, FEWEST_UNITS, LARGEST_SHARE
from edge_ident.fleet.result import Comparison, StandsOut, Survey, SurveyedAxis

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


def difference_words(one: StandsOut) -> str:
    """How a unit differs from the others, as a part of a sentence."""
    comparison, found = one.comparison, one.found
    centre = comparison.centre or 0.0
    what = f"{quantity_words(comparison)} on axis {comparison.axis}"
    if comparison.of_effect:
        shares = (f"{100 * share:.1f} %" for share in (found.value, centre))
        return "{} takes {} of its effort, {} in the others".format(what, *shares)
    way = "above" if found.value > centre else "below"
    values = f"{found.value:.4g} against {centre:.4g} {comparison.unit}"
    if centre == 0.0 or abs(found.value - centre) > abs(centre):
        return f"{what} is far {way} that of the others ({values})"
    percent = f"{100 * abs(found.value / centre - 1.0):.0f} %"
    return f"{what} is {percent} {way} that of the others ({values})"


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
    """Causes of a kind with their shares."""
    return ", ".join(
        f"{cause.effect.replace('_', ' ')} {100 * cause.share:.2g} %"
        for cause in axis.causes
        if cause.kind == kind
    )
