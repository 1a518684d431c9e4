"""Established methods: each takes a problem and gives an estimate.

A method that does not apply raises an `EdgeIdentError` with the reason. To add a method, add a
function, and its name to `METHODS`.
"""

from collections.abc import Callable
from math import gamma, pi, sqrt
from typing import Final

import numpy as np
from scipy import optimize

from edge_ident.baselines.problem import Course, Problem, course_along, fit, simulate
from edge_ident.errors import DataError
from edge_ident.estimation.least_squares import Columns, coloured_std, solve
from edge_ident.estimation.least_squares import fit as edge_fit
from edge_ident.identification.identify import network_input, run_network
from edge_ident.model.model import POSITIVE, Array, Estimate
from edge_ident.signals.conditioning import filtered_regressor, position_noise
from edge_ident.signals.filters import lowpass
from edge_ident.support.stopwatch import Stopwatch

Method = Callable[[Problem], Estimate]

# Change of the modelled effort, relative to the effort, that ends the rounds.
_CONVERGED: Final = 1e-6


# Least squares as `edge-ident identify` runs it.


def least_squares(problem: Problem) -> Estimate:
    """See `edge_ident.estimation.least_squares.fit`."""
    return edge_fit(problem.signals, problem.part)


# The convolutional network, as `edge-ident identify` runs it.


def network(problem: Problem) -> Estimate:
    """See `edge_ident.estimation.network_estimate`.

    Raises
    ------
    DataError
        No network applies to this recording, or its answer misses too much of the effort.
    """
    watch, name = Stopwatch(), "axis"
    seen = network_input(problem.signals, problem.axis, problem.network, watch)
    found, reason = run_network({name: seen}, problem.network, problem.seed, watch)[name]
    if found is None:
        raise DataError(reason, "name a network for this motion with --network, or train one")
    return found


# Ordinary least squares on filtered signals (IDIM-LS; Gautier 1997): what others improve on.


def ordinary_least_squares(problem: Problem) -> Estimate:
    """See `edge_ident.estimation.least_squares.solve`."""
    return problem.with_noise_bias(solve(Columns(problem.regressor), problem.effort))


# Weighted least squares (IDIM-WLS; Gautier and Poignet 2001).
#
# The method weighs each joint's equations by the reciprocal of their residual's deviation. One axis
# has one equation, so segments of the motion take the place of the joints: where the model misses
# more, samples count less. Weights and parameters are computed in turn until they converge.

_SEGMENTS: Final = 12
_FEWEST_SAMPLES: Final = 20  # fewest samples in a segment: its deviation is then known to a sixth
# Largest ratio of weights: without it, a segment fitted by chance would end up alone.
_LARGEST_RATIO: Final = 30.0
_ROUNDS_WLS: Final = 100


