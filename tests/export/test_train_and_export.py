"""From train to the files of export, by the commands of docs/training.md with a small recipe."""

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from typer.testing import CliRunner

torch = pytest.importorskip("torch")
pytest.importorskip("onnxscript")

from edge_ident.cli import app  # noqa: E402
from edge_ident.estimation.network import load_network  # noqa: E402
from export import configuration, data, evaluate, onnx_export, quantization, train  # noqa: E402
from export.onnx_export import Change, Exported  # noqa: E402
from export.rounding import Array  # noqa: E402
from export.train import TrainingProgress  # noqa: E402

SMALL = replace(
    configuration.IMPROVED,
    motions=2,
    drives_with_effect=1,
    head_steps=4,
    dense_steps=6,
    dense_examples=500,
    steps=4,
    batch=8,
)


@pytest.fixture(autouse=True)
def _small(few_effects: None, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(configuration.CONFIGURATIONS, "improved", SMALL)
    monkeypatch.setattr(data, "BASIS_EXAMPLES", 200)
    for name, size in {"TEST_EXAMPLES": 32, "HEAD_BATCH": 128, "CURVE_POINTS": 2}.items():
        monkeypatch.setattr(train, name, size)
    for name, size in {"DRIVES": 8, "MOTIONS": 2, "DRIVES_WITH_EFFECT": 1}.items():
        monkeypatch.setattr(evaluate, name, size)
    for name in ("CALIBRATION_IMAGES", "EQUALIZED_IMAGES", "ROUNDING_IMAGES"):
        monkeypatch.setattr(onnx_export, name, onnx_export.BATCH)
    # that of 3610 inputs takes minutes on a busy machine
    monkeypatch.setattr(quantization, "round_to_grid", _nearest)


def _nearest(weights: Array, scales: Array, *_: object) -> NDArray[np.int8]:
    return np.round(weights / scales[:, None]).astype(np.int8)


def test_train_and_export_end_with_networks_that_load(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    run, networks = tmp_path / "mine", tmp_path / "networks"
    trained = CliRunner().invoke(app, ["train", "--output", str(run)])
    assert trained.exit_code == 0, trained.stderr
    assert trained.stdout.split() == [str(run / "checkpoint.pt")]

    # so little training makes no network that could be judged by its change
    monkeypatch.setattr(onnx_export, "INT8_LIMIT", np.inf)
    done = CliRunner().invoke(
        app, ["export", str(run / "checkpoint.pt"), "--output", str(networks)]
    )
    assert done.exit_code == 0, done.stderr
    assert done.stdout.split() == [str(networks / "feed_drive.json")]
    assert "int8 moves the" in done.stderr
    assert not [word for word in ("Warning", "WARNING", "onnxruntime") if word in done.stderr]
    for variant in ("fp32", "int8"):
        assert load_network(path=networks / f"feed_drive_{variant}.onnx").variant == variant


def test_export_says_that_int8_was_left_out_and_ends_with_1(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    manifest, change = tmp_path / "feed_drive.json", Change("viscous_friction", 0.0104)
    monkeypatch.setattr(onnx_export, "export", lambda *_, **__: Exported(manifest, change))
    done = CliRunner().invoke(app, ["export", "some.pt"])
    assert (done.exit_code, done.stdout.split()) == (1, [str(manifest)])
    assert "int8 moves the viscous_friction of a drive by 1.04% of its range" in done.stderr
    assert "only the fp32 network was written" in done.stderr
    done = CliRunner().invoke(app, ["export", "some.pt", "--json"])
    assert done.exit_code == 1
    document = json.loads(done.stdout)
    assert document["int8"] == {"parameter": "viscous_friction", "share": 0.0104, "written": False}


def test_an_interrupted_training_says_how_it_goes_on(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupted(*_: object, on_progress: Callable[[TrainingProgress], None], **__: object):  # type: ignore[no-untyped-def]
        on_progress(TrainingProgress("head", 40, 100, 0.25, 60.0, 240.0))
        raise KeyboardInterrupt

    monkeypatch.setattr(train, "train", interrupted)
    done = CliRunner().invoke(app, ["train", "--output", str(tmp_path)])
    assert done.exit_code == 130
    assert "the same command with --resume continues the training" in done.stderr
