"""The benchmark's history: what earlier runs measured stands beside each ratio."""

from pathlib import Path

import pytest

from tools import bench


def test_the_history_gives_the_median_of_the_runs_before(tmp_path: Path) -> None:
    history = tmp_path / "new" / "bench.jsonl"
    assert bench.earlier_medians(history) == {}
    for ratio in (1.5, 1.7, 2.5):
        bench.note(history, {"a part": ratio})
    bench.note(history, {"another": 0.7})
    assert bench.earlier_medians(history) == {"a part": 1.7, "another": 0.7}


def test_every_part_is_measured_beside_its_opponent(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    history = tmp_path / "bench.jsonl"
    monkeypatch.setattr("sys.argv", ["bench", "--repetitions", "1", "--history", str(history)])
    monkeypatch.setattr(bench, "link_ratio", lambda repetitions: {"a request": 3.0})
    bench.main()
    lines = capsys.readouterr().out.splitlines()
    ratios = bench.earlier_medians(history)
    assert len(ratios) == len(bench.BATCHES) + 3
    assert all(ratio > 0.0 for ratio in ratios.values())
    assert len(lines) == len(ratios) + 2
