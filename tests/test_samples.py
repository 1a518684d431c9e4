"""Samples of what `run` prints, in the pages: the command prints them, word for word.

Line breaks and the widths of columns are free. A number may differ by one in the last digit that is
printed, or by a twentieth of itself: on another kind of processor numpy rounds otherwise, so that a
designed motion is another one (docs/virtual_board.md#time). A line `…` stands for lines that are
left out.
"""

import re
import shlex
from pathlib import Path
from typing import Final

import pytest
from typer.testing import CliRunner

from edge_ident.cli import app
from tests.repetitions import a_few
from tests.test_docs import FENCE, PAGES, ROOT

WIDTH: Final = "107"
_OF_RUN: Final = "```\n$ edge-ident run "
_BORDER: Final = re.compile(r"[━─]+")
_NUMBER: Final = re.compile(r"-?\d+(?:\.\d+)?")
SAMPLES: Final = [
    (page.name, fence)
    for page in PAGES
    for fence in FENCE.findall(page.read_text("utf-8"))
    if fence.startswith(_OF_RUN)
]


def words(text: str) -> list[str]:
    return _BORDER.sub("━", text).split()


def same(shown: str, printed: str) -> bool:
    """Whether two words are the same but for rounding."""
    if _NUMBER.sub("#", shown) != _NUMBER.sub("#", printed):
        return False
    pairs = zip(_NUMBER.findall(shown), _NUMBER.findall(printed), strict=True)
    return all(close(*pair) for pair in pairs)


def close(shown: str, printed: str) -> bool:
    last = 10.0 ** -len(shown.partition(".")[2])
    return abs(float(shown) - float(printed)) <= max(1.01 * last, 0.05 * abs(float(printed)))


def after(part: list[str], printed: list[str], begin: int) -> int | None:
    """Where a part of a sample ends in what was printed; None where it is not there."""
    for start in range(begin, len(printed) - len(part) + 1):
        end = start + len(part)
        if all(map(same, part, printed[start:end])):
            return end
    return None


def test_readme_and_tutorial_have_a_sample() -> None:
    assert [name for name, _ in SAMPLES] == ["README.md", "tutorial.md"]


@pytest.mark.parametrize(("name", "fence"), a_few(SAMPLES, SAMPLES[:1]))
def test_run_prints_the_sample(
    name: str, fence: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    command, _, sample = (
        fence.removeprefix("```\n$ edge-ident ").removesuffix("\n```").partition("\n")
    )
    done = CliRunner().invoke(app, shlex.split(command), env={"COLUMNS": WIDTH})
    assert done.exit_code == 0, done.stderr
    printed, end = words(done.stdout), 0
    parts = [words(part) for part in re.split(r"^ *…$", sample, flags=re.MULTILINE)]
    for part in parts:
        found = after(part, printed, end)
        assert found is not None, f"{name}: {' '.join(part)}"
        assert end or found == len(part), "the sample begins where the output does"
        end = found
    assert end == len(printed), "the sample ends where the output does"


def test_rounding_is_the_only_freedom() -> None:
    assert ROOT.joinpath("docs/virtual_board.md").read_text("utf-8").count("## Time") == 1
    assert same("0.4226", "0.4227")
    assert not same("0.4226", "0.4526")
    assert same("(24)", "(24)")
    assert not same("x,", "z,")
