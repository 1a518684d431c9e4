"""The tool that runs on used machines and judges what came of it."""

from pathlib import Path

import numpy as np
import pytest

from firmware_interface.gains import CONSERVATIVE_GAINS
from firmware_interface.plant.drives import COUNT_RAD
from firmware_interface.plant.hiding import Hidden
from firmware_interface.registers import AXES
from tools.used_machine_table import gained, missed, over_ideal, table
from tools.used_machines import Case, _judged, main, one_run

SOFT = dict.fromkeys(AXES, CONSERVATIVE_GAINS)


def row(seed: int, after: float, *, exit_code: int = 0, ideal: float = 1.0) -> dict:
    """A run that leaves so many counts of a hundred, on all motions and axes."""

    def everywhere(counts: float) -> dict:
        return {on: dict.fromkeys(AXES, counts * COUNT_RAD) for on in ("second", "third")}

    errors = {"before": everywhere(100.0), "after": everywhere(after), "ideal": everywhere(ideal)}
    return {
        "seed": seed, "wear": 1.0, "friction": None, "options": [], "exit": exit_code,
        "command": f"run {seed}", "conclusion": "as it ended", "confirmed": after < 100.0,
        "writes": 1, "first_write_s": [1.0, 0.9], "computing_s": [9.0, 8.0],
        "errors_rad": errors, "grown": {"second": after / 100.0 - 1.0, "third": after / 100.0 - 1},
        "forecasts": [["sinusoid", "x", "rms_rad", after < 10.0, 1.1]],
    }  # fmt: skip


def test_the_table_counts_what_the_aims_ask_for() -> None:
    told = table([row(1, 1.5), row(2, 40.0, exit_code=1), row(3, 103.0)])
    assert "5 times better or 2 counts    1 of 3 (33%)" in told
    assert "worse by more than 2 %        1 (aim 0)" in told
    assert "90 % interval of the rms      1 of 3 (33%)" in told
    assert "run 1" not in told
    assert "run 2: gained 2.5 times; exit 1. as it ended" in told
    assert "run 3: gained 1.0 times; worse by 3%" in told


def test_an_error_counts_over_that_of_the_truth_with_a_twentieth_of_a_count_for_both() -> None:
    assert over_ideal(row(1, 1.5)) == pytest.approx([1.55 / 1.05] * 4)
    assert gained(row(1, 1.5)) == pytest.approx(100.0 / 1.55)
    slow = row(1, 1.5) | {"first_write_s": [9.0, 2.5], "computing_s": [99.0, 61.0]}
    assert missed(slow) == ["2.5 s to the first write", "61 s of computing"]


def test_gains_are_judged_by_the_true_motion_of_a_fresh_machine() -> None:
    """Those before are taken for those after: nothing is gained, and nothing lost."""
    found = _judged(Case(3, None, "lugre"), SOFT, None)
    body = Hidden.rubbing(3, "lugre").drives.chain.rigid_body[0]
    np.testing.assert_allclose(found["truth"], body, rtol=0.02, atol=0.01)
    assert found["errors_rad"]["after"] == found["errors_rad"]["before"]
    assert max(found["grown"].values()) <= 0.0
    again = _judged(Case(3, None, "lugre"), SOFT, found)
    assert again == found
    for of in found["errors_rad"]["ideal"].values():
        assert all(error < 5.0 * COUNT_RAD for error in of.values())


def test_a_run_is_made_once_and_noted(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A machine without wear is the documented kind: new gains stay, and the aims are met."""
    asked = ["--count", "1", "--wear", "0", "0", "--options=--no-diagnose", "--processes", "1"]
    asked += ["--output", str(tmp_path / "rows.jsonl")]
    main(asked)
    assert "gains written and kept        1 of 1" in capsys.readouterr().out
    main(asked)
    assert len((tmp_path / "rows.jsonl").read_text().splitlines()) == 1


def test_a_run_says_what_was_written_and_how_long_was_computed() -> None:
    noted = one_run(Case(2, 0.0, None, ("--no-diagnose", "--dry-run")))
    assert noted["exit"] == 0
    assert noted["writes"] == 0
    assert noted["first_write_s"] is None
    assert noted["computing_s"][1] > 0.0
    assert noted["moving_s"] < noted["board_s"] < noted["moving_s"] + 2.0
    assert noted["errors_rad"]["after"] == noted["errors_rad"]["before"]
