"""Bags of ROS 1 and ROS 2, and MCAP files: the joint states in them (sensor_msgs/JointState)."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.errors import DataError
from edge_ident.files.bag_sizes import check_description, counted_unpacking
from edge_ident.files.clocks import Series, merged
from edge_ident.files.extras import needed, reading
from edge_ident.files.mcap import foreign_messages
from edge_ident.files.table import Column, Table
from edge_ident.support.limits import MOST_CELLS, MOST_COLUMNS, check_size

Array = NDArray[np.float64]

_JOINT_STATES: Final = "sensor_msgs/msg/JointState"
_NS_PER_S: Final = 1_000_000_000
_QUANTITIES: Final = ("position", "velocity", "effort")


@dataclass
class _Topic:
    """The joint states of one topic: of each joint and quantity, the stamps (ns) and the values."""

    series: dict[tuple[str, str], tuple[list[int], list[float]]] = field(default_factory=dict)

    @property
    def has_efforts(self) -> bool:
        return any(quantity == "effort" for _, quantity in self.series)

    def add(self, stamp_ns: int, names: list[str], quantity: str, values: Array) -> None:
        if len(values) != len(names):  # ROS leaves a quantity out that a joint does not have
            return
        check_size("columns", len(self.series) + len(names), MOST_COLUMNS)
        for name, value in zip(names, values.tolist(), strict=True):
            stamps, held = self.series.setdefault((name, quantity), ([], []))
            stamps.append(stamp_ns)
            held.append(value)


def read_bag(path: Path, topic: str | None = None) -> Table:
    """Read the joint states of a .bag, .db3 or .mcap file, or of the folder of a bag of ROS 2.

    Time is the stamp of each message, or when it was recorded where it has none. A joint has
    columns `NAME/position`, `NAME/velocity` and `NAME/effort`; ROS does not say whether it turns.
    Joints that are sent apart, or in changing order, have a clock each.

    Parameters
    ----------
    path : Path
    topic : str, optional
        To read; not needed where one alone has efforts.

    Raises
    ------
    DataError
        The file is damaged, or no bag of ROS; rosbags is missing; no joint states, or several
        topics of them, have an effort.
    TooLargeError
    """
    highlevel = needed("rosbags.highlevel", "ros", str(path))
    typesys = needed("rosbags.typesys", "ros", str(path))
    if (held := foreign_messages(path)) is not None:
        raise DataError(
            f"{path}: an MCAP file that holds {held}, and no messages of ROS",
            "export position and effort from it as CSV, such as from Foxglove or PlotJuggler",
        )
    store = typesys.get_typestore(typesys.Stores.LATEST)
    with reading(str(path), "ROS"), counted_unpacking():
        check_description(path)
        with highlevel.AnyReader([path], default_typestore=store) as reader:
            topics = sorted({c.topic for c in reader.connections})
            sent = _joint_states(reader)
    chosen = _chosen(path, sent, topics, topic)
    return Table(str(path), _columns(sent[chosen]), f"topic {chosen}")


def _chosen(path: Path, sent: dict[str, _Topic], topics: list[str], wanted: str | None) -> str:
    """The topic to read.

    Raises
    ------
    DataError
    """
    with_effort = [name for name, found in sent.items() if found.has_efforts]
    if wanted is not None:
        if wanted in with_effort:
            return wanted
        what = "there is no such topic" if wanted not in topics else "it has no efforts of joints"
        raise DataError(
            f"{path}: --topic {wanted}: {what}",
            f"topics with efforts: {', '.join(with_effort) or 'none'}",
        )
    if len(with_effort) == 1:
        return with_effort[0]
    raise DataError(
        f"{path}: topics of {_JOINT_STATES} with efforts: {', '.join(with_effort) or 'none'}; all "
        f"topics: {', '.join(topics) or 'none'}",
        f"say which to read: {' or '.join(f'--topic {name}' for name in with_effort)}"
        if with_effort
        else "record a topic that holds positions and efforts of the joints",
    )


def _joint_states(reader: Any) -> dict[str, _Topic]:
    """What each topic of joint states holds."""
    found: dict[str, _Topic] = {}
    states = [c for c in reader.connections if c.msgtype == _JOINT_STATES]
    numbers = 0
    for connection, recorded_ns, raw in reader.messages(states) if states else ():
        topic = found.setdefault(connection.topic, _Topic())
        message = reader.deserialize(raw, connection.msgtype)
        stamp = message.header.stamp
        stamp_ns = int(stamp.sec) * _NS_PER_S + int(stamp.nanosec)
        for quantity in _QUANTITIES:
            values = np.array(getattr(message, quantity), dtype=np.float64)
            numbers += len(values)
            check_size("numbers", numbers, MOST_CELLS)
            topic.add(stamp_ns or recorded_ns, list(message.name), quantity, values)
    return found


def _columns(topic: _Topic) -> tuple[Column, ...]:
    """Columns of a topic, on the stamps of all of its joints; time from the first."""
    first = min(stamps[0] for stamps, _ in topic.series.values())
    names = dict.fromkeys(name for name, _ in topic.series)
    series = []
    for quantity in _QUANTITIES:
        for name in names:
            if (name, quantity) in topic.series:
                stamps, values = topic.series[name, quantity]
                since = (np.array(stamps) - first) / _NS_PER_S
                series.append(Series(f"{name}/{quantity}", None, since, np.array(values)))
    return merged(series, "time [s]", None)
