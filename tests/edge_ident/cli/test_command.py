"""Groups of options become options; errors become messages, documents and exit codes."""

import errno
import json
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import pytest
import typer
from typer.testing import CliRunner, Result

from edge_ident.cli.command import command
from edge_ident.cli.options import ResultOptions
from edge_ident.errors import BoardError, DataError, GainError, LinkError, ModelError


@dataclass(frozen=True)
class Point:
    """A group with an option that must be given and one that need not.

    Attributes
    ----------
    across : STEPS
        How far to
        the right.
    """

    across: Annotated[int, typer.Option("--across")]
    along: Annotated[float, typer.Option("--along", envvar="EDGE_IDENT_ALONG")] = 0.5


def run(function, *arguments: str, **environment: str) -> Result:
    app = typer.Typer(rich_markup_mode=None)
    app.command()(command(function))
    return CliRunner().invoke(app, list(arguments), env=environment)


def place(*, name: Annotated[str, typer.Argument()], point: Point, json: bool = False) -> None:
    """Say where a thing is."""
    print(name, point, json)


def test_a_group_arrives_as_one_value_with_its_defaults() -> None:
    done = run(place, "here", "--across", "3")
    assert done.exit_code == 0, done.stderr
    assert done.stdout == "here Point(across=3, along=0.5) False\n"


def test_an_option_of_a_group_keeps_its_type_its_variable_and_its_place_in_the_help() -> None:
    assert "along=2.0" in run(place, "here", "--across", "3", EDGE_IDENT_ALONG="2").stdout
    assert run(place, "here", "--across", "three").exit_code == 2
    assert run(place, "here").exit_code == 2
    text = run(place, "--help").stdout
    assert text.index("--across") < text.index("--along") < text.index("--json")
    assert "Say where a thing is." in text


def test_the_help_of_an_option_is_that_of_its_own_docstring_or_of_the_shared_one() -> None:
    text = " ".join(run(place, "--help").stdout.split())
    assert "--across STEPS How far to the right." in text
    assert "--json Print the result as one JSON document on stdout." in text


@pytest.mark.parametrize(
    ("error", "code"),
    [(LinkError, 3), (BoardError, 4), (DataError, 5), (ModelError, 5), (GainError, 1)],
)
def test_each_error_has_two_lines_a_document_and_the_contracts_exit_code(error, code: int) -> None:
    def fail(*, results: ResultOptions) -> None:
        raise error("it broke", "mend it")

    done = run(fail)
    assert (done.exit_code, done.stdout) == (code, "")
    assert done.stderr == "error: it broke\nnext:  mend it\n"
    document = json.loads(run(fail, "--json").stdout)
    assert document["schema"] == "edge-ident/error/1"
    assert document["error"] == error.__name__
    assert (document["cause"], document["next_step"]) == ("it broke", "mend it")
    assert (document["message"], document["exit_code"]) == ("it broke", code)
    assert document["code"] in ("link", "board", "data", "model", "gains")


@pytest.mark.parametrize(
    ("number", "remedy"), [(errno.ENOSPC, "free some space"), (errno.EACCES, "your rights")]
)
def test_a_file_that_cannot_be_written_is_no_wrong_usage(number: int, remedy: str) -> None:
    def fail(*, results: ResultOptions) -> None:
        raise OSError(number, "no", "/there")

    done = run(fail)
    assert done.exit_code == 5
    assert remedy in done.stderr


def test_ctrl_c_ends_with_130() -> None:
    def fail(*, results: ResultOptions) -> None:
        raise KeyboardInterrupt

    done = run(fail)
    assert (done.exit_code, done.stderr) == (130, "interrupted\n")


@pytest.mark.parametrize("value", ["nan", "inf", "-inf"])
def test_an_option_takes_no_number_that_is_none(value: str) -> None:
    done = run(place, "here", "--across", "3", "--along", value)
    assert done.exit_code == 2
    assert "--along" in done.stderr
    assert "finite" in done.stderr


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs a device that is always full")
def test_a_result_that_cannot_be_written_is_told_once() -> None:
    arguments = [sys.executable, "-m", "edge_ident", "registers", "--json"]
    with Path("/dev/full").open("w") as full:
        done = subprocess.run(
            arguments, stdout=full, stderr=subprocess.PIPE, text=True, check=False
        )
    assert done.returncode == 5
    assert [line.split(":")[0] for line in done.stderr.splitlines()] == ["error", "next"]
