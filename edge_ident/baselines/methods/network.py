"""The convolutional network, as `edge-ident identify` runs it."""

from edge_ident.baselines.problem import Problem
from edge_ident.errors import DataError
from edge_ident.identification import identify
from edge_ident.model import Estimate
from edge_ident.recording import Recording


def estimate(problem: Problem) -> Estimate:
    """See `edge_ident.cnn`. Its time includes filtering, which it does not share.

    Raises
    ------
    DataError
        No network applies to this recording, or its answer misses too much of the effort.
    """
    recording = Recording(
        problem.time_s, {"axis": problem.axis}, "the recording", problem.effort_shift_s
    )
    axis = identify(recording, problem.network, seed=problem.seed).axes["axis"]
    if axis.network is None:
        raise DataError(
            axis.network_reason, "name a network for this motion with --network, or train one"
        )
    return axis.network
