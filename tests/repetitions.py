"""Cases of which the gate runs a few, and `pytest --thorough` all."""

import os
from collections.abc import Collection, Iterable
from typing import Any

import pytest

THOROUGH = "EDGE_IDENT_TESTS_THOROUGH"
"""Environment variable that is set where all cases are asked for."""


def examples(number: int) -> int:
    """Random examples that hypothesis draws, of a number that are worth it: the gate half."""
    return number if os.environ.get(THOROUGH) else -(-number // 2)


def a_few(cases: Iterable[Any], always: Collection[Any]) -> list[Any]:
    """Cases of a parametrization; all but some are `thorough`.

    Parameters
    ----------
    cases : iterable
        Values, or tuples of several.
    always : collection
        Those that take every path that the others take.
    """
    listed = list(cases)
    assert always
    assert all(case in listed for case in always)
    return [case if case in always else _thorough(case) for case in listed]


def _thorough(case: Any) -> Any:
    values = case if isinstance(case, tuple) else (case,)
    return pytest.param(*values, marks=pytest.mark.thorough)
