"""A survey of a folder: rows for all, one bad file stops nothing, what is done stays done."""

import json
import shutil
import sys
from collections.abc import Iterator
from pathlib import Path

import pandas as pd
import pytest

import edge_ident
from edge_ident.files.reading import ENDINGS
from edge_ident.fleet import workers
from edge_ident.fleet.result import Found
from edge_ident.fleet.survey import FOLDER, find_recordings
from edge_ident.fleet.workers import Task, run_processes


def test_every_file_has_its_row_and_the_bad_one_says_why(
    surveyed: tuple[edge_ident.Survey, Path],
) -> None:
    found, _ = surveyed
    names = [recording.file for recording in found.recordings]
    assert names == ["broken.csv", *(f"unit-{n:02d}.npz" for n in range(1, 9))]
    (broken,) = found.failed
    assert broken.failed is not None
    assert broken.failed.code == "data"
    assert broken.failed.next_step
    assert found.left_out == ("notes.md",)
    assert not found.trusted
    table = found.table()
    assert len(table["unit"]) == 1 + 8 * 2
    assert {len(column) for column in table.values()} == {17}


def test_the_unit_with_more_friction_stands_out_in_its_friction(
    surveyed: tuple[edge_ident.Survey, Path],
) -> None:
    found, _ = surveyed
    assert [
        (one.unit, one.comparison.axis, one.comparison.quantity) for one in found.standing_out
    ] == [("unit-01", "x", "coulomb_friction")]
    (out,) = found.standing_out
    assert out.comparison.centre == pytest.approx(out.found.value / 1.5, rel=0.1)
    table = found.table()
    row = [*zip(table["unit"], table["axis"], strict=True)].index(("unit-01", "x"))
    assert table["stands_out"][row] == "coulomb_friction"


def test_the_parameters_are_those_of_identify(
    surveyed: tuple[edge_ident.Survey, Path], fleet: Path
) -> None:
    found, _ = surveyed
    alone = edge_ident.identify(edge_ident.load_recording(fleet / "unit-03.npz")).axes["x"]
    inside = found.recordings[3].axes["x"]
    assert [value.value for value in inside.parameters.values()] == pytest.approx(
        alone.effective.parameters, rel=1e-9
    )
    assert inside.trusted == alone.trusted


def analysed(folder: Path, output: Path, **options: object) -> list[str]:
    """Files that a survey analyses, and does not take from the folder of results."""
    files: list[str] = []
    edge_ident.survey(
        folder,
        jobs=1,
        output=output,
        on_recording=lambda found: files.append(found.file),
        **options,
    )  # type: ignore[arg-type]
    return sorted(files)


def test_a_second_survey_does_what_is_missing_or_changed(fleet: Path, tmp_path: Path) -> None:
    folder, output = tmp_path / "units", tmp_path / "output"
    folder.mkdir()
    for number in (1, 2, 3):
        shutil.copy(fleet / f"unit-0{number}.npz", folder)
    assert len(analysed(folder, output)) == 3
    assert analysed(folder, output) == []
    shutil.copy(fleet / "unit-04.npz", folder / "unit-02.npz")  # another content
    shutil.copy(fleet / "unit-05.npz", folder / "unit-09.npz")  # another file
    assert analysed(folder, output) == ["unit-02.npz", "unit-09.npz"]
    (folder / "unit-01.npz").rename(folder / "renamed.npz")
    assert analysed(folder, output) == []
    for kept in (output / FOLDER).glob("*.json"):
        kept.write_text("{", encoding="utf-8")  # a damaged result is no result
    assert len(analysed(folder, output)) == 4
    options = edge_ident.ReadOptions(torque_constant=0.5)
    assert len(analysed(folder, output, options=options)) == 4


def test_what_failed_is_tried_again(fleet: Path, tmp_path: Path) -> None:
    folder = tmp_path / "units"
    folder.mkdir()
    shutil.copy(fleet / "broken.csv", folder)
    for _ in range(2):
        assert analysed(folder, tmp_path / "output") == ["broken.csv"]


def test_a_file_that_cannot_be_read_is_a_row(tmp_path: Path) -> None:
    """A process has no memory at address zero, so its memory cannot be read from the start."""
    (tmp_path / "a.npz").symlink_to("/proc/self/mem")
    (recording,) = edge_ident.survey(tmp_path, jobs=1).recordings
    assert recording.failed is not None
    assert recording.failed.code == "file"


def test_recordings_of_several_formats_and_of_subfolders(fleet: Path, tmp_path: Path) -> None:
    recording = edge_ident.load_recording(fleet / "unit-02.npz")
    for day in ("monday", "tuesday"):
        (tmp_path / day).mkdir()
        edge_ident.save_recording(recording, tmp_path / day / "press.csv")
    columns = pd.read_csv(tmp_path / "monday" / "press.csv", comment="#")
    columns.to_parquet(tmp_path / "monday" / "lathe.parquet")
    found = edge_ident.survey(tmp_path, jobs=2)
    assert found.trusted
    assert found.units == ("monday/lathe", "monday/press", "tuesday/press")
    by_day = edge_ident.survey(tmp_path, jobs=1, units="folder", pattern="press.*")
    assert by_day.units == ("monday", "tuesday")


