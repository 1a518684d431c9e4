"""Every command in a block of a page runs, or a reason stands here why not.

The commands of a page run in their order, in one folder, with one virtual board that stays on
between them in place of the board that the page names.
"""

import re
import shlex
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Final

import numpy as np
import pytest
import scipy.io
from typer.testing import CliRunner

import edge_ident
from edge_ident.cli import app
from edge_ident.drive import description
from edge_ident.drive.description import drive_text
from tests.edge_ident.shared_board import SharedBoard
from tests.short_runs import brief_drive
from tests.test_docs import FENCE, PAGES, ROOT, whole_lines

NOT_RUN: Final = {
    r"edge-ident export --c ": "needs onnx; tests/export/test_c_source.py runs it",
    r"edge-ident (train|export) ": "trains for ten minutes; tests/export does both in small",
    r"edge-ident \w+ .*--network networks/": "has a network that training makes",
    r"edge-ident (run|capture) .*--(hide|used) ": "tests/edge_ident/cli/test_hide_options.py hides",
    r"edge-ident plant ": "serves until Ctrl-C; test_plant_socket.py starts it",
    r"edge-ident board ": "serves until Ctrl-C; tests/test_run.py starts it",
    r"edge-ident survey .*--cluster ": "tests/edge_ident/fleet/test_cluster.py has a cluster",
    r"edge-ident profile": "goes by the clock; tests/test_run.py runs it",
    r"edge-ident doctor": "judges clocks; tests/edge_ident/commissioning/test_doctor.py runs it",
    r"ExecStart=": "stands in the unit of a service; docs/tutorial.md runs the command",
    r"(\S*/)?(python3 -m venv|pip) ": "installs; the gate runs README's commands",
    r"(\S*/)?python -m pytest": "these tests",
    r"\. \.venv/bin/activate": "is for an interactive shell",
    r"\S*python -m sphinx ": "tests/test_site.py builds the site",
    r"python tools/check_packages.py ": "takes a minute and the network; the gate runs it",
    r"python docs/examples/": "tests/test_examples.py runs each",
    r"python tools/fault_schedules.py ": "goes on for minutes",
    r"python tools/busy_runs.py ": "goes on for minutes",
    r"python -m tools\.": "goes on for minutes to hours",
    r"edge-ident diagnose recording\.csv second": "here, the recording is of another drive",
    r"podman ": "needs a container engine",
    r"make -C |firmware_interface/\S+/firmware ": "tests/firmware_interface builds and starts it",
}
"""Beginning of a command, and why it does not run here."""
ELSEWHERE: Final = ("commands.md", "bringup.md")
"""Pages without an order of commands, and one whose test does what its reader does by hand."""
_COMMAND: Final = re.compile(
    r"^(\$ )?(?=(\S*/)?(edge-ident|python3?|pip|make|podman|firmware|\.) )"
)
_INDENTED: Final = re.compile(r"^ {4}(\S.*)$", re.MULTILINE)
_BOARD: Final = re.compile(r"--device (?:/dev/\S+|\./board|tcp://\S+|…|virtual)")
_FILE: Final = re.compile(r"Write this as `([\w.]+)`")


def commands(page: Path) -> list[str]:
    """Command lines in the blocks of a page, without the remarks two blanks behind."""
    text = whole_lines(page)
    lines = "\n".join((*FENCE.findall(text), *_INDENTED.findall(FENCE.sub("", text)))).splitlines()
    parts = [part.strip() for line in lines if _COMMAND.match(line) for part in line.split("&&")]
    return [re.split(r"\s{2,}| +# ", part)[0].removeprefix("$ ") for part in parts]


def reason(command: str) -> str | None:
    return next((why for known, why in NOT_RUN.items() if re.match(known, command)), None)


WITH_COMMANDS: Final = [page for page in PAGES if page.name not in ELSEWHERE and commands(page)]


