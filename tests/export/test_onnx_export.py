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
from export.data import Batch, Batches  # noqa: E402
from export.evaluate import DriveSet, evaluation_drives  # noqa: E402
from export.manifest import describe  # noqa: E402
from export.network import ResidualNetwork  # noqa: E402
from export.onnx_export import INT8_LIMIT, check_parity, export, largest_change, to_onnx  # noqa: E402
from export.quantization import equalized, input_moments  # noqa: E402
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
    """Few images and drives, weights rounded one by one."""
    for name, size in {"DRIVES": 8, "MOTIONS": 2, "DRIVES_WITH_EFFECT": 1}.items():
        monkeypatch.setattr(evaluate, name, size)
    for name in ("CALIBRATION_IMAGES", "EQUALIZED_IMAGES", "ROUNDING_IMAGES"):
        monkeypatch.setattr(onnx_export, name, onnx_export.BATCH)
    monkeypatch.setattr(onnx_export, "to_onnx", lambda network: model)
    monkeypatch.setattr(quantization, "_round_again", lambda *_: None)


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


@pytest.fixture(scope="module")
def batches() -> list[Batch]:
    """Drives of the paper's motion."""
    stream = Batches(replace(IMPROVED, drives="halves"), MOTION)
    return [stream.batch("test", number, 32) for number in range(2)]


def test_int8_is_all_from_the_second_convolution_to_the_first_dense_layer(
    network: ResidualNetwork,
    model: "onnx.ModelProto",
    batches: list[Batch],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """What stays in floating point would cost accuracy and saves little."""
    images = np.random.default_rng(1).normal(size=(4, 1, 100, 100)).astype(np.float32)
    seen: dict[int, np.ndarray] = {}

    def nearest(
        weights: np.ndarray, scales: np.ndarray, moment: np.ndarray, damping: float
    ) -> np.ndarray:
        assert moment.shape == (weights.shape[1], weights.shape[1])
        seen[weights.shape[1]] = weights
        return np.round(weights / scales[:, None]).astype(np.int8)

    monkeypatch.setattr(quantization, "round_to_grid", nearest)
    quantized = quantization.quantize(model, images, input_moments(network, batches))
    np.testing.assert_array_equal(seen[3610], network.dense[0].weight.detach().numpy())
    assert set(seen) == {250, 90, 3610}
    sizes: dict[int, int] = {}
    for item in quantized.graph.initializer:
        sizes[item.data_type] = sizes.get(item.data_type, 0) + int(np.prod(item.dims))
    assert sizes[onnx.TensorProto.INT8] >= 10 * 10 * 25 + 10 * 10 * 9 + 3610 * 100
    assert 810 + 10_000 + 400 <= sizes[onnx.TensorProto.FLOAT] < 13_000
    levels = {
        item.name: int(onnx.numpy_helper.to_array(item))
        for item in quantized.graph.initializer
        if item.data_type == onnx.TensorProto.INT8 and not item.dims
    }
    # behind ReLU no level is spent on what is below zero
    assert {zero for zero in levels.values() if zero} == {-128}


def test_equalized_maps_have_one_range_and_the_function_stays(
    network: ResidualNetwork, batches: list[Batch]
) -> None:
    even = equalized(network, batches)
    for batch in batches:
        with torch.no_grad():
            torch.testing.assert_close(
                even.residuals(*batch.factors), network.residuals(*batch.factors)
            )
    with torch.no_grad():
        outputs = [even.maps(*batch.factors) for batch in batches]
    for layer in (1, 2):
        largest = torch.stack([maps[layer].amax(dim=(0, 2, 3)) for maps in outputs]).amax(dim=0)
        used = largest[largest > 0.0]
        assert len(used) > 4
        torch.testing.assert_close(used, used.max().expand_as(used))
    torch.testing.assert_close(even.first.weight, network.first.weight, rtol=0.0, atol=0.0)


def test_moments_are_those_of_what_a_layer_multiplies(
    network: ResidualNetwork, batches: list[Batch]
) -> None:
    """The mean square of a layer's outputs follows from them."""
    moments = input_moments(network, batches)
    with torch.no_grad():
        features = torch.cat([network.features(*b.factors).flatten(1) for b in batches])
        outputs = network.dense_layer(0)(features).square().sum(dim=0).numpy()
    weights = network.dense_layer(0).weight.detach().numpy().astype(np.float64)
    found = np.einsum("oi,ij,oj->o", weights, moments["dense.0.weight"], weights)
    np.testing.assert_allclose(found, outputs, rtol=1e-4)


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

    assert largest_change(fp32, int8(0.9 * INT8_LIMIT), drives).small
    change = largest_change(fp32, int8(1.1 * INT8_LIMIT), drives)
    assert (change.parameter, change.share) == ("viscous_friction", pytest.approx(0.011))
    assert not change.small


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
    exported = export(finished(tmp_path / "run.pt", network), tmp_path / "out", stages.append)
    manifest = exported.manifest
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


def test_where_quantization_costs_too_much_fp32_alone_is_written(
    tmp_path: Path, network: ResidualNetwork, small: None, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Without the int8 network of an earlier export, which does not belong to this manifest."""
    monkeypatch.setattr(onnx_export, "INT8_LIMIT", 0.0)
    output = tmp_path / "out"
    output.mkdir()
    (output / "feed_drive_int8.onnx").write_text("the one before")
    exported = export(finished(tmp_path / "run.pt", network), output, lambda stage: None)
    assert exported.int8 is not None
    assert exported.int8.share > 0.0
    assert "only the fp32 network was written" in str(exported.int8)
    assert {path.name for path in output.iterdir()} == {"feed_drive.json", "feed_drive_fp32.onnx"}
    manifest = load_network(path=output / "feed_drive_fp32.onnx").manifest
    assert set(manifest.parameter_std) == set(manifest.sha256) == {"fp32"}
    assert not [entry.name for entry in manifest.evaluation if "int8" in entry.name]


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
    assert largest_change(load_network("fp32"), load_network("int8"), drives).share < 0.003
