"""The main job, end to end, through the command line: over memory, pseudo-terminal and TCP."""

import json
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from edge_ident.drive.description import drive_text
from edge_ident.signals.recording_files import load_recording
from firmware_interface.board import Board
from firmware_interface.connection import open_link
from firmware_interface.gains import CONSERVATIVE_GAINS
from firmware_interface.plant.feed_drive import FEED_DRIVE
from firmware_interface.registers import State
from tests.boards import served_board
from tests.processes import running
from tests.repetitions import a_few
from tests.short_runs import brief_drive

COMMAND = [sys.executable, "-m", "edge_ident"]


def edge_ident(*arguments: str | Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [*COMMAND, *map(str, arguments)], capture_output=True, text=True, timeout=120, check=False
    )


def telling_what_it_loads(*arguments: str | Path) -> subprocess.CompletedProcess[str]:
    """The same; the last line of its messages is a list of the heavy packages that it imported."""
    source = f"""
import sys
from edge_ident.cli import app
try:
    app({[*map(str, arguments)]!r})
except SystemExit as end:
    assert end.code == 0, end.code
print(sorted(set(sys.modules) & {{"torch", "onnx", "scipy", "matplotlib"}}), file=sys.stderr)
"""
    return subprocess.run(
        [sys.executable, "-c", source], capture_output=True, text=True, timeout=120, check=False
    )


@pytest.fixture(scope="module")
def brief(tmp_path_factory: pytest.TempPathFactory) -> list[str]:
    """Options: the same drive, on one period of 5.5 s."""
    file = tmp_path_factory.mktemp("drive") / "brief.toml"
    file.write_text(drive_text(brief_drive(), {}), encoding="utf-8")
    return ["--drive", str(file)]


@pytest.fixture(scope="module")
def whole_run(
    tmp_path_factory: pytest.TempPathFactory,
) -> tuple[subprocess.CompletedProcess[str], Path]:
    folder = tmp_path_factory.mktemp("run")
    done = telling_what_it_loads("run", "--device", "virtual", "--json", "--output", folder)
    assert done.returncode == 0, done.stderr
    return done, folder


@pytest.fixture(scope="module")
def virtual_run(whole_run: tuple[subprocess.CompletedProcess[str], Path]) -> tuple[dict, Path]:
    done, folder = whole_run
    return json.loads(done.stdout), folder


@pytest.mark.parametrize("axis", ["x", "z"])
def test_parameters_agree_with_the_plants_truth(virtual_run: tuple[dict, Path], axis: str) -> None:
    found = virtual_run[0]["identification"]["axes"][axis]
    truth = FEED_DRIVE[axis]
    parameters = found["parameters"]
    assert found["trusted"]
    for name in ("viscous_friction", "coulomb_friction"):
        assert parameters[name]["value"] == pytest.approx(getattr(truth, name), rel=0.03)
    inertia = parameters["inertia"]
    assert abs(inertia["value"] - truth.inertia) < 1.96 * inertia["std"]
    assert inertia["std"] < 0.05 * truth.inertia
    assert inertia["unit"] == "kg*m^2"


def test_the_virtual_board_identifies_by_itself_and_agrees(virtual_run: tuple[dict, Path]) -> None:
    said = virtual_run[0]["board_identification"]
    assert said["state"] == "DONE"
    for axis in said["axes"].values():
        assert axis["verdict"] == "agrees"
        for parameter in axis["parameters"].values():
            assert parameter["value"] == pytest.approx(parameter["recomputed"], rel=1e-6)
    assert "The board itself" in (virtual_run[1] / "report.html").read_text("utf-8")


def test_network_and_least_squares_stand_side_by_side(virtual_run: tuple[dict, Path]) -> None:
    for axis in virtual_run[0]["identification"]["axes"].values():
        assert axis["estimators"]["cnn"] is not None, axis["cnn_reason"]
        for name, value in axis["estimators"]["least_squares"].items():
            network = axis["estimators"]["cnn"][name]
            combined = np.hypot(network["std"], value["std"])
            assert abs(network["value"] - value["value"]) < 3 * combined


def test_new_gains_follow_at_least_five_times_better(virtual_run: tuple[dict, Path]) -> None:
    document, _ = virtual_run
    assert document["confirmed"]
    assert not document["stored"]
    for axis in document["verification"].values():
        assert axis["ratio"] > 5
    for design in document["designs"].values():
        assert design["phase_margin_deg"] >= 50
        assert design["gain_margin"] >= 2.5


