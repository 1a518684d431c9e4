"""Training: a run that was interrupted gives the network of one that was not."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

torch = pytest.importorskip("torch")

from edge_ident.errors import ModelError  # noqa: E402
from export import data, train, warm_start  # noqa: E402
from export.checkpoint import load, trained_network  # noqa: E402
from export.configuration import CONFIGURATIONS, IMPROVED, PAPER, configuration  # noqa: E402
from export.train import TrainingProgress, relative_loss, sigmoid_loss  # noqa: E402

TINY = replace(IMPROVED, head_steps=4, steps=4, batch=8)


@pytest.fixture(autouse=True)
def _small_and_talkative(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(data, "MOTIONS", 2)
    monkeypatch.setattr(warm_start, "READ_IMAGES", 16)
    monkeypatch.setattr(train, "REPORT_EVERY_S", 0.0)
    monkeypatch.setattr(train, "SAVE_EVERY_S", 0.0)


def run(path: Path, on_progress: Callable[[TrainingProgress], None], *, resume: bool) -> Path:
    return train.train(TINY, path, resume=resume, accelerator=None, on_progress=on_progress)


def interrupt_at(stage: str, step: int) -> Callable[[TrainingProgress], None]:
    def on_progress(progress: TrainingProgress) -> None:
        if (progress.stage, progress.step) == (stage, step):
            raise KeyboardInterrupt

    return on_progress


def test_resumed_run_equals_an_uninterrupted_one(tmp_path: Path) -> None:
    whole = run(tmp_path / "whole.pt", lambda _: None, resume=False)
    parts = tmp_path / "parts.pt"
    with pytest.raises(KeyboardInterrupt):
        run(parts, interrupt_at("head", 3), resume=False)
    assert load(parts).step == 2
    with pytest.raises(KeyboardInterrupt):
        run(parts, interrupt_at("network", 3), resume=True)
    assert (load(parts).stage, load(parts).step) == ("network", 2)
    run(parts, lambda _: None, resume=True)
    expected, found = load(whole).network, load(parts).network
    for name, weights in expected.items():
        torch.testing.assert_close(found[name], weights, rtol=0.0, atol=0.0)


def test_progress_counts_up_in_every_stage(tmp_path: Path) -> None:
    seen: list[TrainingProgress] = []
    run(tmp_path / "run.pt", seen.append, resume=False)
    assert [(p.stage, p.step) for p in seen] == [
        (stage, step) for stage in ("head", "network") for step in (1, 2, 3, 4)
    ]
    assert seen[-1].examples == 32
    assert seen[-1].elapsed_s > 0.0


def test_an_unfinished_run_is_not_exported(tmp_path: Path) -> None:
    with pytest.raises(KeyboardInterrupt):
        run(tmp_path / "run.pt", interrupt_at("head", 2), resume=False)
    with pytest.raises(ModelError, match="stopped in stage 'head'"):
        trained_network(tmp_path / "run.pt")


def test_a_checkpoint_is_neither_overwritten_nor_resumed_by_another_run(tmp_path: Path) -> None:
    path = run(tmp_path / "run.pt", lambda _: None, resume=False)
    with pytest.raises(ModelError, match="exists already"):
        run(path, lambda _: None, resume=False)
    with pytest.raises(ModelError, match="belongs to configuration"):
        train.train(PAPER, path, resume=True, accelerator=None, on_progress=lambda _: None)


def test_a_damaged_checkpoint_is_an_error(tmp_path: Path) -> None:
    (tmp_path / "run.pt").write_bytes(b"no checkpoint")
    with pytest.raises(ModelError, match="not a checkpoint"):
        load(tmp_path / "run.pt")
    with pytest.raises(ModelError, match="no such checkpoint"):
        load(tmp_path / "none.pt")


def test_the_papers_recipe_trains_from_random_weights(tmp_path: Path) -> None:
    recipe = replace(PAPER, steps=3)
    seen: list[TrainingProgress] = []
    path = train.train(
        recipe, tmp_path / "p.pt", resume=False, accelerator=None, on_progress=seen.append
    )
    assert {progress.stage for progress in seen} == {"network"}
    assert load(path).complete


def test_losses_vanish_at_the_truth_and_small_residuals_count() -> None:
    residual = torch.tensor([[0.5, 0.0, 0.0, 0.0], [0.01, 0.0, 0.0, 0.0]])
    for loss in (sigmoid_loss, relative_loss):
        assert loss(residual, residual) == 0.0
    error = torch.tensor([[0.01, 0.0, 0.0, 0.0]])
    large, small = (relative_loss(r[None] + error, r[None]) for r in residual)
    assert small > 100 * large


def test_configurations_are_found_by_name() -> None:
    assert configuration("paper") is PAPER
    assert configuration("improved") is IMPROVED
    with pytest.raises(ModelError, match="no training configuration"):
        configuration("other")
    assert all(name == entry.name for name, entry in CONFIGURATIONS.items())
