"""The convolutional network, as `edge-ident identify` runs it."""

from edge_ident.baselines.problem import Problem
from edge_ident.errors import DataError
from edge_ident.identification.identify import run_network
from edge_ident.model.model import Estimate
from edge_ident.support.stopwatch import Stopwatch


def estimate(problem: Problem) -> Estimate:
    """See `edge_ident.estimation.network_estimate`.

    Raises
    ------
    DataError
        No network applies to this recording, or its answer misses too much of the effort.
    """
    found, reason = run_network(
        problem.signals, problem.axis, problem.network, problem.seed, Stopwatch()
    )
    if found is None:
        raise DataError(reason, "name a network for this motion with --network, or train one")
    return found
