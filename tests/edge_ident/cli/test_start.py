"""A command starts without the others, and is the same as among them."""

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest
import typer
from typer.testing import CliRunner

from edge_ident.cli import GROUPS, HOMES, app_for, settings, whole_app
from edge_ident.signals.recording_files import save_recording
from edge_ident.simulation.simulate import simulate


@pytest.fixture(autouse=True)
def no_settings(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    file = tmp_path / "config.toml"
    monkeypatch.setenv(settings.FILE_VARIABLE, str(file))
    return file


def commands(app: typer.Typer) -> dict[str, object]:
    """Of each command the names of its options, and of a group its commands."""
    group = typer.main.get_command(app)
    return {
        name: (sorted(getattr(one, "commands", {})), [option.opts for option in one.params])
        for name, one in group.commands.items()  # type: ignore[attr-defined]
    }


def test_every_command_has_a_home() -> None:
    assert set(commands(whole_app())) == set(HOMES)


def test_the_help_names_every_command_in_its_group() -> None:
    """Words of the help between the titles of two groups are those of the group."""
    text = CliRunner().invoke(whole_app(), ["--help"]).stdout
    parts = re.split(r"^(" + "|".join(GROUPS) + r"):$", text, flags=re.M)[1:]
    assert parts[::2] == list(GROUPS)
    for title, part in zip(parts[::2], parts[1::2], strict=True):
        assert set(re.findall(r"^  (\S+)", part, re.M)) == set(GROUPS[title])


@pytest.mark.parametrize("name", [name for name in HOMES if name != "config"])
def test_a_command_alone_is_the_command_among_all(name: str) -> None:
    alone = commands(app_for(["--quiet", name, "--json"]))
    assert len(alone) < len(HOMES)
    assert alone[name] == commands(whole_app())[name]


@pytest.mark.parametrize("arguments", [[], ["--help"], ["identfy"], ["config", "set"]])
def test_help_a_wrong_name_and_the_settings_know_all(arguments: list[str]) -> None:
    assert app_for(arguments) is whole_app()


def test_settings_may_be_those_of_any_command(no_settings: Path) -> None:
    no_settings.write_text('device = "virtual"\n')
    assert app_for(["identify"]) is whole_app()


@pytest.fixture(scope="module")
def identified(tmp_path_factory: pytest.TempPathFactory) -> dict:
    """What a process has loaded and done in which the script identified two sound axes."""
    file = tmp_path_factory.mktemp("start") / "drive.npz"
    save_recording(simulate(), file)
    source = f"""
import gc, json, sys
from edge_ident.__main__ import main
def looks():
    return sum(generation["collections"] for generation in gc.get_stats())
before = looks()
sys.argv = ["edge-ident", "identify", {str(file)!r}, "--json"]
try:
    main()
except SystemExit as end:
    assert not end.code, end.code
loaded = [name for name, module in sys.modules.items() if module]
found = {{"loaded": loaded, "looks": looks() - before, "frozen": gc.get_freeze_count()}}
print(json.dumps(found), file=sys.stderr)
"""
    done = subprocess.run(
        [sys.executable, "-c", source], capture_output=True, text=True, check=True
    )
    return json.loads(done.stderr.splitlines()[-1])


def test_sound_axes_load_nothing_of_effects_boards_and_diagnoses(identified: dict) -> None:
    loaded = set(identified["loaded"])
    assert {"edge_ident.identification.answer", "edge_ident.estimation.network"} <= loaded
    beside = {"email", "logging", "tomllib", "numpy.ma", "numpy.random", "rich", "jinja2", "scipy"}
    ours = {
        "edge_ident.control.position_loop",
        "edge_ident.diagnosis.result",
        "edge_ident.estimation.known_effects",
        "edge_ident.model.effect",
        "edge_ident.model.effects",
        "edge_ident.model.model_files",
        "firmware_interface.gains",
    }
    openssl = {"_hashlib"}
    assert not loaded & (beside | openssl | ours)


def test_no_garbage_is_looked_for_while_a_command_loads_and_ends(identified: dict) -> None:
    assert identified["looks"] == 0
    assert identified["frozen"] > 0


def test_a_run_for_a_program_loads_what_it_needs_and_keeps_no_network(tmp_path: Path) -> None:
    source = f"""
import gc, sys
from edge_ident import report
from edge_ident.__main__ import main
document, sessions = report.run_documents.run_document, []
def counted(*given):
    sessions.append(sum(type(one).__name__ == "InferenceSession" for one in gc.get_objects()))
    return document(*given)
report.run_documents.run_document = counted
sys.argv = ["edge-ident", "run", "--device", "virtual", "--output", {str(tmp_path)!r}, "--json"]
stdout, sys.stdout = sys.stdout, sys.stderr
try:
    main()
except SystemExit as end:
    assert not end.code, end.code
print(sessions, *sys.modules, file=stdout)
"""
    done = subprocess.run(
        [sys.executable, "-c", source], capture_output=True, text=True, check=True
    )
    sessions, *loaded = done.stdout.split()
    assert (tmp_path / "report.html").exists()
    assert not {"rich", "email", "numpy.ma", "scipy"} & set(loaded)
    assert sessions == "[0]"
