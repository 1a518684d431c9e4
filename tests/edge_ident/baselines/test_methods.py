"""Each method finds a known drive, and beats least squares where theory says that it should."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.signal

from edge_ident.baselines.methods import METHODS
from edge_ident.baselines.problem import Problem, pose
from edge_ident.errors import DataError
from edge_ident.estimation.network import load_network
from edge_ident.model.model import Estimate
from edge_ident.signals import conditioning
from tests.edge_ident.baselines.drives import TRUTH, paper_record, record

EXACT = sorted(set(METHODS) - {"network", "random_search"})
"""Methods whose error vanishes with the noise."""


def error(estimate: Estimate) -> np.ndarray:
    return np.abs(estimate.parameters / TRUTH - 1.0)


def coloured(rng: np.random.Generator, std: float, samples: int = 8742) -> np.ndarray:
    noise = scipy.signal.lfilter([1], [1, -0.9], rng.normal(size=samples + 500))[500:]
    return std * noise / np.std(noise)


def test_methods_of_the_comparison_are_there() -> None:
    assert set(METHODS) == {
        "huber_regression",
        "instrumental_variables",
        "least_squares",
        "network",
        "ordinary_least_squares",
        "output_error",
        "random_search",
        "total_least_squares",
        "weighted_least_squares",
    }


@pytest.mark.parametrize("method", EXACT)
def test_a_known_drive_is_found(method: str) -> None:
    found = METHODS[method](pose(record(), "x"))
    np.testing.assert_array_less(error(found), [0.01, 0.01, 0.01, 0.03])


@pytest.mark.parametrize("method", EXACT)
def test_intervals_hold_under_coloured_noise(method: str) -> None:
    rng = np.random.default_rng(11)
    inside = []
    for _ in range(8):
        noisy = record(effort_noise=coloured(rng, 0.05), phase=rng.uniform(0, 6))
        found = METHODS[method](pose(noisy, "x"))
        inside.append(np.abs(found.parameters - TRUTH) < 1.96 * found.std)
        np.testing.assert_array_less(error(found), [0.02, 0.03, 0.03, 0.3])
    assert np.mean(inside) > 0.8  # 95 % wanted; 32 correlated figures resolve some 5 points


@pytest.mark.parametrize(
    ("method", "with_reference", "bound"),
    [
        ("total_least_squares", False, 0.01),
        ("instrumental_variables", False, 0.03),
        ("instrumental_variables", True, 0.01),
    ],
)
def test_encoder_noise_in_the_acceleration_biases_least_squares_only(
    monkeypatch: pytest.MonkeyPatch, method: str, with_reference: bool, bound: float
) -> None:
    """Errors in variables: a filter too wide for the encoder takes a sixth off the inertia."""
    # noise of the acceleration grows as the 2.5th power of the cut-off, so this one is 2.5 times
    # as wide
    monkeypatch.setattr(
        conditioning, "ACCELERATION_NOISE_SHARE", 2.5**2.5 * conditioning.ACCELERATION_NOISE_SHARE
    )
    rng = np.random.default_rng(5)
    noise = {"effort_noise": coloured(rng, 0.02), "position_noise": 1e-3 * rng.normal(size=8742)}
    problem = pose(record(with_reference=with_reference, **noise), "x")
    plain, better = METHODS["ordinary_least_squares"](problem), METHODS[method](problem)
    assert error(plain)[0] > 0.1
    assert error(better)[0] < bound
    assert abs(better.parameters[0] - TRUTH[0]) < 3 * better.std[0]
    np.testing.assert_array_less(error(better)[1:], [0.01, 0.01, 0.05])


def test_huber_resists_collisions() -> None:
    """Short pulses on the effort, all of one sign."""
    pulses = np.zeros(8742)
    for start in range(300, 8700, 900):
        pulses[start : start + 60] = 5.0
    problem = pose(record(effort_noise=pulses + coloured(np.random.default_rng(2), 0.02)), "x")
    plain, robust = METHODS["ordinary_least_squares"](problem), METHODS["huber_regression"](problem)
    assert error(plain)[3] > 1.0
    assert error(robust)[3] < 0.5 * error(plain)[3]
    weighed = np.linalg.norm(problem.regressor, axis=0)
    assert np.linalg.norm((robust.parameters - TRUTH) * weighed) < 0.4 * np.linalg.norm(
        (plain.parameters - TRUTH) * weighed
    )


def test_weights_make_use_of_the_quiet_part() -> None:
    """Noise twenty times larger in one half of the record."""
    rng = np.random.default_rng(8)
    squares: dict[str, list[np.ndarray]] = {
        "ordinary_least_squares": [],
        "weighted_least_squares": [],
    }
    for _ in range(6):
        noise = coloured(rng, 0.5)
        noise[4371:] *= 0.05
        problem = pose(record(effort_noise=noise, phase=rng.uniform(0, 6)), "x")
        for method, found in squares.items():
            found.append(error(METHODS[method](problem)) ** 2)
    plain, weighted = (np.sqrt(np.mean(found, axis=0)) for found in squares.values())
    np.testing.assert_array_less(weighted, 0.5 * plain)


def test_output_error_stays_physical_and_reports_its_simulations() -> None:
    """A drive without dry friction: noise makes it negative for least squares."""
    truth = np.array([0.43, 0.9, 0.0, 0.1])
    notes: list[str] = []
    noise = -coloured(np.random.default_rng(1), 0.3)
    problem = replace(pose(record(truth=truth, effort_noise=noise), "x"), note=notes.append)
    plain, simulated = METHODS["ordinary_least_squares"](problem), METHODS["output_error"](problem)
    assert plain.parameters[2] < 0.0
    assert simulated.parameters[2] > 0.0
    assert np.all(np.abs(simulated.parameters - truth) < 3.0 * simulated.std)
    assert notes[0].startswith("simulation 1, residual")


def test_weights_need_more_than_one_stretch() -> None:
    problem = pose(record(), "x")
    short = replace(problem, regressor=problem.regressor[:30], effort=problem.effort[:30])
    with pytest.raises(DataError, match="not enough"):
        METHODS["weighted_least_squares"](short)


def miss(problem: Problem, estimate: Estimate) -> float:
    modelled = problem.regressor @ estimate.parameters
    return float(np.linalg.norm(problem.effort - modelled) / np.linalg.norm(problem.effort))


def test_random_search_needs_thousands_of_tries() -> None:
    problem = pose(record(), "x")
    few = METHODS["random_search"](replace(problem, tries=8))
    many = METHODS["random_search"](replace(problem, tries=3000))
    assert miss(problem, few) > 0.15
    assert miss(problem, many) < 0.5 * miss(problem, few)
    assert np.all(many.std < few.std)
    again = METHODS["random_search"](replace(problem, tries=8))
    np.testing.assert_array_equal(few.parameters, again.parameters)


def test_the_network_answers_on_its_motion_alone() -> None:
    network = load_network()
    found = METHODS["network"](pose(paper_record(), "x", network=network))
    assert np.all(np.abs(found.parameters - TRUTH) < 3 * found.std)
    with pytest.raises(
        DataError, match="the axis moved otherwise than the network was trained for"
    ):
        METHODS["network"](pose(record(samples=9000), "x", network=network))
    with pytest.raises(DataError, match="no network was given"):
        METHODS["network"](pose(paper_record(), "x"))
