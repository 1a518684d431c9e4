"""The image is an outer product; its normalization is affine and keeps what can be told apart."""

import numpy as np
import pytest

from edge_ident.estimation.image import effort_image, effort_scale, scale_and_offset

RNG = np.random.default_rng(3)
MODEL = RNG.normal(size=(5, 100))
MEASURED = RNG.normal(size=100)


def test_image_is_the_outer_product_of_both_efforts() -> None:
    images = effort_image(MODEL, MEASURED, "effort-scale")
    assert images.shape == (5, 1, 100, 100)
    assert images.dtype == np.float32
    np.testing.assert_allclose(images[2, 0], np.outer(MODEL[2], MEASURED), atol=1e-6)


def test_min_max_fills_zero_to_one_in_every_image() -> None:
    images = effort_image(MODEL, MEASURED, "min-max")
    np.testing.assert_allclose(images.min(axis=(1, 2, 3)), 0.0, atol=1e-6)
    np.testing.assert_allclose(images.max(axis=(1, 2, 3)), 1.0, atol=1e-6)


def test_min_max_hides_the_scale_of_the_guess_and_effort_scale_keeps_it() -> None:
    once, twice = (effort_image(k * MODEL, MEASURED, "min-max") for k in (1.0, 2.0))
    np.testing.assert_allclose(once, twice, atol=1e-6)
    once, twice = (effort_image(k * MODEL, MEASURED, "effort-scale") for k in (1.0, 2.0))
    np.testing.assert_allclose(2.0 * once, twice, atol=1e-5)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_min_max_of_efforts_of_one_sign(sign: float) -> None:
    one_sided = sign * np.abs(MODEL)
    gain, bias = scale_and_offset(one_sided, np.broadcast_to(np.abs(MEASURED), (5, 100)), "min-max")
    image = gain[0] * np.outer(one_sided[0], np.abs(MEASURED)) + bias[0]
    assert image.min() == pytest.approx(0.0, abs=1e-12)
    assert image.max() == pytest.approx(1.0)


def test_a_silent_guess_makes_a_finite_image() -> None:
    assert np.all(np.isfinite(effort_image(np.zeros((1, 100)), MEASURED, "min-max")))


def test_effort_scale_of_a_sine_is_its_peak_and_noise_hardly_moves_it() -> None:
    sine = 3.0 * np.sin(2.0 * np.pi * np.arange(100) / 100)
    noisy = sine + 0.06 * RNG.normal(size=100)
    assert effort_scale(sine, "effort-scale") == pytest.approx(3.0)
    assert effort_scale(noisy, "effort-scale") == pytest.approx(3.0, rel=0.01)
    assert effort_scale(noisy, "min-max") == np.max(np.abs(noisy))
