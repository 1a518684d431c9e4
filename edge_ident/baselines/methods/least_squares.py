"""Least squares as `edge-ident identify` runs it."""

from edge_ident.baselines.problem import Problem
from edge_ident.estimation import least_squares
from edge_ident.model.model import Estimate


def estimate(problem: Problem) -> Estimate:
    """See `edge_ident.estimation.least_squares.fit`."""
    return least_squares.fit(problem.signals, problem.part)
