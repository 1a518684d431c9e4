"""Recordings of two days may differ in offset and in friction, and that is no cause."""

import re

import numpy as np
import pytest

from edge_ident.diagnosis.diagnose import diagnose
from edge_ident.diagnosis.measures import Verdict
from edge_ident.diagnosis.result import AxisDiagnosis
from edge_ident.signals.recording import AxisRecord, Recording
from tests.repetitions import a_few

PERIOD_S = 4e-3
NOISE = 0.02
RATES = 2.0 * np.pi * np.array([0.11, 0.23, 0.37, 0.61, 0.89])
OFFSETS = (0.2, 0.05, 0.2)


def day(
    number: int,
    *,
    seconds: float,
    bend: float = 0.0,
    friction: float = 1.0,
    inertia: float = 0.5,
    scale: float = 1.0,
    gear: float = 1.0,
    clock: float = 1.0,
    noise: float = NOISE,
) -> Recording:
    """Five sines of random phase, with the day's offset and friction, and friction that bends.

    Columns may be larger than they should be.
    """
    rng = np.random.default_rng(number)
    t = np.arange(0.0, seconds, PERIOD_S)
    angle = RATES * t[:, None] + rng.uniform(0.0, 2.0 * np.pi, len(RATES))
    x, v, a = (np.sin(angle) / RATES).sum(1), np.cos(angle).sum(1), -(RATES * np.sin(angle)).sum(1)
    effort = inertia * a + friction * (0.8 * v + 1.1 * np.sign(v) + bend * v * np.abs(v))
    effort += OFFSETS[number]
    effort += noise * rng.standard_normal(len(t))
    effort *= scale
    axis = AxisRecord(np.round(gear * x / 1e-5) * 1e-5, effort, "rad", "N*m")
    return Recording(clock * t, {"x": axis}, f"{number}.csv")


def diagnosed(*recordings: Recording) -> AxisDiagnosis:
    return diagnose(recordings).axes["x"]


def said(axis: AxisDiagnosis, code: str = "offsets_differ") -> list[str]:
    return [finding.message for finding in axis.findings if finding.code == code]


def test_a_sound_axis_stays_sound_though_its_offset_changed() -> None:
    axis = diagnosed(day(0, seconds=15.0), day(1, seconds=10.0), day(2, seconds=10.0))
    assert axis.verdict is Verdict.ADEQUATE
    assert axis.causes == axis.suspected == ()
    (message,) = said(axis)
    (apart,) = re.findall(r"(-[0-9.]+) N\*m in 1\.csv, relative to 2\.csv", message)
    assert float(apart) == pytest.approx(OFFSETS[1] - OFFSETS[2], abs=0.005)
    assert "0.csv" not in message, "their difference is noise"
    estimate = axis.model.parameters
    assert estimate[:3] == pytest.approx([0.5, 0.8, 1.1], rel=0.01)
    mean = np.average(OFFSETS, weights=[15.0, 10.0, 10.0])
    assert estimate[3] == pytest.approx(mean, abs=0.01), "over all samples"


def test_a_cause_of_both_days_is_found_and_nothing_else() -> None:
    """What the base model lacks is another error in each motion, and no friction of its own."""
    axis = diagnosed(day(0, seconds=15.0, bend=0.2), day(1, seconds=15.0, bend=0.2))
    assert axis.verdict is Verdict.EXPLAINED
    assert [cause.term.effect for cause in axis.causes] == ["nonlinear_viscous"]
    assert axis.causes[0].shown_in == ("0.csv", "1.csv")
    assert said(axis)
    assert not said(axis, "friction_differs")


def test_one_recording_has_one_offset() -> None:
    assert not said(diagnosed(day(0, seconds=15.0)))


def test_friction_that_changed_over_night_is_said_and_no_payload() -> None:
    axis = diagnosed(day(0, seconds=15.0, friction=0.95), day(2, seconds=15.0))
    assert axis.verdict is Verdict.ADEQUATE
    assert axis.causes == ()
    (message,) = said(axis, "friction_differs")
    (less,) = re.findall(r"coulomb friction ([+-][0-9.]+) N\*m in 0\.csv", message)
    assert float(less) == pytest.approx(-0.055, abs=0.006)
    assert axis.model.parameters[:3] == pytest.approx([0.5, 0.78, 1.0725], rel=0.01)


