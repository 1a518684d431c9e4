"""What is deprecated stays for one release, has no effect, and says so."""

import pytest
from typer.testing import CliRunner

import edge_ident
from edge_ident.cli import app


@pytest.mark.parametrize("given", [True, False])
@pytest.mark.parametrize("name", ["stability", "keep_minor"])
def test_a_diagnosis_says_what_has_no_effect(name: str, given: bool) -> None:
    with (
        pytest.warns(DeprecationWarning, match=f"`{name}` has no effect"),
        pytest.raises((edge_ident.DataError, ValueError, IndexError)),
    ):
        edge_ident.diagnose([], **{name: given})


@pytest.mark.parametrize("flag", ["--stability", "--no-stability", "--keep-minor"])
def test_the_command_says_what_has_no_effect(flag: str) -> None:
    with_it = CliRunner().invoke(app, ["diagnose", "missing.csv", flag])
    without = CliRunner().invoke(app, ["diagnose", "missing.csv"])
    assert "deprecated" in with_it.stderr
    assert flag in with_it.stderr
    assert "deprecated" not in without.stderr
    assert with_it.exit_code == without.exit_code
