"""How runs on machines with drawn faults are scored, and the tables of their counts."""

from collections.abc import Iterator
from typing import Any

import numpy as np

Row = dict[str, Any]


def scored(row: Row) -> dict[str, bool]:
    """Whether exactly the truth is named, comes first on its axis, and has no rival left.

    `right` counts causes. `listed` counts minor ones too, and those that are not there against it.
    """
    axes: dict[str, Row] = row["axes"]
    truth = {(fault["axis"], fault["effect"]) for fault in row["faults"]}
    named = {(axis, effect) for axis, of in axes.items() for effect in of["causes"]}
    minor = {(axis, effect) for axis, of in axes.items() for effect in of.get("minor", ())}
    first = [axes.get(axis, {}).get("causes", [])[:1] for axis, _ in truth]
    right = bool(axes) and named == truth and row.get("rigid_gains", True) | bool(truth)
    return {
        "right": right,
        "listed": bool(axes) and named | minor == truth,
        "first": bool(axes)
        and all((a, *f) in truth for f, (a, _) in zip(first, truth, strict=True)),
        "no_rival": right and not any(of["rivals"] for of in axes.values()),
    }


def line(row: Row) -> str:
    truth = ", ".join(f"{f['effect']} {f['axis']} {f['strength']:.3g}" for f in row["faults"])
    said = [f"{axis} {_named(of)}" for axis, of in row["axes"].items()] or [row["error"]]
    spent = f"{row.get('motions', 0)} motions, {row['processor_s']} s"
    mark = "right" if row["right"] else "WRONG"
    return f"{row['seed']} {row['arm']} {mark} [{truth}] {'; '.join(said)} ({spent})"


def _named(of: Row) -> str:
    text = f"{of['verdict']}: {', '.join(of['causes'])}"
    return f"{text} or {', '.join(of['rivals'])}" if of["rivals"] else text


def table(rows: Any) -> str:
    """Counts of each arm, of all cases and of those in which `run` made further motions."""
    every = [row for row in rows if row["arm"] != "counts"]
    asked = {row["seed"] for row in every if row["arm"] == "run" and row.get("motions", 1) > 1}
    further = [row for row in every if row["seed"] in asked]
    return "\n".join([*_counted("all", every), *_counted("further motions", further)])


def _counted(what: str, rows: list[Row]) -> Iterator[str]:
    yield f"{what:16}cases  right  minor too  first  no rival  motions  seconds"
    for arm in dict.fromkeys(row["arm"] for row in rows):
        of = [row for row in rows if row["arm"] == arm]
        sums = [sum(row[what] for row in of) for what in ("right", "listed", "first", "no_rival")]
        means = [np.mean([row.get(what, 0) for row in of]) for what in ("motions", "seconds")]
        counts = "{:7d}{:11d}{:7d}{:10d}".format(*sums)
        yield f"{arm:14}{len(of):7d}{counts}{means[0]:9.2f}{means[1]:9.1f}"
