"""A network in torch for measurements, as an `edge_ident.estimation.network.Network`."""

import numpy as np
import torch
from numpy.typing import NDArray

from edge_ident.estimation.manifest import Variant
from edge_ident.estimation.network import Network
from export.checkpoint import Checkpoint
from export.manifest import describe
from export.network import ResidualNetwork


class TorchNetwork(Network):
    """What has been trained, as the loop would run it, without export and quantization.

    Attributes
    ----------
    manifest : Manifest
        Without figures: standard deviations are zero.
    variant : "fp32"
    """

    def __init__(self, network: ResidualNetwork, checkpoint: Checkpoint) -> None:
        self._network = network
        contents: dict[Variant, bytes] = {"fp32": b"", "int8": b""}
        self.manifest = describe(checkpoint.configuration, checkpoint.motion, contents)
        self.variant = "fp32"

    def residual_shares(self, images: NDArray[np.float32]) -> NDArray[np.float64]:
        """Guess minus truth in shares, (n, 4), from images (n, 1, points, points)."""
        with torch.no_grad():
            output = torch.logit(self._network(torch.from_numpy(images)), eps=1e-6)
        return output.numpy().astype(np.float64)
