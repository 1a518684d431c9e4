"""`edge-ident config`: flag, then environment, then settings file, then default."""

import json
import os
from pathlib import Path
from types import SimpleNamespace

import pytest
import typer
from typer.testing import CliRunner, Result

from edge_ident.cli import app, machine, sessions, settings
from edge_ident.cli.command import INTERNAL
from tests.repetitions import a_few


@pytest.fixture
def settings_file(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Path:
    path = tmp_path / "settings" / "config.toml"
    monkeypatch.chdir(tmp_path)  # a setting may make a folder
    monkeypatch.setenv("EDGE_IDENT_CONFIG_FILE", str(path))
    for name in ("DEVICE", "BANDWIDTH", "DRIVE", "SEED"):
        monkeypatch.delenv(f"EDGE_IDENT_{name}", raising=False)
    return path


def run(*arguments: object, **environment: str) -> Result:
    return CliRunner().invoke(app, [*map(str, arguments)], env=environment)


def shown(key: str, **environment: str) -> tuple[object, str]:
    document = json.loads(run("config", "--json", **environment).stdout)
    setting = document["settings"][key]
    return setting["value"], setting["source"]


def used_device(monkeypatch: pytest.MonkeyPatch, *arguments: object, **environment: str) -> str:
    """The device that a command connects to."""
    asked: list[str] = []

    def connect(device: str, **_: object) -> None:
        asked.append(device)
        raise OSError(device)

    monkeypatch.setattr(sessions.edge_ident, "connect", connect, raising=False)
    run("gains", "show", *arguments, **environment)
    return asked[0]


def test_a_device_that_is_set_is_used_until_it_is_removed(
    settings_file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert run("config", "set", "device", "tcp://192.0.2.7:502").exit_code == 0
    assert run("config", "get", "device").stdout == "tcp://192.0.2.7:502\n"
    assert used_device(monkeypatch) == "tcp://192.0.2.7:502"
    assert run("config", "unset", "device").exit_code == 0
    assert run("gains", "show").exit_code == 2
    settings_file.write_text('device = ""\n')
    assert "no board is named" in run("gains", "show").stderr


def test_a_flag_comes_before_the_environment_and_that_before_the_drive_and_the_settings(
    settings_file: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    drive = tmp_path / "press.toml"
    built_in = Path(sessions.edge_ident.__file__).parent / "drive" / "feed_drive.toml"
    drive.write_text(built_in.read_text() + '\n[board]\ndevice = "press"\n')
    run("config", "set", "device", "settings")
    assert used_device(monkeypatch) == "settings"
    assert used_device(monkeypatch, "--drive", drive) == "press"
    assert used_device(monkeypatch, "--drive", drive, EDGE_IDENT_DEVICE="env") == "env"
    assert used_device(monkeypatch, "--device", "flag", EDGE_IDENT_DEVICE="env") == "flag"
    assert shown("device") == ("settings", "settings file")
    assert shown("device", EDGE_IDENT_DEVICE="env") == ("env", "environment EDGE_IDENT_DEVICE")
    assert shown("device", EDGE_IDENT_DRIVE=str(drive)) == ("press", f"drive description {drive}")


def test_other_settings_become_defaults_of_their_options(settings_file: Path) -> None:
    assert shown("bandwidth") == (None, "default")
    run("config", "set", "bandwidth", "12")
    assert shown("bandwidth") == (12.0, "settings file")
    assert "default: 12.0" in run("gains", "design", "--help").stdout
    assert shown("bandwidth", EDGE_IDENT_BANDWIDTH="9") == ("9", "environment EDGE_IDENT_BANDWIDTH")


def test_other_lines_of_the_file_stay(settings_file: Path) -> None:
    settings_file.parent.mkdir()
    settings_file.write_text('# the mill\ndevice = "a"  # left port\nseed = 3\n')
    run("config", "set", "device", 'COM"3')
    run("config", "unset", "seed")
    assert settings_file.read_text() == '# the mill\ndevice = "COM\\"3"\n'
    assert run("config", "get", "device").stdout == 'COM"3\n'


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("set", "bandwith", "3"), "no setting bandwith"),
        (("set", "bandwidth", "wide"), "is not a valid"),
        (("set", "bandwidth", "1_2"), "is not a valid"),
        (("set", "cycles", "1_2"), "is not a valid"),
        (("set", "bandwidth", "0.01"), "0.1"),
        (("get", "nothing"), "no setting nothing"),
    ],
)
def test_a_wrong_name_or_value_is_refused(
    settings_file: Path, arguments: tuple[str, ...], said: str
) -> None:
    done = run("config", *arguments)
    assert done.exit_code == 2
    assert said in done.stderr
    assert not settings_file.exists()


