"""What new gains promised and what was measured, for the page of a run."""

import math

import numpy as np
from markupsafe import Markup

from edge_ident.commissioning.promise import WORTH, Promise, Promised
from edge_ident.commissioning.run import Outcome
from edge_ident.commissioning.verification import GainChange
from edge_ident.report.page.card import IntervalPicture, IntervalRow, Row, Table
from edge_ident.report.page.scale import Scale
from edge_ident.report.page.wording import digits, minus
from edge_ident.report.promise_report import promise_rows, tried
from edge_ident.support.words import listed, spoken

_ROOM = 1.3
"""Factor by which the scale goes beyond the smallest and the largest error."""
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


def promise_table(promise: Promise) -> Table:
    """Rms and peak of every axis and motion; nothing is measured where no gains were tried."""
    promised = "promised (90 % interval)"
    headings = ("axis, motion", "old gains", promised, "kept up to", "measured", "kept")
    rows: list[Row] = [
        (f"{axis}, {motion}, {quantity}", *map(minus, cells))
        for motion, axis, quantity, *cells in promise_rows(promise)
    ]
    if tried(promise):
        return Table("Tracking error (mrad)", headings, rows)
    return Table("Tracking error (mrad), not tried", headings[:-3], [row[:-3] for row in rows])


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
