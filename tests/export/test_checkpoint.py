"""Checkpoints come back as they went, or say what is wrong with them."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

torch = pytest.importorskip("torch")

from edge_ident.errors import ModelError  # noqa: E402
from edge_ident.signals.recording import AxisRecord, Recording  # noqa: E402
from export.checkpoint import Checkpoint, Loss, load, save, trained_network  # noqa: E402
from export.configuration import IMPROVED, PAPER, Configuration  # noqa: E402
from export.motion import TrainingMotion, motion_from, paper_motion  # noqa: E402
from export.network import ResidualNetwork  # noqa: E402

SMALL = replace(IMPROVED, points=40, steps=6)


def recorded_motion() -> TrainingMotion:
    """Of a recording, with numpy's own numbers in it and no partner."""
    time = 0.004 * np.arange(3000)
    position = 1e-4 * np.round(1e4 * np.sin(2.0 * np.pi * time / 4.0))
    axis = AxisRecord(position, position, "m", "N")
    return motion_from(Recording(time, {"q": axis}, "test"), None, "carriage")


def checkpoint(
    configuration: Configuration, motion: TrainingMotion, stage: str = "network", step: int = 6
) -> Checkpoint:
    torch.manual_seed(3)
    network = ResidualNetwork(configuration.points)
    optimizer = torch.optim.Adam(network.parameters())
    torch.stack([weights.sum() for weights in network.parameters()]).sum().backward()
    optimizer.step()
    return Checkpoint(
        configuration=configuration,
        motion=motion,
        stage=stage,
        step=step,
        elapsed_s=12.5,
        network=network.state_dict(),
        head={},
        optimizer=optimizer.state_dict(),
        losses=(Loss("head", 5, 0.25, 0.5), Loss("network", 6, 0.125, 0.0625)),
    )


@pytest.mark.parametrize("motion", [paper_motion(), recorded_motion()], ids=["paper", "recorded"])
@pytest.mark.parametrize("configuration", [SMALL, replace(PAPER, points=40)], ids=["start", "none"])
def test_a_checkpoint_comes_back_whole(
    tmp_path: Path, configuration: Configuration, motion: TrainingMotion
) -> None:
    written = checkpoint(configuration, motion)
    save(written, tmp_path / "new" / "run.pt")
    read = load(tmp_path / "new" / "run.pt")
    assert read.configuration == configuration
    for name in ("stage", "step", "elapsed_s", "head", "losses"):
        assert getattr(read, name) == getattr(written, name)
    for name, value in vars(motion).items():
        np.testing.assert_array_equal(getattr(read.motion, name), value)
        assert isinstance(getattr(read.motion, name), np.ndarray) == isinstance(value, np.ndarray)
    for name, weights in written.network.items():
        assert torch.equal(read.network[name], weights)
    assert str(read.optimizer) == str(written.optimizer)


def test_the_trained_network_is_that_of_its_weights_and_points(tmp_path: Path) -> None:
    written = checkpoint(SMALL, paper_motion())
    save(written, tmp_path / "run.pt")
    network, _ = trained_network(tmp_path / "run.pt")
    assert network.points == 40
    assert torch.equal(network.first.weight, written.network["first.weight"])
    assert not network.training


@pytest.mark.parametrize(("stage", "step"), [("head", 6), ("dense", 2), ("network", 5)])
def test_an_unfinished_run_has_no_network_yet(tmp_path: Path, stage: str, step: int) -> None:
    save(checkpoint(SMALL, paper_motion(), stage, step), tmp_path / "run.pt")
    with pytest.raises(ModelError, match=f"stopped in stage '{stage}' at step {step}"):
        trained_network(tmp_path / "run.pt")


def test_a_new_checkpoint_takes_the_old_ones_place_only_when_it_is_whole(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "run.pt"
    save(checkpoint(SMALL, paper_motion(), step=4), path)

    def full_disk(content: object, to: Path) -> None:
        Path(to).write_bytes(b"half")
        raise OSError("no space left on device")

    monkeypatch.setattr(torch, "save", full_disk)
    with pytest.raises(OSError, match="no space"):
        save(checkpoint(SMALL, paper_motion(), step=5), path)
    assert load(path).step == 4


def test_a_damaged_or_missing_checkpoint_is_an_error(tmp_path: Path) -> None:
    path = tmp_path / "run.pt"
    with pytest.raises(ModelError, match="no such checkpoint"):
        load(path)
    path.write_bytes(b"no checkpoint")
    with pytest.raises(ModelError, match="not a checkpoint"):
        load(path)
    save(checkpoint(SMALL, paper_motion()), path)
    path.write_bytes(path.read_bytes()[:2000])
    with pytest.raises(ModelError, match="not a checkpoint"):
        load(path)
    torch.save({"stage": "network"}, path)
    with pytest.raises(ModelError, match="not a checkpoint"):
        load(path)
