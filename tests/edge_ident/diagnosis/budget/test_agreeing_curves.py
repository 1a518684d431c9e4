"""Which curves hold in every part of a recording, beside the base model alone."""

import numpy as np
import pytest

from edge_ident.diagnosis.budget.account import Missed
from edge_ident.diagnosis.budget.agreement import agreeing_curves
from edge_ident.diagnosis.fit.noise_floor import noise_floor
from edge_ident.diagnosis.prepare.preparation import prepare_axis
from edge_ident.diagnosis.select.selection import fitted_base
from edge_ident.model.model import Estimate, base_axis
from edge_ident.signals.recording import AxisRecord, Recording
from tests.edge_ident.diagnosis.test_curves_in_model import SIZES, hidden, sound


def curves_of(recording: Recording) -> list[str]:
    data = prepare_axis([recording], "x")
    none = Estimate(np.zeros(4), np.zeros(4))
    base = fitted_base(data, base_axis(none))
    found = agreeing_curves(Missed(data, base, noise_floor(data, base).rms))
    return [curve.term.effect for curve in found]


@pytest.mark.parametrize("name", SIZES)
def test_the_hidden_curve_holds_and_no_other(name: str) -> None:
    assert curves_of(hidden(name)[0]) == [name]


def test_a_sound_axis_has_none() -> None:
    assert curves_of(sound()) == []


@pytest.mark.parametrize("passes", [1, 3])
def test_what_may_be_a_law_of_time_as_well_is_in_no_model(passes: int) -> None:
    """A place is passed once, and the load may as well have come and gone; or there and back, and
    it belongs to the place."""
    time_s = np.arange(0.0, 30.0, 0.004)
    rate = np.pi * passes / 30.0
    position = -3.0 * np.cos(rate * time_s) + 0.1 * np.sin(9.0 * time_s)
    velocity = np.gradient(position, 0.004)
    acceleration = np.gradient(velocity, 0.004)
    effort = 0.05 * acceleration + 0.3 * velocity + 0.2 * np.sign(velocity)
    effort += 0.3 * np.interp(position, np.linspace(-3.1, 3.1, 7), [0, 1, -1, 1, 0.5, -1, 0])
    effort += 0.01 * np.random.default_rng(5).standard_normal(len(time_s))
    record = AxisRecord(position, effort, "rad", "N*m")
    expected = ["load_over_position"] if passes > 1 else []
    assert curves_of(Recording(time_s, {"x": record}, "by hand")) == expected
