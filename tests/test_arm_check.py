"""What the check on ARM refuses and skips; `python -m tools.arm_check` is the check itself."""

import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tools.arm_check import board as arm_board
from tools.arm_check.agreement import SHARES_LIMIT, networks_agree, parameters_agree

ROOT = Path(__file__).parents[1]


def residuals(*, outputs_off: int = 0, shares_off: float = 0.0) -> dict[str, Any]:
    """Of networks whose int8 output is some float32 numbers off, and whose fp32 shares are off."""
    output = np.float32(0.37)
    for _ in range(outputs_off):
        output = np.nextafter(output, np.float32(1.0))
    share = np.log(float(output) / (1.0 - float(output)))
    return {"int8": [[share] * 4], "fp32": [[0.1 + shares_off] * 4]}


def test_int8_networks_that_differ_by_one_bit_are_told_apart() -> None:
    assert networks_agree(residuals(), residuals(), exact=True)[1]
    told, agree = networks_agree(residuals(outputs_off=1), residuals(), exact=True)
    assert not agree
    assert "apart; fp32" in told


def test_where_x86_saturates_int8_is_reported_and_not_judged() -> None:
    told, agree = networks_agree(residuals(outputs_off=1), residuals(), exact=False)
    assert agree
    assert "not judged" in told


@pytest.mark.parametrize("off", [2.0 * SHARES_LIMIT, np.nan])
def test_fp32_networks_that_differ_by_more_than_their_loop_resolves(off: float) -> None:
    assert networks_agree(residuals(shares_off=0.5 * SHARES_LIMIT), residuals(), exact=True)[1]
    assert not networks_agree(residuals(shares_off=off), residuals(), exact=True)[1]


def document(
    inertia: float = 0.43, *, trusted: bool = True, network: bool = True
) -> dict[str, Any]:
    parameters = {"inertia": {"value": inertia, "std": 0.01, "unit": "kg*m^2"}}
    estimators = {"least_squares": parameters, "cnn": parameters if network else None}
    return {"axes": {"x": {"trusted": trusted, "estimators": estimators}}}


@pytest.mark.parametrize(
    ("found", "agree"),
    [
        (document(), True),
        (document(0.43 + 0.009 * 0.01), True),
        (document(0.43 + 0.011 * 0.01), False),
        (document(np.nan), False),
        (document(trusted=False), False),
        (document(network=False), False),
    ],
)
def test_parameters_agree_to_a_hundredth_of_their_standard_deviations(
    found: dict[str, Any], agree: bool
) -> None:
    assert parameters_agree(found, document())[1] is agree


def test_without_an_emulator_the_reason_is_told_and_nothing_fails(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "tools.arm_check", "--folder", str(tmp_path / "arm")]
    done = subprocess.run(
        command, cwd=ROOT, env={"PATH": str(tmp_path), "HOME": str(tmp_path)},
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("ARM: skipped: ")
    assert not (tmp_path / "arm").exists()


def test_a_server_that_cannot_be_reached_is_a_reason_to_skip(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    for name in ("qemu-aarch64", "apt-get", "dpkg-deb"):
        program = tmp_path / "programs" / name
        program.parent.mkdir(exist_ok=True)
        program.write_text(
            "#!/bin/sh\necho 'W: first' >&2\necho 'E: no route to host' >&2\nexit 100\n"
        )
        program.chmod(0o755)
    monkeypatch.setenv("PATH", f"{tmp_path / 'programs'}:/usr/bin:/bin")
    monkeypatch.setattr(arm_board.platform, "machine", lambda: "x86_64")
    with pytest.raises(arm_board.NotHereError, match="Debian: E: no route to host"):
        arm_board.board(tmp_path / "arm")
    assert not (tmp_path / "arm" / "sysroot").exists()


def test_the_wheels_are_those_of_the_project_in_the_releases_here() -> None:
    wanted = arm_board.requirements()
    assert f"numpy=={np.__version__}" in wanted
    assert any(one.startswith("pymodbus") for one in wanted)
    assert not any(one.startswith("scipy") for one in wanted)
