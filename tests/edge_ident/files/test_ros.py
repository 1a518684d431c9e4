"""Exports of ROS: stamps in two parts, joints with names, and files that have to be exported."""

import csv
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

import edge_ident
from edge_ident.errors import DataError
from tests.edge_ident.signals.test_column_proposals import accepted, proposed
from tests.test_bad_recordings import sound

GOOD = sound()
STAMP_NS = 1_700_000_000_000_000_000 + np.rint(1e9 * GOOD.time_s).astype(np.int64)
SECONDS, NANOSECONDS = STAMP_NS // 10**9, STAMP_NS % 10**9


def write(path: Path, heading: str, columns: Sequence[Any]) -> Path:
    with path.open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(heading.split(","))
        full = [[c] * len(STAMP_NS) if isinstance(c, str) else c.tolist() for c in columns]
        writer.writerows(zip(*full, strict=True))
    return path


def check(recording: edge_ident.Recording, *names: str) -> None:
    assert list(recording.axes) == list(names)
    for name, share in zip(names, (1.0, 0.9), strict=True):
        np.testing.assert_allclose(recording.axes[name].position, share * GOOD.position)
        np.testing.assert_allclose(recording.axes[name].effort, share * GOOD.effort)
    np.testing.assert_allclose(recording.time_s - recording.time_s[0], GOOD.time_s, atol=1e-6)


@pytest.mark.parametrize(
    ("seconds", "nanoseconds", "stamp"),
    [
        ("header.stamp.secs", "header.stamp.nsecs", "header.stamp"),
        ("header.stamp.sec", "header.stamp.nanosec", "header.stamp"),
        ("stamp_sec", "stamp_nanosec", "stamp"),
        ("sec", "nanosec", "stamp"),
    ],
)
def test_stamps_of_two_parts_are_joined(
    seconds: str, nanoseconds: str, stamp: str, tmp_path: Path
) -> None:
    """To the nanosecond: a double has 240 ns at seconds since 1970."""
    path = write(
        tmp_path / "joints.csv",
        f"{seconds},{nanoseconds},position [rad],effort [Nm]",
        [SECONDS, NANOSECONDS, GOOD.position, GOOD.effort],
    )
    read = edge_ident.load_recording(path)
    np.testing.assert_allclose(read.time_s, GOOD.time_s, rtol=0.0, atol=1e-9)
    found = edge_ident.inspect_recording(path)
    assert f"{stamp} of {seconds} and {nanoseconds}" in found.how
    frame = edge_ident.load_recording(pd.read_csv(path))
    np.testing.assert_array_equal(frame.time_s, read.time_s)


def test_seconds_that_are_no_stamp_stay_as_they_are(tmp_path: Path) -> None:
    path = write(
        tmp_path / "other.csv",
        "t.sec,t.nsec,position [rad],effort [Nm]",
        [GOOD.time_s, 1e9 * GOOD.time_s, GOOD.position, GOOD.effort],
    )
    headings = [use.heading for use in edge_ident.inspect_recording(path).columns]
    assert headings[:2] == ["t.sec", "t.nsec"]


def test_rostopic_writes_nanoseconds_and_names(tmp_path: Path) -> None:
    """`rostopic echo -p`: the stamp of the measurement goes before that of the writing."""
    path = write(
        tmp_path / "joints.csv",
        "%time,field.header.seq,field.header.stamp,field.header.frame_id,field.name0,field.name1,"
        "field.position0,field.position1,field.effort0,field.effort1",
        [STAMP_NS + 70_000 * (np.arange(len(STAMP_NS)) % 9), np.arange(len(STAMP_NS)), STAMP_NS,
         "", "pan joint", "tilt-joint", GOOD.position, 0.9 * GOOD.position, GOOD.effort,
         0.9 * GOOD.effort],
    )  # fmt: skip
    found = proposed(path)
    assert found["field.header.stamp"] == ("time_s", "ns")
    assert found["field.position1"] == ("tilt_joint_position_rad", "rad")
    check(accepted(path), "pan_joint", "tilt_joint")


