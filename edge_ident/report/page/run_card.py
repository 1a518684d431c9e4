"""The first screen of a run: what was written, how much better the axis follows, what to do."""

import math
from dataclasses import asdict, replace
from typing import Final

import numpy as np
from markupsafe import Markup, escape

from edge_ident.commissioning.promise import SHARE, WORTH, Promise, Promised
from edge_ident.commissioning.run import Outcome
from edge_ident.commissioning.separation import Separation
from edge_ident.commissioning.verification import GainChange, Tracking, error_fall
from edge_ident.experiment.result import QUANTITIES
from edge_ident.identification.result import AxisIdentification
from edge_ident.model.effects import named
from edge_ident.model.model import PARAMETERS
from edge_ident.report.chart import Chart, Scale
from edge_ident.report.gain_report import tried
from edge_ident.report.gain_rows import gain_label
from edge_ident.report.numbers import digits, effort_word, sentence, to_its_std, unit_text
from edge_ident.report.page.card import (
    PICTURE_HEIGHT,
    Card,
    IntervalPicture,
    IntervalRow,
    all_of,
    angle,
    number,
    percent,
)
from edge_ident.report.page.diagnosis_card import distinct, in_words
from edge_ident.report.run_documents import axis_steps
from edge_ident.report.run_motions import peaks
from edge_ident.report.view import Grid, Row
from edge_ident.support.words import listed, spoken
from firmware_interface.gains import GAIN_FIELDS, OFF

# Single numbers that every board has; ripples and tables belong to an effect, which is named.
_FIRST_TERMS: Final = tuple(gain for gain in GAIN_FIELDS[3] if gain in OFF)


def run_card(name: str, outcome: Outcome, chart: Chart, device: str | None = None) -> Card:
    """What the first screen says of an axis.

    Parameters
    ----------
    name : str
        Of the axis.
    outcome : Outcome
    chart : Chart
    device : str, optional
        The board's, as --device names it.
    """
    axis = outcome.identification.axes[name]
    found = axis.diagnosis
    causes = () if found is None else found.causes or found.minor
    parts = [named(cause.term.effect).advice.part for cause in distinct(causes)[:3]]
    ending = outcome.answer.ending
    verdict = _verdict(name, axis, outcome)
    contradicted = outcome.change is not None and name in outcome.change.contradicted
    if causes:
        said = "The motion does not confirm" if contradicted else "The diagnosis found"
        words = all_of(in_words(causes[:2]))
        verdict += Markup(" {}: {}.").format(said, words)
    return Card(
        axis=name,
        status="good" if ending.good else "open",
        label=ending.spoken,
        verdict=verdict,
        terms=f"{axis.source.spoken} used; {axis.reason}",
        sure=[*_model_sure(name, axis, outcome), *_tracking_sure(name, outcome)],
        part=[escape(sentence(part)) for part in parts] or [Markup("No part stands out.")],
        action=[escape(sentence(step)) for step in axis_steps(axis, outcome, device)],
        chart=replace(chart, height=PICTURE_HEIGHT),
        written=_written(name, outcome),
        table=_changes(name, outcome),
    )


def tracking_of(name: str, outcome: Outcome) -> Tracking | None:
    """What the verification motion measured on an axis, if there was one."""
    return outcome.answer.axes[name].tracking


def _verdict(name: str, axis: AxisIdentification, outcome: Outcome) -> Markup:
    change, tracking = outcome.change, tracking_of(name, outcome)
    if change is None and not axis.consistent:
        said = "The data of this axis contradict themselves. Nothing was written to the board."
    elif change is None:
        said = (
            "This axis is fine. The data of another contradict themselves, so nothing was written "
            "to the board."
        )
    elif change.dry_run:
        return _forecast(name, change)
    elif change.unchanged:
        said = f"{not_worth(change)} Nothing was written to the board."
    elif not change.confirmed:
        said = f"{taken_back(change)} The old gains are in force again."
    elif tracking is None or tracking.verdict == "equal":
        said = "New gains are in force. The axis follows its path as well as before."
    else:
        return Markup("New gains are in force. The error from the path fell {}.").format(
            _fall(name, tracking)
        )
    return Markup(said)


def _fall(name: str, tracking: Tracking) -> Markup:
    """The same sentence as in the terminal, its figures bound to the document."""

    def shown(field: str, value: float) -> str:
        at = ("verification", name, field)
        return str(number(value, digits(value, 3), *at) if field == "ratio" else angle(value, *at))

    errors = tracking.before_rad, tracking.after_rad, tracking.count_rad
    return Markup(error_fall(*errors, shown))


