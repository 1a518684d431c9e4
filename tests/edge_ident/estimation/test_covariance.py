"""Standard deviations: textbook values for white noise, coverage for coloured and few samples."""

import numpy as np
import pytest
import scipy.signal

from edge_ident.estimation.least_squares import coloured_std

TRUTH = np.array([0.4, 0.9, 1.4, 0.05])


def slow_regressor(samples: int, turns: float = 1.0, phase: float = 0.3) -> np.ndarray:
    """Acceleration, velocity, its sign and one of a slow sinusoid."""
    angle = 2 * np.pi * turns * np.arange(samples) / samples + phase
    velocity = np.cos(angle)
    return np.column_stack([-np.sin(angle), velocity, np.sign(velocity), np.ones(samples)])


def coverage(noise, regressor: np.ndarray, draws: int) -> np.ndarray:
    """Share of draws whose 95 % interval covers the truth, by parameter."""
    inverse = np.linalg.pinv(regressor)
    covered = []
    for _ in range(draws):
        effort = regressor @ TRUTH + noise(len(regressor))
        found = inverse @ effort
        std = coloured_std(regressor, effort - regressor @ found)
        covered.append(np.abs(found - TRUTH) < 1.96 * std)
    return np.mean(covered, axis=0)


def test_white_noise_gives_the_textbook_covariance() -> None:
    rng = np.random.default_rng(1)
    regressor = slow_regressor(400)
    projector = regressor @ np.linalg.pinv(regressor)
    ratios = []
    for _ in range(20):
        residual = rng.normal(size=400)
        residual -= projector @ residual
        variance = residual @ residual / (400 - 4)
        textbook = np.sqrt(variance * np.diag(np.linalg.inv(regressor.T @ regressor)))
        ratios.append(coloured_std(regressor, residual) / textbook)
    np.testing.assert_allclose(np.mean(ratios, axis=0), 1.0, atol=0.12)


@pytest.mark.parametrize("pole", [0.0, 0.6, 0.87])
def test_intervals_cover_under_slow_noise(pole: float) -> None:
    """The slowest has a fortieth of the record as its correlation time."""
    rng = np.random.default_rng(2)

    def noise(samples: int) -> np.ndarray:
        return scipy.signal.lfilter([1.0], [1.0, -pole], rng.normal(size=samples + 200))[200:]

    covered = coverage(noise, slow_regressor(300), draws=250)
    # 250 draws resolve a share of 95 % to 1.4 points
    assert np.all(covered > 0.91)
    assert np.all(covered < 0.995)


def test_few_samples_widen_the_interval_as_students_t_does() -> None:
    rng = np.random.default_rng(3)
    covered = coverage(lambda n: rng.normal(size=n), slow_regressor(20), draws=300)
    assert np.all(covered > 0.90)


def test_a_resonance_far_from_the_motion_is_not_taken_for_slow_noise() -> None:
    """Most of the residual's power lies where it does not disturb the parameters."""
    rng = np.random.default_rng(4)
    regressor = slow_regressor(300)
    inverse = np.linalg.pinv(regressor)
    denominator = np.real(np.poly(0.95 * np.exp(1j * np.array([1.0, -1.0]))))
    errors, stds = [], []
    for _ in range(60):
        noise = scipy.signal.lfilter([1.0], denominator, rng.normal(size=600))[300:]
        errors.append(inverse @ noise)
        noise -= regressor @ errors[-1]
        stds.append(coloured_std(regressor, noise))
    actual = np.std(errors, axis=0)
    # as white noise, the inertia's would be 2.3 times too large
    assert np.all(np.median(stds, axis=0) < 1.8 * actual)


def test_what_the_parameters_explain_does_not_count() -> None:
    """The restricted likelihood sees only what no parameter can explain."""
    rng = np.random.default_rng(5)
    regressor = slow_regressor(200)
    noise = np.cumsum(rng.normal(size=200))
    residual = noise - regressor @ (np.linalg.pinv(regressor) @ noise)
    moved = residual + 0.1 * regressor @ TRUTH
    np.testing.assert_allclose(
        coloured_std(regressor, moved), coloured_std(regressor, residual), rtol=0.02
    )


def test_units_do_not_matter() -> None:
    rng = np.random.default_rng(6)
    regressor, residual = slow_regressor(150), rng.normal(size=150)
    units = np.array([1e-4, 1.0, 1e3, 10.0])
    np.testing.assert_allclose(
        coloured_std(regressor * units, 1e-3 * residual) * units,
        1e-3 * coloured_std(regressor, residual),
        rtol=1e-6,
    )


def test_inseparable_columns_and_no_residual_have_an_answer() -> None:
    rng = np.random.default_rng(7)
    one_way = np.column_stack([np.linspace(0, 1, 60), np.ones(60), np.ones(60)])
    assert np.all(np.isfinite(coloured_std(one_way, rng.normal(size=60))))
    np.testing.assert_array_equal(coloured_std(one_way, np.zeros(60)), 0.0)
