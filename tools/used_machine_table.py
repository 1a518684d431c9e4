"""Tables of runs on used machines, and whether the aims are met."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any, Final

import numpy as np

from firmware_interface.plant.drives import COUNT_RAD

Row = Mapping[str, Any]
WORSE: Final = 0.02
BETTER: Final = 5.0
COUNTS: Final = 2.0
"""An error below so many counts is as small as it has to be."""
_NO_LOSS: Final = 0.05 * COUNT_RAD


def key_of(row: Row) -> str:
    """A name of the machine and of how `run` was asked."""
    how = row["friction"] or f"{row['wear']:g}"
    return "-".join([str(row["seed"]), how, *map(str.strip, row["options"])]).replace("/", "_")


def group_of(row: Row) -> str:
    """Machines that are counted together."""
    wear = row["wear"]
    kind = f"clean, {row['friction']}" if wear is None else "worn" if wear >= 2 else "used"
    return " ".join([kind, *row["options"]])


def gained(row: Row) -> float:
    """Of the axis that gained least on the third motion: error before over error after."""
    errors = row["errors_rad"]
    return min(
        float(errors["before"]["third"][axis] / (after + _NO_LOSS))
        for axis, after in errors["after"]["third"].items()
    )


def helped(row: Row) -> bool:
    """Every axis follows the third motion `BETTER` times better, or within `COUNTS`."""
    errors = row["errors_rad"]
    return all(
        after <= COUNTS * COUNT_RAD or errors["before"]["third"][axis] >= BETTER * after
        for axis, after in errors["after"]["third"].items()
    )


def over_ideal(row: Row) -> list[float]:
    """Errors over those of gains from the truth, of both motions and axes."""
    after, ideal = row["errors_rad"]["after"], row["errors_rad"]["ideal"]
    return [
        (after[on][axis] + _NO_LOSS) / (ideal[on][axis] + _NO_LOSS)
        for on in after
        for axis in after[on]
    ]


def missed(row: Row) -> list[str]:
    """Aims that a run misses."""
    if "errors_rad" not in row:
        return ["not judged: " + row.get("not_judged", row.get("error", ""))[:60]]
    found = []
    if not helped(row):
        found.append(f"gained {gained(row):.1f} times")
    worse = max(row["grown"].values())
    if worse > WORSE:
        found.append(f"worse by {worse:.0%}")
    if row["exit"]:
        found.append(f"exit {row['exit']}")
    if row["first_write_s"] and row["first_write_s"][1] > 2.0:
        found.append(f"{row['first_write_s'][1]:.1f} s to the first write")
    if row["computing_s"][1] > 60.0:
        found.append(f"{row['computing_s'][1]:.0f} s of computing")
    return found


def table(rows: Sequence[Row]) -> str:
    """Aims of each group, and the runs that miss some."""
    groups = dict.fromkeys(map(group_of, rows))
    lines = [line for group in groups for line in _of_group(group, rows)]
    lines += ["", "runs that miss an aim:"]
    for row in sorted(rows, key=lambda row: (group_of(row), row["seed"])):
        if aims := missed(row):
            lines.append(f"{row['command']}: {'; '.join(aims)}. {row['conclusion'][:110]}")
    return "\n".join(lines)


def _of_group(group: str, rows: Iterable[Row]) -> Iterator[str]:
    every = [row for row in rows if group_of(row) == group]
    judged = [row for row in every if "errors_rad" in row]
    yield f"\n{group}: {len(every)} machines, {len(every) - len(judged)} not judged"
    if not judged:
        return
    yield f"  exit 0                        {_part(row['exit'] == 0 for row in every)}"
    yield f"  gains written and kept        {_part(row['confirmed'] for row in every)}"
    yield f"  5 times better or 2 counts    {_part(map(helped, judged))} (aim 95 %)"
    worse = [max(row["grown"].values()) > WORSE for row in judged]
    yield f"  worse by more than 2 %        {sum(worse)} (aim 0)"
    times = np.quantile([gained(row) for row in judged], [0.05, 0.5])
    yield f"  gained, weakest axis          {times[1]:.0f} times (median), {times[0]:.1f} (5 %)"
    ideal = [each for row in judged for each in over_ideal(row)]
    half, most = np.quantile(ideal, [0.5, 0.9])
    yield f"  over gains of the truth       {half:.2f} (median, aim 1.5), {most:.2f} in 90 %"
    writes = np.bincount([row["writes"] for row in every]).tolist()
    counts = ", ".join(f"{of} with {n}" for n, of in enumerate(writes) if of)
    yield f"  runs by number of writes      {counts}"
    yield from _times(every)
    yield from _forecasts(every)


def _times(every: Sequence[Row]) -> Iterator[str]:
    for what, spent, aim in (
        ("to the first write", [row["first_write_s"] for row in every], 2),
        ("beside the motions", [row["computing_s"] for row in every], 60),
    ):
        if found := [both[1] for both in spent if both]:
            middle, most = np.median(found), max(found)
            yield (
                f"  computing {what}  {middle:.1f} s (median), {most:.1f} s (most; aim {aim} s), "
                f"processor time"
            )


def _forecasts(every: Sequence[Row]) -> Iterator[str]:
    for quantity in ("rms_rad", "peak_rad"):
        found = [hit for row in every for hit in row["forecasts"] if hit[2] == quantity]
        if found:
            ratio = np.median([hit[4] for hit in found])
            held = _part(hit[3] for hit in found)
            yield (
                f"  90 % interval of the {quantity[:-4]:4}     {held} (aim 85 to 97 %), measured "
                f"over forecast {ratio:.2f} (median)"
            )


def _part(of: Iterable[bool]) -> str:
    found = list(of)
    return f"{sum(found)} of {len(found)} ({sum(found) / len(found):.0%})"
