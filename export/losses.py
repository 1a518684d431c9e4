"""Loss functions of training, of the residuals found and wanted, (n, 4) tensors each."""

from typing import Final

from torch import Tensor, sigmoid

SMALL: Final = 0.02
"""Residual below which the relative loss counts the error itself."""
BLUNT: Final = 0.001
"""Error below which the absolute loss is a square, so that it has a slope of zero at zero."""


def sigmoid_loss(found: Tensor, residual: Tensor) -> Tensor:
    """½·Σ(target - output)² of the residuals' sigmoids (reconstruction of the paper's)."""
    error = sigmoid(found) - sigmoid(residual)
    return 0.5 * error.square().sum(dim=1).mean()


def relative_loss(found: Tensor, residual: Tensor) -> Tensor:
    """Σ(found - residual)² / (Σresidual² + small²), mean over the batch."""
    size = residual.square().sum(dim=1) + SMALL**2
    return ((found - residual).square().sum(dim=1) / size).mean()


def absolute_loss(found: Tensor, residual: Tensor) -> Tensor:
    """|found - residual|, rounded at zero, mean over batch and parameters."""
    return ((found - residual).square() + BLUNT**2).sqrt().mean()


LOSSES: Final = {"sigmoid": sigmoid_loss, "relative": relative_loss, "absolute": absolute_loss}