def test_columns_of_a_bag_in_a_frame_have_their_joints_names(tmp_path: Path) -> None:
    path = write(
        tmp_path / "joints.csv",
        "Time,header.stamp.secs,header.stamp.nsecs,name_0,name_1,position_0,position_1,effort_0,"
        "effort_1",
        [1e-9 * STAMP_NS + 1e-3, SECONDS, NANOSECONDS, "pan", "tilt", GOOD.position,
         0.9 * GOOD.position, GOOD.effort, 0.9 * GOOD.effort],
    )  # fmt: skip
    assert proposed(path)["header.stamp"] == ("time_s", "s")
    check(accepted(path), "pan", "tilt")
    targets = [use.target for use in edge_ident.inspect_recording(pd.read_csv(path)).columns]
    assert "pan_position_rad" in targets


@pytest.mark.parametrize("names", [("pan", "pan"), ("", "tilt"), ("3", "4")])
def test_names_that_name_no_axis_are_passed_over(names: tuple[str, str], tmp_path: Path) -> None:
    path = write(
        tmp_path / "joints.csv",
        "t [s],name_0,name_1,position_0 [rad],position_1 [rad],effort_0 [Nm],effort_1 [Nm]",
        [GOOD.time_s, *names, GOOD.position, 0.9 * GOOD.position, GOOD.effort, 0.9 * GOOD.effort],
    )
    assert len(edge_ident.load_recording(path).axes) == 2


@pytest.mark.parametrize(
    "headings",
    [
        "t,q1,q2,tau1,tau2",
        "t,q_1,q_2,tau_1,tau_2",
        "t,q[1],q[2],tau[1],tau[2]",
        "t,joint1_pos,joint2_pos,joint1_effort,joint2_effort",
        "t,joint_1/position,joint_2/position,joint_1/effort,joint_2/effort",
    ],
)
def test_axes_of_an_arm_by_their_number(headings: str, tmp_path: Path) -> None:
    columns = [GOOD.time_s, GOOD.position, 0.9 * GOOD.position, GOOD.effort, 0.9 * GOOD.effort]
    check(accepted(write(tmp_path / "arm.csv", headings, columns)), "axis1", "axis2")


def test_a_plotted_topic_names_its_joints(tmp_path: Path) -> None:
    path = write(
        tmp_path / "plot.csv",
        "__time,/joint_states/pan/position,/joint_states/tilt/position,/joint_states/pan/effort,"
        "/joint_states/tilt/effort",
        [1e-9 * STAMP_NS, GOOD.position, 0.9 * GOOD.position, GOOD.effort, 0.9 * GOOD.effort],
    )
    check(accepted(path), "pan", "tilt")


def test_where_no_heading_helps_the_command_says_what_it_wants(tmp_path: Path) -> None:
    columns = [GOOD.time_s, GOOD.position, GOOD.effort, GOOD.position, GOOD.effort]
    path = write(tmp_path / "letters.csv", "t,a,b,c,d", columns)
    options = edge_ident.inspect_recording(path).options
    assert options[-4:] == (
        "--column", "POSITION=x_position_rad", "--column", "EFFORT=x_torque_nm"
    )  # fmt: skip
    said = {"POSITION": "x_position_rad", "EFFORT": "x_torque_nm"}
    with pytest.raises(DataError, match="no column POSITION") as caught:
        edge_ident.load_recording(path, said)
    assert caught.value.next_step == "its columns are t, a, b, c, d"


@pytest.mark.parametrize(
    ("ending", "next_step"),
    [
        (".npy", "numpy.savez"),
    ],
)
def test_what_is_not_read_says_how_to_export_it(
    ending: str, next_step: str, tmp_path: Path
) -> None:
    path = tmp_path / f"joints{ending}"
    path.write_bytes(b"\x89MCAP0\r\n")
    with pytest.raises(DataError, match="which edge-ident does not read") as caught:
        edge_ident.load_recording(path)
    assert next_step in caught.value.next_step
