"""Bags of ROS, written by rosbags: the joint states in them are a recording."""

import struct
import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Writer2
from rosbags.typesys import Stores, get_typestore

import edge_ident
from edge_ident.errors import DataError
from tests.edge_ident.files.test_ros import GOOD, STAMP_NS, check
from tests.edge_ident.signals.test_column_proposals import accepted, accepting

JOINT_STATES = "sensor_msgs/msg/JointState"
TEXT = "std_msgs/msg/String"


def state(types: Any, stamp_ns: int, names: Sequence[str], position: float, effort: float) -> Any:
    """Of all joints but the first, nine tenths of position and effort."""
    shares = np.where(np.arange(len(names)) == 0, 1.0, 0.9)
    stamp = types["builtin_interfaces/msg/Time"](*divmod(stamp_ns, 10**9))
    extra = {"seq": 0} if "seq" in types["std_msgs/msg/Header"].__dataclass_fields__ else {}
    return types[JOINT_STATES](
        header=types["std_msgs/msg/Header"](stamp=stamp, frame_id="", **extra),
        name=list(names),
        position=shares * position,
        velocity=np.zeros(0),
        effort=shares * effort,
    )


def write(
    folder: Path, ending: str, topics: dict[str, Sequence[str]], stamped: bool = True
) -> Path:
    """A bag with the joint states of these joints on each topic, and a topic of text."""
    folder.mkdir(exist_ok=True)
    store = get_typestore(Stores.ROS1_NOETIC if ending == ".bag" else Stores.ROS2_HUMBLE)
    if ending == ".bag":
        writer: Any = Writer1(folder / "joints.bag")
        packed = store.serialize_ros1
    else:
        plugin = StoragePlugin.MCAP if ending == ".mcap" else StoragePlugin.SQLITE3
        writer = Writer2(folder / "bag", version=9, storage_plugin=plugin)
        packed = store.serialize_cdr
    with writer:
        text = writer.add_connection("/chatter", TEXT, typestore=store)
        writer.write(text, int(STAMP_NS[0]), packed(store.types[TEXT](data="begin"), TEXT))
        for topic, names in topics.items():
            states = writer.add_connection(topic, JOINT_STATES, typestore=store)
            for k, stamp_ns in enumerate(STAMP_NS.tolist()):
                made = state(
                    store.types, stamp_ns * stamped, names, GOOD.position[k], GOOD.effort[k]
                )
                writer.write(states, stamp_ns, packed(made, JOINT_STATES))
    (path,) = folder.rglob(f"*{ending}")
    return path


@pytest.mark.parametrize("ending", [".bag", ".db3", ".mcap"])
@pytest.mark.parametrize("stamped", [True, False])
def test_joint_states_of_a_bag_are_a_recording(ending: str, stamped: bool, tmp_path: Path) -> None:
    path = write(tmp_path, ending, {"/joint_states": ["pan", "tilt"]}, stamped)
    found = edge_ident.inspect_recording(path)
    assert "topic /joint_states" in found.how
    check(accepted(path), "pan", "tilt")


def test_a_bag_of_ros_2_is_its_folder_too(tmp_path: Path) -> None:
    path = write(tmp_path, ".db3", {"/joint_states": ["pan", "tilt"]})
    check(accepted(path.parent), "pan", "tilt")


def test_of_several_topics_none_is_taken(tmp_path: Path) -> None:
    path = write(tmp_path, ".db3", {"/left": ["pan"], "/right": ["pan"]})
    with pytest.raises(DataError, match="with efforts: /left, /right") as caught:
        edge_ident.load_recording(path)
    assert caught.value.next_step == "say which to read: --topic /left or --topic /right"
    options = replace(accepting(path, topic="/right"), topic="/right")
    read = edge_ident.load_recording(path, options=options).axes["pan"]
    np.testing.assert_allclose(read.position, GOOD.position, rtol=1e-12)


