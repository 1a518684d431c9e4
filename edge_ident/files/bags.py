"""Bags of ROS 1 and ROS 2, and MCAP files: the joint states in them (sensor_msgs/JointState)."""

from collections import defaultdict
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.errors import DataError
from edge_ident.files.bag_sizes import check_description, counted_unpacking
from edge_ident.files.extras import needed, reading
from edge_ident.files.table import Table, series
from edge_ident.support.limits import MOST_CELLS, check_size

Array = NDArray[np.float64]
_Message = tuple[int, tuple[Array, ...]]

_JOINT_STATES: Final = "sensor_msgs/msg/JointState"
_NS_PER_S: Final = 1_000_000_000


def read_bag(path: Path, topic: str | None = None) -> Table:
    """Read the joint states of a .bag, .db3 or .mcap file, or of the folder of a bag of ROS 2.

    Time is the stamp of each message, or when it was recorded where it has none. A joint has
    columns `NAME/position`, `NAME/velocity` and `NAME/effort`; ROS does not say whether it turns.
    Of joints that are sent apart, those that are sent most often are read.

    Raises
    ------
    DataError
        The file is damaged, rosbags is missing, or no joint states, or several topics of them, have
        an effort.
    TooLargeError
    """
    highlevel = needed("rosbags.highlevel", "ros", str(path))
    typesys = needed("rosbags.typesys", "ros", str(path))
    store = typesys.get_typestore(typesys.Stores.LATEST)
    with reading(str(path), "ROS"), counted_unpacking():
        check_description(path)
        with highlevel.AnyReader([path], default_typestore=store) as reader:
            topics = sorted({c.topic for c in reader.connections})
            sent = _joint_states(reader)
    with_effort = {topic: found for topic, found in sent.items() if found}
    if len(with_effort) != 1:
        several = ", ".join(with_effort) or "none"
        raise DataError(
            f"{path}: topics of {_JOINT_STATES} with efforts: {several}; all topics: "
            f"{', '.join(topics) or 'none'}",
            "record one topic that holds positions and efforts of the joints",
        )
    ((topic, by_joints),) = with_effort.items()
    joints, messages = max(by_joints.items(), key=lambda pair: len(pair[1]))
    arrays = _arrays(joints, sorted(messages, key=lambda message: message[0]))
    return series(str(path), arrays, f"topic {topic}")


def _joint_states(reader: Any) -> dict[str, dict[tuple[str, ...], list[_Message]]]:
    """Stamps (ns) with position, velocity and effort, by topic and by the names of the joints."""
    found: dict[str, dict[tuple[str, ...], list[_Message]]] = {}
    states = [c for c in reader.connections if c.msgtype == _JOINT_STATES]
    numbers = 0
    for connection, recorded_ns, raw in reader.messages(states) if states else ():
        by_joints = found.setdefault(connection.topic, defaultdict(list))
        message = reader.deserialize(raw, connection.msgtype)
        stamp = message.header.stamp
        stamp_ns = int(stamp.sec) * _NS_PER_S + int(stamp.nanosec)
        held = message.position, message.velocity, message.effort
        numbers += 1 + sum(map(len, held))
        check_size("numbers", numbers, MOST_CELLS)
        if len(message.name) == len(message.position) == len(message.effort):
            columns = tuple(np.array(values, dtype=np.float64) for values in held)  # not the bag's
            by_joints[tuple(message.name)].append((stamp_ns or recorded_ns, columns))
    return found


def _arrays(joints: tuple[str, ...], messages: list[_Message]) -> dict[str, Array]:
    stamps_ns = np.array([stamp for stamp, _ in messages])
    arrays = {"time [s]": (stamps_ns - stamps_ns[0]) / _NS_PER_S}
    for place, quantity in enumerate(("position", "velocity", "effort")):
        rows = [columns[place] for _, columns in messages]
        if all(len(row) == len(joints) for row in rows):
            values = np.array(rows, dtype=np.float64)
            arrays |= {f"{name}/{quantity}": values[:, k] for k, name in enumerate(joints)}
    return arrays
