"""Series that have a clock each, in one table: its rows are the stamps of all of them.

A column is sparse then: NaN stands where it was not sampled. What reads the table resamples.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from edge_ident.files.table import Column, make_columns
from edge_ident.support.limits import check_table

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Series:
    """One series.

    Attributes
    ----------
    heading : str
    unit : str or None
        Where it stands apart from the heading.
    stamps : (N,) array
        In the unit of the clock, which all series of a table share.
    values : (N,) array
    """

    heading: str
    unit: str | None
    stamps: Array
    values: Array


def merged(series: Sequence[Series], clock: str, clock_unit: str | None) -> tuple[Column, ...]:
    """Columns of series, with their stamps in the first column; sparse where the stamps differ.

    Parameters
    ----------
    series : sequence of Series
        Of several values at one stamp, the last counts.
    clock, clock_unit : str
        Heading and unit of the column of stamps.

    Raises
    ------
    TooLargeError
    """
    stamps = np.unique(np.concatenate([each.stamps for each in series]))
    check_table(len(series) + 1, len(stamps))
    arrays = [stamps]
    for each in series:
        values = np.full(len(stamps), np.nan)
        values[np.searchsorted(stamps, each.stamps)] = each.values
        arrays.append(values)
    headings = [clock, *(each.heading for each in series)]
    return make_columns(
        headings, arrays, [clock_unit, *(each.unit for each in series)], sparse=True
    )
