"""A command starts without the others, and is the same as among them."""

from pathlib import Path

import pytest
import typer

from edge_ident.cli import HOMES, app_for, settings, whole_app


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
    assert list(commands(whole_app())) == list(HOMES)


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