def test_a_topic_that_is_not_there_names_those_that_are(tmp_path: Path) -> None:
    path = write(tmp_path, ".db3", {"/left": ["pan"], "/right": ["pan"]})
    for topic, why in (("/up", "there is no such topic"), ("/chatter", "it has no efforts")):
        with pytest.raises(DataError, match=why) as caught:
            edge_ident.load_recording(path, options=edge_ident.ReadOptions(topic=topic))
        assert "/left, /right" in caught.value.next_step


@pytest.mark.parametrize("apart", [True, False], ids=["sent apart", "in changing order"])
def test_no_joint_and_no_message_is_lost(apart: bool, tmp_path: Path) -> None:
    """Two nodes publish a joint each on one topic; or one publishes both, in changing order."""
    store = get_typestore(Stores.ROS2_HUMBLE)
    with Writer2(tmp_path / "bag", version=9, storage_plugin=StoragePlugin.SQLITE3) as writer:
        states = writer.add_connection("/joint_states", JOINT_STATES, typestore=store)
        for k, stamp_ns in enumerate(STAMP_NS.tolist()):
            orders = [["pan"], ["tilt"]] if apart else [["pan", "tilt"][:: 1 if k % 2 else -1]]
            for late, names in enumerate(orders):
                at = GOOD.position[k], GOOD.effort[k]
                made = state(store.types, stamp_ns + 1000 * late, names, *at)
                shares = np.array([1.0 if name == "pan" else 0.9 for name in names])
                made = replace(made, position=shares * at[0], effort=shares * at[1])
                writer.write(states, stamp_ns, store.serialize_cdr(made, JOINT_STATES))
    (path,) = tmp_path.rglob("*.db3")
    recording = edge_ident.load_recording(path, options=accepting(path))
    assert abs(len(recording.time_s) - len(STAMP_NS)) <= 2
    for name, share in (("pan", 1.0), ("tilt", 0.9)):
        true = np.interp(recording.time_s, GOOD.time_s - GOOD.time_s[0], share * GOOD.position)
        assert np.max(np.abs(recording.axes[name].position - true)) < 1e-3


def test_an_mcap_of_another_system_is_named(tmp_path: Path) -> None:
    """A file as Foxglove's libraries write it: header, summary with schema and channel, footer."""

    def text(value: str) -> bytes:
        return struct.pack("<I", len(value)) + value.encode()

    def record(kind: int, body: bytes) -> bytes:
        return struct.pack("<BQ", kind, len(body)) + body

    head = (
        b"\x89MCAP0\r\n" + record(1, text("") + text("a test")) + record(15, struct.pack("<I", 0))
    )
    schema = record(3, struct.pack("<H", 1) + text("robot.State") + text("jsonschema") + text("{}"))
    channel = record(4, struct.pack("<HH", 1, 1) + text("/state") + text("json") + text(""))
    footer = record(2, struct.pack("<QQI", len(head), 0, 0)) + head[:8]
    path = tmp_path / "robot.mcap"
    path.write_bytes(head + schema + channel + footer)
    with pytest.raises(DataError, match=r"json .*robot\.State; topics /state") as caught:
        edge_ident.load_recording(path)
    assert "no messages of ROS" in caught.value.cause


def test_a_bag_without_joint_states_names_its_topics(tmp_path: Path) -> None:
    path = write(tmp_path, ".mcap", {})
    with pytest.raises(DataError, match="with efforts: none; all topics: /chatter"):
        edge_ident.load_recording(path)


def test_a_missing_package_names_its_extra(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = write(tmp_path, ".mcap", {"/joint_states": ["pan"]})
    monkeypatch.setitem(sys.modules, "rosbags.highlevel", None)
    with pytest.raises(DataError, match="needs rosbags, which is not installed") as caught:
        edge_ident.load_recording(path)
    assert "edge-ident[ros]" in caught.value.next_step


@pytest.mark.parametrize("ending", [".bag", ".db3", ".mcap"])
@pytest.mark.parametrize("kept", [0, 100, 3000])
def test_a_damaged_bag_is_refused(ending: str, kept: int, tmp_path: Path) -> None:
    path = write(tmp_path, ending, {"/joint_states": ["pan"]})
    path.write_bytes(path.read_bytes()[:kept])
    with pytest.raises(DataError, match=r"not a readable|with efforts"):
        edge_ident.load_recording(path)
