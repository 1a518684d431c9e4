"""Laws of other axes beside something unknown, along one path and its repetitions."""

import numpy as np
import pytest

from edge_ident.diagnosis.diagnose import diagnose
from edge_ident.diagnosis.fit.fitting import FittedModel
from edge_ident.diagnosis.prepare.axis_data import AxisData
from edge_ident.diagnosis.prepare.preparation import prepare_axis
from edge_ident.diagnosis.select.search import independent_samples, samples_of_unknown
from edge_ident.diagnosis.select.selection import fitted_base
from edge_ident.model.model import Estimate, base_axis
from edge_ident.signals.recording import AxisRecord, Recording
from tools.arms import ARMS, recorded

PERIOD_S = 0.004
PATH_S = 8.0
OF_OTHER_AXES = {"cross_axis_coupling", "pose_dependent_inertia"}


def missed(laps: int, unknown: float, noise: float) -> tuple[AxisData, FittedModel]:
    """An axis with an effort that returns in each lap, and the base model that misses it."""
    t = PERIOD_S * np.arange(round(laps * PATH_S / PERIOD_S))
    phase = 2.0 * np.pi * t / PATH_S
    angle = np.sin(phase) + 0.4 * np.sin(3.0 * phase + 1.0) + 0.2 * np.sin(7.0 * phase + 2.0)
    speed = np.gradient(angle, PERIOD_S)
    rng = np.random.default_rng(1)
    effort = 0.2 * np.gradient(speed, PERIOD_S) + speed + 0.5 * np.sign(speed)
    effort += unknown * np.cos(2.0 * phase) + noise * rng.standard_normal(len(t))
    data = prepare_axis([Recording(t, {"j": AxisRecord(angle, effort, "rad", "N*m")}, "laps")], "j")
    return data, fitted_base(data, base_axis(Estimate(np.zeros(4), np.zeros(4))))


def test_a_repetition_says_nothing_new() -> None:
    once, four_times = (samples_of_unknown(*missed(laps, 0.5, 0.01)) for laps in (1, 4))
    assert 2.0 < once < 30.0
    assert four_times == pytest.approx(once, rel=0.5)


def test_most_samples_of_noise_say_something() -> None:
    noisy = missed(4, 0.0, 0.2)
    assert 0.6 < samples_of_unknown(*noisy) / independent_samples(*noisy) < 1.1


@pytest.mark.thorough
@pytest.mark.parametrize("axis", ["j1", "j5"])
def test_what_no_law_says_has_no_names_along_one_path(axis: str) -> None:
    """With four to six laws of other joints it was explained down to the noise."""
    found = diagnose([recorded(ARMS["three parallel joints"], 1, 2, 1.0)], only=axis).axes[axis]
    assert not OF_OTHER_AXES & {cause.term.effect for cause in found.causes}
    assert all(curve.term.source_axis is None for curve in found.curves)


@pytest.mark.thorough
def test_what_joints_in_one_plane_feel_of_each_other_keeps_its_names() -> None:
    found = diagnose([recorded(ARMS["spherical wrist"], 1, 2, 1.0)], only="j2").axes["j2"]
    named = {(cause.term.effect, cause.term.source_axis) for cause in found.causes}
    assert ("position_dependent_load", "j3") in named