def _forecast(name: str, change: GainChange | None) -> Markup:
    """What new gains would be worth to an axis, which were not tried."""
    said = Markup(
        "A trial run: new gains were designed and checked. Nothing was written to the board."
    )
    if change is None or change.promise is None:
        return said
    if not change.promise.worth_a_write:
        return said + f" {not_worth(change)}"
    ((motion, axes),) = change.promise.motions.items()
    at, of_axis = ("promise", name, motion), axes[name]
    if not math.isfinite(of_axis.after.rms.middle_rad):
        return said
    return said + Markup(
        " By the forecast, new gains take the error from the path from {} to {} (rms)."
    ).format(
        angle(of_axis.now.rms_rad, *at, "now", "rms_rad"),
        angle(of_axis.after.rms.middle_rad, *at, "after", "rms_rad"),
    )


def _written(name: str, outcome: Outcome) -> list[Markup]:
    if outcome.change is None or outcome.change.unchanged or outcome.change.dry_run:
        return [Markup("Nothing.")]
    if not outcome.confirmed:
        return [Markup("Nothing that stays: the new gains were taken back.")]
    by = "two motions" if outcome.change.others else "a motion"
    kept = "They outlast a power cycle." if outcome.stored else "They are lost without power."
    said = [Markup("The new gains below, read back and confirmed by {}. {}").format(by, kept)]
    used = [spoken(of.effect) for of in outcome.designs[name].used]
    if used:
        said.append(Markup("They make up for: {}.").format(all_of(used)))
    return said


def _model_sure(name: str, axis: AxisIdentification, outcome: Outcome) -> list[Markup]:
    at = ("identification", "axes", name)
    best = outcome.answer.axes[name].model.estimate
    inertia, std = float(best.parameters[0]), float(best.std[0])
    place = ("answer", "axes", name, "parameters", PARAMETERS[0])
    value_text, std_text = to_its_std(inertia, std)
    short = f"{outcome.answer.axes[name].sentence}."
    short = short[0].upper() + short[1:]
    return [
        Markup("<b>{}</b>").format(short),
        Markup("The model misses {} of the {}.").format(
            percent(axis.metric.relative_residual, *at, "metric", "relative_residual"),
            effort_word(axis.units[3]),
        ),
        Markup("The inertia is {} ± {} {} (one standard deviation).").format(
            number(inertia, value_text, *place, "value"),
            number(std, std_text, *place, "std"),
            unit_text(axis.units[0]),
        ),
    ]


def _tracking_sure(name: str, outcome: Outcome) -> list[Markup]:
    tracking = tracking_of(name, outcome)
    if tracking is None:
        return []
    least = angle(tracking.repeatability_rad, "verification", name, "repeatability_rad")
    if not tracking.limited_by_floor:
        return [
            Markup("The motion repeats within {}: a smaller change means nothing.").format(least)
        ]
    of_error = tracking.resolved_rad <= SHARE * tracking.before_rad * (1.0 + 1e-9)
    what = f"{100 * SHARE:.0f} % of the error before" if of_error else "what the encoder resolves"
    return [
        Markup(
            "A change below {}, {}, counts as none; the motion repeats more closely than that."
        ).format(least, what)
    ]


def _changes(name: str, outcome: Outcome) -> Grid | None:
    """Tracking error and the gains of every board, old and new; gains that stay are left out."""
    cells: dict[str, tuple[Markup, Markup]] = {}
    tracking, design = tracking_of(name, outcome), outcome.designs.get(name)
    if tracking is not None:
        at = ("verification", name)
        cells["tracking error, rms"] = (
            angle(tracking.before_rad, *at, "tracking_rms_before_rad"),
            angle(tracking.after_rad, *at, "tracking_rms_after_rad"),
        )
    if design is not None:
        old, new = asdict(outcome.gains_before[name]), asdict(design.gains)
        cells |= {
            gain_label(gain): (
                number(old[gain], digits(old[gain], 3), "gains_before", name, gain),
                number(new[gain], digits(new[gain], 3), "designs", name, "gains", gain),
            )
            for gain in _FIRST_TERMS
            if new[gain] != old[gain]
        }
    if not cells:
        return None
    before, after = zip(*cells.values(), strict=True)
    last = "new" if outcome.confirmed else "designed"
    rows: list[Row] = [("old", *before), (last, *after)]
    return Grid(f"Old and {last} gains (N·m, rad, s), and how the axis follows", ("", *cells), rows)


# What new gains promised and what was measured, for the page of a run.

