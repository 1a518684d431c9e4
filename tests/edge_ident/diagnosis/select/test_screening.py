"""What a candidate needs before any model is fitted with it."""

from typing import Any

import numpy as np
import pytest

from edge_ident.diagnosis.fit.fitting import FittedTerm, fit
from edge_ident.diagnosis.prepare.preparation import prepare_axis
from edge_ident.diagnosis.select.search import Search, reliable
from tests.edge_ident.diagnosis.select.test_search_parts import TEMPLATE, recorded, rigid, swing


@pytest.mark.parametrize(("noise", "passes"), [(0.3, True), (0.45, True), (0.55, False)])
def test_a_candidate_is_mostly_motion(noise: float, passes: bool) -> None:
    """Beside a constant; the replica has as much noise once more, and the rest is motion."""
    motion, first, second = np.random.default_rng(3).standard_normal((3, 1, 4000))
    regressor = np.sqrt(1.0 - noise) * motion + np.sqrt(noise) * first
    replica, constant = regressor + np.sqrt(noise) * second, np.ones((4000, 1))
    assert reliable(regressor + 5.0, replica + 5.0, constant, constant) is passes


def test_what_no_machine_has_bars_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    """On a belt, a load of six times the inertia explained most, and was refused. What it barred
    was friction by direction, which the axis had: nothing was found at all."""
    t, x, v, a = swing()
    both = 0.3 * np.sin(4.0 * x) + 0.02 * np.abs(v)
    data = prepare_axis([recorded(t, x, rigid(v, a) + both, noise=0.02)], "x")
    start = fit(data, TEMPLATE, np.array([1.0, 0.0, 0.0, 0.0]), ())
    search = Search.of(data, TEMPLATE, start)
    found = {scored.candidate.effect for scored in search.score(start)}
    assert "asymmetric_friction" not in found, "it is far behind"
    possible = Search._admissible

    def but_loads(self: Search, term: FittedTerm, *others: Any) -> bool:
        along = ("position_dependent_load", "torque_ripple", "encoder_eccentricity")
        return term.candidate.effect not in along and possible(self, term, *others)

    monkeypatch.setattr(Search, "_admissible", but_loads)
    found = {scored.candidate.effect for scored in search.score(start)}
    assert "asymmetric_friction" in found
