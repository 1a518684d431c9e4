"""What may stand in a name acts on no terminal, and stays readable and valid JSON."""

import io
import json
import sys
import unicodedata

import pytest
from hypothesis import given
from hypothesis import strategies as st
from rich.text import Text

from edge_ident.support import process
from edge_ident.support.console import FittingTable, VisibleConsole
from edge_ident.support.documents import to_json
from edge_ident.support.words import brief, on_a_line, visible

ACTING = {
    "a title of the window": "\x1b]0;owned\x07",
    "a cleared screen": "\x1b[2J",
    "a link": "\x1b]8;;http://x\x1b\\here\x1b]8;;\x1b\\",
    "C1": "\x9b31m\x9d0;owned\x9c\x90",
    "direction": "\u202egnp.exe\u202c\u2066\u2069\u200e\u061c",
    "no width": "a\u200bb\u200c\u200d\u2060\ufeff\u00ad",
    "lines": "a\u2028b\u2029c\x0b\x0c\x85\r",
    "delete": "\x7f\x08",
    "tags": "\U000e0041\U000e007f",
    "no text": "\udcff",
}
HOSTILE = "".join(ACTING.values())


def is_seen(text: str) -> bool:
    return all(unicodedata.category(c)[0] != "C" for c in text.replace("\n", ""))


@pytest.mark.parametrize("kind", ACTING)
def test_what_acts_or_hides_becomes_a_number(kind: str) -> None:
    shown = visible(ACTING[kind])
    assert is_seen(shown)
    assert "\\u" in shown


@given(st.text())
def test_any_text_is_visible_and_a_readable_one_stays(text: str) -> None:
    shown = visible(text)
    assert is_seen(shown.replace("\t", ""))
    assert visible(shown) == shown
    if is_seen(text) and "\u2028" not in text and "\u2029" not in text:
        assert shown == text
    assert "\n" not in on_a_line(text)


def test_names_in_other_scripts_and_no_break_spaces_stay() -> None:
    text = "Größe 位置 θ̇ 12\u00a0% ▇▆ 🙂"
    assert visible(text) == text


@given(st.dictionaries(st.text(), st.text()))
def test_a_document_stays_one_and_shows_everything(document: dict[str, str]) -> None:
    written = to_json(document)
    assert is_seen(written)
    assert json.loads(visible(written)) == document


@pytest.mark.parametrize("terminal", [True, False])
def test_a_console_draws_names_as_text(terminal: bool) -> None:
    """What is left of escape sequences are styles, which the console sets itself."""
    file = io.StringIO()
    colours = "truecolor" if terminal else None
    console = VisibleConsole(file, force_terminal=terminal, width=60, color_system=colours)
    table = FittingTable(title=HOSTILE)
    table.add_column(HOSTILE)
    table.add_row(HOSTILE)
    table.add_row(Text(HOSTILE, style="red"))
    for shown in (table, Text(HOSTILE, style="bold"), HOSTILE, f"[bold]{HOSTILE}[/]"):
        console.print(shown)
    drawn = file.getvalue()
    for kind in ("\x1b]", "\x1b[2J", "\x07", "\x9b", "\u202e", "\u200b", "\x7f", "\r"):
        assert kind not in drawn
    assert ("\x1b[" in drawn) == terminal


def test_standard_streams_show_what_others_print(monkeypatch: pytest.MonkeyPatch) -> None:
    made = io.BytesIO()
    for name in ("stdout", "stderr"):
        monkeypatch.setattr(sys, name, io.TextIOWrapper(made, encoding="ascii"))
    process.show_any_character()
    print(f"{HOSTILE} µ → é")
    print(HOSTILE, file=sys.stderr)
    sys.stdout.writelines([HOSTILE])
    for stream in (sys.stdout, sys.stderr):
        stream.flush()
    shown = made.getvalue().decode("ascii")
    assert is_seen(shown)
    assert "\\u00b5 \\u2192 \\u00e9" in shown
    assert "\\u001b]0;owned\\u0007" in shown


def test_a_value_is_quoted_briefly_whatever_it_is() -> None:
    deep: object = 1
    for _ in range(100_000):
        deep = [deep]
    assert brief(deep) == "a list of 1"
    assert brief(16**5000) == "a number of 20001 bits"
    assert len(brief("x" * 100_000)) < 100
    assert brief("mm") == "'mm'"
    while isinstance(deep, list):  # or the interpreter takes it apart, level in level
        deep = deep.pop()