_ROOM = 1.3  # factor by which the scale goes beyond the smallest and the largest error
_TRIED = "Cross: measured with the new ones. ◀ marks an rms error above what was promised. "


def notices(outcome: Outcome) -> list[str]:
    """What the reader must not miss, at the top of the page."""
    change = outcome.change
    if change is None:
        return []
    if change.unchanged:
        return [f"{not_worth(change)} Nothing was written; the board has the gains that it had."]
    found = [
        f"The motion does not confirm what was found on axis {axis}: "
        f"{listed(map(spoken, effects))}. "
        "Do not adjust the machine on its word."
        for axis, effects in change.contradicted.items()
    ]
    if change.verification is not None and not change.confirmed:
        return [f"{taken_back(change)} The old gains are in force again.", *found]
    return found


def not_worth(change: GainChange) -> str:
    """Why nothing was worth a write, in everyday words."""
    promise = change.promise
    if promise is not None and promise.worse:
        return "New gains would follow worse."
    if promise is not None and promise.best >= WORTH:
        return "New gains promise no more than the forecast itself may be off."
    return "The axes are tuned already: new gains would hardly follow closer."


def taken_back(change: GainChange) -> str:
    """Why new gains were rolled back, in everyday words."""
    if change.in_doubt:
        return "Whether the new gains follow better could not be told."
    verdicts = [of.verdict for of in (change.verification, *change.others.values()) if of]
    if "too lively" in verdicts and "worse" not in verdicts:
        return "The new gains made an axis too lively."
    return "The new gains followed worse."


def effects_said(outcome: Outcome) -> list[str]:
    """What became of each effect of the model, a sentence each."""
    said = []
    for name, design in outcome.designs.items():
        parts = [f"{spoken(of.effect)}: {of.sentence}" for of in design.used]
        parts += [f"{spoken(of.effect)} is not used: {of.reason}" for of in design.unused]
        said += [f"Axis {name}, {part}." for part in parts]
    return said


def promise_picture(promise: Promise) -> IntervalPicture | None:
    """Rms errors of every axis and motion; None where a forecast has no end."""
    shown = [1e3 * value for *_, of in promise.every for value in _errors(of)]
    if not all(map(math.isfinite, shown)) or min(shown) <= 0.0:
        return None
    scale = Scale(min(shown) / _ROOM, max(shown) * _ROOM, "log")
    return IntervalPicture(
        "promise",
        "Tracking error, rms (mrad)",
        [_line(f"axis {a}, {m}", of, promise.judged, scale) for m, a, of in promise.every],
        (digits(scale.low, 2), digits(scale.high, 2)),
        "Dot: measured with the old gains. Bar: promised for the new ones, with its 90 % interval. "
        + (_TRIED if tried(promise) else "The new gains were not tried. ")
        + "The same distance is the same factor everywhere.",
    )


def _errors(of: Promised) -> list[float]:
    measured = [] if of.measured is None else [of.measured.rms_rad]
    return [of.now.rms_rad, of.after.rms.low_rad, of.after.rms.high_rad, *measured]


def _line(name: str, of: Promised, judged: int, scale: Scale) -> IntervalRow:
    values = [1e3 * value for value in _errors(of)]
    at = [f"{100.0 * float(scale.fraction(np.array(value))):.2f}%" for value in values]
    now, low, high, *measured = (digits(value, 3) for value in values)
    said = f"{name}: {now} mrad with the old gains, promised {low} to {high}"
    cross = Markup("")
    if measured:
        said += f", measured {measured[0]}"
        cross = Markup('<text x="{}" y="8">×</text>').format(at[3])
    picture = Markup(
        '<svg class="interval" role="img" height="16" width="100%"><title>{}</title>'
        '<circle class="old" cx="{}" cy="8" r="4"/>'
        '<line class="promised" x1="{}" x2="{}" y1="8" y2="8"/>{}</svg>'
    ).format(said, *at[:3], cross)
    value = f"{now} → {measured[0]}" if measured else now
    return IntervalRow(name, value, picture, of.rms_kept(judged) is False)


def peaks_table(separation: Separation) -> Grid:
    """What each motion asked of each axis: as commanded, and the effort as recorded."""
    headings = ("motion, axis", *(f"{name} ({unit})" for name, _, unit in QUANTITIES))
    rows: list[Row] = [
        (f"{made.file}, {axis}", *(f"{of[field]:.3g}" for _, field, _ in QUANTITIES))
        for made in separation.motions
        for axis, of in peaks(made).items()
    ]
    return Grid("Peaks: motion as commanded, effort as recorded", headings, rows)