def test_the_run_leaves_its_evidence(virtual_run: tuple[dict, Path]) -> None:
    document, folder = virtual_run
    assert json.loads((folder / "report.json").read_text()) == document
    backup = json.loads((folder / "gains_before.json").read_text())
    assert backup["axes"]["x"]["proportional"] == CONSERVATIVE_GAINS.proportional
    capture = load_recording(folder / "capture.npz")
    assert len(capture.time_s) == document["capture"]["samples"] == 8742
    assert load_recording(folder / "verification.npz").axes.keys() == {"x", "z"}
    assert "committed" in (folder / "log.txt").read_text()


def test_a_recorded_capture_is_identified_alike(virtual_run: tuple[dict, Path]) -> None:
    document, folder = virtual_run
    done = edge_ident("identify", folder / "capture.npz", "--json")
    assert done.returncode == 0, done.stderr
    again = json.loads(done.stdout)
    assert again["schema"] == "edge-ident/identification/2"
    assert {"load", "signals", "cnn", "estimate", "total"} <= again["timing_ms"].keys()
    for axis, found in document["identification"]["axes"].items():
        for name, value in found["parameters"].items():
            assert again["axes"][axis]["parameters"][name]["value"] == pytest.approx(value["value"])


def test_a_run_repeats_to_the_last_bit(virtual_run: tuple[dict, Path], tmp_path: Path) -> None:
    again = edge_ident("run", "--device", "virtual", "--dry-run", "--json", "--output", tmp_path)
    first = virtual_run[0]["identification"]["axes"]
    second = json.loads(again.stdout)["identification"]["axes"]
    assert first["x"]["parameters"] == second["x"]["parameters"]


@pytest.mark.parametrize("where", a_few(["pty=True", "tcp_port=0"], ["pty=True"]))
def test_the_same_over_a_real_line(where: str, brief: list[str], tmp_path: Path) -> None:
    with served_board(where) as device:
        done = edge_ident("run", "--device", device, "--json", "--output", tmp_path, *brief)
        assert done.returncode == 0, done.stderr
        document = json.loads(done.stdout)
        assert document["confirmed"]
        assert document["capture"]["samples"] == 2185
        board = Board.connect(open_link(device))
        designed = document["designs"]["x"]["gains"]["proportional"]
        assert board.active_gains()["x"].proportional == np.float32(designed)
        assert board.status().state is State.IDLE


def test_one_period_in_real_time_arrives_whole(brief: list[str], tmp_path: Path) -> None:
    with served_board(speed=1.0) as device:
        done = edge_ident("capture", "--device", device, "--json", "--output", tmp_path, *brief)
    assert done.returncode == 0, done.stderr
    document = json.loads(done.stdout)
    assert (document["samples"], document["pages"]) == (2185, 157)
    steps = np.diff(load_recording(Path(document["file"])).axes["x"].position)
    assert np.max(np.abs(steps)) < 2.5 * 1.806 * 0.0025  # no gap: nowhere faster than the motion


def test_dry_run_writes_nothing(tmp_path: Path) -> None:
    with served_board() as device:
        done = edge_ident("run", "--device", device, "--dry-run", "--json", "--output", tmp_path)
        assert done.returncode == 0, done.stderr
        document = json.loads(done.stdout)
        assert document["designs"]["x"]["gains"]["proportional"] > 30
        assert document["verification"] is None
        assert document["dry_run"]
        for axis in ("x", "z"):
            ((motion, promised),) = document["promise"][axis].items()
            assert motion == "sinusoid"
            assert promised["improvement"] > 0.8
            low, high = promised["interval"]["rms_rad"]
            assert low <= promised["after"]["rms_rad"] <= high < promised["now"]["rms_rad"]
            untried = [promised[field] for field in ("tried", "measured", "kept")]
            assert untried == [False, None, None]
        board = Board.connect(open_link(device))
        assert board.active_gains()["x"].proportional == CONSERVATIVE_GAINS.proportional


