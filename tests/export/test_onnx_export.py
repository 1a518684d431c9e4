"""What leaves torch: the same function, nothing but the network in the file, and only if good."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

torch = pytest.importorskip("torch")
onnx = pytest.importorskip("onnx")
pytest.importorskip("onnxscript")

import onnxruntime  # noqa: E402

from edge_ident.errors import ModelError  # noqa: E402
from edge_ident.estimation.manifest import BUILT_IN, VARIANTS, load_manifest  # noqa: E402
from edge_ident.estimation.network import Network, load_network  # noqa: E402
from export import evaluate, onnx_export, quantization  # noqa: E402
from export.checkpoint import Checkpoint, save  # noqa: E402
from export.configuration import IMPROVED, Configuration  # noqa: E402
from export.evaluate import DriveSet, evaluation_drives  # noqa: E402
from export.manifest import describe  # noqa: E402
from export.network import ResidualNetwork  # noqa: E402
from export.onnx_export import INT8_LIMIT, check_parity, check_quantization, export, to_onnx  # noqa: E402
from export.torch_runtime import TorchNetwork  # noqa: E402
from tests.edge_ident.stand_ins import MOTION, START, StandIn, nothing  # noqa: E402

SMALL = replace(IMPROVED, motions=2, drives_with_effect=0)


@pytest.fixture(scope="module")
def network() -> ResidualNetwork:
    torch.manual_seed(5)
    return ResidualNetwork().eval()


@pytest.fixture(scope="module")
def model(network: ResidualNetwork) -> "onnx.ModelProto":
    return to_onnx(network)


@pytest.fixture
def small(few_effects: None, model: "onnx.ModelProto", monkeypatch: pytest.MonkeyPatch) -> None:
    """Few images and drives, the first dense layer rounded weight by weight."""
    for name, size in {"DRIVES": 8, "MOTIONS": 2, "DRIVES_WITH_EFFECT": 1}.items():
        monkeypatch.setattr(evaluate, name, size)
    for name in ("CALIBRATION_IMAGES", "ROUNDING_IMAGES"):
        monkeypatch.setattr(onnx_export, name, onnx_export.BATCH)
    monkeypatch.setattr(onnx_export, "to_onnx", lambda network: model)
    monkeypatch.setattr(quantization, "_round_first_dense", lambda *_: None)


def finished(path: Path, network: ResidualNetwork, configuration: Configuration = SMALL) -> Path:
    """The checkpoint of a run that ended with this network."""
    weights, steps = network.state_dict(), configuration.steps
    save(
        Checkpoint(configuration, MOTION, "network", steps, 1.0, weights, {}, {}, ()),
        path,
    )
    return path


# ---- the file


def test_onnxruntime_computes_what_torch_does(
    network: ResidualNetwork, model: "onnx.ModelProto"
) -> None:
    session = onnxruntime.InferenceSession(model.SerializeToString())
    for count in (1, 5):
        images = torch.randn(count, 1, 100, 100)
        (found,) = session.run(None, {"image": images.numpy()})
        with torch.no_grad():
            np.testing.assert_allclose(found, network(images).numpy(), atol=1e-6)


def test_no_path_of_the_machine_is_in_the_file(model: "onnx.ModelProto") -> None:
    content = model.SerializeToString()
    assert str(Path(__file__).parents[2]).encode() not in content
    assert b"site-packages" not in content
    assert b".py" not in content


def test_int8_is_all_from_the_second_convolution_to_the_first_dense_layer(
    network: ResidualNetwork, model: "onnx.ModelProto", monkeypatch: pytest.MonkeyPatch
) -> None:
    """What stays in floating point would cost accuracy and saves little."""
    images = np.random.default_rng(1).normal(size=(4, 1, 100, 100)).astype(np.float32)
    with torch.no_grad():
        features = network.pooled_layers(
            torch.nn.functional.max_pool2d(network.first(torch.from_numpy(images)), 2)
        )[-1].flatten(1)
    seen: list[np.ndarray] = []

    def nearest(weights: np.ndarray, scales: np.ndarray, *rest: object) -> np.ndarray:
        seen.append(weights)
        return np.round(weights / scales[:, None]).astype(np.int8)

    monkeypatch.setattr(quantization, "round_to_grid", nearest)
    quantized = quantization.quantize(model, images, features.numpy().astype(np.float64))
    np.testing.assert_array_equal(seen[0], network.dense[0].weight.detach().numpy())
    sizes: dict[int, int] = {}
    for item in quantized.graph.initializer:
        sizes[item.data_type] = sizes.get(item.data_type, 0) + int(np.prod(item.dims))
    assert sizes[onnx.TensorProto.INT8] >= 10 * 10 * 25 + 10 * 10 * 9 + 3610 * 100
    assert 810 + 10_000 + 400 <= sizes[onnx.TensorProto.FLOAT] < 13_000


# ---- the checks


def test_another_function_than_torchs_is_not_exported(
    network: ResidualNetwork, model: "onnx.ModelProto"
) -> None:
    manifest = describe(SMALL, MOTION, {"fp32": b"", "int8": b""})
    exported = Network(model.SerializeToString, manifest, "fp32")
    images = np.random.default_rng(1).normal(size=(4, 1, 100, 100)).astype(np.float32)
    check_parity(network, exported, images)
    torch.manual_seed(6)
    with pytest.raises(ModelError, match="differs from torch's"):
        check_parity(ResidualNetwork().eval(), exported, images)


@pytest.fixture
def drives(small: None) -> DriveSet:
    return evaluation_drives(MOTION, 100).clean


def test_int8_may_move_a_parameter_by_one_per_cent_of_its_range(drives: DriveSet) -> None:
    """Stand-ins that stay where they start, at shares that differ in one parameter."""
    fp32 = StandIn(nothing, START)

    def int8(change: float) -> StandIn:
        return StandIn(nothing, (START[0], START[1] + change, *START[2:]))

    check_quantization(fp32, int8(0.9 * INT8_LIMIT), drives)
    with pytest.raises(ModelError, match=r"moves the viscous_friction of a drive by 1\.10%"):
        check_quantization(fp32, int8(1.1 * INT8_LIMIT), drives)


def test_torch_runs_in_the_loop_as_onnxruntime_would(
    network: ResidualNetwork, model: "onnx.ModelProto"
) -> None:
    trained = Checkpoint(SMALL, MOTION, "network", SMALL.steps, 1.0, {}, {}, {}, ())
    in_torch = TorchNetwork(network, trained)
    exported = Network(model.SerializeToString, in_torch.manifest, "fp32")
    images = np.random.default_rng(1).normal(size=(4, 1, 100, 100)).astype(np.float32)
    np.testing.assert_allclose(
        in_torch.residual_shares(images), exported.residual_shares(images), atol=1e-4
    )
    assert in_torch.manifest.start_shares is not None


# ---- from checkpoint to files


def test_export_writes_both_variants_and_a_manifest_that_describes_them(
    tmp_path: Path, network: ResidualNetwork, small: None, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(onnx_export, "INT8_LIMIT", np.inf)  # nobody trained this network
    stages: list[str] = []
    manifest = export(finished(tmp_path / "run.pt", network), tmp_path / "out", stages.append)
    assert stages == ["recording", "exporting", "quantizing", "evaluating"]
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == [
        "feed_drive.json",
        "feed_drive_fp32.onnx",
        "feed_drive_int8.onnx",
    ]
    described = load_manifest(manifest)
    assert described.start_shares is not None
    np.testing.assert_array_equal(described.start_shares, START)
    for variant in VARIANTS:
        loaded = load_network(path=tmp_path / "out" / f"feed_drive_{variant}.onnx")
        assert loaded.variant == variant
        assert np.all(described.parameter_std[variant] > 0.0)
    assert [entry.name for entry in described.evaluation][:2] == ["clean", "clean_int8"]
    fp32, int8 = ((tmp_path / "out" / f"feed_drive_{v}.onnx").stat().st_size for v in VARIANTS)
    assert int8 < 0.3 * fp32


def test_quantization_that_costs_too_much_replaces_nothing(
    tmp_path: Path, network: ResidualNetwork, small: None, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(onnx_export, "INT8_LIMIT", 0.0)
    output = tmp_path / "out"
    output.mkdir()
    (output / "feed_drive.json").write_text("the one before")
    with pytest.raises(ModelError, match="int8 moves the"):
        export(finished(tmp_path / "run.pt", network), output, lambda stage: None)
    assert [path.name for path in output.iterdir()] == ["feed_drive.json"]
    assert (output / "feed_drive.json").read_text() == "the one before"


def test_without_int8_the_other_network_is_written(
    tmp_path: Path, network: ResidualNetwork, small: None, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(onnx_export, "INT8_LIMIT", 0.0)
    output = tmp_path / "out"
    export(finished(tmp_path / "run.pt", network), output, lambda stage: None, int8=False)
    assert {path.name for path in output.iterdir()} == {"feed_drive.json", "feed_drive_fp32.onnx"}
    manifest = load_network(path=output / "feed_drive_fp32.onnx").manifest
    assert set(manifest.parameter_std) == set(manifest.sha256) == {"fp32"}
    assert not [entry.name for entry in manifest.evaluation if "int8" in entry.name]


def test_images_of_another_size_are_not_exported(tmp_path: Path) -> None:
    other = replace(SMALL, points=40)
    path = finished(tmp_path / "run.pt", ResidualNetwork(40), other)
    with pytest.raises(ModelError, match="takes images of 40 points"):
        export(path, tmp_path / "out", lambda stage: None)
    assert not (tmp_path / "out").exists()


def test_an_unfinished_run_is_not_exported(tmp_path: Path, network: ResidualNetwork) -> None:
    weights = network.state_dict()
    save(Checkpoint(SMALL, MOTION, "dense", 3, 1.0, weights, {}, {}, ()), tmp_path / "run.pt")
    with pytest.raises(ModelError, match="stopped in stage 'dense'"):
        export(tmp_path / "run.pt", tmp_path / "out", lambda stage: None)


# ---- the networks of the package


@pytest.mark.parametrize("variant", VARIANTS)
def test_the_packages_networks_hold_no_notes(variant: str) -> None:
    model = onnx.load(BUILT_IN.with_name(f"feed_drive_{variant}.onnx"))
    assert not any(node.metadata_props or node.doc_string for node in model.graph.node)
    assert not any(item.external_data for item in model.graph.initializer)


def test_the_packages_int8_identifies_the_same_parameters_as_fp32(drives: DriveSet) -> None:
    check_quantization(load_network("fp32"), load_network("int8"), drives)