@pytest.mark.parametrize(("text", "said"), [("device = \n", "line 1"), ("devise = 1\n", "devise")])
def test_a_file_that_cannot_be_used_stops_every_command_but_config(
    settings_file: Path, text: str, said: str
) -> None:
    settings_file.parent.mkdir()
    settings_file.write_text(text)
    done = run("registers", "--json")
    assert done.exit_code == 5
    document = json.loads(done.stdout)
    assert document["code"] == "data"
    assert said in document["message"]


def test_a_setting_that_nobody_knows_can_be_removed(settings_file: Path) -> None:
    settings_file.parent.mkdir()
    settings_file.write_text("devise = 1\nseed = 2\n")
    assert run("config", "unset", "devise").exit_code == 0
    assert settings_file.read_text() == "seed = 2\n"


@pytest.mark.parametrize("line", ['seed = "x"', "cycles = inf", "cycles = 0"])
def test_a_value_that_no_option_takes_is_an_error_of_the_file(
    settings_file: Path, tmp_path: Path, line: str
) -> None:
    settings_file.parent.mkdir()
    settings_file.write_text(line)
    done = run("identify", tmp_path / "any.csv", "--json")
    assert done.exit_code == 5
    error = json.loads(done.stdout)
    assert error["code"] == "data"
    assert str(settings_file) in error["cause"]
    assert f"config set {line.partition(' ')[0]}" in error["next_step"]
    assert run("config", "unset", line.partition(" ")[0]).exit_code == 0


@pytest.mark.parametrize(
    ("text", "command"),
    [('"device" = "virtual"\n', ["set", "device", "x"]), ("[other]\nx = 1\n", ["unset", "other"])],
)
def test_what_a_line_alone_does_not_change_stays_as_it_is(
    settings_file: Path, text: str, command: list[str]
) -> None:
    settings_file.parent.mkdir()
    settings_file.write_text(text)
    done = run("config", *command)
    assert done.exit_code == 5
    assert f"{command[1]} as a table, in quotes, twice or over several lines" in done.stderr
    assert settings_file.read_text() == text


OPTIONS = dict(settings.options(typer.main.get_command(app)))
SETTINGS = sorted(OPTIONS)
OF_EACH_TYPE = sorted({type(OPTIONS[key].type): key for key in SETTINGS}.values())
"""One setting of each type that options have."""
HARMLESS = {"device": "virtual", "motion": "multisine", "precision": "fp32", "speed": "max"} | {
    "format": "markdown", "accelerator": "cpu", "no_diagnose": "true", "cluster": "tcp://a:1",
    "until": "3%", "tolerance": "5%", "baud_rate": "9600", "diagnose_first": "true",
}  # fmt: skip
"""Values of settings that take no number."""
ANY_TOML = (
    '"x"', '""', "0.03", "-1", "nan", "inf", "true", "[1, 2]", "{a = 1}", "1979-05-27", "07:32:00",
    '"a\\u0000b"', "0x" + "f" * 5000,
)  # fmt: skip
"""Each type of value that a file may have for any key, and values at its edges."""


def stopped(monkeypatch: pytest.MonkeyPatch, *arguments: str) -> tuple[Result, list[object]]:
    """What `stop` says, and the boards that it stops."""
    boards: list[object] = []

    def stop_machine(device: str, baud_rate: int, _: object) -> SimpleNamespace:
        boards.append((device, baud_rate))
        return SimpleNamespace(state=SimpleNamespace(name="IDLE"), enabled=False)

    monkeypatch.setattr(machine.commissioning.safety, "stop_machine", stop_machine)
    return run("stop", *arguments), boards


