"""What leaves torch: the same function, nothing but the network in the file."""

from pathlib import Path

import numpy as np
import pytest

torch = pytest.importorskip("torch")
onnx = pytest.importorskip("onnx")
pytest.importorskip("onnxscript")

import onnxruntime  # noqa: E402

from edge_ident.network import BUILT_IN, load_network  # noqa: E402
from export.evaluate import DriveSet, clean_drives, identified, shares  # noqa: E402
from export.network import ResidualNetwork  # noqa: E402
from export.onnx_export import INT8_LIMIT, to_onnx  # noqa: E402
from export.rounding import round_to_grid  # noqa: E402


@pytest.fixture(scope="module")
def network() -> ResidualNetwork:
    torch.manual_seed(5)
    return ResidualNetwork().eval()


@pytest.fixture(scope="module")
def model(network: ResidualNetwork) -> "onnx.ModelProto":
    return to_onnx(network)


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


@pytest.mark.parametrize("variant", ["fp32", "int8"])
def test_the_packages_networks_hold_no_notes(variant: str) -> None:
    model = onnx.load(BUILT_IN.with_name(f"feed_drive_{variant}.onnx"))
    assert not any(node.metadata_props or node.doc_string for node in model.graph.node)
    assert not any(item.external_data for item in model.graph.initializer)


def test_int8_identifies_the_same_parameters_as_fp32() -> None:
    every = clean_drives()
    drives = DriveSet(
        every.columns[::20], every.effort[::20], every.clean_effort[::20], every.parameters[::20]
    )
    moved = identified(load_network("int8"), drives) - identified(load_network("fp32"), drives)
    change = np.max(np.abs(shares(drives, moved, "effort-scale")), axis=1)
    assert 0.0 < np.median(change) < 1.5 * INT8_LIMIT


def test_rounding_keeps_outputs_where_rounding_each_weight_does_not() -> None:
    """Inputs of low rank: errors of one weight can be made up for by others."""
    rng = np.random.default_rng(0)
    features = rng.normal(size=(400, 8)) @ rng.normal(size=(8, 120))
    weights = rng.normal(size=(5, 120))
    scales = np.max(np.abs(weights), axis=1) / 7.0
    nearest = np.clip(np.round(weights / scales[:, None]), -127, 127)
    rounded = round_to_grid(weights, scales, features, 1e-2)

    def error(grid: np.ndarray) -> float:
        return float(np.linalg.norm(features @ (grid * scales[:, None] - weights).T))

    assert rounded.dtype == np.int8
    assert error(rounded) < 0.3 * error(nearest)
