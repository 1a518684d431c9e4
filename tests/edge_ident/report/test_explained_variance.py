"""Where a residual lives: all of it with the quantity that makes it, none of it in noise."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from edge_ident.diagnosis.measures import Traces, Verdict
from edge_ident.report.page.diagnosis_charts import acceleration_at, explained_variance
from tests.edge_ident.diagnosis import hand_made

AXIS = hand_made.axis(Verdict.ADEQUATE)
QUANTITIES = ("position", "velocity", "distance_since_reversal", "acceleration_of_z", "time")


def shares(residual: np.ndarray) -> dict[str, float]:
    """Of a base model that leaves this."""
    traces = replace(AXIS.traces, base_effort=AXIS.traces.effort - residual)
    other = replace(AXIS.traces, acceleration=np.sin(9.7 * AXIS.traces.time_s))
    axes = {"x": replace(AXIS, traces=traces), "z": replace(AXIS, traces=other)}
    return explained_variance("x", axes)["base"]


@pytest.mark.parametrize(
    ("quantity", "residual"),
    [
        ("position", lambda t: np.sin(2.0 * t.position)),
        ("position", lambda t: np.sign(t.velocity) * np.cos(2.0 * t.position)),
        ("velocity", lambda t: t.velocity * np.abs(t.velocity)),
        (
            "distance_since_reversal",
            lambda t: np.sign(t.velocity) * np.exp(-t.since_reversal),
        ),
        ("acceleration_of_z", lambda t: np.sin(9.7 * t.time_s)),
        ("time", lambda t: (t.time_s > 7.0) * 1.0),
    ],
)
def test_a_residual_lives_with_the_quantity_that_makes_it(
    quantity: str, residual: Callable[[Traces], np.ndarray]
) -> None:
    found = shares(residual(AXIS.traces))
    assert tuple(found) == QUANTITIES
    assert max(found, key=found.__getitem__) == quantity
    assert found[quantity] > 0.9


def test_white_noise_lives_nowhere() -> None:
    found = shares(np.random.default_rng(3).normal(size=len(AXIS.traces.time_s)))
    assert max(found.values()) < 0.02


def test_what_does_not_vary_and_what_was_never_judged_have_no_share() -> None:
    assert set(shares(np.zeros(len(AXIS.traces.time_s))).values()) == {0.0}
    blind = replace(AXIS, traces=replace(AXIS.traces, valid=np.zeros(4000, dtype=np.bool_)))
    assert set(explained_variance("x", {"x": blind})["base"].values()) == {0.0}


def test_another_axis_is_read_at_the_times_of_this_one_and_in_the_same_recording() -> None:
    traces = AXIS.traces
    sparse = slice(None, None, 7)
    names = ("time_s", "acceleration", "recording")
    second = (np.arange(4000) >= 2000).astype(np.intp)
    line = replace(
        traces, recording=second, acceleration=np.where(second, -1.0, 1.0) * traces.time_s
    )
    other = replace(line, **{name: getattr(line, name)[sparse] for name in names})
    here = replace(traces, recording=second)
    assert acceleration_at(here, other)[:1900] == pytest.approx(traces.time_s[:1900])
    assert acceleration_at(here, other)[2010:3990] == pytest.approx(-traces.time_s[2010:3990])


def test_another_axis_that_rests_in_a_recording_is_not_read_from_the_next_one() -> None:
    second = (np.arange(4000) >= 2000).astype(np.intp)
    here = replace(AXIS.traces, recording=second)
    last = {n: getattr(here, n)[2000:] for n in ("time_s", "acceleration", "recording")}
    read = acceleration_at(here, replace(here, **last))
    assert np.all(read[:2000] == 0.0)
    assert read[2000:] == pytest.approx(here.acceleration[2000:])
