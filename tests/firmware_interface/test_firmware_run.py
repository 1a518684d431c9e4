"""The whole job on the C firmware, with a fault hidden in the drive behind it."""

from pathlib import Path

import pytest

from tools.firmware_run import run_on, served


@pytest.mark.thorough
def test_a_run_finds_a_hidden_fault_and_writes_gains_that_keep_their_promise(
    firmware: Path, tmp_path: Path
) -> None:
    with served(firmware, tmp_path, "torque_ripple", speed=2.0) as device:
        ran = run_on(device, tmp_path / "run", "torque_ripple")
    assert "identification" in ran.document, ran.document
    axes = ran.document["identification"]["axes"]
    assert {cause["effect"] for cause in axes["x"]["diagnosis"]["causes"]} == {"torque_ripple"}
    assert axes["z"]["diagnosis"] is None
    assert ran.document["confirmed"]
    for motions in ran.document["promise"].values():
        assert [of["kept"] for of in motions.values()] == [True, True]
    assert ran.document["verification"]["x"]["ratio"] > 50
    gains = ran.document["designs"]["x"]["gains"]
    assert ran.held["x"].proportional == pytest.approx(gains["proportional"], rel=1e-6)
    assert ran.held["x"].ripple_cosine == pytest.approx(gains["ripple_cosine"], rel=1e-6)
    assert any(ran.held["x"].ripple_cosine)
    assert "  read back  the designed gains" in list(ran.lines())
    assert (tmp_path / "run" / "report.html").is_file()