@pytest.fixture
def no_variables(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in set(os.environ) & {f"EDGE_IDENT_{key.upper()}" for key in SETTINGS}:
        monkeypatch.delenv(name)


@pytest.mark.parametrize("key", SETTINGS)
def test_every_setting_is_set_shown_used_and_removed(
    settings_file: Path, no_variables: None, monkeypatch: pytest.MonkeyPatch, key: str
) -> None:
    value = HARMLESS.get(key, "2")
    assert run("config", "set", key, value).exit_code == 0
    kept, source = shown(key)
    assert source == "settings file"
    assert str(kept).lower() in (value, f"{value}.0")
    used = run("registers", "status", "--json")
    assert used.exit_code == (5 if key == "drive" else 0)  # there is no file 2
    done, boards = stopped(monkeypatch, "--device", "there")
    assert (done.exit_code, boards[0][0]) == (0, "there")
    assert run("config", "unset", key).exit_code == 0
    assert shown(key)[1] == "default"


@pytest.mark.parametrize(
    "key",
    a_few(dict.fromkeys([*OF_EACH_TYPE, *settings.BOARD, "drive"]), [*settings.BOARD, "drive"]),
)
def test_nothing_in_the_file_ends_in_a_traceback_or_keeps_a_machine_from_its_stop(
    settings_file: Path, no_variables: None, monkeypatch: pytest.MonkeyPatch, key: str
) -> None:
    settings_file.parent.mkdir()
    for value in ANY_TOML:
        settings_file.write_text(f"{key} = {value}\n")
        assert run("ports", "--help").exit_code == 0
        assert run("registers", "--json").exit_code != INTERNAL, value
        done, boards = stopped(monkeypatch, "--device", "there")
        assert (done.exit_code, boards) == (0, [("there", 115200)]) or key == "baud_rate", value
        assert run("config", "show", "--json").exit_code == 0, value
        assert run("config", "get", key).exit_code == 0, value
        assert run("config", "unset", key).exit_code == 0, value
        assert settings_file.read_text() == ""


@pytest.mark.parametrize(
    "text",
    ["devise = 1\n", "seed = [1]\n", 'drive = "none.toml"\n', "baud_rate = 10\n", "[x]\ny = 1\n"],
)
def test_stop_says_what_it_ignores_and_uses_the_rest(
    settings_file: Path, monkeypatch: pytest.MonkeyPatch, text: str
) -> None:
    settings_file.parent.mkdir()
    settings_file.write_text(f'device = "there"\n{text}')
    done, boards = stopped(monkeypatch)
    assert (done.exit_code, boards) == (0, [("there", 115200)])
    assert "ignored: " in done.stderr
    assert text.split()[0].strip("[]") in done.stderr or "none.toml" in done.stderr
    assert done.stdout == "IDLE\n"


@pytest.mark.parametrize("content", [b"device = \n", b"\xff\xfe", b"a = " + b"[" * 5000])
def test_a_damaged_file_keeps_no_machine_from_its_stop_and_is_told(
    settings_file: Path, monkeypatch: pytest.MonkeyPatch, content: bytes
) -> None:
    settings_file.parent.mkdir()
    settings_file.write_bytes(content)
    done, boards = stopped(monkeypatch, "--device", "there")
    assert (done.exit_code, boards) == (0, [("there", 115200)])
    assert "the settings cannot be read" in done.stderr
    done = run("config", "show", "--json")
    assert done.exit_code == 0
    assert "the settings cannot be read" in json.loads(done.stdout)["ignored"][0]
    done = run("config", "unset", "seed")
    assert done.exit_code == 5
    assert "the settings cannot be read" in done.stderr
    assert settings_file.read_bytes() == content


def test_the_line_that_damages_the_file_can_be_removed(settings_file: Path) -> None:
    settings_file.parent.mkdir()
    settings_file.write_text("device = \nseed = 2\n")
    assert run("config", "unset", "device").exit_code == 0
    assert settings_file.read_text() == "seed = 2\n"


def test_a_drive_that_is_named_but_missing_is_not_ignored_where_it_names_the_board(
    settings_file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    run("config", "set", "device", "another machine")
    done, boards = stopped(monkeypatch, "--drive", "press.toml")
    assert (done.exit_code, boards) == (5, [])


@pytest.mark.parametrize("value", ["nan", "inf", "\udcff"])
def test_what_the_file_cannot_hold_is_refused(settings_file: Path, value: str) -> None:
    for key in ("bandwidth", "device") if value == "\udcff" else ("bandwidth",):
        assert run("config", "set", key, value).exit_code == 2
    assert not settings_file.exists()
