"""docs/commands.md says what the commands declare."""

import re
from pathlib import Path

import pytest

from tests.test_docs import commands
from tools import command_pages


def section(name: str) -> str:
    return command_pages.render().split(f"\n## edge-ident {name}\n")[1].split("\n## ")[0]


def test_the_page_in_the_docs_is_up_to_date() -> None:
    assert command_pages.main(["--check"]) == 0


def test_check_tells_an_old_page_and_leaves_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    page = tmp_path / "commands.md"
    page.write_text("old")
    monkeypatch.setattr(command_pages, "PAGE", page)
    assert command_pages.main(["--check"]) == 1
    assert "out of date: python -m tools.command_pages" in capsys.readouterr().err
    assert page.read_text() == "old"
    assert command_pages.main([]) == 0
    assert command_pages.main(["--check"]) == 0


@pytest.mark.parametrize(
    "name", [name for name in commands() if name not in ("", "gains", "config")]
)
def test_every_option_of_a_command_is_there(name: str) -> None:
    shared = command_pages.render().split("\n## edge-ident ")[0]
    text = section(name)
    for option in commands()[name] - {"--help"}:
        if option.startswith("--"):
            row = re.compile(rf"^\| .*`{option}[ `]", re.MULTILINE)
            assert row.search(text) or row.search(shared), option


def test_a_choice_a_default_and_a_variable_stand_in_a_row() -> None:
    row = "| `--format html\\|markdown` * | {} Default: `html`. |"
    meaning = "Format of the page in the folder: one HTML file, or Markdown with pictures."
    assert row.format(meaning) in section("diagnose")
    assert "| `--int8`, `--no-int8` |" in section("export")
    assert "```\nedge-ident identify recording.csv --column" in section("identify")


def test_what_several_commands_have_is_explained_once() -> None:
    page = command_pages.render()
    for option in ("--device DEVICE` * | Board: a", "--column NAME", "--hide NAME", "--json`"):
        assert page.count(f"| `{option}") == 1, option
    assert "the [options for reading a recording](#options-for-" in section("identify")
    assert "Also `--device`" in section("home").replace("`--baud-rate`, `--output`, ", "")
