"""Instrumental variables from a simulated drive (IDIM-IV; Janot, Vandanjon, Gautier 2014).

The instruments are a second regressor, computed from a closed-loop simulation of the present model.
It varies as the measured regressor does but is independent of its noise, so the estimate has no
bias by encoder noise. Model and instruments are computed in turn until the parameters converge.

The simulated drive follows the recorded reference. Without one it follows the measured position,
filtered at half the cut-off. Its acceleration shares 7 % of the noise's power with the regressor.
That share of the bias remains and is added to the standard deviation.
"""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.baselines.closed_loop import Course, course_along, simulate
from edge_ident.baselines.problem import Problem, fit
from edge_ident.errors import DataError
from edge_ident.estimation.covariance import coloured_std
from edge_ident.model.model import Estimate
from edge_ident.signals.conditioning import filtered_regressor

Array = NDArray[np.float64]

_ROUNDS: Final = 20
_NARROWER: Final = 0.5
"""Cut-off of the position to follow, over that of the regressor."""
_SHARED_NOISE: Final = 0.073
"""Share of the acceleration noise's power: ∫x⁴/(1 + x⁸)/(1 + (2x)⁸) over ∫x⁴/(1 + x⁸)²."""
_CONVERGED: Final = 1e-4
"""Change of the modelled effort, relative to the effort, that ends the rounds."""


def estimate(problem: Problem) -> Estimate:
    """Estimate by simulated instruments.

    With as many instruments as parameters the estimate is least squares on the regressor's
    projection onto the instruments; so are its deviations.

    Raises
    ------
    DataError
        The model cannot be simulated, or the rounds do not converge.
    """
    measured, effort = problem.regressor, problem.effort
    course, shared_noise = _course(problem)
    parameters = fit(measured, effort)
    for done in range(1, _ROUNDS + 1):
        problem.note(f"simulation {done}")
        instruments = _instruments(problem, parameters, course)
        projected = instruments @ np.linalg.lstsq(instruments, measured, rcond=None)[0]
        before, parameters = parameters, fit(projected, effort)
        moved = np.linalg.norm(measured @ (parameters - before))
        if moved <= _CONVERGED * np.linalg.norm(effort):
            std = coloured_std(projected, effort - measured @ parameters)
            return problem.with_noise_bias(Estimate(parameters, std), shared_noise)
    raise DataError(
        f"the parameters did not converge in {_ROUNDS} simulations",
        "record a motion that determines all parameters; see edge-ident identify",
    )


def _course(problem: Problem) -> tuple[Course, float]:
    """What to follow, and how much of the regressor's noise power it shares."""
    signals, axis = problem.signals, problem.axis
    if axis.reference is not None:
        return course_along(axis.reference, signals.cutoff_hz, signals.period_s), 0.0
    narrow_hz = _NARROWER * signals.cutoff_hz
    return course_along(axis.position, narrow_hz, signals.period_s), _SHARED_NOISE


def _instruments(problem: Problem, parameters: Array, course: Course) -> Array:
    """The simulated regressor, filtered as the measured one is, at the same samples."""
    cutoff_hz, period_s = problem.signals.cutoff_hz, problem.signals.period_s
    response = simulate(parameters, course, period_s)
    columns = filtered_regressor(response.position, cutoff_hz, period_s)
    return np.asarray(columns[problem.part.samples])
