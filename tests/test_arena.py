"""The arena: the same signals for all, what is missing is said, the product needs none of it."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from edge_ident.signals.recording import Recording
from edge_ident.signals.recording_files import save_recording
from tests.edge_ident.diagnosis.select.test_search_parts import recorded, rigid, swing
from tests.test_docs import ROOT
from tools.arena import __main__ as arena
from tools.arena.ours import base_model, by_direction, curves
from tools.arena.signals import RUN_IN, Half, both_ways

LOCK = (ROOT / "tools/arena/requirements.lock").read_text("utf-8")
PACKAGES = sorted({c.package for c in arena.CONTESTANTS if c.package})


@pytest.fixture(scope="module")
def by_direction_drive() -> Recording:
    """A drive whose viscous friction is 0.3 larger forward than backward on average."""
    t, x, v, a = swing(period_s=1e-3, seconds=20.0)
    return recorded(t, x, rigid(v, a) + 0.3 * np.abs(v), noise=0.002, count=1e-7)


def left(recording: Recording, fit: arena.Fit) -> list[float]:
    return [other.left(fit(fitted)(other)) for fitted, other in both_ways(recording, "x")]


def test_each_model_describes_the_half_that_it_has_not_seen(by_direction_drive: Recording) -> None:
    base, by_hand, with_curves = (
        left(by_direction_drive, fit) for fit in (base_model, by_direction, curves)
    )
    assert min(base) > 0.03
    assert max(by_hand) < 0.005
    assert max(with_curves) < 0.3 * min(base)


def test_both_halves_are_fitted_and_none_is_scored_on_itself(by_direction_drive: Recording) -> None:
    (one, other), (again, first) = both_ways(by_direction_drive, "x")
    assert np.array_equal(one.effort, first.effort)
    assert np.array_equal(other.effort, again.effort)
    assert not np.array_equal(one.effort, other.effort)


def test_the_score_is_what_is_left_over_the_effort_where_it_is_scored(
    by_direction_drive: Recording,
) -> None:
    half = Half.of(by_direction_drive, "x")
    assert half.left(half.effort) == 0.0
    assert half.left(1.1 * half.effort) == pytest.approx(0.1)
    wrong_at_start = half.effort.copy()
    wrong_at_start[:RUN_IN] += 100.0
    assert half.left(wrong_at_start) == 0.0
    wrong_at_start[RUN_IN] += 100.0
    assert half.left(wrong_at_start) > 0.1


def test_what_is_not_installed_is_said_and_the_others_run(
    by_direction_drive: Recording,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    save_recording(by_direction_drive, tmp_path / "emps_train.csv")
    base = next(c for c in arena.CONTESTANTS if c.fit is base_model)
    absent = replace(base, name="absent, tuned", package="no-such-package")
    monkeypatch.setattr(arena, "CONTESTANTS", (absent, base))
    monkeypatch.setattr("sys.argv", ["arena", str(tmp_path), "--repeats", "1"])
    assert arena.main() == 0
    printed = capsys.readouterr().out
    assert "not installed: no-such-package" in printed
    assert "tools/arena/requirements.lock" in printed
    assert "absent, tuned" not in printed
    assert base.name in printed


@pytest.mark.parametrize("package", PACKAGES)
def test_a_contestant_is_pinned_with_its_hash_and_the_product_does_without(package: str) -> None:
    pinned = re.search(rf"^{package}==(\S+) --hash=sha256:[0-9a-f]{{64}}$", LOCK, re.MULTILINE)
    assert pinned is not None
    assert package not in (ROOT / "pyproject.toml").read_text("utf-8")
    assert f"{package} {pinned[1]}" in (ROOT / "docs/arena.md").read_text("utf-8")


def test_the_lock_file_names_no_place_to_load_from() -> None:
    assert "://" not in LOCK
    lines = [line for line in LOCK.splitlines() if not line.startswith("#")]
    assert len(lines) > 20
    assert all(re.fullmatch(r"[a-z0-9-]+==\S+ --hash=sha256:[0-9a-f]{64}", line) for line in lines)


def test_the_page_has_a_row_for_each_contestant() -> None:
    page = (ROOT / "docs/arena.md").read_text("utf-8")
    assert not [c.name for c in arena.CONTESTANTS if f"| {c.name} |" not in page]