def test_several_recordings_of_a_unit_become_one_value(fleet: Path, tmp_path: Path) -> None:
    (tmp_path / "press").mkdir()
    for number in (2, 3):
        shutil.copy(fleet / f"unit-0{number}.npz", tmp_path / "press")
    found = edge_ident.survey(tmp_path, jobs=1, units="folder")
    each = [recording.axes["x"].parameters["inertia"].value for recording in found.recordings]
    pooled = found.comparisons[0].units["press"]
    assert min(each) < pooled.value < max(each)
    assert pooled.distance is None  # one unit is too few


def test_every_format_that_is_read_is_taken(tmp_path: Path) -> None:
    for ending in ENDINGS:
        (tmp_path / f"PRESS{ending.upper()}").touch()
    found, left = find_recordings(tmp_path, "file", None, None)
    assert len(found) == len(ENDINGS)
    assert left == ()


def test_a_compressed_recording_is_of_the_unit_that_it_is_called_after(tmp_path: Path) -> None:
    (tmp_path / "press.csv.gz").touch()
    (tmp_path / "lathe.csv").touch()
    found, _ = find_recordings(tmp_path, "file", None, None)
    assert [one.unit for one in found] == ["lathe", "press"]


def test_results_and_hidden_files_are_no_recordings(tmp_path: Path) -> None:
    for name in (
        "a.csv",
        "A.CSV.bak",
        ".hidden/b.csv",
        "old/survey.json",
        "old/survey.csv",
        "out/c.csv",
    ):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).touch()
    found, left = find_recordings(tmp_path, "file", None, tmp_path / "out")
    assert [file.name for file in found] == ["a.csv"]
    assert left == ("A.CSV.bak",)


def test_units_of_equal_names_keep_their_endings(tmp_path: Path) -> None:
    for name in ("a.csv", "a.npz", "b.csv"):
        (tmp_path / name).touch()
    found, _ = find_recordings(tmp_path, "file", None, None)
    assert [file.unit for file in found] == ["a.csv", "a.npz", "b"]


@pytest.mark.parametrize(
    ("folder", "said"),
    [
        ("missing", "no such folder"),
        ("file.csv", "no such folder"),
        ("empty", "there is no recording"),
        (".", "in the folder for the results"),
    ],
)
def test_a_folder_without_recordings_is_refused(tmp_path: Path, folder: str, said: str) -> None:
    (tmp_path / "empty").mkdir()
    (tmp_path / "file.csv").touch()
    before = sorted(tmp_path.rglob("*"))
    output = tmp_path / folder / ("" if folder == "." else "results")
    with pytest.raises(edge_ident.DataError, match=said):
        edge_ident.survey(tmp_path / folder, output=output)
    assert sorted(tmp_path.rglob("*")) == before


# ---- processes

ECHO = """
import json, os, sys
for line in sys.stdin:
    file = json.loads(line)["file"]
    if "dies" in file:
        os.kill(os.getpid(), 9)
    if "leaves" in file:
        sys.exit(3)
    print(json.dumps({"file": file, "threads": os.environ["OMP_NUM_THREADS"]}), flush=True)
"""


@pytest.fixture
def echo(monkeypatch: pytest.MonkeyPatch) -> None:
    """Workers that tell what they were given, and die of some names."""
    monkeypatch.setattr(workers, "COMMAND", (sys.executable, "-c", ECHO))


def tasks(*names: str) -> Iterator[Task]:
    return (Task(Found(Path(name), name, name), "", name, {}) for name in names)


@pytest.mark.usefixtures("echo")
@pytest.mark.parametrize("jobs", [1, 2, 9])
def test_a_worker_that_dies_takes_down_its_recording_alone(jobs: int) -> None:
    names = ["a", "dies", "b", "leaves", "c", "dies too", "d"]
    outcomes = {task.found.name: document for task, document in run_processes(tasks(*names), jobs)}
    assert set(outcomes) == set(names)
    assert {outcomes[name]["file"] for name in "abcd"} == set("abcd")
    assert "Killed" in outcomes["dies"]["failed"]["cause"]
    assert "exit code 3" in outcomes["leaves"]["failed"]["cause"]
    assert outcomes["dies too"]["failed"]["code"] == "ended"


@pytest.mark.usefixtures("echo")
def test_each_worker_has_one_thread() -> None:
    ((_, document),) = run_processes(tasks("a"), 1)
    assert document["threads"] == "1"


@pytest.mark.usefixtures("echo")
def test_closing_ends_the_workers() -> None:
    outcomes = run_processes(tasks(*"abcdef"), 2)
    next(outcomes)
    outcomes.close()
    assert not [*outcomes]


def test_a_kept_result_is_the_result(surveyed: tuple[edge_ident.Survey, Path], fleet: Path) -> None:
    """What comes back from JSON is equal to what was found."""
    found, output = surveyed
    again = edge_ident.survey(fleet, jobs=1, output=output)
    assert again.recordings[1:] == found.recordings[1:]  # the first one failed, and was tried again
    assert again.comparisons == found.comparisons
    for file in (output / FOLDER).iterdir():
        assert json.loads(file.read_text("utf-8"))["schema"] == "edge-ident/survey-recording/1"
