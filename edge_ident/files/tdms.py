"""LabVIEW's .tdms files."""

from collections import Counter
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from edge_ident.files.extras import needed, reading
from edge_ident.files.table import Table, series
from edge_ident.support.limits import MOST_COLUMNS, MOST_NUMBERS, check_size


def read_tdms(path: Path) -> Table:
    """Read the channels of a .tdms file, with their units and the period of their waveforms.

    A channel is called by its own name, or `group.channel` where two groups have it.

    Raises
    ------
    DataError
        The file is damaged, npTDMS is missing, or no two channels have the same length.
    TooLargeError
    """
    nptdms = needed("nptdms", "tdms", str(path))
    arrays: dict[str, NDArray[np.generic]] = {}
    periods = set()
    with reading(str(path), ".tdms"), nptdms.TdmsFile.open(path) as file:
        channels = [channel for group in file.groups() for channel in group.channels()]
        check_size("columns", len(channels), MOST_COLUMNS)
        check_size("numbers", sum(map(len, channels)), MOST_NUMBERS)
        often = Counter(channel.name for channel in channels)
        for channel in channels:
            unit = channel.properties.get("unit_string", "")
            alone = often[channel.name] == 1
            name = channel.name if alone else f"{channel.group_name}.{channel.name}"
            arrays[name + (f" [{unit}]" if unit else "")] = np.asarray(channel[:])
            periods.add(float(channel.properties.get("wf_increment", 0.0)))
    table = series(str(path), arrays, "TDMS")
    stated = periods.pop() if len(periods) == 1 else 0.0
    return Table(**(vars(table) | {"period_s": stated or None}))
