"""Disturbed data say about half as much, and a cause that is there is found in them."""

import numpy as np
import pytest

from edge_ident.diagnosis.fit.fitting import fit
from edge_ident.diagnosis.fit.noise_floor import noise_floor
from edge_ident.diagnosis.judge.stability import RUNS, disturbed_runs
from edge_ident.diagnosis.prepare.preparation import prepare_axis
from edge_ident.diagnosis.select.forward_selection import select_forward
from edge_ident.diagnosis.select.search import Search
from tests.edge_ident.diagnosis.select.test_search_parts import TEMPLATE, recorded, rigid, swing


def test_what_gains_twice_what_it_must_is_found_again() -> None:
    """A ripple of a fifth of the noise."""
    t, x, v, a = swing(seconds=12.0)
    effort = rigid(v, a) + 0.01 * np.sin(2.0 * np.pi * x / 0.8)
    data = prepare_axis([recorded(t, x, effort, noise=0.05)], "x")
    start = fit(data, TEMPLATE, np.zeros(4), ())
    found = select_forward(Search.of(data, TEMPLATE, start), start)
    assert found.search.gain(start, found.model) == pytest.approx(55.0, abs=5.0)
    runs = disturbed_runs(found.search, start, found.model, noise_floor(data, start).rms)
    assert runs.times_found(found.model) == [RUNS]
