"""Stamps that exports of ROS messages spread over two columns."""

import re
from dataclasses import replace
from typing import Final

import numpy as np

from edge_ident.files.table import Column, Table

_PART: Final = re.compile(r"(?P<part>n|nano)?se?cs?\Z", re.IGNORECASE)
"""`header.stamp.secs` and `.nsecs` of ROS 1, `header.stamp.sec` and `.nanosec` of ROS 2."""
_NS_PER_S: Final = 1e9


def joined_stamps(table: Table) -> Table:
    """Put stamps of seconds and nanoseconds together: seconds since the first of them."""
    headings = {column.heading for column in table.columns}
    parts: dict[str, dict[bool, Column]] = {}
    for column in table.columns:
        if match := _PART.search(column.heading):
            stem = _without_signs(column.heading[: match.start()])
            parts.setdefault(stem, {})[bool(match["part"])] = column
    columns, how = list(table.columns), [table.how] if table.how else []
    for stem, pair in parts.items():
        heading = stem or "stamp"
        if len(pair) < 2 or heading in headings or not _is_stamp(pair[False], pair[True]):
            continue
        seconds, fine = pair[False], pair[True]
        values = seconds.values - seconds.values[0]
        values += (fine.values - fine.values[0]) / _NS_PER_S
        joined = Column(heading, heading, "s", values)
        columns = [joined if c is seconds else c for c in columns if c is not fine]
        how.append(f"{heading} of {seconds.heading} and {fine.heading}")
    return replace(table, columns=tuple(columns), how=", ".join(how))


def _without_signs(text: str) -> str:
    """Text up to its last letter or digit."""
    end = len(text)
    while end and not text[end - 1].isalnum():
        end -= 1
    return text[:end]


def _is_stamp(seconds: Column, fine: Column) -> bool:
    if not len(seconds.values):
        return False
    whole = bool(np.all(np.floor(seconds.values) == seconds.values))
    return whole and bool(np.all((fine.values >= 0.0) & (fine.values < _NS_PER_S)))
