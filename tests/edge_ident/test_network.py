"""Only networks that are whole, described and of the right shape are run."""

import hashlib
import json
import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from edge_ident.errors import ModelError
from edge_ident.network import BUILT_IN, VARIANTS, Variant, load_manifest, load_network

onnx = pytest.importorskip("onnx")


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for path in BUILT_IN.parent.glob("feed_drive*"):
        shutil.copy(path, tmp_path)
    return tmp_path


@pytest.mark.parametrize("variant", VARIANTS)
def test_the_package_has_both_networks(variant: Variant) -> None:
    network = load_network(variant)
    assert network.sha256 == network.manifest.sha256[variant]
    images = np.random.default_rng(1).normal(size=(3, 1, 100, 100)).astype(np.float32)
    assert network.residual_shares(images).shape == (3, 4)
    batch = network.residual_shares(images)
    alone = np.vstack([network.residual_shares(image[None]) for image in images])
    np.testing.assert_allclose(batch, alone, atol=1e-4)


def test_a_path_names_its_variant_and_manifest(folder: Path) -> None:
    network = load_network(path=folder / "feed_drive_int8.onnx")
    assert network.variant == "int8"


def test_the_manifest_says_how_the_network_was_made_and_what_it_can_do() -> None:
    manifest = load_manifest(BUILT_IN)
    assert manifest.configuration["name"] == "improved"
    assert isinstance(manifest.configuration["seed"], int)
    figures = {entry.name: entry for entry in manifest.evaluation}
    assert figures["clean"].drives == 500
    assert figures["clean"].residual_median < 0.02
    assert figures["clean"].residual_p90 < 0.06
    assert figures["clean"].residual_median < 0.1 * figures["random_search"].residual_median
    assert all(np.all(manifest.parameter_std[variant] > 0.0) for variant in VARIANTS)


def test_one_changed_byte_fails_the_hash(folder: Path) -> None:
    path = folder / "feed_drive_fp32.onnx"
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    path.write_bytes(content)
    with pytest.raises(ModelError, match="fails its hash"):
        load_network(path=path)


@pytest.mark.parametrize("missing", ["feed_drive_fp32.onnx", "feed_drive.json"])
def test_a_missing_file_is_named(folder: Path, missing: str) -> None:
    (folder / missing).unlink()
    with pytest.raises(ModelError, match=missing):
        load_network(path=folder / "feed_drive_fp32.onnx")


def test_a_name_without_variant_is_refused(folder: Path) -> None:
    with pytest.raises(ModelError, match="variant"):
        load_network(path=folder / "feed_drive.onnx")


@pytest.mark.parametrize(
    "change",
    [
        {"schema": "edge-ident/network/9"},
        {"normalization": "none"},
        {"parameter_std": {"fp32": [1.0, 2.0], "int8": [1.0, 2.0]}},
        {"motion": {}},
        {"guess_range": [1.0]},
    ],
)
def test_a_malformed_manifest_is_refused(folder: Path, change: dict[str, object]) -> None:
    path = folder / "feed_drive.json"
    path.write_text(json.dumps(json.loads(path.read_text()) | change))
    with pytest.raises(ModelError, match="not a network's manifest"):
        load_manifest(path)


def _wrong_shape(model: "onnx.ModelProto") -> None:
    model.graph.input[0].type.tensor_type.shape.dim[2].dim_value = 50


def _unknown_domain(model: "onnx.ModelProto") -> None:
    model.graph.node[0].domain = "somebody.else"


def _external_data(model: "onnx.ModelProto") -> None:
    weights = next(item for item in model.graph.initializer if len(item.dims) == 2)
    onnx.external_data_helper.set_external_data(weights, "/etc/hostname")
    weights.ClearField("raw_data")


@pytest.mark.parametrize("spoil", [_wrong_shape, _unknown_domain, _external_data])
def test_a_network_of_another_kind_is_refused(
    folder: Path, spoil: Callable[["onnx.ModelProto"], None]
) -> None:
    path, manifest = folder / "feed_drive_fp32.onnx", folder / "feed_drive.json"
    model = onnx.load(path)
    spoil(model)
    path.write_bytes(model.SerializeToString())
    fields = json.loads(manifest.read_text())
    fields["sha256"]["fp32"] = hashlib.sha256(path.read_bytes()).hexdigest()
    manifest.write_text(json.dumps(fields))
    with pytest.raises(ModelError):
        load_network(path=path)
