"""Standard streams that are closed, full, or that nobody reads: no result and no word is lost."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from edge_ident.drive.description import drive_text
from tests import processes
from tests.short_runs import brief_drive

COMMAND = [sys.executable, "-m", "edge_ident"]


def redirected(redirection: str, *arguments: object) -> subprocess.CompletedProcess[str]:
    """A command whose standard streams a shell redirects."""
    shell = ["sh", "-c", f'exec "$@" {redirection}', "sh", *COMMAND, *map(str, arguments)]
    return subprocess.run(shell, capture_output=True, text=True, timeout=60, check=False)


def unread(*arguments: object) -> subprocess.CompletedProcess[str]:
    """A command whose stdout is a pipe that nobody reads any more."""
    reading, writing = os.pipe()
    os.close(reading)
    try:
        return subprocess.run(
            [*COMMAND, *map(str, arguments)],
            stdout=writing,
            stderr=subprocess.PIPE,
            text=True,
            timeout=60,
            check=False,
        )
    finally:
        os.close(writing)


@pytest.fixture
def brief_run(tmp_path: Path) -> list[object]:
    drive = tmp_path / "brief.toml"
    drive.write_text(drive_text(brief_drive(), {}), encoding="utf-8")
    return ["run", "--device", "virtual", "--drive", drive, "--output", tmp_path / "run"]


def confirmed(folder: Path) -> bool:
    return bool(json.loads((folder / "report.json").read_text("utf-8"))["confirmed"])


@pytest.mark.parametrize("form", [[], ["--json"]])
def test_a_run_whose_result_nobody_reads_says_which_gains_are_in_force(
    form: list[str], brief_run: list[object], tmp_path: Path
) -> None:
    done = unread(*brief_run, *form)
    assert done.returncode == 5
    assert "error: the output was closed" in done.stderr
    assert "note:  new gains confirmed" in done.stderr
    assert "Traceback" not in done.stderr
    assert confirmed(tmp_path / "run")
    assert {"report.html", "model.json"} <= {file.name for file in (tmp_path / "run").iterdir()}


@pytest.mark.parametrize("redirection", [">&-", "2>&-", "2>/dev/full"])
def test_a_run_goes_on_without_a_stream(
    redirection: str, brief_run: list[object], tmp_path: Path
) -> None:
    done = redirected(redirection, *brief_run)
    assert (done.returncode, "Traceback" in done.stderr) == (0, False)
    assert ("new gains confirmed" in done.stdout) == (redirection != ">&-")
    assert confirmed(tmp_path / "run")


def test_a_run_whose_terminal_is_gone_writes_its_results(
    brief_run: list[object], tmp_path: Path
) -> None:
    """As one that `disown` keeps alive where the connection to its terminal is lost."""
    terminal, stderr = os.openpty()
    command = [*COMMAND, *map(str, brief_run), "--json"]
    with processes.running(command, stderr) as process:
        os.close(stderr)
        said = b""
        while b"axes enabled" not in said:
            said += os.read(terminal, 4096)
        os.close(terminal)
        assert process.stdout is not None
        assert json.loads(process.stdout.read())["confirmed"]
        assert process.wait(timeout=60) == 0
    assert confirmed(tmp_path / "run")
    assert {"report.html", "model.json"} <= {file.name for file in (tmp_path / "run").iterdir()}


def test_a_file_does_not_get_the_number_of_a_closed_stream(tmp_path: Path) -> None:
    opened = "import edge_ident.__main__ as m, os; m.process.open_closed(); "
    script = opened + "print(os.dup(0), file=m.sys.stderr)"
    shell = ["sh", "-c", 'exec "$@" <&- >&-', "sh", sys.executable, "-c", script]
    done = subprocess.run(shell, stderr=subprocess.PIPE, text=True, timeout=60, check=True)
    assert int(done.stderr) > 2


def test_what_only_reads_ends_silently_where_nobody_reads_it() -> None:
    for form in ([], ["--json"]):
        done = unread("config", "--quiet", *form)
        assert (done.returncode, done.stderr) == (141, "")


def test_a_written_register_is_told_where_nobody_reads_the_result() -> None:
    write = ["registers", "watchdog.timeout", "--write", "0.5", "--yes", "--device", "virtual"]
    done = unread(*write)
    assert done.returncode == 5
    assert "note:  watchdog.timeout is written" in done.stderr


@pytest.mark.parametrize(
    ("command", "note"),
    [
        (["stop"], "the board is IDLE, its effort is off"),
        (["clear-fault"], "the board is IDLE, its effort is off"),
        (["home", "--to", "x=0.5"], "x: 0.0000 → 0."),
    ],
    ids=["stop", "clear-fault", "home"],
)
def test_what_became_of_the_machine_is_told_where_the_result_cannot_be_written(
    command: list[str], note: str, tmp_path: Path
) -> None:
    for name in ("state.json", "home.json"):
        (tmp_path / name).mkdir()
    done = subprocess.run(
        [*COMMAND, *command, "--device", "virtual", "--output", str(tmp_path)],
        capture_output=True, text=True, timeout=60, check=False,
    )  # fmt: skip
    assert done.returncode == 5
    assert f"note:  {note}" in done.stderr
    assert f"note:  {note}" in unread(*command, "--device", "virtual").stderr


@pytest.mark.parametrize(
    ("redirection", "arguments"), [(">/dev/full", ["--help"]), ("2>/dev/full", ["no-such-command"])]
)
def test_help_for_which_there_is_no_room_is_no_defect(
    redirection: str, arguments: list[str]
) -> None:
    done = redirected(redirection, *arguments)
    assert (done.returncode, "Traceback" in done.stderr) == (5, False)


@pytest.mark.parametrize("form", [[], ["--json"]])
def test_a_terminal_without_utf_8_is_told_all_the_same(form: list[str]) -> None:
    environment = os.environ | {"PYTHONIOENCODING": "ascii"}
    done = subprocess.run(
        [*COMMAND, "home", "--by", "x=0.5", "--device", "virtual", *form],
        capture_output=True, text=True, timeout=60, check=False, env=environment,
    )  # fmt: skip
    assert (done.returncode, "Traceback" in done.stderr) == (0, False)
    assert json.loads(done.stdout)["axes"] if form else "x: 0.0000 \\u2192 0.4" in done.stdout


def test_the_name_of_a_folder_may_be_no_text(brief_run: list[object], tmp_path: Path) -> None:
    folder = os.fsdecode(bytes(tmp_path) + b"/bad\xff")
    done = subprocess.run(
        [*COMMAND, *map(str, brief_run[:-1]), folder, "--dry-run", "--json"],
        capture_output=True, text=True, timeout=60, check=False,
    )  # fmt: skip
    assert (done.returncode, "Traceback" in done.stderr) == (0, False), done.stderr
    assert json.loads(done.stdout) == json.loads((Path(folder) / "report.json").read_text("utf-8"))
    assert (Path(folder) / "report.html").is_file()