def test_a_cause_is_found_beside_friction_of_two_days() -> None:
    days = [day(0, seconds=15.0, bend=0.2, friction=0.95), day(2, seconds=15.0, bend=0.2)]
    axis = diagnosed(*days)
    assert axis.verdict is Verdict.EXPLAINED
    assert [cause.term.effect for cause in axis.causes] == ["nonlinear_viscous"]
    assert said(axis, "friction_differs")


def test_a_payload_of_one_day_has_no_weight_but_its_mass() -> None:
    axis = diagnosed(day(0, seconds=15.0), day(2, seconds=15.0, inertia=0.7))
    (payload,) = axis.causes
    assert payload.term.effect == "payload_change"
    assert abs(float(payload.term.values["inertia"])) == pytest.approx(0.2, rel=0.02)
    assert payload.term.values["offset"] == 0.0
    assert axis.model.parameters[3] == pytest.approx(0.2, abs=0.01)
    assert not said(axis)


def test_one_factor_of_all_is_another_scale_and_no_payload() -> None:
    days = [day(0, seconds=15.0, bend=0.2), day(2, seconds=15.0, bend=0.2, scale=1.3)]
    axis = diagnosed(*days)
    assert axis.causes == ()
    (message,) = said(axis, "scale_differs")
    assert message.startswith("the effort of 2.csv is 1.3 times")
    assert not said(axis, "friction_differs")


def test_another_scale_of_the_recording_that_judges_is_said_and_forbids_nothing() -> None:
    axis = diagnose([day(0, seconds=15.0)], validate=day(2, seconds=15.0, scale=1.3)).axes["x"]
    (finding,) = [each for each in axis.findings if each.code == "scale_differs"]
    assert finding.message.startswith("the effort of 2.csv is 1.3 times what 0.csv has")
    assert not finding.blocks


WRONG = (
    ({"gear": 2.0}, "the position of 2.csv is 2 times"),
    ({"gear": 0.8}, "the position of 2.csv is 0.8 times"),
    ({"clock": 1.1}, "the time of 2.csv is 1.1 times"),
)


@pytest.mark.parametrize(
    ("wrong", "said_of_it"),
    a_few(WRONG, [WRONG[1], WRONG[2]]),
)
def test_one_factor_of_a_position_or_of_the_time_is_no_payload(
    wrong: dict[str, float], said_of_it: str
) -> None:
    axis = diagnosed(day(0, seconds=15.0), day(2, seconds=15.0, **wrong))
    assert axis.causes == ()
    (message,) = said(axis, "scale_differs")
    assert message.startswith(said_of_it)


def test_a_factor_that_is_not_worth_naming_forbids_nothing() -> None:
    days = [
        day(number, seconds=15.0, bend=0.2, noise=0.001, scale=scale)
        for number, scale in ((0, 1.0), (2, 1.004))
    ]
    axis = diagnosed(*days)
    assert not said(axis, "scale_differs")
    assert [cause.term.effect for cause in axis.causes] == ["nonlinear_viscous"]


def test_another_load_and_other_friction_are_no_other_scale() -> None:
    axis = diagnosed(day(0, seconds=15.0), day(2, seconds=15.0, inertia=0.65, friction=1.15))
    assert not said(axis, "scale_differs")
    (payload,) = axis.causes
    assert abs(float(payload.term.values["inertia"])) == pytest.approx(0.15, rel=0.03)
    assert payload.term.values["coulomb_friction"] == 0.0, (
        "friction differs by more than a payload's"
    )
    assert said(axis, "friction_differs")


def test_a_wrong_sign_names_the_recording_that_has_it() -> None:
    axis = diagnosed(day(0, seconds=15.0), day(2, seconds=15.0, scale=-1.0))
    (message,) = said(axis, "effort_sign")
    assert message.startswith("in 2.csv, inertia")


def test_no_recording_has_a_negative_friction_of_its_own() -> None:
    """That the other one would be the larger for it is no finding."""
    axis = diagnosed(day(0, seconds=15.0), day(2, seconds=15.0, friction=-0.05))
    assert not said(axis, "friction_differs")
    assert axis.causes == ()
