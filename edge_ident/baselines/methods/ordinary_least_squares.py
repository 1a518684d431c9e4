"""Ordinary least squares on filtered signals (IDIM-LS; Gautier 1997): what others improve on."""

from edge_ident.baselines.problem import Problem
from edge_ident.estimation.least_squares import Columns, solve
from edge_ident.model.model import Estimate


def estimate(problem: Problem) -> Estimate:
    """See `edge_ident.estimation.least_squares.solve`."""
    return problem.with_noise_bias(solve(Columns(problem.regressor), problem.effort))
