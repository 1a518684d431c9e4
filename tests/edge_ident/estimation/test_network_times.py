"""Which way to run a network a machine takes, and that it measures once."""

import json
from collections.abc import Callable
from pathlib import Path

import pytest

from edge_ident.estimation.network import Way, fastest, load_network, times_of

RANK_ONE: Way = ("fp32", "rank_one")
IMAGE: Way = ("fp32", "image")
INT8: Way = ("int8", "rank_one")


class Ways:
    """Two ways, and how often they were got ready."""

    def __init__(self) -> None:
        self.asked = 0

    def __call__(self) -> dict[Way, Callable[[], object]]:
        self.asked += 1
        return {RANK_ONE: lambda: None, IMAGE: lambda: None}


@pytest.fixture
def file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    return tmp_path / "edge-ident" / "network_times.json"


@pytest.mark.parametrize(
    ("times", "chosen"),
    [
        ({RANK_ONE: 1.0, IMAGE: 2.0, INT8: 0.9}, RANK_ONE),
        ({RANK_ONE: 1.0, IMAGE: 2.0, INT8: 0.7}, INT8),
        ({RANK_ONE: 2.0, IMAGE: 1.0, INT8: 0.9}, IMAGE),
        ({IMAGE: 1.0}, IMAGE),
    ],
)
def test_a_later_way_is_taken_where_it_is_faster_by_a_fifth(
    times: dict[Way, float], chosen: Way
) -> None:
    assert fastest(times) == chosen


def test_a_machine_measures_once(file: Path) -> None:
    ways = Ways()
    first = times_of({"fp32": "abc"}, ways)
    assert list(first) == [RANK_ONE, IMAGE]
    assert times_of({"fp32": "abc"}, ways) == first
    assert ways.asked == 1
    times_of({"fp32": "def"}, ways)
    assert ways.asked == 2
    assert times_of({"fp32": "abc"}, ways) == first


@pytest.mark.parametrize(
    "spoilt", ["", "[]", "{}", '{"schema": "edge-ident/network-times/9", "machines": {}}']
)
def test_a_file_that_says_nothing_is_written_anew(file: Path, spoilt: str) -> None:
    ways = Ways()
    file.parent.mkdir()
    file.write_text(spoilt)
    times = times_of({"fp32": "abc"}, ways)
    assert times_of({"fp32": "abc"}, ways) == times
    assert ways.asked == 1


@pytest.mark.parametrize(
    "entry",
    [
        None,
        3,
        [["fp32", "image"]],
        [["int8", "image", 1.0]],
        [["fp32", "image", -1.0]],
        [["fp32", "image", "1"]],
    ],
)
def test_times_that_somebody_changed_are_measured_anew(file: Path, entry: object) -> None:
    ways = Ways()
    times_of({"fp32": "abc"}, ways)
    document = json.loads(file.read_text())
    for networks in document["machines"].values():
        networks["abc"] = entry
    file.write_text(json.dumps(document))
    assert list(times_of({"fp32": "abc"}, ways)) == [RANK_ONE, IMAGE]
    assert ways.asked == 2


def test_without_a_folder_to_write_to_it_goes_on(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    occupied = tmp_path / "a_file"
    occupied.write_text("")
    monkeypatch.setenv("XDG_CACHE_HOME", str(occupied))
    ways = Ways()
    for asked in (1, 2):
        assert list(times_of({"fp32": "abc"}, ways)) == [RANK_ONE, IMAGE]
        assert ways.asked == asked


@pytest.mark.parametrize("way", [RANK_ONE, IMAGE, INT8])
def test_the_network_is_run_as_was_remembered(file: Path, way: Way) -> None:
    load_network("fastest")
    document = json.loads(file.read_text())
    for networks in document["machines"].values():
        for times in networks.values():
            for time in times:
                time[2] = 1.0 if tuple(time[:2]) == way else 10.0
    file.write_text(json.dumps(document))
    network = load_network("fastest")
    assert (network.variant, network.graph) == way
