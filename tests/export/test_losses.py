"""What training makes small: zero at the truth, and weighing errors as each says."""

import pytest

torch = pytest.importorskip("torch")

from export.losses import absolute_loss, relative_loss, sigmoid_loss  # noqa: E402


def test_losses_vanish_at_the_truth_alone() -> None:
    residual = torch.tensor([[0.5, 0.0, 0.0, 0.0], [0.01, 0.0, 0.0, 0.0]])
    for loss in (sigmoid_loss, relative_loss, absolute_loss):
        assert loss(residual, residual) == pytest.approx(0.0, abs=0.0011)
        assert loss(residual + 0.1, residual) > loss(residual, residual) + 1e-3


def test_relative_loss_counts_small_residuals_and_absolute_loss_counts_all_alike() -> None:
    residual = torch.tensor([[0.5, 0.0, 0.0, 0.0], [0.01, 0.0, 0.0, 0.0]])
    error = torch.tensor([[0.01, 0.0, 0.0, 0.0]])
    large, small = (relative_loss(r[None] + error, r[None]) for r in residual)
    assert small > 100 * large
    large, small = (absolute_loss(r[None] + error, r[None]) for r in residual)
    assert small == pytest.approx(float(large), rel=1e-3)


def test_absolute_loss_forgives_what_disturbs_few_drives() -> None:
    """Its slope is the same for any error, so one drive far off pulls no harder than another."""
    found = torch.tensor([[0.01, 0.0, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0]], requires_grad=True)
    absolute_loss(found, torch.zeros(2, 4)).backward()
    near, far = found.grad[:, 0]
    assert far == pytest.approx(float(near), rel=0.01)
