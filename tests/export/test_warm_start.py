"""The warm start reads the image linearly and starts from the head's answer."""

from dataclasses import replace

import numpy as np
import pytest

torch = pytest.importorskip("torch")

from export import data, warm_start  # noqa: E402
from export.configuration import IMPROVED  # noqa: E402
from export.network import ResidualNetwork  # noqa: E402
from export.warm_start import Head, head_batch, join, look_linear, products  # noqa: E402


@pytest.fixture
def network() -> ResidualNetwork:
    torch.manual_seed(1)
    network = ResidualNetwork()
    look_linear(network)
    return network


def test_pairs_of_features_are_linear_in_a_smooth_image(network: ResidualNetwork) -> None:
    """Maximum pooling of opposite maps leaves their mid-range: linear up to curvature."""
    slope = torch.linspace(-1.0, 1.0, 100)
    flat, tilted = torch.ones(1, 100), slope[None]
    with torch.no_grad():
        features = [
            network.features(model, flat, torch.zeros(1))[0]
            for model in (flat, tilted, flat + tilted)
        ]
    one, other, both = (maps[0:8:2] - maps[1:8:2] for maps in features)
    scale = both.abs().max()
    assert (one + other - both).abs().max() < 0.05 * scale


def test_last_pair_of_features_is_constant(network: ResidualNetwork) -> None:
    with torch.no_grad():
        maps = network.features(torch.randn(2, 100), torch.randn(2, 100), torch.zeros(2))
    assert torch.all(maps[:, -2:] == 1.0)


def test_products_are_those_of_guess_and_truth() -> None:
    guess, truth = np.array([[1.0, 2.0, 3.0, 4.0]]), np.array([[5.0, 6.0, 7.0, 8.0]])
    known = products(guess, truth)
    assert known.shape == (1, 17)
    assert known[0, 6] == 2.0 * 7.0
    assert known[0, 16] == 1.0


def test_joined_network_answers_like_its_head(
    network: ResidualNetwork, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(data, "MOTIONS", 4)
    monkeypatch.setattr(warm_start, "READ_IMAGES", 600)
    batches = data.Batches(replace(IMPROVED, batch=200))
    head = Head(network)
    join(network, head, batches)
    batch = batches.batch(-1)  # one that the regression saw: 600 images are few for 3610 features
    inverse = np.linalg.pinv(data.nominal_shapes())
    guess = batch.model_effort @ inverse.T
    factors = (batch.model_effort, batch.measured_effort, batch.bias)
    with torch.no_grad():
        wanted = head(products(guess, guess - batch.residual))
        found = network.residuals(*(data.tensor(factor) for factor in factors))
    assert (found - wanted).square().mean().sqrt() < 0.1 * wanted.std()


def test_head_batches_are_fixed_by_seed_and_step() -> None:
    torch.testing.assert_close(head_batch(1, 2), head_batch(1, 2), rtol=0.0, atol=0.0)
    assert not torch.equal(head_batch(1, 2)[1], head_batch(1, 3)[1])
