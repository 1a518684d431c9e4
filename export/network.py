"""The paper's network in torch: 375,640 weights, 29,384 neurons, 210 kernels."""

import torch
from torch import Tensor, nn
from torch.nn import functional

from edge_ident.model.model import PARAMETERS
from edge_ident.signals.metrics import POINTS

MAPS = 10
DENSE = 100


def features(points: int) -> int:
    """Outputs of the convolutions for images of so many rows: 3610 for the paper's 100."""
    return MAPS * (((points - 8) // 2 - 4) // 2 - 2) ** 2


class ResidualNetwork(nn.Module):
    """From the image of two efforts to the sigmoid of the parameters' residuals.

    Three convolutions (9x9, 5x5, 3x3) of ten maps, 2x2 maximum pooling after the first two,
    ReLU, three dense layers without biases, sigmoid. The text fixes kernels, counts and order;
    ten maps, 100 dense units and where the biases are follow from the counts (reconstruction).

    Parameters
    ----------
    points : int
        Rows and columns of the image.
    """

    def __init__(self, points: int = POINTS) -> None:
        super().__init__()
        self.points = points
        self.first = nn.Conv2d(1, MAPS, 9)
        self.second = nn.Conv2d(MAPS, MAPS, 5)
        self.third = nn.Conv2d(MAPS, MAPS, 3)
        sizes = ((features(points), DENSE), (DENSE, DENSE), (DENSE, len(PARAMETERS)))
        self.dense = nn.ModuleList(nn.Linear(*size, bias=False) for size in sizes)

    def dense_layer(self, index: int) -> nn.Linear:
        """One of the three dense layers."""
        layer = self.dense[index]
        assert isinstance(layer, nn.Linear)
        return layer

    def forward(self, image: Tensor) -> Tensor:
        """Sigmoid of the residuals, (n, 4), from images (n, 1, points, points)."""
        maps = self.pooled_layers(functional.max_pool2d(self.first(image), 2))
        return torch.sigmoid(self.dense_layers(maps[-1])[-1])

    def features(self, model_effort: Tensor, measured_effort: Tensor, offset: Tensor) -> Tensor:
        """What the convolutions put out, (n, 10, 19, 19) for 100 points; see `maps`."""
        return self.maps(model_effort, measured_effort, offset)[-1]

    def maps(self, model_effort: Tensor, measured_effort: Tensor, offset: Tensor) -> list[Tensor]:
        """Outputs of the three convolutional layers, from the image's factors.

        The first convolution of ψαᵀ + b is Σ_q (Σ_p K_pq ψ_(i+p)) α_(j+q) + b·ΣK: two small
        matrix products in place of a two-dimensional convolution.

        Parameters
        ----------
        model_effort, measured_effort : (n, points) tensors
            The first multiplied by the normalization's scale.
        offset : (n,) tensor
            The normalization's constant.
        """
        kernel = self.first.weight[:, 0]
        maps, height, width = kernel.shape
        rows = self.points - height + 1
        model = model_effort.unfold(1, height, 1).reshape(-1, height)
        left = (model @ kernel.permute(1, 0, 2).reshape(height, -1)).view(-1, rows, maps, width)
        left = left.permute(0, 2, 1, 3).reshape(-1, maps * rows, width)
        right = measured_effort.unfold(1, width, 1).transpose(1, 2)
        # maximum over neighbouring columns, then rows: five times faster than pooling the product
        columns = torch.maximum(torch.bmm(left, right[..., ::2]), torch.bmm(left, right[..., 1::2]))
        pairs = columns.view(-1, maps, rows // 2, 2, columns.shape[-1])
        constant = bias_of(self.first) + offset[:, None] * kernel.sum(dim=(1, 2))
        pooled = torch.maximum(pairs[:, :, :, 0], pairs[:, :, :, 1]) + constant[:, :, None, None]
        # this order of memory makes the second convolution a fifth faster
        return self.pooled_layers(pooled.contiguous(memory_format=torch.channels_last))

    def residuals(self, model_effort: Tensor, measured_effort: Tensor, offset: Tensor) -> Tensor:
        """Residuals (n, 4) from the two factors of the image; see `maps`."""
        return self.dense_layers(self.features(model_effort, measured_effort, offset))[-1]

    def pooled_layers(self, first: Tensor) -> list[Tensor]:
        """Outputs of the three convolutional layers, from the first's before its ReLU.

        ReLU stands before the second pooling, where an exported convolution takes it in: behind
        it, int8 would spend half of its levels on what ReLU takes away.
        """
        one = functional.relu(first)
        two = functional.max_pool2d(functional.relu(self.second(one)), 2)
        return [one, two, functional.relu(self.third(two))]

    def dense_layers(self, features: Tensor) -> list[Tensor]:
        """Outputs of the three dense layers, the last before its sigmoid."""
        one = functional.relu(self.dense[0](features.flatten(1)))
        two = functional.relu(self.dense[1](one))
        return [one, two, self.dense[2](two)]


def bias_of(layer: nn.Conv2d) -> Tensor:
    """The biases of a convolution, which all of the network's have."""
    assert layer.bias is not None
    return layer.bias
