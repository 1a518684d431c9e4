"""What every command does in a terminal, in a pipe and for a script."""

import errno
import json
import os
import re
import sys
from pathlib import Path
from threading import Event

import pytest
import typer
from rich.console import Console
from typer.testing import CliRunner, Result

import edge_ident
from edge_ident.cli import app, messages
from edge_ident.cli.messages import Progress, ProgressLines, Verbosity, shown_progress, telling
from edge_ident.support.console import FittingTable

KERNELS = Path("/sys/kernel")
"""On Linux a folder of the kernel's own, in which not even root makes one."""
MOTION = ("simulate", "--cycles", "1")


def run(*arguments: object, **environment: str) -> Result:
    return CliRunner().invoke(app, [*map(str, arguments)], env=environment)


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("recordings") / "rec.npz"
    edge_ident.save_recording(edge_ident.simulate(motion="sinusoid"), path)
    return path


def every_command() -> list[tuple[str, ...]]:
    def below(command: object, path: tuple[str, ...]) -> list[tuple[str, ...]]:
        subs = getattr(command, "commands", {})
        return [path, *(found for name, sub in subs.items() for found in below(sub, (*path, name)))]

    return below(typer.main.get_command(app), ())


# ---- help


@pytest.mark.parametrize("command", every_command(), ids=" ".join)
def test_help_is_whole_and_has_an_example(command: tuple[str, ...]) -> None:
    done = run(*command, "--help", COLUMNS="60")
    assert done.exit_code == 0
    assert "..." not in done.stdout.replace("[ARGS]...", "").replace("{FILE}...", "")
    assert "\n  Example:\n    edge-ident" in done.stdout
    if "--output" in done.stdout:
        assert re.search(r"-o, --output (FOLDER|FILE)\b", done.stdout)


def test_run_capture_and_simulate_know_the_same_motions(tmp_path: Path) -> None:
    for command in ("run", "capture", "simulate"):
        assert "sinusoid|multisine|staircase" in run(command, "--help").stdout
    documents = [
        json.loads(run(*MOTION, "--motion", name, "-o", tmp_path / f"{name}.npz", "--json").stdout)
        for name in ("sinusoid", "paper")  # paper is the old name
    ]
    assert documents[0]["axes"] == documents[1]["axes"]


# ---- tables


def printed(table: FittingTable, width: int) -> str:
    console = Console(width=width, record=True, file=open(os.devnull, "w"))  # noqa: SIM115
    console.print(table, crop=False, overflow="fold")
    return console.export_text()


def table_of(numbers: list[str]) -> FittingTable:
    table = FittingTable(title="axis x")
    table.add_column("parameter")
    for index in range(len(numbers)):
        table.add_column(f"column {index}", justify="right")
    table.add_row("viscous friction of the axis", *numbers)
    return table


@pytest.mark.parametrize("width", [40, 60, 80, 200])
@pytest.mark.parametrize("count", [1, 4, 9])
def test_a_table_cuts_no_number_at_any_width(count: int, width: int) -> None:
    numbers = [f"{index}.{'123456789'[: index + 1]}e-05" for index in range(count)]
    text = printed(table_of(numbers), width)
    assert "…" not in text
    for number in numbers:
        assert number in text
    assert max(map(len, text.splitlines())) <= width


@pytest.mark.parametrize("columns", [60, 80])
@pytest.mark.parametrize("command", ["identify", "compare", "gains"])
def test_the_tables_of_a_recording_fit(command: str, columns: int, recording: Path) -> None:
    more = ["--method", "least_squares"] if command == "compare" else []
    done = run(command, recording, *more, COLUMNS=str(columns))
    assert done.exit_code == 0, done.stderr
    assert "…" not in done.stdout
    tables = [line for line in done.stdout.splitlines() if re.match("[┏┃┡│└]", line)]
    assert all(len(line.rstrip()) <= columns for line in tables)


# ---- how much is told


