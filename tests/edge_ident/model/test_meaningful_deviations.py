"""A deviation that says nothing is null in every document."""

import math

import pytest

from edge_ident.model.model import AxisModel, Term
from edge_ident.model.model_files import values_document


@pytest.mark.parametrize(
    ("value", "std", "written"),
    [
        (2.0, 0.1, 0.1),
        (2.0, 0.0, 0.0),
        (0.0, 0.3, 0.3),
        (0.0, 1e-156, None),
        (2.0, 1e12, None),
        (0.0, 1e12, None),
        (2.0, math.inf, None),
    ],
)
def test_a_deviation_that_says_nothing_is_null(
    value: float, std: float, written: float | None
) -> None:
    term = Term("stribeck_friction", {"level": value, "speed": 0.1}, {"level": std})
    document = values_document(term, AxisModel((term,)))
    assert document["level"]["std"] == written