@pytest.mark.thorough
def test_other_motions_and_cycles(brief: list[str], tmp_path: Path) -> None:
    done = edge_ident(
        "run", "--device", "virtual", "--dry-run", "--motion", "multisine", "--json",
        "--output", tmp_path,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    axis = json.loads(done.stdout)["identification"]["axes"]["x"]
    truth = FEED_DRIVE["x"]
    assert axis["estimators"]["cnn"] is None
    assert "the axis moved otherwise than the network was trained for" in axis["cnn_reason"]
    assert axis["parameters"]["inertia"]["value"] == pytest.approx(truth.inertia, rel=0.02)
    for motion, cycles in (("staircase", ()), ("sinusoid", ("--cycles", "2"))):
        done = edge_ident(
            "capture", "--device", "virtual", "--motion", motion, *cycles,
            "--output", tmp_path / motion, *brief,
        )  # fmt: skip
        assert done.returncode == 0, done.stderr
    assert len(load_recording(tmp_path / "sinusoid" / "capture.npz").time_s) == 4371


@pytest.mark.parametrize(
    ("progress", "ending"),
    a_few(
        [
            ("motion", signal.SIGINT),
            ("motion", signal.SIGTERM),
            ("verification", signal.SIGINT),
            ("verification", signal.SIGHUP),
        ],
        [("motion", signal.SIGTERM), ("verification", signal.SIGINT)],
    ),
)
def test_interrupt_leaves_the_machine_stopped_and_the_gains_old(
    progress: str, ending: signal.Signals, brief: list[str], tmp_path: Path
) -> None:
    command = [*COMMAND, "run", *brief, "--output", str(tmp_path), "--device"]
    with served_board(speed=5.0) as device, running([*command, device]) as process:
        wanted = {"motion": "motion started", "verification": "gains committed"}[progress]
        log, deadline = tmp_path / "log.txt", time.monotonic() + 120
        while not log.is_file() or wanted not in log.read_text():
            assert time.monotonic() < deadline
            time.sleep(0.02)
        time.sleep(0.5)
        process.send_signal(ending)
        process.communicate(timeout=60)
        assert process.returncode == 130
        board = Board.connect(open_link(device))
        status = board.status()
        assert status.state is State.IDLE
        assert not status.unconfirmed
        assert board.active_gains()["x"].numbers() == pytest.approx(
            CONSERVATIVE_GAINS.numbers(), rel=1e-6
        )


def test_heavy_packages_stay_unimported(
    whole_run: tuple[subprocess.CompletedProcess[str], Path],
) -> None:
    done, folder = whole_run
    identified = telling_what_it_loads("identify", folder / "capture.npz", "--json")
    for one in (done, identified):
        assert one.returncode == 0, one.stderr
        assert one.stderr.splitlines()[-1] == "[]"


def test_stop_and_clear_fault() -> None:
    with served_board(settings="fault=Fault.FOLLOWING_ERROR") as device:
        cleared = edge_ident("clear-fault", "--device", device)
        assert cleared.returncode == 0, cleared.stderr
        assert cleared.stdout.strip() == "IDLE"
        assert "FOLLOWING_ERROR" in cleared.stderr
        again = edge_ident("clear-fault", "--device", device)
        assert (again.returncode, again.stdout.strip()) == (0, "IDLE")
        assert "no fault" in again.stderr
        stopped = edge_ident("stop", "--device", device, "--json")
        assert json.loads(stopped.stdout)["state"] == "IDLE"


@pytest.mark.thorough
def test_a_run_cleans_up_after_a_host_that_died(brief: list[str], tmp_path: Path) -> None:
    with served_board() as device:
        link = open_link(device)
        board = Board.connect(link)
        board.stage_gains(dict.fromkeys(("x", "z"), replace(CONSERVATIVE_GAINS, proportional=35.0)))
        board.commit()
        link.close()  # neither confirmed nor rolled back
        done = edge_ident(
            "run", "--device", device, "--dry-run", "--json", "--output", tmp_path, *brief
        )
        assert done.returncode == 0, done.stderr
        assert json.loads(done.stdout)["gains_before"]["x"]["proportional"] == 30.0


@pytest.mark.parametrize("where", [["--pty"], ["--tcp", "0"]])
def test_the_board_command_serves_until_interrupted(where: list[str]) -> None:
    with running([*COMMAND, "board", *where, "--speed", "max"]) as process:
        assert process.stdout is not None
        device = process.stdout.readline().strip()
        assert Board.connect(open_link(device)).status().state is State.IDLE
        process.send_signal(signal.SIGINT)
        _, errors = process.communicate(timeout=10)
    assert process.returncode == 0, errors
    assert "Traceback" not in errors
