"""Training for a machine whose effects are known: every drive has them, at the model's values."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

pytest.importorskip("torch")

from edge_ident.cli import app
from edge_ident.errors import ModelError
from edge_ident.estimation.image import effort_scale
from edge_ident.estimation.manifest import load_manifest
from edge_ident.model.model import BASE, PARAMETERS, AxisModel, Model, Term
from edge_ident.model.model_files import save_model
from edge_ident.signals.metrics import subsample
from export import evaluate
from export.checkpoint import Checkpoint, load, save
from export.configuration import IMPROVED, PAPER
from export.data import Batches
from export.drives import efforts
from export.manifest import describe, write
from export.motion import TrainingMotion, paper_motion, with_effects
from export.recordings import KNOWN_DRIVES, make_recordings

POINTS = 100
TRUTH = (0.43, 0.9, 1.4, 0.03)
BASE_TERM = Term(BASE, dict(zip(PARAMETERS, TRUTH, strict=True)))
LOAD = Term("position_dependent_load", {
    "stiffness": 0.05, "curvature": 0.0, "cosine": 0.0, "sine": 0.0, "period": 1.0,
})  # fmt: skip
DIRECTION = Term("asymmetric_friction", {"difference": 0.2}, {"difference": 0.02})
COUPLING = Term("cross_axis_coupling", {
    "inertia": 0.1, "viscous_friction": 0.0, "coulomb_friction": 0.0,
}, source_axis="z")  # fmt: skip


def model(*effects: Term) -> Model:
    return Model({"x": AxisModel((BASE_TERM, *effects)), "z": AxisModel((BASE_TERM,))})


def motion(*effects: Term) -> TrainingMotion:
    steady = replace(paper_motion(), largest_lag=0.0)
    return with_effects(steady, model(*effects), "x")


def own_scale(of: TrainingMotion) -> float:
    """Scale of the effort that the model's base term needs."""
    effort = of.scaled_regressor(POINTS) @ (np.array(TRUTH) * of.column_scales)
    return float(effort_scale(effort[None], "effort-scale")[0])


def added(*effects: Term) -> tuple[TrainingMotion, np.ndarray]:
    """What known effects add on two motions, in N·m."""
    of = motion(*effects)
    made = make_recordings(of, POINTS, np.random.default_rng(1), motions=2, drives=0)
    assert made.known_parameters.shape == (2, KNOWN_DRIVES, 4)
    return of, made.known_added * own_scale(of)


def test_a_spring_adds_its_force_to_drives_of_the_machines_size() -> None:
    of, found = added(LOAD)
    spring = subsample(0.05 * of.position[:, None], POINTS)[:, 0]
    for effort in found.reshape(-1, POINTS):  # on motions of 3 % more or less
        np.testing.assert_allclose(effort, spring, atol=0.04 * np.max(np.abs(spring)))


def test_values_vary_within_their_deviation_and_nothing_else_does() -> None:
    of, found = added(DIRECTION)
    speed = subsample(np.abs(of.velocity)[:, None], POINTS)[:, 0]
    differences = found[0] @ speed / (speed @ speed)
    assert np.mean(differences) == pytest.approx(0.2, abs=0.012)
    assert np.std(differences) == pytest.approx(0.02, rel=0.4)
    _, fixed = added(replace(DIRECTION, std={}))
    assert np.std(fixed[0] @ speed / (speed @ speed)) < 1e-9


def test_the_other_axis_acts_with_its_own_motion() -> None:
    of, found = added(COUPLING)
    assert of.partner is not None
    pull = subsample(0.1 * of.partner[1][:, None], POINTS)[:, 0]
    np.testing.assert_allclose(found[0, 0], pull, atol=0.02 * np.max(np.abs(pull)))


def test_every_example_has_the_known_effect_and_the_configurations_on_top() -> None:
    plain = replace(IMPROVED, motions=2, drives_with_effect=0)
    of = motion(LOAD)
    examples = Batches(plain, of).examples(np.random.default_rng(3), 200)
    rest = examples.measured - efforts(examples.regressor, examples.truth)
    # sine on the paper's motion, in the direction of -acceleration's column
    spring = -examples.regressor[..., 0]
    strength = np.sum(rest * spring, axis=1) / np.sum(spring**2, axis=1)
    alone = 0.05 * 2 * np.pi / own_scale(of)
    assert np.all(strength > 0.4 * alone)
    assert np.quantile(strength, 0.95) < 1.3 * alone


def test_figures_are_of_drives_with_the_known_effect(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(evaluate, "MOTIONS", 2)
    monkeypatch.setattr(evaluate, "DRIVES", 20)
    monkeypatch.setattr(evaluate, "DRIVES_WITH_EFFECT", 1)
    monkeypatch.setattr("export.recordings.catalogue", dict)
    found = evaluate.evaluation_drives(motion(LOAD), POINTS)
    for drives in (found.clean, found.noisy):
        rest = drives.effort - drives.base_effort
        assert np.all(np.std(rest, axis=1) > 0.02 * np.std(drives.effort, axis=1))


def test_checkpoint_and_manifest_keep_what_was_known(tmp_path: Path) -> None:
    known = motion(LOAD, DIRECTION)
    run = Checkpoint(IMPROVED, known, "network", 0, 0.0, {}, {}, {}, ())
    save(run, tmp_path / "run.pt")
    assert load(tmp_path / "run.pt").motion.known == known.known
    write(describe(IMPROVED, known, {"fp32": b"", "int8": b""}), tmp_path / "network.json")
    found = load_manifest(tmp_path / "network.json")
    assert found.motion.effects == ("position_dependent_load", "asymmetric_friction")


def test_what_cannot_be_trained_for_is_refused() -> None:
    paper = paper_motion()
    with pytest.raises(ModelError, match="trained for one axis; the model has x, z"):
        with_effects(paper, model(LOAD), None)
    with pytest.raises(ModelError, match="has no effects"):
        with_effects(paper, model(LOAD), "z")
    with pytest.raises(ModelError, match="in rad and N\\*m, the motion in m and N"):
        with_effects(replace(paper, position_unit="m", effort_unit="N"), model(LOAD), "x")
    with pytest.raises(ModelError, match="needs the other axis"):
        with_effects(replace(paper, partner=None), model(COUPLING), "x")
    with pytest.raises(ModelError, match="the paper's recipe knows no effects"):
        Batches(PAPER, motion(LOAD))


def test_the_command_trains_for_the_model_that_it_is_given(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    trained: list[TrainingMotion] = []

    def train(configuration: object, motion: TrainingMotion, output: Path, **_: object) -> Path:
        trained.append(motion)
        return output

    monkeypatch.setattr("export.train.train", train)
    save_model(model(LOAD), tmp_path / "known.json")
    arguments = ["train", "--output", str(tmp_path), "--model", str(tmp_path / "known.json")]
    refused = CliRunner().invoke(app, arguments)
    assert refused.exit_code == 5
    assert "--axis" in refused.stderr
    done = CliRunner().invoke(app, [*arguments, "--axis", "x"])
    assert done.exit_code == 0, done.stderr
    assert trained[0].known == model(LOAD).axes["x"]
