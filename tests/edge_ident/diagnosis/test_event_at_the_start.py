"""What happens before the axis has moved far enough one way for friction to forget."""

import numpy as np
import pytest
from numpy.typing import NDArray

from edge_ident.diagnosis.diagnose import diagnose
from edge_ident.diagnosis.measures import Verdict
from edge_ident.identification.identify import identify
from edge_ident.signals.recording import AxisRecord, Recording
from tests.repetitions import a_few

Array = NDArray[np.float64]

TIME_S = 2.5e-3 * np.arange(8_000)
RATE = 2.0 * np.pi / 10.0
COUNT_RAD = 2.0 * np.pi / 65_536
COULOMB = 1.2


def recorded(disturbance: Array) -> Recording:
    """A sinusoid that begins shortly before its first turning point, at 0.6 s."""
    angle = RATE * (TIME_S - 0.6) + 0.2 * np.sin(3.0 * RATE * (TIME_S - 0.6))
    rate = RATE * (1.0 + 0.6 * np.cos(3.0 * RATE * (TIME_S - 0.6)))
    position = 4.0 * np.cos(angle)
    velocity = -4.0 * rate * np.sin(angle)
    acceleration = np.gradient(velocity, TIME_S)
    effort = 0.4 * acceleration + 0.5 * velocity + COULOMB * np.sign(velocity) + disturbance
    effort += 0.01 * np.random.default_rng(3).standard_normal(len(TIME_S))
    shown = COUNT_RAD * np.floor(position / COUNT_RAD)
    return Recording(TIME_S, {"x": AxisRecord(shown, effort, "rad", "N*m")}, "by hand")


def push(begin_s: float) -> Array:
    """For a tenth of a second, once."""
    return 4.0 * np.exp(-0.5 * np.square((TIME_S - begin_s) / 0.03))


@pytest.mark.parametrize("begin_s", a_few([1.1, 6.0], [1.1]))
def test_a_push_is_an_event_whenever_it_comes(begin_s: float) -> None:
    """At 1.1 s the axis has moved by 6 % of its travel since it turned."""
    axis = diagnose([recorded(push(begin_s))]).axes["x"]
    (cause,) = {cause.term.effect for cause in axis.causes}
    assert cause == "disturbance_event"
    (first, *_) = axis.causes
    assert float(first.term.values["time"]) == pytest.approx(begin_s, abs=0.15)
    assert not identify(recorded(push(begin_s))).axes["x"].adequacy.adequate


def test_friction_that_remembers_what_was_before_is_none() -> None:
    """It begins at the other direction's, and has turned round after a thousandth of the travel."""
    moved = np.abs(recorded(np.zeros(len(TIME_S))).axes["x"].position)
    turned = np.exp(-np.abs(moved - moved[0]) / 0.008)
    before = -2.0 * COULOMB * turned * (TIME_S < 0.5)
    assert diagnose([recorded(before)]).axes["x"].verdict is Verdict.ADEQUATE
    assert identify(recorded(before)).axes["x"].adequacy.adequate
