"""A starting point for training: layers that read the image linearly, dense layers that solve it.

The convolutions start 'looks-linear': pairs of opposite kernels whose ReLUs add up to a linear map
(Balduzzi et al., The shattered gradients problem, 2017). So linear regression on their outputs
finds whatever is linear in the image. That is the measured effort's description by a few numbers
(`Batches.basis`) where the guess is always the same, and its products with the guess otherwise.
From those numbers the dense layers alone learn the residual, hundreds of times faster than from
images. If they start with the linear answer, they learn only its errors.

Then regression and first layer are joined. The dense layers are trained on the outputs of the
convolutions, and last the whole network on images.

The paper does not do this: it starts from random weights.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import torch
from torch import Tensor, nn

from edge_ident.model.model import PARAMETERS
from export.data import Array, Batch, Batches, tensor
from export.network import ResidualNetwork, bias_of

CHUNK: Final = 500
"""Images whose features are computed at once."""
RIDGE: Final = 1e-6
"""Ridge over the mean square feature: keeps the regression from fitting rounding errors."""

_SMALL: Final = 0.02  # weights of the last layer behind units that start with no part in the answer


class Head(nn.Module):
    """The network's dense layers, with the known numbers and a constant in place of features.

    Parameters
    ----------
    network : ResidualNetwork
        Whose second and third dense layer are the head's.
    batches : Batches
    basis : (K, points) array
        Its first four rows give the parameters that least squares finds.
    """

    def __init__(self, network: ResidualNetwork, batches: Batches, basis: Array) -> None:
        super().__init__()
        self._products = batches.configuration.start_shares is None
        self._basis = basis
        inputs = len(basis) * (len(PARAMETERS) if self._products else 1) + 1
        self.layers = nn.Sequential(
            nn.Linear(inputs, network.dense_layer(0).out_features, bias=False),
            nn.ReLU(),
            network.dense_layer(1),
            nn.ReLU(),
            network.dense_layer(2),
        )
        if not self._products:
            self._answer_linearly()

    def forward(self, known: Tensor) -> Tensor:
        """Residuals (n, 4) from known numbers (n, K + 1) or (n, 4K + 1)."""
        result: Tensor = self.layers(known)
        return result

    def known(self, batch: Batch) -> Tensor:
        """The numbers that the head sees, in place of images."""
        described = tensor(batch.measured_effort @ self._basis.T)
        if self._products:
            described = (tensor(batch.guess)[:, :, None] * described[:, None, :]).flatten(1)
        return torch.cat([described, torch.ones(len(described), 1)], dim=1)

    def weight(self, index: int) -> Tensor:
        """Weights of one of the three layers."""
        layer = self.layers[2 * index]
        assert isinstance(layer, nn.Linear)
        return layer.weight

    def _answer_linearly(self) -> None:
        """Let pairs of opposite units carry minus the parameters of least squares."""
        first, second, third = (self.weight(index) for index in range(3))
        carried = 2 * len(PARAMETERS)
        with torch.no_grad():
            for weight in (first, second):
                weight[:carried] = 0.0
            third.mul_(_SMALL)
            third[:, :carried] = 0.0
            for parameter in range(len(PARAMETERS)):
                plus, minus = 2 * parameter, 2 * parameter + 1
                first[plus, parameter] = -1.0
                first[minus] = -first[plus]
                second[plus, plus], second[plus, minus] = 1.0, -1.0
                second[minus] = -second[plus]
                third[parameter, plus], third[parameter, minus] = 1.0, -1.0


def look_linear(network: ResidualNetwork) -> None:
    """Set the convolutions to pairs of opposite kernels; the last pair of the third is constant."""
    with torch.no_grad():
        for layer in (network.first, network.second, network.third):
            kernel = layer.weight[::2].clone()
            if kernel.shape[1] > 1:  # the input comes in pairs as well
                kernel = torch.stack([kernel[:, ::2], -kernel[:, ::2]], 2).flatten(1, 2)
            layer.weight.copy_(torch.stack([kernel, -kernel], 1).flatten(0, 1))
            bias_of(layer).zero_()
        network.third.weight[-2:].zero_()
        bias_of(network.third)[-2:].fill_(1.0)


@dataclass(frozen=True)
class Features:
    """What the convolutions put out for many images, and the answers wanted.

    Attributes
    ----------
    values : (n, F) tensor
    residual : (n, 4) tensor
    known : (n, K) tensor
        What a head would see.
    """

    values: Tensor
    residual: Tensor
    known: Tensor


def compute_features(
    network: ResidualNetwork,
    head: Head,
    batches: Batches,
    count: int,
    on_progress: Callable[[int, int], None],
) -> Features:
    """Features of `count` training examples, by the network as it is."""
    values, residual, known = [], [], []
    for number in range(-(-count // CHUNK)):
        batch = batches.batch("dense", number, min(CHUNK, count - number * CHUNK))
        with torch.no_grad():
            values.append(network.features(*batch.factors).flatten(1))
        residual.append(tensor(batch.residual))
        known.append(head.known(batch))
        on_progress(min((number + 1) * CHUNK, count), count)
    return Features(torch.cat(values), torch.cat(residual), torch.cat(known))


def join(network: ResidualNetwork, head: Head, features: Features) -> None:
    """Make the first dense layer from the head and a regression of known numbers on features."""
    size = features.values.shape[1]
    gram = torch.zeros(size, size, dtype=torch.float64)
    moment = torch.zeros(size, features.known.shape[1], dtype=torch.float64)
    for begin in range(0, len(features.values), 4 * CHUNK):
        part = slice(begin, begin + 4 * CHUNK)
        values, known = features.values[part], features.known[part]
        gram += values.T.double() @ values.double()
        moment += values.T.double() @ known.double()
    gram.diagonal().add_(RIDGE * gram.diagonal().mean())
    reader = torch.linalg.solve(gram, moment)
    with torch.no_grad():
        network.dense_layer(0).weight.copy_(head.weight(0).double() @ reader.T)
