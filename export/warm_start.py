"""A starting point for training: layers that read the image linearly, a head that solves it.

The image is ψαᵀ = C·(guess·truthᵀ)·Cᵀ with the motion's columns C: sixteen products of parameters.
From those and a constant the three dense layers alone learn the residual, hundreds of times
faster than from images. The convolutions start 'looks-linear': pairs of opposite kernels whose
ReLUs add up to a linear map (Balduzzi et al., The shattered gradients problem, 2017). So linear
regression finds the products in what they put out, and regression and head together are the
first dense layer. Training then goes on with the whole network and images of recordings.

Not the paper's: it starts from random weights.
"""

from typing import Final

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

from edge_ident.model import PARAMETERS
from export.data import Batches, nominal_shapes, tensor
from export.drives import as_shares, guesses, mixture
from export.network import FEATURES, ResidualNetwork

Array = NDArray[np.float64]

HEAD_BATCH: Final = 512
HEAD_LEARNING_RATE: Final = 3e-3
READ_IMAGES: Final = 20_000
"""Images that the regression is fitted to, several for each of its features."""
RIDGE: Final = 1e-6
"""Of the mean square feature: keeps the regression from reading rounding errors."""

_PRODUCTS: Final = len(PARAMETERS) ** 2


class Head(nn.Module):
    """The network's dense layers, with products and a constant in place of features."""

    def __init__(self, network: ResidualNetwork) -> None:
        super().__init__()
        self.layers = nn.Sequential(
            nn.Linear(_PRODUCTS + 1, network.dense[0].out_features, bias=False),
            nn.ReLU(),
            network.dense[1],
            nn.ReLU(),
            network.dense[2],
        )

    def forward(self, known: Tensor) -> Tensor:
        """Residuals (n, 4) from products (n, 17)."""
        result: Tensor = self.layers(known)
        return result


def head_batch(seed: int, step: int) -> tuple[Tensor, Tensor]:
    """Products (n, 17) and residuals (n, 4) of random drives on the nominal motion."""
    rng = np.random.default_rng((seed, step, 1))
    truth = as_shares(nominal_shapes(), mixture(rng, HEAD_BATCH), "effort-scale")
    guess = guesses(rng, truth)
    return products(guess, truth), tensor(guess - truth)


def products(guess: Array, truth: Array) -> Tensor:
    """Products guess_i·truth_j and a one, (n, 17)."""
    outer = (guess[:, :, None] * truth[:, None, :]).reshape(-1, _PRODUCTS)
    return tensor(np.hstack([outer, np.ones((len(outer), 1))]))


def look_linear(network: ResidualNetwork) -> None:
    """Set the convolutions to pairs of opposite kernels; the last pair of the third is constant."""
    with torch.no_grad():
        for layer in (network.first, network.second, network.third):
            kernel = layer.weight[::2].clone()
            if kernel.shape[1] > 1:  # the input comes in pairs as well
                kernel = torch.stack([kernel[:, ::2], -kernel[:, ::2]], 2).flatten(1, 2)
            layer.weight.copy_(torch.stack([kernel, -kernel], 1).flatten(0, 1))
            layer.bias.zero_()
        network.third.weight[-2:].zero_()
        network.third.bias[-2:].fill_(1.0)


def join(network: ResidualNetwork, head: Head, batches: Batches) -> None:
    """Make the first dense layer from the head and a regression of products on features.

    Parameters
    ----------
    network : ResidualNetwork
        After `look_linear`; its other dense layers are the head's.
    head : Head
        Trained.
    batches : Batches
        Images in "effort-scale" normalization.
    """
    inverse = np.linalg.pinv(nominal_shapes())
    gram = torch.zeros(FEATURES, FEATURES, dtype=torch.float64)
    moment = torch.zeros(FEATURES, _PRODUCTS + 1, dtype=torch.float64)
    seen = 0
    while seen < READ_IMAGES:
        batch = batches.batch(-1 - seen)
        guess = batch.model_effort @ inverse.T
        with torch.no_grad():
            factors = tensor(batch.model_effort), tensor(batch.measured_effort), tensor(batch.bias)
            features = network.features(*factors).flatten(1).double()
        gram += features.T @ features
        moment += features.T @ products(guess, guess - batch.residual).double()
        seen += len(guess)
    gram.diagonal().add_(RIDGE * gram.diagonal().mean())
    reader = torch.linalg.solve(gram, moment)
    with torch.no_grad():
        network.dense[0].weight.copy_(head.layers[0].weight.double() @ reader.T)