def weighted_least_squares(problem: Problem) -> Estimate:
    """Estimate with the noise of each segment of the motion.

    Raises
    ------
    DataError
        The record is too short for two segments, or the weights do not converge.
    """
    count = min(_SEGMENTS, len(problem.effort) // _FEWEST_SAMPLES)
    if count < 2:
        raise DataError(
            f"{len(problem.effort)} independent samples are not enough to weigh segments of them",
            f"record a longer motion: {2 * _FEWEST_SAMPLES} are needed",
        )
    regressor, effort = problem.regressor, problem.effort
    weight = np.ones(len(effort))
    modelled = np.zeros(len(effort))
    for _ in range(_ROUNDS_WLS):
        weighted = regressor * weight[:, None]
        parameters = fit(weighted, effort * weight)
        before, modelled = modelled, regressor @ parameters
        if np.linalg.norm(modelled - before) <= _CONVERGED * np.linalg.norm(effort):
            std = coloured_std(weighted, (effort - modelled) * weight)
            return problem.with_noise_bias(Estimate(parameters, std))
        weight = _weights(effort - modelled, count)
    raise DataError(
        f"the weights did not converge in {_ROUNDS_WLS} rounds", "record a longer motion"
    )


def _weights(residual: Array, count: int) -> Array:
    """Reciprocal deviation of the residual in each segment, for every sample."""
    segments = np.array_split(residual, count)
    deviation = np.array([np.sqrt(np.mean(segment**2)) for segment in segments])
    deviation = np.maximum(deviation, np.max(deviation) / _LARGEST_RATIO)
    deviation = np.maximum(deviation, np.finfo(float).tiny)
    return np.repeat(np.min(deviation) / deviation, [len(segment) for segment in segments])


# Total least squares: acceleration and velocity have noise as the effort does.
#
# Mixed LS-TLS (Van Huffel and Vandewalle 1991, section 3.5). The offset's column is exact and the
# sign's nearly so; a QR decomposition removes both. The other columns and the effort are divided by
# their noise. The answer is the right singular vector of the smallest singular value. Noise of
# velocity and of acceleration is uncorrelated, as any stationary signal and its derivative are.

_NOISY: Final = 2  # leading columns of the regressor that carry noise: acceleration and velocity
# Least noise of the effort, over its rms; without any, no rule could divide the residual.
_LEAST_EFFORT_NOISE: Final = 1e-6
# Relative deviation of the noise's power: an encoder's steps are not quite white noise.
_UNCERTAINTY: Final = 0.1
_ROUNDS_TLS: Final = 50


def total_least_squares(problem: Problem) -> Estimate:
    """Estimate with noise in regressor and effort.

    The encoder's noise follows from the position; the effort's is what is left of the residual,
    so both are found in turn until they converge.

    Raises
    ------
    DataError
        The rounds do not converge: encoder noise explains more than the residual.
    """
    regressor, effort = problem.regressor, problem.effort
    noise = _regressor_noise(problem)
    parameters = fit(regressor, effort)
    for _ in range(_ROUNDS_TLS):
        residual = effort - regressor @ parameters
        effort_noise = _effort_noise(residual, effort, noise * parameters)
        before, parameters = parameters, _mixed(regressor, effort, noise, effort_noise)
        moved = np.linalg.norm(regressor @ (parameters - before))
        if moved <= _CONVERGED * np.linalg.norm(effort):
            cleaned = _without_noise(regressor, effort, parameters, noise, effort_noise)
            std = coloured_std(cleaned, effort - regressor @ parameters)
            return problem.with_noise_bias(Estimate(parameters, std), _UNCERTAINTY)
    raise DataError(
        f"total least squares did not converge in {_ROUNDS_TLS} rounds",
        "record a motion with more acceleration, or a finer encoder",
    )


def _regressor_noise(problem: Problem) -> Array:
    """Standard deviation of the noise in each column, (4,).

    White noise of deviation s has density 2s²·period; the n-th derivative behind a filter of
    power gain 1/(1 + (f/f_c)⁸)² keeps (2π)²ⁿ·f_c²ⁿ⁺¹ times the integral of x²ⁿ/(1 + x⁸)².
    """
    signals = problem.signals
    density = 2.0 * position_noise(problem.axis.position) ** 2 * signals.period_s
    noise = np.zeros(problem.regressor.shape[1])
    for column, order in ((0, 2), (1, 1)):
        share = (2 * order + 1) / 8.0
        integral = gamma(share) * gamma(2.0 - share) / 8.0
        width = signals.cutoff_hz ** (2 * order + 1)
        noise[column] = (2.0 * pi) ** order * sqrt(density * width * integral)
    return noise


def _effort_noise(residual: Array, effort: Array, from_regressor: Array) -> float:
    """Deviation of the effort's own noise: the residual's without what the regressor causes."""
    variance = float(np.mean(residual**2)) - float(from_regressor @ from_regressor)
    return sqrt(max(variance, _LEAST_EFFORT_NOISE**2 * float(np.mean(effort**2))))


def _mixed(regressor: Array, effort: Array, noise: Array, effort_noise: float) -> Array:
    exact, noisy = regressor[:, _NOISY:], regressor[:, :_NOISY] / noise[:_NOISY]
    stacked = np.column_stack([exact, noisy, effort / effort_noise])
    triangle = np.linalg.qr(stacked).R
    k = exact.shape[1]
    vector = np.linalg.svd(triangle[k:, k:])[2][-1]
    scaled = -vector[:-1] / vector[-1]
    rest = triangle[:k, -1] - triangle[:k, k:-1] @ scaled
    exactly = np.linalg.lstsq(triangle[:k, :k], rest, rcond=None)[0]
    return np.asarray(effort_noise * np.concatenate([scaled / noise[:_NOISY], exactly]))


def _without_noise(
    regressor: Array, effort: Array, parameters: Array, noise: Array, effort_noise: float
) -> Array:
    """The regressor with its likeliest share of the residual taken out."""
    residual = effort - regressor @ parameters
    pulled = noise**2 * parameters
    return np.asarray(
        regressor + np.outer(residual, pulled) / (effort_noise**2 + pulled @ parameters)
    )


# Huber's regression: outliers pull with a bounded force (Huber 1964).
#
# Iteratively reweighted least squares; the scale is the median absolute residual, so that it does
# not grow with the outliers.


# Threshold in deviations: 95 % of least squares' efficiency on normal noise.
_THRESHOLD: Final = 1.345
_MEDIAN_TO_DEVIATION: Final = 1.4826
_ROUNDS_HUBER: Final = 200


def huber_regression(problem: Problem) -> Estimate:
    """Estimate with bounded influence of every sample.

    The deviations are those of least squares on pseudo-residuals (Street, Carroll and Ruppert
    1988), which gives the M-estimator's covariance, under coloured residuals too.

    Raises
    ------
    DataError
        The rounds do not converge.
    """
    regressor, effort = problem.regressor, problem.effort
    parameters = fit(regressor, effort)
    for _ in range(_ROUNDS_HUBER):
        residual = effort - regressor @ parameters
        limit = _limit(residual)
        root = np.sqrt(np.clip(residual, -limit, limit) / np.where(residual == 0, 1, residual))
        root[residual == 0] = 1.0
        before = parameters
        parameters = fit(regressor * root[:, None], effort * root)
        moved = np.linalg.norm(regressor @ (parameters - before))
        if moved <= _CONVERGED * np.linalg.norm(effort):
            return problem.with_noise_bias(
                Estimate(parameters, _std(regressor, effort, parameters))
            )
    raise DataError(
        f"the weights did not converge in {_ROUNDS_HUBER} rounds", "examine the residual over time"
    )


def _limit(residual: Array) -> float:
    """Residual beyond which a sample pulls no harder."""
    scale = _MEDIAN_TO_DEVIATION * float(np.median(np.abs(residual)))
    return max(_THRESHOLD * scale, np.finfo(float).tiny)


def _std(regressor: Array, effort: Array, parameters: Array) -> Array:
    residual = effort - regressor @ parameters
    limit = _limit(residual)
    inside = float(np.mean(np.abs(residual) <= limit))
    return coloured_std(regressor, np.clip(residual, -limit, limit) / inside)


# Instrumental variables from a simulated drive (IDIM-IV; Janot, Vandanjon, Gautier 2014).
#
# The instruments are a second regressor, computed from a closed-loop simulation of the present
# model. It varies as the measured regressor does but is independent of its noise, so the estimate
# has no bias by encoder noise. Model and instruments are computed in turn until the parameters
# converge.
#
# The simulated drive follows the recorded reference. Without one it follows the measured position,
# filtered at half the cut-off. Its acceleration shares 7 % of the noise's power with the regressor.
# That share of the bias remains and is added to the standard deviation.

_ROUNDS_IV: Final = 20
_NARROWER: Final = 0.5  # Cut-off of the position to follow, over that of the regressor
# Share of the acceleration noise's power: ∫x⁴/(1 + x⁸)/(1 + (2x)⁸) over ∫x⁴/(1 + x⁸)².
_SHARED_NOISE: Final = 0.073
# Change of the modelled effort, relative to the effort, that ends the rounds.
_CONVERGED_IV: Final = 1e-4


def instrumental_variables(problem: Problem) -> Estimate:
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
    for done in range(1, _ROUNDS_IV + 1):
        problem.note(f"simulation {done}")
        instruments = _instruments(problem, parameters, course)
        projected = instruments @ np.linalg.lstsq(instruments, measured, rcond=None)[0]
        before, parameters = parameters, fit(projected, effort)
        moved = np.linalg.norm(measured @ (parameters - before))
        if moved <= _CONVERGED_IV * np.linalg.norm(effort):
            std = coloured_std(projected, effort - measured @ parameters)
            return problem.with_noise_bias(Estimate(parameters, std), shared_noise)
    raise DataError(
        f"the parameters did not converge in {_ROUNDS_IV} simulations",
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


# Output error: the parameters whose simulated drive has the measured position and effort.
#
# Position and effort of a closed-loop simulation are fitted by Gauss-Newton steps in a trust region
# (CLOE: Landau and Karimi 1997; DIDIM: Gautier, Janot, Vandanjon 2013). The recording's controller
# is unknown. The simulated one follows the filtered measured position, with stiff feedback and its
# model's own feed-forward. So the fit depends almost only on the effort, and noise in the followed
# position acts as in least squares. The simulation adds friction that sticks at reversals.

_SMALLEST: Final = 1e-4  # least share of the effort that inertia and frictions may have
# Step of the numerical derivatives, in shares: friction's events are not smooth below it.
_DIFFERENCE: Final = 1e-3
_TOLERANCE: Final = 1e-6
_EVALUATIONS: Final = 40


def output_error(problem: Problem) -> Estimate:
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
    found = optimize.least_squares(
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
            [(effort - problem.effort) / self._effort_noise, position / self._position_noise]
        )


# Random search: the best of a few random drives, which is the network's loop without the network.
#
# It shows how lenient a metric is: guesses from [0, 1] reach a correlation of 0.9 in most draws.

_REPEATS: Final = 64  # further searches, which show how far from each other they end


def random_search(problem: Problem) -> Estimate:
    """Draw as often as the network may look, and keep the smallest relative residual.

    Shares are uniform in [0, 1], the offset's in [-1, 1]; a share of one alone causes the peak
    effort. The deviation is that of the same search with other draws.
    """
    regressor, effort = problem.regressor, problem.effort
    peak = np.max(np.abs(regressor), axis=0)
    scale = np.max(np.abs(effort)) / np.where(peak > 0, peak, 1.0)
    rng = np.random.default_rng(problem.seed)
    shares = rng.uniform(np.where(POSITIVE, 0.0, -1.0), 1.0, (1 + _REPEATS, problem.tries, 4))
    drives = scale * shares
    # ‖effort - regressor·drive‖², less the effort's own square, which all have in common
    misses = np.sum((drives @ (regressor.T @ regressor) - 2.0 * effort @ regressor) * drives, -1)
    best = drives[np.arange(1 + _REPEATS), np.argmin(misses, axis=1)]
    return Estimate(best[0], np.std(best, axis=0))


METHODS: Final[dict[str, Method]] = {
    method.__name__: method
    for method in (
        huber_regression,
        instrumental_variables,
        least_squares,
        network,
        ordinary_least_squares,
        output_error,
        random_search,
        total_least_squares,
        weighted_least_squares,
    )
}
"""Every method by its name, in alphabetical order."""
