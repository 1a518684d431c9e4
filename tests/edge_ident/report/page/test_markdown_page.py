"""The Markdown export: what the terminal says, with pictures beside it that stand alone."""

import re
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import pytest

from edge_ident.diagnosis.result import NotTestable
from edge_ident.report.page.diagnosis_page import write_markdown
from edge_ident.support.words import visible
from tests.edge_ident.diagnosis import hand_made


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("page")
    found = hand_made.diagnosis(doubtful=True)
    found = replace(found, axes={"x": found.axes["x"]})
    write_markdown(found, ["monday.csv", "tuesday.csv"], folder)
    return folder


def text(folder: Path) -> str:
    return (folder / "report.md").read_text(encoding="utf-8")


def test_the_page_says_what_the_terminal_says(folder: Path) -> None:
    said = text(folder)
    assert said.startswith("# What the model gets wrong about monday.csv and tuesday.csv")
    assert "stamps stray by 0.3 sampling periods" in said
    assert "- axis x explained by torque ripple and asymmetric friction\n  - the residual" in said
    assert "| torque ripple | 31 %<br>27 to 35 % | 12.0 % | cosine 0.2 ± 0.01 N\\*m<br>" in said
    assert "this motion does not distinguish it from nonlinear viscous" in said
    assert "accepted: without it the criterion is 412 units worse" in said
    assert "| relative residual, validation | 12.0 % | 4.00 % |" in said
    assert "| distance since reversal |" in said
    assert "| load dependent friction | the load is constant | two payloads |" in said


def test_every_picture_that_the_page_names_lies_beside_it(folder: Path) -> None:
    named = re.findall(r"\]\((.+?)\)", text(folder))
    assert len(named) > 10
    assert {file.name for file in folder.glob("*.svg")} == set(named)
    for name in named:
        picture = ElementTree.parse(folder / name).getroot()
        assert picture.tag == "{http://www.w3.org/2000/svg}svg"


def test_what_would_break_a_table_does_not(tmp_path: Path) -> None:
    found = hand_made.diagnosis()
    odd = NotTestable("backlash", "|v| stays above 1", "a|b")
    axes = {"z": replace(found.axes["z"], not_testable=(odd,))}
    write_markdown(replace(found, axes=axes, validation={}), ["a.csv"], tmp_path)
    rows = [line for line in text(tmp_path).splitlines() if line.startswith("| backlash")]
    assert [row.count("|") for row in rows] == [4]


def test_names_are_neither_html_nor_marks(tmp_path: Path) -> None:
    """A page of Markdown is shown as HTML: a name in it is text, in titles and in cells."""
    found = hand_made.diagnosis(doubtful=True)
    name = "<img src=x onerror=alert(1)>[a](http://b)`*c*`&amp;|\n# _d_\x1b]0;e\x07"
    odd = NotTestable("backlash", name, name)
    axes = {name: replace(found.axes["x"], not_testable=(odd,))}
    write_markdown(replace(found, axes=axes, validation={}), [name], tmp_path)
    said = text(tmp_path)
    assert visible(said) == said
    assert "<img" not in said
    assert not re.search(r"[^\\]\]\(http", said)
    assert "\n# _d_" not in said
    title = said.splitlines()[0]
    assert r"&lt;img src=x onerror=alert(1)&gt;\[a\](http://b)\`\*c\*\`&amp;amp;&#124;" in title
    for picture in tmp_path.glob("*.svg"):
        ElementTree.parse(picture)


def test_an_axis_cannot_name_a_file_outside_the_folder(tmp_path: Path) -> None:
    found = hand_made.diagnosis()
    folder = tmp_path / "inside"
    axes = {"../z": found.axes["z"]}
    write_markdown(replace(found, axes=axes, validation={}), ["a.csv"], folder)
    assert list(tmp_path.iterdir()) == [folder]
