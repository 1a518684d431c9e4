"""Only networks that are whole, described and of the right shape are run."""

import hashlib
import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from edge_ident.errors import ModelError
from edge_ident.estimation.manifest import BUILT_IN, VARIANTS, Variant, load_manifest
from edge_ident.estimation.network import load_network
from export.configuration import IMPROVED
from export.manifest import describe, write
from export.motion import paper_motion

onnx = pytest.importorskip("onnx")


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A network of one layer in both variants, with its manifest."""
    contents = {variant: one_layer(0.01 if variant == "fp32" else 0.02) for variant in VARIANTS}
    for variant, content in contents.items():
        (tmp_path / f"small_{variant}.onnx").write_bytes(content)
    write(describe(IMPROVED, paper_motion(), contents), tmp_path / "small.json")
    return tmp_path


def one_layer(weight: float) -> bytes:
    """The sigmoid of the image's sum times a weight, four times."""
    helper = onnx.helper
    image = helper.make_tensor_value_info("image", onnx.TensorProto.FLOAT, ["n", 1, 100, 100])
    sigmoid = helper.make_tensor_value_info("sigmoid", onnx.TensorProto.FLOAT, ["n", 4])
    weights = onnx.numpy_helper.from_array(np.full((10_000, 4), weight, np.float32), "weights")
    nodes = [
        helper.make_node("Flatten", ["image"], ["flat"]),
        helper.make_node("MatMul", ["flat", "weights"], ["sum"]),
        helper.make_node("Sigmoid", ["sum"], ["sigmoid"]),
    ]
    graph = helper.make_graph(nodes, "small", [image], [sigmoid], [weights])
    opset = helper.make_opsetid("", 18)
    content: bytes = helper.make_model(
        graph, opset_imports=[opset], ir_version=9
    ).SerializeToString()
    return content


@pytest.mark.parametrize(("variant", "weight"), [("fp32", 0.01), ("int8", 0.02)])
def test_a_path_names_its_variant_and_residuals_are_before_the_sigmoid(
    folder: Path, variant: Variant, weight: float
) -> None:
    network = load_network(path=folder / f"small_{variant}.onnx")
    assert network.variant == variant
    assert network.sha256 == network.manifest.sha256[variant]
    images = np.zeros((2, 1, 100, 100), np.float32)
    images[1, 0, 3, :50] = 1.0
    residual = network.residual_shares(images)
    np.testing.assert_allclose(residual, [[0.0] * 4, [50.0 * weight] * 4], atol=1e-5)


def test_residuals_stay_finite_where_the_sigmoid_has_saturated(folder: Path) -> None:
    network = load_network(path=folder / "small_fp32.onnx")
    for sign in (1.0, -1.0):
        residual = network.residual_shares(np.full((1, 1, 100, 100), sign, np.float32))
        assert np.all(np.isfinite(residual))
        assert np.all(sign * residual > 10.0)


def test_a_network_that_gave_its_memory_back_answers_the_same_from_the_same_file_alone(
    folder: Path,
) -> None:
    path = folder / "small_fp32.onnx"
    network, content = load_network(path=path), path.read_bytes()
    image = np.full((1, 1, 100, 100), 0.25, np.float32)
    before = network.residual_shares(image)
    network.unload()
    np.testing.assert_array_equal(network.residual_shares(image), before)
    network.unload()
    path.write_bytes(content[:-1])
    with pytest.raises(ModelError, match="has the wrong hash"):
        network.residual_shares(image)


def test_one_changed_byte_fails_the_hash(folder: Path) -> None:
    path = folder / "small_fp32.onnx"
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    path.write_bytes(content)
    with pytest.raises(ModelError, match="has the wrong hash"):
        load_network(path=path)


@pytest.mark.parametrize("missing", ["small_fp32.onnx", "small.json"])
def test_a_missing_file_is_named(folder: Path, missing: str) -> None:
    (folder / missing).unlink()
    with pytest.raises(ModelError, match=missing):
        load_network(path=folder / "small_fp32.onnx")


def test_a_name_without_variant_is_refused(folder: Path) -> None:
    with pytest.raises(ModelError, match="variant"):
        load_network(path=folder / "small.onnx")


