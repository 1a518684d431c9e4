"""Training: a run that was interrupted gives the network of one that was not."""

import csv
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

torch = pytest.importorskip("torch")

from edge_ident.errors import ModelError  # noqa: E402
from export import data, train  # noqa: E402
from export.checkpoint import Loss, load, trained_network  # noqa: E402
from export.configuration import IMPROVED, PAPER, Configuration  # noqa: E402
from export.losses import (  # noqa: E402
    absolute_loss,
)
from export.motion import TrainingMotion, paper_motion  # noqa: E402
from export.time_left import STEP_S, TimeLeft  # noqa: E402
from export.train import TrainingProgress  # noqa: E402

TINY = replace(
    IMPROVED,
    points=40,
    motions=2,
    drives_with_effect=2,
    head_steps=4,
    dense_steps=4,
    dense_examples=500,
    steps=4,
    batch=8,
)
WITHOUT_EFFECTS = replace(TINY, drives_with_effect=0)
STAGES = ("recordings", "head", "features", "dense", "network")

Observer = Callable[[TrainingProgress], None]


@pytest.fixture(autouse=True)
def _small_and_talkative(few_effects: None, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(data, "BASIS_EXAMPLES", 200)
    monkeypatch.setattr(train, "TEST_EXAMPLES", 32)
    monkeypatch.setattr(train, "HEAD_BATCH", 128)
    monkeypatch.setattr(train, "CURVE_POINTS", 2)
    monkeypatch.setattr(train, "REPORT_EVERY_S", 0.0)
    monkeypatch.setattr(train, "SAVE_EVERY_S", 0.0)


def run(
    path: Path,
    on_progress: Observer = lambda _: None,
    *,
    resume: bool = False,
    recipe: Configuration = WITHOUT_EFFECTS,
    motion: TrainingMotion | None = None,
) -> Path:
    motion = motion or paper_motion()
    return train.train(
        recipe, motion, path, resume=resume, accelerator="cpu", on_progress=on_progress
    )


def interrupt_at(stage: str, step: int) -> Observer:
    def on_progress(progress: TrainingProgress) -> None:
        if (progress.stage, progress.step) == (stage, step):
            raise KeyboardInterrupt

    return on_progress


def curves(folder: Path) -> list[dict[str, str]]:
    with (folder / "losses.csv").open() as file:
        return list(csv.DictReader(file))


@pytest.mark.parametrize(
    "recipe",
    [TINY, pytest.param(replace(WITHOUT_EFFECTS, start_shares=None), marks=pytest.mark.thorough)],
    ids=["start", "random starts"],
)
def test_resumed_run_equals_an_uninterrupted_one(tmp_path: Path, recipe: Configuration) -> None:
    whole = run(tmp_path / "whole" / "run.pt", recipe=recipe)
    parts = tmp_path / "parts" / "run.pt"
    stops = [("head", 3), ("features", 500), ("dense", 3), ("network", 3)]
    left = [("head", 2), ("head", 4), ("dense", 2), ("network", 2)]
    for (stage, step), expected in zip(stops, left, strict=True):
        with pytest.raises(KeyboardInterrupt):
            run(parts, interrupt_at(stage, step), resume=parts.exists(), recipe=recipe)
        assert (load(parts).stage, load(parts).step) == expected
    run(parts, resume=True, recipe=recipe)
    expected_weights, found = load(whole).network, load(parts).network
    for name, weights in expected_weights.items():
        torch.testing.assert_close(found[name], weights, rtol=0.0, atol=0.0)
    assert load(parts).losses == load(whole).losses


def test_loss_curves_have_train_and_test_of_every_stage(tmp_path: Path) -> None:
    path = run(tmp_path / "run.pt")
    rows = curves(tmp_path)
    assert [(row["stage"], row["step"]) for row in rows] == [
        (stage, step) for stage in ("head", "dense", "network") for step in ("2", "4")
    ]
    assert all(float(row["train"]) > 0.0 and float(row["test"]) > 0.0 for row in rows)
    assert tuple(rows[0]) == Loss._fields
    assert [loss.test for loss in load(path).losses] == [float(row["test"]) for row in rows]


def test_the_test_loss_is_that_of_held_out_drives(tmp_path: Path) -> None:
    network, trained = trained_network(run(tmp_path / "run.pt"))
    held_out = data.Batches(WITHOUT_EFFECTS, trained.motion, held_out=True).batch("test", 0, 32)
    factors = (held_out.model_effort, held_out.measured_effort, held_out.offset)
    with torch.no_grad():
        found = network.residuals(*(data.tensor(factor) for factor in factors))
        loss = absolute_loss(found, data.tensor(held_out.residual))
    assert trained.losses[-1].test == pytest.approx(float(loss), rel=1e-5)


def test_dense_layers_and_network_go_on_where_the_head_ended(tmp_path: Path) -> None:
    """Linear regression passes the head's answer on: its loss does not start again."""
    recipe = replace(WITHOUT_EFFECTS, head_steps=30, dense_steps=2, dense_examples=1000, steps=2)
    run(tmp_path / "run.pt", recipe=recipe)
    test = {(row["stage"], int(row["step"])): float(row["test"]) for row in curves(tmp_path)}
    plain = run(tmp_path / "plain" / "run.pt", recipe=replace(recipe, head_steps=0))
    from_random_weights = load(plain).losses[-1].test
    assert test["dense", 2] < 2.0 * test["head", 30]
    assert test["network", 2] < 2.0 * test["head", 30]
    assert test["network", 2] < 0.5 * from_random_weights


def test_training_lowers_the_loss_on_held_out_drives(tmp_path: Path) -> None:
    recipe = replace(WITHOUT_EFFECTS, head_steps=60, dense_steps=1, steps=1)
    run(tmp_path / "run.pt", recipe=recipe)
    head = [float(row["test"]) for row in curves(tmp_path) if row["stage"] == "head"]
    assert head[-1] < head[0]


def test_progress_counts_up_in_every_stage(tmp_path: Path) -> None:
    seen: list[TrainingProgress] = []
    run(tmp_path / "run.pt", seen.append)
    assert tuple(dict.fromkeys(progress.stage for progress in seen)) == STAGES
    for stage in STAGES:
        steps = [progress.step for progress in seen if progress.stage == stage]
        assert steps == sorted(set(steps))
        assert steps[-1] == next(p.steps for p in seen if p.stage == stage)
    elapsed = [progress.elapsed_s for progress in seen]
    assert elapsed == sorted(elapsed)


def test_elapsed_time_goes_on_over_sessions(tmp_path: Path) -> None:
    path = tmp_path / "run.pt"
    with pytest.raises(KeyboardInterrupt):
        run(path, interrupt_at("head", 3))
    before = load(path).elapsed_s
    seen: list[TrainingProgress] = []
    run(path, seen.append, resume=True)
    assert load(path).elapsed_s > before > 0.0
    assert next(p for p in seen if p.stage == "head").elapsed_s > before


def test_a_resumed_run_goes_on_with_its_own_motion(tmp_path: Path) -> None:
    own = replace(paper_motion(), name="carriage", largest_lag=0.5)
    whole = run(tmp_path / "whole" / "run.pt", motion=own)
    parts = tmp_path / "parts" / "run.pt"
    with pytest.raises(KeyboardInterrupt):
        run(parts, interrupt_at("head", 3), motion=own)
    run(parts, resume=True, motion=paper_motion())
    assert load(parts).motion.name == "carriage"
    assert load(parts).losses == load(whole).losses


def test_an_unfinished_run_is_not_exported(tmp_path: Path) -> None:
    with pytest.raises(KeyboardInterrupt):
        run(tmp_path / "run.pt", interrupt_at("head", 2))
    with pytest.raises(ModelError, match="stopped in stage 'head'"):
        trained_network(tmp_path / "run.pt")


def test_a_checkpoint_is_neither_overwritten_nor_resumed_by_another_run(tmp_path: Path) -> None:
    path = run(tmp_path / "run.pt")
    with pytest.raises(ModelError, match="already exists"):
        run(path)
    with pytest.raises(ModelError, match="belongs to configuration"):
        run(path, resume=True, recipe=PAPER)


def test_resuming_begins_where_a_run_was_interrupted_before_its_first_checkpoint(
    tmp_path: Path,
) -> None:
    path = tmp_path / "run.pt"
    with pytest.raises(KeyboardInterrupt):
        run(path, interrupt_at("recordings", 1))
    assert not path.exists()
    assert load(run(path, resume=True)).complete


def test_a_finished_run_that_is_resumed_computes_nothing(tmp_path: Path) -> None:
    path = run(tmp_path / "run.pt")
    before = path.read_bytes()
    assert run(path, interrupt_at("recordings", 1), resume=True).read_bytes() == before


def test_time_left_is_that_of_all_stages_at_the_pace_of_this_session() -> None:
    """A machine that takes twice the time of each step has as much left as twice their sum."""
    recipe = replace(IMPROVED, motions=10, head_steps=100, dense_examples=1000, dense_steps=50)
    work_s = {
        "recordings": 10 * STEP_S["recordings"],
        "head": 100 * STEP_S["head"],
        "features": 1000 * STEP_S["features"],
        "dense": 50 * STEP_S["dense"],
        "network": recipe.steps * STEP_S["network"],
    }
    whole_s, left = sum(work_s.values()), TimeLeft(recipe, None)
    assert left.after("recordings", 0, 1.0) is None
    done_s = work_s["recordings"] + 40 * STEP_S["head"]
    assert left.after("head", 40, 2.0 * done_s) == pytest.approx(2.0 * (whole_s - done_s))
    assert left.after("network", recipe.steps, 9.0) == 0.0


def test_time_left_of_a_resumed_run_leaves_out_what_earlier_sessions_did(tmp_path: Path) -> None:
    path = tmp_path / "run.pt"
    with pytest.raises(KeyboardInterrupt):
        run(path, interrupt_at("network", 3))
    left, recipe = TimeLeft(WITHOUT_EFFECTS, load(path)), WITHOUT_EFFECTS
    recorded_s = recipe.motions * STEP_S["recordings"]
    two_steps_s = (recipe.steps - 2) * STEP_S["network"]
    assert left.after("recordings", recipe.motions, recorded_s) == pytest.approx(two_steps_s)
    assert left.after("network", 3, recorded_s + STEP_S["network"]) == pytest.approx(
        STEP_S["network"]
    )


def test_the_papers_recipe_trains_from_random_weights(tmp_path: Path) -> None:
    seen: list[TrainingProgress] = []
    path = run(tmp_path / "run.pt", seen.append, recipe=replace(PAPER, points=40, steps=3))
    assert {progress.stage for progress in seen} == {"network"}
    assert load(path).complete
    assert {row["stage"] for row in curves(tmp_path)} == {"network"}
