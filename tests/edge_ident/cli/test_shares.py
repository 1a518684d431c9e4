"""A share may be written as a number or as a percentage, wherever an option takes one."""

import pytest
import typer

from edge_ident.cli.board import simulate
from edge_ident.cli.diagnose import diagnose
from edge_ident.cli.options import part, share, true_part
from edge_ident.cli.run import run


@pytest.mark.parametrize(
    ("given", "found"),
    [("5%", 0.05), ("0.05", 0.05), (0.05, 0.05), ("0.5 %", 0.005), ("1e-3", 1e-3)],
)
def test_both_ways_of_writing_a_share_are_read(given: str | float, found: float) -> None:
    for parse in (share, part, true_part):
        assert parse(given) == pytest.approx(found)


@pytest.mark.parametrize("text", ["nan", "nan%", "-1%", "%", "two%", "", "inf", "True", "2_5%"])
def test_what_is_no_share_is_refused(text: str) -> None:
    for parse in (share, part, true_part):
        with pytest.raises(typer.BadParameter, match=r"5% or 0\.05"):
            parse(text)


def test_each_option_has_its_bounds() -> None:
    assert (share("150%"), part("0"), part("100%")) == (1.5, 0.0, 1.0)
    for parse, texts in ((part, ("5", "101%")), (true_part, ("2", "0%", "100%"))):
        for text in texts:
            with pytest.raises(typer.BadParameter, match="100%"):
                parse(text)


def test_every_option_that_takes_a_share_reads_both() -> None:
    app = typer.Typer()
    for command in (run, diagnose, simulate):
        app.command()(command)
    options = {
        option.name: option
        for command in typer.main.get_command(app).commands.values()  # type: ignore[attr-defined]
        for option in command.params
        if option.metavar == "SHARE"
    }
    assert set(options) == {"until", "tolerance", "noise"}
    for option in options.values():
        assert option.type.convert("5%", option, None) == pytest.approx(0.05)
