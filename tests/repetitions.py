"""Cases of which the gate runs a few, and `pytest --thorough` all."""

from collections.abc import Container, Iterable
from typing import Any

import pytest


def a_few(cases: Iterable[Any], always: Container[Any]) -> list[Any]:
    """Cases of a parametrization; those that are not named are `thorough`.

    The named ones take every path that the others take.
    """
    return [
        case if case in always else pytest.param(case, marks=pytest.mark.thorough) for case in cases
    ]