@pytest.mark.parametrize(
    "change",
    [
        {"schema": "edge-ident/network/1"},
        {"schema": "edge-ident/network/9"},
        {"normalization": "none"},
        {"parameter_std": {"fp32": [1.0, 2.0], "int8": [1.0, 2.0]}},
        {"motion": {}},
        {"start_shares": [0.5]},
        {"start_shares": [0.5, 0.5, 0.5, None]},
    ],
)
def test_a_malformed_manifest_is_refused(folder: Path, change: dict[str, object]) -> None:
    path = folder / "small.json"
    path.write_text(json.dumps(json.loads(path.read_text()) | change))
    with pytest.raises(ModelError, match="not a network's manifest"):
        load_manifest(path)


def test_a_manifest_that_does_not_say_how_the_loop_starts_is_refused(folder: Path) -> None:
    path = folder / "small.json"
    fields = json.loads(path.read_text())
    del fields["start_shares"]
    path.write_text(json.dumps(fields))
    with pytest.raises(ModelError, match="no 'start_shares'"):
        load_manifest(path)


def _wrong_shape(model: "onnx.ModelProto") -> None:
    model.graph.input[0].type.tensor_type.shape.dim[2].dim_value = 50
    weights = model.graph.initializer[0]
    weights.CopyFrom(onnx.numpy_helper.from_array(np.zeros((5000, 4), np.float32), weights.name))


def _unknown_domain(model: "onnx.ModelProto") -> None:
    model.graph.node[0].domain = "somebody.else"


def _external_data(model: "onnx.ModelProto") -> None:
    weights = model.graph.initializer[0]
    onnx.external_data_helper.set_external_data(weights, "/etc/hostname")
    weights.ClearField("raw_data")


@pytest.mark.parametrize(
    ("spoil", "cause"),
    [
        (_wrong_shape, "maps"),
        (_unknown_domain, "onnxruntime refuses"),
        (_external_data, "onnxruntime refuses"),
    ],
)
def test_a_network_of_another_kind_is_refused(
    folder: Path, spoil: Callable[["onnx.ModelProto"], None], cause: str
) -> None:
    path, manifest = folder / "small_fp32.onnx", folder / "small.json"
    model = onnx.load(path)
    spoil(model)
    path.write_bytes(model.SerializeToString())
    fields = json.loads(manifest.read_text())
    fields["sha256"]["fp32"] = hashlib.sha256(path.read_bytes()).hexdigest()
    manifest.write_text(json.dumps(fields))
    with pytest.raises(ModelError, match=cause):
        load_network(path=path)


# ---- the network of the package


@pytest.mark.parametrize("variant", VARIANTS)
def test_the_package_has_both_networks(variant: Variant) -> None:
    network = load_network(variant)
    assert network.sha256 == network.manifest.sha256[variant]
    images = np.random.default_rng(1).normal(size=(3, 1, 100, 100)).astype(np.float32)
    batch = network.residual_shares(images)
    alone = np.vstack([network.residual_shares(image[None]) for image in images])
    assert batch.shape == (3, 4)
    np.testing.assert_allclose(batch, alone, atol=1e-4)


def test_the_manifest_says_how_the_network_was_made_and_what_it_can_do() -> None:
    manifest = load_manifest(BUILT_IN)
    assert manifest.configuration["name"] == "improved"
    assert isinstance(manifest.configuration["seed"], int)
    assert manifest.start_shares is not None
    figures = {entry.name: entry for entry in manifest.evaluation}
    assert figures["clean"].drives == 500
    for name in ("clean", "clean_int8"):
        assert figures[name].residual_p90 < 1e-3
        assert np.all(figures[name].share_error_p95 < 1e-3)
    disturbed = np.mean(figures["one_effect"].share_error_median)
    assert disturbed < 0.6 * np.mean(figures["one_effect_least_squares"].share_error_median)
    assert disturbed < 0.05 * np.mean(figures["one_effect_random_search"].share_error_median)
    assert all(np.all(manifest.parameter_std[variant] > 0.0) for variant in VARIANTS)
