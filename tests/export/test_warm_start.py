"""The warm start reads the image linearly, and starts from the answer of least squares."""

from dataclasses import replace

import numpy as np
import pytest

torch = pytest.importorskip("torch")

from export import data, warm_start  # noqa: E402
from export.configuration import IMPROVED, Configuration  # noqa: E402
from export.data import Batches, tensor  # noqa: E402
from export.motion import paper_motion  # noqa: E402
from export.network import ResidualNetwork  # noqa: E402
from export.warm_start import Head, compute_features, join, look_linear  # noqa: E402

POINTS = 60
REMAINDERS = replace(IMPROVED, points=POINTS, motions=4, drives_with_effect=2)
PRODUCTS = replace(REMAINDERS, drives_with_effect=0, start_shares=None, loss="relative")


@pytest.fixture(autouse=True)
def _few_effects(few_effects: None, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(data, "BASIS_EXAMPLES", 2000)


@pytest.fixture
def network() -> ResidualNetwork:
    torch.manual_seed(1)
    network = ResidualNetwork(POINTS)
    look_linear(network)
    return network


def head_of(network: ResidualNetwork, configuration: Configuration) -> tuple[Head, Batches]:
    batches = Batches(configuration, paper_motion())
    torch.manual_seed(2)
    return Head(network, batches, batches.basis()), batches


def test_pairs_of_features_are_linear_in_a_smooth_image() -> None:
    """Maximum pooling of opposite maps leaves their mid-range: linear up to curvature."""
    torch.manual_seed(1)
    network = ResidualNetwork(100)
    look_linear(network)
    flat, tilted = torch.ones(1, 100), torch.linspace(-1.0, 1.0, 100)[None]
    with torch.no_grad():
        features = [
            network.features(model, flat, torch.zeros(1))[0]
            for model in (flat, tilted, flat + tilted)
        ]
    one, other, both = (maps[0:8:2] - maps[1:8:2] for maps in features)
    assert (one + other - both).abs().max() < 0.05 * both.abs().max()


def test_last_pair_of_features_is_constant(network: ResidualNetwork) -> None:
    with torch.no_grad():
        maps = network.features(torch.randn(2, POINTS), torch.randn(2, POINTS), torch.zeros(2))
    assert torch.all(maps[:, -2:] == 1.0)


def test_the_head_starts_with_the_answer_of_least_squares(network: ResidualNetwork) -> None:
    """Minus the remainder's parameters: all of the residual, where nothing is disturbed."""
    head, batches = head_of(network, REMAINDERS)
    batch = batches.batch("test", 0, 100)
    solved = np.linalg.lstsq(batches.nominal, batch.measured_effort.T, rcond=None)[0].T
    with torch.no_grad():
        answer = head(head.known(batch)).numpy()
    # units without a part in the answer have small weights, so that they can learn
    error = np.sqrt(np.mean((answer + solved) ** 2))
    assert error < 0.01 * np.sqrt(np.mean(solved**2))
    head.layers[4].weight.data[:, 8:] = 0.0
    with torch.no_grad():
        answer = head(head.known(batch)).numpy()
    np.testing.assert_allclose(answer, -solved, atol=1e-5)


def test_known_numbers_are_the_remainders_description_and_a_constant(
    network: ResidualNetwork,
) -> None:
    head, batches = head_of(network, REMAINDERS)
    batch = batches.batch("test", 0, 5)
    known = head.known(batch).numpy()
    np.testing.assert_allclose(known[:, :-1], batch.measured_effort @ batches.basis().T, atol=1e-4)
    np.testing.assert_array_equal(known[:, -1], 1.0)


def test_without_a_start_they_are_products_of_guess_and_parameters(
    network: ResidualNetwork,
) -> None:
    head, batches = head_of(network, PRODUCTS)
    batch = batches.batch("test", 0, 5)
    known = head.known(batch).numpy()
    solved = batch.measured_effort @ batches.inverse.T
    assert known.shape == (5, 17)
    np.testing.assert_allclose(known[:, 6], batch.guess[:, 1] * solved[:, 2], rtol=1e-4, atol=1e-6)
    np.testing.assert_array_equal(known[:, 16], 1.0)


@pytest.mark.parametrize("configuration", [REMAINDERS, PRODUCTS], ids=["remainders", "products"])
def test_joined_network_answers_like_its_head(
    network: ResidualNetwork, configuration: Configuration
) -> None:
    head, batches = head_of(network, configuration)
    features = compute_features(network, head, batches, 2000, lambda done, total: None)
    join(network, head, features)
    batch = batches.batch("test", 0, 200)
    factors = (batch.model_effort, batch.measured_effort, batch.offset)
    with torch.no_grad():
        wanted = head(head.known(batch))
        found = network.residuals(*(tensor(factor) for factor in factors))
    assert (found - wanted).square().mean().sqrt() < 0.2 * wanted.std()


def test_features_are_the_networks_own_of_the_stages_examples(
    network: ResidualNetwork, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(warm_start, "CHUNK", 20)
    head, batches = head_of(network, REMAINDERS)
    seen: list[tuple[int, int]] = []
    features = compute_features(network, head, batches, 50, lambda *at: seen.append(at))
    assert seen == [(20, 50), (40, 50), (50, 50)]
    assert features.values.shape == (50, 810)
    second = batches.batch("dense", 1, 20)
    torch.testing.assert_close(features.residual[20:40], tensor(second.residual))
    factors = (second.model_effort, second.measured_effort, second.offset)
    with torch.no_grad():
        values = network.features(*(tensor(factor) for factor in factors)).flatten(1)
    torch.testing.assert_close(features.values[20:40], values)
    torch.testing.assert_close(features.known[20:40], head.known(second))
