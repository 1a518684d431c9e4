"""The convolutional network, as `edge-ident identify` runs it."""

from edge_ident.baselines.problem import Problem
from edge_ident.errors import DataError
from edge_ident.identification.network_answers import network_input, run_network
from edge_ident.model.model import Estimate
from edge_ident.support.stopwatch import Stopwatch


def estimate(problem: Problem) -> Estimate:
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
