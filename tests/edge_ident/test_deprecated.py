"""What is deprecated stays for one release, has no effect, and says so."""

import pytest
from typer.testing import CliRunner

import edge_ident
from edge_ident.cli import app


@pytest.mark.parametrize("stability", [True, False])
def test_a_diagnosis_says_that_stability_has_no_effect(stability: bool) -> None:
    with (
        pytest.warns(DeprecationWarning, match="`stability` has no effect"),
        pytest.raises((edge_ident.DataError, ValueError, IndexError)),
    ):
        edge_ident.diagnose([], stability=stability)


@pytest.mark.parametrize("flag", ["--stability", "--no-stability"])
def test_the_command_says_that_stability_has_no_effect(flag: str) -> None:
    with_it = CliRunner().invoke(app, ["diagnose", "missing.csv", flag])
    without = CliRunner().invoke(app, ["diagnose", "missing.csv"])
    assert "--no-stability are deprecated, and have no effect" in with_it.stderr
    assert "deprecated" not in without.stderr
    assert with_it.exit_code == without.exit_code
