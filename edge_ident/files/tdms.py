"""LabVIEW's .tdms files."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from edge_ident.files.extras import needed, unreadable
from edge_ident.files.table import Table, series


def read_tdms(path: Path) -> Table:
    """Read the channels of a .tdms file, with their units and the period of their waveforms.

    A channel is called by its own name, or `group.channel` where two groups have it.

    Raises
    ------
    DataError
        The file is damaged, npTDMS is missing, or no two channels have the same length.
    """
    nptdms = needed("nptdms", "tdms", str(path))
    try:
        file = nptdms.TdmsFile.read(path)
    except (ValueError, OSError, KeyError, EOFError) as error:
        raise unreadable(str(path), ".tdms", error) from error
    channels = [channel for group in file.groups() for channel in group.channels()]
    names = [channel.name for channel in channels]
    arrays: dict[str, NDArray[np.generic]] = {}
    periods = set()
    for channel in channels:
        alone = names.count(channel.name) == 1
        unit = channel.properties.get("unit_string", "")
        name = channel.name if alone else f"{channel.group_name}.{channel.name}"
        arrays[name + (f" [{unit}]" if unit else "")] = np.asarray(channel[:])
        periods.add(float(channel.properties.get("wf_increment", 0.0)))
    table = series(str(path), arrays, "TDMS")
    stated = periods.pop() if len(periods) == 1 else 0.0
    return Table(**(vars(table) | {"period_s": stated or None}))
