"""docs/effects.md says what the effects' files say, of every effect."""

from pathlib import Path

import pytest

from edge_ident.model.effects import catalogue
from edge_ident.model.effects.backlash import EFFECT as BACKLASH
from tools import effect_pages


def section(name: str) -> str:
    return effect_pages.render().split(f"\n## {name}\n")[1].split("\n## ")[0]


def test_the_page_in_the_docs_is_up_to_date() -> None:
    assert effect_pages.main(["--check"]) == 0


def test_check_tells_an_old_page_and_leaves_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    page = tmp_path / "effects.md"
    page.write_text("old")
    monkeypatch.setattr(effect_pages, "PAGE", page)
    assert effect_pages.main(["--check"]) == 1
    assert "effects.md is out of date" in capsys.readouterr().err
    assert page.read_text() == "old"
    assert effect_pages.main([]) == 0
    assert effect_pages.main(["--check"]) == 0


@pytest.mark.parametrize("name", catalogue())
def test_every_effect_has_its_physics_parameters_alternatives_and_motion(name: str) -> None:
    text, effect = section(name), catalogue()[name]
    assert "Source:" in text
    for parameter in effect.parameters:
        mark = "" if parameter.name in effect.search.linear else " *"
        assert f"| `{parameter.name}`{mark} | {parameter.description} |" in text
    assert f"| [{name}](#{name}) | {effect.search.signature} |" in effect_pages.render()
    assert effect.search.experiment in text
    for other in effect.search.alternatives:
        assert f"[{other}](#{other})" in text
    assert ("do not use it" in text) != effect.compensation.used


def test_units_and_ranges_are_those_of_a_rotary_axis() -> None:
    assert BACKLASH.parameters[0].name == "gap"
    assert "`gap` * | free travel between the contacts | rad, ≥ 0 |" in section("backlash")
    assert "| kg·m^2, > 0 |" in section("backlash")
    assert "| N·m·s/rad |" in section("asymmetric_friction")
    assert "| s, -1 to 1 |" in section("time_delay")


def test_another_argument_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    assert effect_pages.main(["--chek"]) == 2
    assert "usage" in capsys.readouterr().err
