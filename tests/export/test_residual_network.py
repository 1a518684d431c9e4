"""The network is the paper's, and its fast form computes the same."""

import numpy as np
import pytest

from edge_ident.estimation.image import Normalization, effort_image, scale_and_offset

torch = pytest.importorskip("torch")

from torch.nn import functional  # noqa: E402

from export.data import tensor  # noqa: E402
from export.network import ResidualNetwork  # noqa: E402


@pytest.fixture
def network() -> ResidualNetwork:
    torch.manual_seed(5)
    return ResidualNetwork().eval()


def test_weights_neurons_and_kernels_of_the_paper(network: ResidualNetwork) -> None:
    assert sum(parameter.numel() for parameter in network.parameters()) == 375_640
    image = torch.zeros(1, 1, network.points, network.points)
    maps = network.pooled_layers(functional.max_pool2d(network.first(image), 2))
    assert sum(out.numel() for out in maps + network.dense_layers(maps[-1])) == 29_384
    layers = (network.first, network.second, network.third)
    assert sum(layer.weight.shape[0] * layer.weight.shape[1] for layer in layers) == 210


def test_output_is_the_sigmoid_of_four_residuals(network: ResidualNetwork) -> None:
    output = network(torch.randn(3, 1, 100, 100))
    assert output.shape == (3, 4)
    assert torch.all((output > 0) & (output < 1))


@pytest.mark.parametrize("normalization", ["effort-scale", "min-max"])
def test_factored_first_convolution_equals_the_plain_one(
    network: ResidualNetwork, normalization: Normalization
) -> None:
    rng = np.random.default_rng(8)
    model, measured = rng.normal(size=(4, 100)), rng.normal(size=(4, 100))
    for parameter in network.parameters():  # away from an all but constant output
        parameter.data *= 2.0
    scale, offset = scale_and_offset(model, measured, normalization)
    with torch.no_grad():
        fast = network.residuals(tensor(scale[:, None] * model), tensor(measured), tensor(offset))
        plain = network(torch.from_numpy(effort_image(model, measured, normalization)))
    assert fast.std() > 0.01
    torch.testing.assert_close(torch.sigmoid(fast), plain, atol=1e-5, rtol=0.0)
