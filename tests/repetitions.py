"""Cases of which the gate runs a few, and `pytest --thorough` all."""

from collections.abc import Collection, Iterable
from typing import Any

import pytest


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