def runnable(page: Path) -> tuple[str, ...]:
    """What runs here for a page, in its order; the same command once."""
    found = (here(command) for command in commands(page) if not reason(command))
    return tuple(dict.fromkeys(command.removeprefix(".venv/bin/") for command in found))


def here(command: str) -> str:
    """A command on the board that there is."""
    return _BOARD.sub("--device shared", command)


def told_elsewhere(story: tuple[str, ...]) -> bool:
    """Whether a longer story has the same commands in the same order."""
    longer = (iter(other) for other in map(runnable, WITH_COMMANDS) if len(other) > len(story))
    return any(all(command in rest for command in story) for rest in longer)


STORIES: Final = {
    runnable(page): page for page in WITH_COMMANDS if not told_elsewhere(runnable(page))
}
"""What runs, and a page that says it: several pages say the same."""


@pytest.fixture(scope="module")
def brief(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """The built-in drive moves for eleven seconds: the commands run, whatever they find."""
    folder = tmp_path_factory.mktemp("built-in")
    (folder / "feed_drive.toml").write_text(drive_text(brief_drive(2.0), {}), encoding="utf-8")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(description, "BUILT_IN", folder / "feed_drive.toml")
        yield


@pytest.fixture(scope="module")
def stock(brief: None, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Files that a page takes for granted."""
    folder = tmp_path_factory.mktemp("stock")
    recording = edge_ident.simulate(noise=0.02)
    for name in ("recording.csv", "capture.npz", "recordings/monday.npz"):
        edge_ident.save_recording(recording, folder / name)
    edge_ident.save_model(edge_ident.identify(recording).model, folder / "model.json")
    axis, time_s = recording.axes["x"], recording.time_s
    rows = zip(1e3 * time_s, 1e6 * axis.position * 6e-4, axis.effort, strict=True)
    text = "Zeit (ms);X.ActPos [µm];X.Kraft [kN]\n"
    text += "".join(f"{t:.1f};{x:.3f};{f:.6f}\n".replace(".", ",") for t, x, f in rows)
    (folder / "scope.csv").write_text(text, encoding="latin-1")
    log = {"t_s": time_s, "pos": np.degrees(axis.position), "torque_nm": axis.effort}
    scipy.io.savemat(folder / "log.mat", log)
    return folder


@pytest.mark.parametrize("page", STORIES.values(), ids=lambda page: str(page.relative_to(ROOT)))
def test_every_command_of_a_page_runs(
    page: Path, stock: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    SharedBoard(monkeypatch)
    monkeypatch.setenv("EDGE_IDENT_DEVICE", "shared")
    monkeypatch.setenv("EDGE_IDENT_CONFIG_FILE", str(tmp_path / "config.toml"))
    monkeypatch.chdir(tmp_path)
    shutil.copytree(stock, tmp_path, dirs_exist_ok=True)
    write_files_of(page)
    for command in runnable(page):
        words = shlex.split(command)
        assert words[0].endswith("edge-ident"), f"{command}: say here why it does not run"
        result = CliRunner().invoke(app, [existing(word) for word in words[1:]])
        assert result.exit_code == 0, f"{command}\n{result.output}\n{result.exception!r}"


def write_files_of(page: Path) -> None:
    """Files whose text stands on the page."""
    text = page.read_text("utf-8")
    for found in _FILE.finditer(text):
        block = FENCE.search(text, found.end())
        assert block, found[0]
        Path(found[1]).write_text("\n".join(block[0].splitlines()[1:-1]), encoding="utf-8")


def existing(word: str) -> str:
    """A path, with the date or serial number that it has here."""
    folder, last = Path(word).parent, Path(word).name
    if folder.name in ("edge-ident-gains", "edge-ident-runs"):
        return str(max(folder.iterdir()))
    return str(folder / last) if "/" in word else word


def test_every_reason_is_needed() -> None:
    every = [command for page in WITH_COMMANDS for command in commands(page)]
    for known in NOT_RUN:
        assert any(re.match(known, command) for command in every), known
