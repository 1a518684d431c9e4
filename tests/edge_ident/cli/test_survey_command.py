"""The command survey: results in a folder, exit codes, Ctrl-C keeps what is finished."""

import csv
import json
import os
import shutil
import signal
import sys
import time
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from typer.testing import CliRunner, Result

import edge_ident
from edge_ident.cli import app
from edge_ident.fleet.survey import FOLDER
from edge_ident.report.survey import with_std
from tests.processes import running


def run(*arguments: object, **environment: str) -> Result:
    return CliRunner().invoke(app, ["survey", *map(str, arguments)], env=environment)


@pytest.fixture(scope="module")
def sound(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("sound")
    for seed in (1, 2):
        recording = edge_ident.simulate(
            edge_ident.reduced_model(), "multisine", noise=0.01, seed=seed
        )
        edge_ident.save_recording(recording, folder / f"press-{seed}.csv")
    return folder


def test_a_sound_folder_gives_table_page_and_document(sound: Path, tmp_path: Path) -> None:
    output = tmp_path / "out"
    done = run(sound, "-o", output, "--json", "--jobs", 1)
    assert done.exit_code == 0, done.stderr
    document = json.loads(done.stdout)
    assert document["schema"] == "edge-ident/survey/1"
    assert json.loads((output / "survey.json").read_text("utf-8")) == document
    assert document["trusted"]
    assert document["standing_out"] == []
    assert [one["unit"] for one in document["recordings"]] == ["press-1", "press-2"]
    assert "too few" in document["conclusion"]
    with (output / "survey.csv").open(newline="") as file:
        rows = [*csv.DictReader(file)]
    assert [(row["unit"], row["axis"], row["trusted"]) for row in rows] == [
        (unit, axis, "True") for unit in ("press-1", "press-2") for axis in ("x", "z")
    ]
    assert float(rows[0]["inertia"]) == pytest.approx(0.43, rel=0.02)
    assert "press-1" in (output / "report.html").read_text("utf-8")


def test_the_table_is_the_same_as_parquet(sound: Path, tmp_path: Path) -> None:
    (tmp_path / "in").mkdir()
    shutil.copy(sound / "press-1.csv", tmp_path / "in")
    (tmp_path / "in" / "bad.csv").write_text("nothing\n", encoding="utf-8")
    assert run(tmp_path / "in", "-o", tmp_path / "out", "-q", "-j", 1).exit_code == 1
    text = pd.read_csv(tmp_path / "out" / "survey.csv")
    binary = pd.read_parquet(tmp_path / "out" / "survey.parquet")
    assert list(text.columns) == list(binary.columns)
    assert binary["inertia"].dtype == float
    pd.testing.assert_series_equal(text["inertia"], binary["inertia"])
    assert list(text["error_code"].dropna()) == list(binary["error_code"].dropna()) == ["data"]


def test_without_output_the_results_lie_in_the_folder(sound: Path, tmp_path: Path) -> None:
    shutil.copytree(sound, tmp_path / "in")
    assert run(tmp_path / "in", "-q", "-j", 1).exit_code == 0
    assert (tmp_path / "in" / "edge-ident-survey" / "report.html").is_file()
    again = run(tmp_path / "in", "-v", "-j", 1)
    assert again.exit_code == 0
    assert "press-1.csv: " not in again.stderr  # its result is taken, and the results are not read
    assert "press-1" in again.stdout


def test_quiet_says_nothing_but_the_result(sound: Path, tmp_path: Path) -> None:
    done = run(sound, "-o", tmp_path, "-q", "-j", 1)
    assert done.stderr == ""
    assert "press-2" in done.stdout


def test_a_bad_file_is_told_with_its_next_step(sound: Path, tmp_path: Path) -> None:
    shutil.copytree(sound, tmp_path / "in")
    (tmp_path / "in" / "bad.csv").write_text("time_s,x_position_rad\n0,1\n", encoding="utf-8")
    done = run(tmp_path / "in", "-j", 1)
    assert done.exit_code == 1
    assert "bad.csv: no result" in done.stdout
    assert "next: " in done.stdout


def test_only_bad_files_end_with_the_code_of_a_bad_file(tmp_path: Path) -> None:
    (tmp_path / "bad.csv").write_text("nothing\n", encoding="utf-8")
    assert run(tmp_path, "-j", 1).exit_code == 5
    assert (tmp_path / "edge-ident-survey" / "survey.csv").is_file()


def test_a_missing_folder_and_a_folder_that_cannot_be_written(sound: Path, tmp_path: Path) -> None:
    done = run(tmp_path / "none", "--json")
    assert (done.exit_code, json.loads(done.stdout)["code"]) == (5, "data")
    (tmp_path / "file").touch()
    done = run(sound, "-o", tmp_path / "file" / "out", "--json")
    assert (done.exit_code, json.loads(done.stdout)["code"]) == (5, "file")
    assert "choose another place" in json.loads(done.stdout)["next_step"]


def test_what_is_said_of_the_files_holds_for_all(sound: Path, tmp_path: Path) -> None:
    for file in sound.glob("*.csv"):
        text = file.read_text("utf-8").replace("x_position_rad", "A").replace("x_torque_nm", "B")
        lines = (line for line in text.splitlines() if not line.startswith("#"))
        (tmp_path / file.name).write_text("\n".join(lines) + "\n", encoding="utf-8")
    named = ("--column", "A=x_position_rad", "--column", "B=x_torque_nm", "-j", 1)
    assert run(tmp_path, *named).exit_code == 0
    without = run(tmp_path, "-j", 1, "--json")
    axes = [set(one["axes"]) for one in json.loads(without.stdout)["recordings"]]
    assert axes != [{"x", "z"}] * 2


def test_a_unit_that_stands_out_is_on_the_page_and_in_the_document(
    sound: Path, tmp_path: Path
) -> None:
    """Eight units from the first recording; the effort of one is a tenth larger."""
    recording = edge_ident.load_recording(sound / "press-1.csv")
    rng = np.random.default_rng(3)
    for number in range(8):
        factor = 1.2 if number == 0 else 1.0 + 0.004 * rng.standard_normal()
        axis = recording.axes["x"]
        scaled = edge_ident.AxisRecord(axis.position, factor * axis.effort, "rad", "N*m")
        made = edge_ident.Recording(recording.time_s, {"x": scaled}, "made")
        edge_ident.save_recording(made, tmp_path / "in" / f"unit-{number}.npz")
    done = run(tmp_path / "in", "-o", tmp_path / "out", "--json", "-q", "-j", 2)
    document = json.loads(done.stdout)
    assert {one["unit"] for one in document["standing_out"]} == {"unit-0"}
    assert document["conclusion"] == "One of 8 units stands out: unit-0."
    assert {one["quantity"] for one in document["standing_out"]} >= {"inertia", "coulomb_friction"}
    lines = run(tmp_path / "in", "-o", tmp_path / "out", "-q", "-j", 1).stdout.splitlines()
    assert lines[0] == document["conclusion"]
    assert lines[-1] == "every value is in survey.csv"
    assert len(lines) <= 20
    assert lines[1].startswith("  unit-0: ")
    shown = str(edge_ident.survey(tmp_path / "in", output=tmp_path / "out", jobs=1)).splitlines()
    marked, *others = (line for line in shown if "unit-" in line and "│" in line)
    assert "unit-0" in marked
    assert "stands out: " in marked
    assert not any("stands out" in line for line in others)


def test_deviations_have_two_digits() -> None:
    assert with_std(0.42861, 0.00139) == "0.4286 ± 0.0014"
    assert with_std(1.4, 0.00096) == "1.40000 ± 0.00096"
    assert with_std(-12345.6, 123.4) == "−12346 ± 123"
    assert with_std(1.0, None) == "1"
    assert with_std(1.0, 1.23e-9) == "1"


def test_ctrl_c_ends_the_workers_and_keeps_what_is_finished(sound: Path, tmp_path: Path) -> None:
    folder, kept = tmp_path / "in", tmp_path / "out" / FOLDER
    folder.mkdir()
    shutil.copy(sound / "press-1.csv", folder / "a.csv")
    time_s = 1e-4 * np.arange(2_000_000)
    speed, acceleration = np.cos(time_s), -np.sin(time_s)
    effort = 0.4 * acceleration + 0.9 * speed + 1.4 * np.sign(speed)
    long = edge_ident.AxisRecord(np.sin(time_s), effort, "rad", "N*m")
    for name in "bcd":
        edge_ident.save_recording(
            edge_ident.Recording(time_s, {name: long}, "long"), folder / f"{name}.npz"
        )
    command = [sys.executable, "-m", "edge_ident", "survey", str(folder), "-j", "1"]
    with running([*command, "-o", str(tmp_path / "out")]) as process:
        while not [*kept.glob("[!.]*.json")]:  # none that is still being written
            assert process.poll() is None, process.communicate()
            time.sleep(0.01)
        workers = children(process.pid)
        process.send_signal(signal.SIGINT)
        _, errors = process.communicate(timeout=60)
    assert process.returncode == 130
    assert "interrupted" in errors
    assert "Traceback" not in errors
    assert workers
    assert not any(Path(f"/proc/{pid}").exists() for pid in workers)
    assert len([*kept.glob("*.json")]) == 1
    for name in "bcd":
        (folder / f"{name}.npz").unlink()
    again = run(folder, "-o", tmp_path / "out", "-v", "-j", 1)
    assert again.exit_code == 0
    assert "a.csv: " not in again.stderr


def children(parent: int) -> list[int]:
    found = []
    for status in Path("/proc").glob("[0-9]*/stat"):
        try:
            fields = status.read_text().rpartition(")")[2].split()
        except OSError:  # it has ended
            continue
        if int(fields[1]) == parent:
            found.append(int(status.parent.name))
    return found


def test_a_cluster_needs_its_extra(
    sound: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    done = run(sound, "-o", tmp_path, "--cluster", "tcp://127.0.0.1:9")
    assert done.exit_code == 5
    assert "edge-ident[cluster]" in done.stderr
    assert os.listdir(tmp_path) == []
