"""Output error: the parameters whose simulated drive has the measured position and effort.

Position and effort of a closed-loop simulation are fitted by Gauss-Newton steps in a trust region
(CLOE: Landau and Karimi 1997; DIDIM: Gautier, Janot, Vandanjon 2013). The recording's controller is
unknown. The simulated one follows the filtered measured position, with stiff feedback and its
model's own feed-forward. So the fit depends almost only on the effort, and noise in the followed
position acts as in least squares. The simulation adds friction that sticks at reversals.
"""

from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from edge_ident.baselines.closed_loop import course_along, simulate
from edge_ident.baselines.problem import Problem, fit
from edge_ident.errors import DataError
from edge_ident.estimation.covariance import coloured_std
from edge_ident.model.model import POSITIVE, Estimate
from edge_ident.signals.encoder import position_noise
from edge_ident.signals.filters import lowpass

Array = NDArray[np.float64]

_SMALLEST: Final = 1e-4
"""Least share of the effort that inertia and frictions may have."""
_DIFFERENCE: Final = 1e-3
"""Step of the numerical derivatives, in shares: friction's events are not smooth below it."""
_TOLERANCE: Final = 1e-6
_EVALUATIONS: Final = 40


def estimate(problem: Problem) -> Estimate:
    """Estimate by simulation.

    Raises
    ------
    DataError
        The search does not converge.
    """
    scale = _scale(problem)
    residuals = _Residuals(problem, scale)
    start = fit(problem.regressor, problem.effort) / scale
    lowest = np.where(POSITIVE, _SMALLEST, -np.inf)
    found = least_squares(
        residuals,
        np.maximum(start, 2.0 * lowest),
        bounds=(lowest, np.inf),
        diff_step=_DIFFERENCE / np.maximum(np.abs(start), _DIFFERENCE),
        xtol=_TOLERANCE,
        ftol=_TOLERANCE,
        max_nfev=_EVALUATIONS,
    )
    if not found.success:
        raise DataError(
            f"the search did not converge in {residuals.simulations} simulations",
            "record a motion that determines all parameters; see edge-ident identify",
        )
    effort_rows = slice(len(problem.effort))  # the position's have next to no slope
    std = coloured_std(found.jac[effort_rows], found.fun[effort_rows])
    return problem.with_noise_bias(Estimate(found.x * scale, std * scale))


def _scale(problem: Problem) -> Array:
    """Parameters that would each alone cause the rms effort."""
    rms = np.sqrt(np.mean(problem.regressor**2, axis=0))
    return np.asarray(np.sqrt(np.mean(problem.effort**2)) / np.where(rms > 0, rms, 1.0))


class _Residuals:
    """Simulated less measured effort and position, each over its noise, (2M,)."""

    def __init__(self, problem: Problem, scale: Array) -> None:
        self._problem, self._scale = problem, scale
        signals = problem.signals
        self._course = course_along(problem.axis.position, signals.cutoff_hz, signals.period_s)
        fitted = fit(problem.regressor, problem.effort)
        missed = problem.effort - problem.regressor @ fitted
        self._effort_noise = max(float(np.std(missed)), 1e-9 * float(np.std(problem.effort)))
        self._position_noise = position_noise(problem.axis.position)
        self.simulations = 0

    def __call__(self, shares: Array) -> Array:
        problem, signals = self._problem, self._problem.signals
        response = simulate(shares * self._scale, self._course, signals.period_s)
        effort = lowpass(
            response.effort, signals.cutoff_hz, signals.period_s, delay_s=0.5 * signals.period_s
        )[problem.part.samples]
        position = (response.position - self._course.position)[problem.part.samples]
        self.simulations += 1
        missed = np.linalg.norm(effort - problem.effort) / np.linalg.norm(problem.effort)
        problem.note(f"simulation {self.simulations}, residual {missed:.2%}")
        return np.concatenate(
            [
                (effort - problem.effort) / self._effort_noise,
                position / self._position_noise,
            ]
        )