def test_quiet_leaves_the_result_and_errors(recording: Path, tmp_path: Path) -> None:
    for arguments in (("--quiet", *MOTION), (*MOTION, "-q")):
        done = run(*arguments, "-o", tmp_path / "q.csv")
        assert (done.stdout, done.stderr) == (f"{tmp_path / 'q.csv'}\n", "")
    done = run("-q", "identify", tmp_path / "none.csv")
    assert done.exit_code == 5
    assert done.stderr.startswith("error: ")


def test_verbose_tells_what_took_how_long(tmp_path: Path) -> None:
    for arguments in (("--verbose", *MOTION), (*MOTION, "-v")):
        done = run(*arguments, "-o", tmp_path / "v.csv")
        assert re.search(r"^simulating full: \d+\.\d\d s$", done.stderr, re.MULTILINE)
        assert re.search(r"^done in \d+\.\d\d s$", done.stderr, re.MULTILINE)
    assert run("-q", *MOTION, "-v", "-o", tmp_path / "v.csv").exit_code == 2


class Clock:
    """Time that passes when the test says so."""

    def __init__(self) -> None:
        self.now_s = 100.0

    def monotonic(self) -> float:
        return self.now_s


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    """The clock of progress."""
    clock = Clock()
    monkeypatch.setattr(messages, "time", clock)
    return clock


def test_without_a_terminal_a_line_of_progress_comes_every_few_seconds(
    clock: Clock, capsys: pytest.CaptureFixture[str]
) -> None:
    with shown_progress() as shown:
        assert isinstance(shown, ProgressLines)
        for done in range(0, 101, 10):
            shown.show("training", done, 100)
            clock.now_s += 1.0
    lines = capsys.readouterr().err.splitlines()
    assert lines == ["training: 50 of 100, 5 s left", "training: 100 of 100"]


def test_what_counts_nothing_says_every_few_seconds_that_it_goes_on(
    clock: Clock, capsys: pytest.CaptureFixture[str]
) -> None:
    with shown_progress() as shown:
        assert isinstance(shown, ProgressLines)
        shown.beat()
        shown.stage("diagnosis")
        for _ in range(12):
            clock.now_s += 1.0
            shown.beat()
    assert capsys.readouterr().err.splitlines() == [
        "diagnosis: 5 s so far", "diagnosis: 10 s so far"
    ]  # fmt: skip


def test_between_two_counts_the_last_one_is_said_with_the_time_that_is_left(
    clock: Clock, capsys: pytest.CaptureFixture[str]
) -> None:
    with shown_progress() as shown:
        assert isinstance(shown, ProgressLines)
        shown.show("gains", 0, 3)
        for done in range(1, 4):
            for _ in range(2):
                clock.now_s += 5.0
                shown.beat()
            shown.show("gains", done, 3)
    assert capsys.readouterr().err.splitlines() == [
        "gains: 5 s so far", "gains: 10 s so far",
        "gains: 1 of 3, 15 s left", "gains: 1 of 3, 10 s left",
        "gains: 2 of 3, 5 s left", "gains: 2 of 3, 0 s left",
    ]  # fmt: skip


def test_a_step_that_takes_longer_than_the_estimate_has_no_time_left(
    clock: Clock, capsys: pytest.CaptureFixture[str]
) -> None:
    """The first of two axes may be blocked at once, and the second searched for a minute."""
    with shown_progress() as shown:
        assert isinstance(shown, ProgressLines)
        shown.show("diagnosis", 0, 2)
        clock.now_s += 2.0
        shown.show("diagnosis", 1, 2)
        for _ in range(2):
            clock.now_s += 5.0
            shown.beat()
    assert capsys.readouterr().err.splitlines() == ["diagnosis: 1 of 2", "diagnosis: 1 of 2"]


