"""A motion file is read back as it was written, and refused where a board could not follow it."""

import json
from pathlib import Path

import pytest

from edge_ident.drive.description import load_drive
from edge_ident.drive.motions import (
    MOTIONS,
    MotionName,
    load_motion,
    motion_document,
    named_trajectory,
    save_motion,
)
from edge_ident.errors import DataError


@pytest.mark.parametrize("name", MOTIONS)
def test_a_motion_is_read_back_to_the_last_bit(name: MotionName, tmp_path: Path) -> None:
    trajectory = named_trajectory(load_drive(), name)
    save_motion(trajectory, tmp_path / "new" / "motion.json")
    assert load_motion(tmp_path / "new" / "motion.json") == trajectory


def test_it_names_its_schema() -> None:
    assert motion_document(load_drive().trajectory())["schema"] == "edge-ident/motion/1"


def damaged(change) -> str:
    document = json.loads(json.dumps(motion_document(named_trajectory(load_drive(), "multisine"))))
    change(document)
    return json.dumps(document)


CASES = {
    "no JSON": ("{", "no JSON"),
    "another document": ('{"schema": "edge-ident/model/1"}', "its schema is not"),
    "no duration": (damaged(lambda d: d.pop("duration_s")), "duration_s is missing"),
    "not a number": (damaged(lambda d: d.update(lead_in_s="5")), "lead_in_s is '5'"),
    "an endless motion": (damaged(lambda d: d.update(duration_s=1e9)), "duration_s is"),
    "no axis": (damaged(lambda d: d.update(axes={})), "all of one kind"),
    "no lines": (damaged(lambda d: d["axes"]["x"].update(components=[])), "0 components"),
    "too many lines": (
        damaged(lambda d: d["axes"]["x"].update(components=9 * d["axes"]["x"]["components"][:1])),
        "9 components, a board takes 1 to 8",
    ),
    "two kinds": (
        damaged(
            lambda d: d["axes"].update(
                z={"speeds_rad_s": [1.0], "dwell_s": 1.0, "acceleration_rad_s2": 1.0}
            )
        ),
        "all of one kind",
    ),
    "axes in a list": (damaged(lambda d: d.update(axes=[1])), "axes is .1., and must be an object"),
    "an axis of text": (damaged(lambda d: d["axes"].update(x="y")), "axes.x is 'y', and must be"),
    "lines of text": (
        damaged(lambda d: d["axes"]["x"].update(components="abc")),
        "axes.x.components is 'abc', and must be a list",
    ),
    "lines of nothing": (
        damaged(lambda d: d["axes"]["x"].update(components=None)),
        "axes.x.components is None, and must be a list",
    ),
    "a line of text": (
        damaged(lambda d: d["axes"]["x"].update(components=["abc"])),
        r"axes.x.components\[0\] is 'abc', and must be an object",
    ),
    "a line without an amplitude": (
        damaged(lambda d: d["axes"]["x"]["components"][0].pop("amplitude_rad")),
        r"axes.x.components\[0\].amplitude_rad is missing",
    ),
    "a frequency whose square is none": (
        damaged(lambda d: d["axes"]["x"]["components"][0].update(angular_frequency_rad_s=1e300)),
        "angular_frequency_rad_s is 1e.300, and must be a number from -100000 to 100000",
    ),
    "neither lines nor a staircase": (
        damaged(lambda d: d["axes"].update(x={})),
        "axes.x.speeds_rad_s is missing",
    ),
}


@pytest.mark.parametrize("case", CASES)
def test_a_damaged_file_is_refused_with_its_mistake(case: str, tmp_path: Path) -> None:
    text, cause = CASES[case]
    path = tmp_path / "motion.json"
    path.write_text(text)
    with pytest.raises(DataError, match=cause) as error:
        load_motion(path)
    assert "edge-ident plan" in error.value.next_step


def test_a_missing_file_is_refused(tmp_path: Path) -> None:
    with pytest.raises(DataError, match="no such file"):
        load_motion(tmp_path / "none.json")