def test_lines_appear_while_the_command_itself_tells_nothing(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """As for a million samples, whose preparation is one long computation."""
    monkeypatch.setattr(messages, "LINE_EVERY_S", 0.01)
    said, twice = list[str](), Event()

    def say(message: str) -> None:
        said.append(message)
        if len(said) > 1:
            twice.set()

    monkeypatch.setattr(messages, "say", say)
    with shown_progress() as shown:
        shown.stage("diagnosis")
        assert twice.wait(60.0)
    assert said[-1].startswith("diagnosis: ")


def test_the_time_that_is_left_does_not_count_the_lead_in(
    clock: Clock, capsys: pytest.CaptureFixture[str]
) -> None:
    with shown_progress() as shown:
        shown.stage("motion")
        clock.now_s += 5.0
        for in_hand in (10, 60, 110):
            shown.samples(in_hand, 210)
            clock.now_s += 5.0
    lines = capsys.readouterr().err.splitlines()
    assert lines == [
        "motion: 10 of 210", "motion: 60 of 210, 15 s left", "motion: 110 of 210, 10 s left"
    ]  # fmt: skip


def test_quiet_shows_no_progress(clock: Clock, capsys: pytest.CaptureFixture[str]) -> None:
    with telling(Verbosity(quiet=True)), shown_progress() as shown:
        assert type(shown) is Progress
        shown.stage("training")
        clock.now_s += 60.0
        shown.samples(1, 2)
    assert capsys.readouterr().err == ""


@pytest.mark.parametrize(("seconds", "text"), [(42.4, "42 s"), (150.0, "2 min"), (9000.0, "2.5 h")])
def test_the_time_that_is_left_has_a_unit_of_its_size(seconds: float, text: str) -> None:
    assert messages.duration(seconds) == text


# ---- errors


def one_document(done: Result, code: str, exit_code: int) -> None:
    document = json.loads(done.stdout)
    assert document["schema"] == "edge-ident/error/1"
    assert (document["code"], document["exit_code"]) == (code, exit_code)
    assert document["message"]
    assert document["next_step"]
    assert done.exit_code == exit_code


@pytest.mark.parametrize(
    "arguments",
    [
        ("identify", "--json"),
        ("identify", "a.csv", "--json", "--precision", "fp64"),
        ("simulate", "--json", "-o", "rec.txt"),
        ("unheard-of", "--json"),
        ("--json", "identify", "a.csv"),
        ("gains", "show", "--json", "--baud-rate", "x"),
        ("gains", "show", "--json"),
    ],
)
def test_a_usage_error_is_one_document_too(arguments: tuple[str, ...]) -> None:
    one_document(run(*arguments), "usage", 2)


@pytest.mark.skipif(not KERNELS.is_dir(), reason="no folder here is closed to root too")
def test_a_folder_that_may_not_be_written_is_a_file_error(recording: Path) -> None:
    one_document(run("identify", recording, "-o", KERNELS / "out", "--json"), "file", 5)


@pytest.mark.parametrize("command", ["identify", "compare", "simulate"])
def test_a_full_disk_is_a_file_error_and_one_document(
    command: str, recording: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*_: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device", "model.json")

    monkeypatch.setattr(Path, "replace", full)
    inputs = {
        "identify": ["identify", recording],
        "compare": ["compare", recording, "--method", "least_squares"],
        "simulate": MOTION,
    }[command]
    done = run(*inputs, "-o", tmp_path / "out", "--json")
    one_document(done, "file", 5)
    assert "free some space" in done.stderr


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no /dev/full here")
def test_a_full_stdout_is_a_file_error() -> None:
    import subprocess

    with open("/dev/full", "w") as full:
        done = subprocess.run(
            [sys.executable, "-m", "edge_ident", "registers"],
            stdout=full, stderr=subprocess.PIPE, text=True, check=False,
        )  # fmt: skip
    assert done.returncode == 5
    assert "Traceback" not in done.stderr


def test_a_defect_is_a_document_a_traceback_and_a_code_of_its_own(
    recording: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken(*_: object, **__: object) -> None:
        raise ZeroDivisionError("division by zero")

    monkeypatch.setattr("edge_ident.identification.identify.identify", broken)
    done = run("identify", recording, "--json")
    assert json.loads(done.stdout)["code"] == "internal"
    assert "ZeroDivisionError: division by zero" in done.stderr
    assert done.exit_code == 70
