"""The parts that the diagnosis is made of, on motions and noise made by hand."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from edge_ident.diagnosis.diagnose import diagnose
from edge_ident.diagnosis.fit.external_vibrations import VIBRATION
from edge_ident.diagnosis.fit.fitting import FittedTerm, fit
from edge_ident.diagnosis.fit.noise_floor import noise_floor
from edge_ident.diagnosis.judge.assessment import Assessment
from edge_ident.diagnosis.measures import Verdict
from edge_ident.diagnosis.prepare.preparation import prepare_axis
from edge_ident.diagnosis.result import AxisDiagnosis
from edge_ident.diagnosis.select.search import Search
from edge_ident.diagnosis.wording import facts
from edge_ident.model.model import BASE, PARAMETERS, AxisModel, Model, Term
from edge_ident.signals.recording import AxisRecord, Recording
from tests.repetitions import a_few

Array = NDArray[np.float64]

PERIOD_S = 2e-3
COARSE_S = 4e-3
"""Where a whole search looks at a motion: it takes half as long."""
TEMPLATE = AxisModel((Term(BASE, dict.fromkeys(PARAMETERS, 0.0)),))


def swing(
    seconds: float = 15.0, seed: int = 0, period_s: float = PERIOD_S
) -> tuple[Array, Array, Array, Array]:
    """Time, position, velocity and acceleration of five sines of random phase."""
    rng = np.random.default_rng(seed)
    t = np.arange(0.0, seconds, period_s)
    rate = 2.0 * np.pi * np.array([0.11, 0.23, 0.37, 0.61, 0.89])
    phase = rng.uniform(0.0, 2.0 * np.pi, 5)
    angle = rate * t[:, None] + phase
    x, v, a = (np.sin(angle) / rate, np.cos(angle), -rate * np.sin(angle))
    return t, x.sum(1), v.sum(1), a.sum(1)


def recorded(
    t: Array, x: Array, effort: Array, noise: float, seed: int = 1, count: float = 1e-5
) -> Recording:
    rng = np.random.default_rng(seed)
    read = np.round(x / count) * count
    measured = effort + noise * rng.standard_normal(len(t))
    return Recording(t, {"x": AxisRecord(read, measured, "rad", "N*m")}, "by hand")


def diagnosed(record: Recording) -> AxisDiagnosis:
    """Without the repetitions beside noise, which are for whether a cause is reliable."""
    return diagnose([record]).axes["x"]


def rigid(v: Array, a: Array) -> Array:
    return 0.5 * a + 0.8 * v + 1.1 * np.sign(v) + 0.2


@pytest.mark.parametrize("noise", [0.02, 0.1])
@pytest.mark.parametrize("missed", [0.0, 0.5])
def test_the_floor_is_the_noise_that_was_added(noise: float, missed: float) -> None:
    """What the filter passes of the added noise, whatever the base model misses besides; the
    encoder is so fine that it adds none."""
    t, x, v, a = swing()
    ripple = missed * np.sin(2.0 * np.pi * x / 0.31)
    record = recorded(t, x, rigid(v, a) + ripple, noise=noise, count=1e-7)
    data = prepare_axis([record], "x")
    start = fit(data, TEMPLATE, np.zeros(4), ())
    frequency_hz = np.linspace(0.0, 0.5 / PERIOD_S, 20_001)
    passed = np.trapezoid(data.segments[0].band.power(frequency_hz), frequency_hz)
    added = noise * np.sqrt(2.0 * PERIOD_S * passed)
    assert noise_floor(data, start).rms == pytest.approx(added, rel=0.1)


def test_a_vibration_that_is_left_out_is_not_found_again() -> None:
    """A selection that drops a vibration leaves it out, and would not end if it came back."""
    t, x, v, a = swing()
    vibrating = rigid(v, a) + 0.2 * np.sin(2.0 * np.pi * 3.7 * t)
    data = prepare_axis([recorded(t, x, vibrating, noise=0.02)], "x")
    start = fit(data, TEMPLATE, np.zeros(4), ())
    search = Search.of(data, TEMPLATE, start)
    assert search.score(start)[0].candidate == VIBRATION
    left = search.score(start, frozenset({VIBRATION.effect}))
    assert all(scored.candidate != VIBRATION for scored in left)


@pytest.mark.parametrize("what", ["nothing", "drift", "warm-up", "event", "payload"])
def test_what_changes_from_lap_to_lap_is_no_noise(what: str) -> None:
    """Beside noise of 0.02, whose floor is as large with it as without."""
    laps, samples = 4, 7000
    angle = 2.0 * np.pi * np.arange(laps * samples) / samples
    rate = 2.0 * np.pi / (samples * PERIOD_S)
    x = np.sin(angle) + 0.4 * np.cos(3.0 * angle)
    v = rate * (np.cos(angle) - 1.2 * np.sin(3.0 * angle))
    a = rate**2 * (-np.sin(angle) - 3.6 * np.cos(3.0 * angle))
    time = PERIOD_S * np.arange(len(x))
    added = {
        "nothing": 0.0 * time,
        "drift": 0.03 * time,
        "warm-up": 0.5 * v * np.exp(-time / 9.0),
        "event": 1.5 * np.exp(-(((time - 9.3) / 0.2) ** 2)),
        "payload": 0.2 * a * (time > 12.0),
    }[what]
    data = prepare_axis([recorded(time, x, rigid(v, a) + added, noise=0.02, count=1e-7)], "x")
    floor = noise_floor(data, fit(data, TEMPLATE, np.zeros(4), ()))
    passed = 2.0 * PERIOD_S * data.segments[0].band.power(np.linspace(0.0, 500.0, 20_001)).mean()
    assert floor.rms == pytest.approx(0.02 * np.sqrt(passed * 500.0), rel=0.3)


def test_a_motion_that_repeats_shows_what_repeats() -> None:
    """Slow noise that no high frequency betrays is found by comparing laps, but for what is so slow
    that it may be a drift. Where all laps but one are masked, nothing is left to compare."""
    laps, samples = 4, 7000
    angle = 2.0 * np.pi * np.arange(samples) / samples
    x = np.tile(np.sin(angle) + 0.4 * np.cos(3.0 * angle), laps)
    rate = 2.0 * np.pi / (samples * PERIOD_S)
    v = np.tile(rate * (np.cos(angle) - 1.2 * np.sin(3.0 * angle)), laps)
    a = np.tile(rate**2 * (-np.sin(angle) - 3.6 * np.cos(3.0 * angle)), laps)
    time = PERIOD_S * np.arange(len(x))
    slow = np.interp(time, np.arange(0.0, 30.0, 0.3), np.random.default_rng(2).normal(0, 0.1, 100))
    data = prepare_axis([recorded(time, x, rigid(v, a) + slow, noise=0.002)], "x")
    start = fit(data, TEMPLATE, np.zeros(4), ())
    floor = noise_floor(data, start)
    assert floor.source == "from the motion's repetition"
    assert 0.5 * np.std(slow) < floor.rms < 1.1 * np.std(slow)
    (segment,) = data.segments
    first = segment.sample_index < len(segment.effort) // laps
    one_lap = replace(segment, far=segment.far & first)
    alone = noise_floor(replace(data, segments=(one_lap,)), start)
    assert alone.source == "from the noise of effort and encoder"


def spring_on_one_sine(stiffness: float) -> tuple[Recording, float]:
    """Acceleration is proportional to position there: the spring is inertia, exactly."""
    t = np.arange(0.0, 22.0, COARSE_S)
    rate = 2.0 * np.pi / 11.0
    x, v, a = np.sin(rate * t), rate * np.cos(rate * t), -(rate**2) * np.sin(rate * t)
    return recorded(t, x, rigid(v, a) + stiffness * x, noise=0.02), 0.5 - stiffness / rate**2


def test_a_spring_that_looks_like_less_inertia_is_not_named() -> None:
    record, apparent = spring_on_one_sine(0.1)
    axis = diagnosed(record)
    assert axis.verdict is Verdict.ADEQUATE
    assert axis.base.estimate.parameters[0] == pytest.approx(apparent, abs=0.05)
    missing = {effect.effect: effect.reason for effect in axis.not_testable}
    assert "exactly like the base model's terms" in missing["load_dependent_friction"]
    # friction decides the sign of the effort, except near the reversals, where nothing counts
    assert "exactly like the base model's terms" in missing["actuator_deadband"]


def test_a_spring_that_looks_like_negative_inertia_is_named() -> None:
    record, apparent = spring_on_one_sine(0.3)
    assert apparent < 0.0
    axis = diagnosed(record)
    assert [cause.term.effect for cause in axis.causes] == ["position_dependent_load"]
    assert axis.base.estimate.parameters[0] == 0.0, "no physics makes it negative"


def test_an_external_vibration_is_reported_and_is_no_cause() -> None:
    t, x, v, a = swing(period_s=COARSE_S)
    effort = rigid(v, a) + 0.1 * np.sin(2.0 * np.pi * 2.13 * t + 0.4)
    axis = diagnosed(recorded(t, x, effort, noise=0.02))
    assert axis.verdict is Verdict.UNEXPLAINED
    assert axis.causes == ()
    (found,) = axis.external_vibrations
    assert found.frequency_hz == pytest.approx(2.13, abs=0.005)
    assert found.amplitude == pytest.approx(0.1, rel=0.05)
    assert any("2.13 Hz" in fact for fact in facts(axis))
    assert [term.effect for term in axis.model.terms] == [BASE]
    error = axis.extended.estimate.parameters - [0.5, 0.8, 1.1, 0.2]
    assert np.abs(error) == pytest.approx(0.0, abs=0.02), "nor does it bias the base"


@pytest.mark.parametrize("frequency_hz", a_few([8.0, 20.0], [8.0]))
def test_a_vibration_that_shakes_the_axis_is_reported(frequency_hz: float) -> None:
    """In a loop of 6 Hz the axis gives way. Then the base model alone asks for a shift of up to a
    sample and a half, which is none beside the vibration."""
    size, inertia, viscous, loop = 0.15, 0.5, 0.8, 2.0 * np.pi * 6.0
    rate = 2.0 * np.pi * frequency_hz
    t, x, v, a = swing(period_s=5e-4)
    stiffness, damping = inertia * loop**2, 1.4 * inertia * loop
    wave = np.exp(1j * rate * t)
    gives = size / (stiffness - inertia * rate**2 + 1j * rate * (viscous + damping)) * wave
    x, v, a = (s + np.imag(gives * (1j * rate) ** k) for k, s in enumerate((x, v, a)))
    axis = diagnosed(recorded(t, x, rigid(v, a) - size * np.imag(wave), noise=0.02, count=1e-6))
    assert axis.causes == ()
    (found,) = axis.external_vibrations
    assert found.frequency_hz == pytest.approx(frequency_hz, abs=0.005)
    assert found.amplitude == pytest.approx(size, rel=0.01)
    error = axis.extended.estimate.parameters - [0.5, 0.8, 1.1, 0.2]
    assert np.abs(error) == pytest.approx(0.0, abs=0.02)


@pytest.mark.parametrize("frequency_hz", [0.4, 1.7])
def test_beside_a_vibration_at_its_one_frequency_a_motion_says_nothing(
    frequency_hz: float,
) -> None:
    """The axis swings at 0.4 Hz and hardly otherwise."""
    t, x, v, a = swing()
    rate = 2.0 * np.pi * 0.4
    x = 0.01 * x + np.sin(rate * t)
    v = 0.01 * v + rate * np.cos(rate * t)
    a = 0.01 * a - rate**2 * np.sin(rate * t)
    data = prepare_axis([recorded(t, x, rigid(v, a), noise=0.02)], "x")
    start = fit(data, TEMPLATE, np.zeros(4), ())
    place = {"begin": 0.0, "end": 15.0, "clock": 0.0}
    shake = FittedTerm(
        VIBRATION, {"frequency": frequency_hz, **place}, {"cosine": 0.0, "sine": 0.0}
    )
    search = Search.of(data, TEMPLATE, start)
    model = search.fit(start.base, (shake,))
    assessed = Assessment.of(search, model, noise_floor(data, start), 0.01)
    kept = assessed.information_kept([0])
    assert kept < 0.1 if frequency_hz == 0.4 else kept > 0.95
    assert assessed.information_kept([]) == 1.0


def test_a_vibration_just_above_the_band_is_none_of_a_spring() -> None:
    """The filter passes a part of it."""
    t, x, v, a = swing(period_s=COARSE_S)
    cutoff_hz = diagnosed(recorded(t, x, rigid(v, a), noise=0.02)).cutoff_hz
    wave = 0.4 * np.sin(2.0 * np.pi * 1.15 * cutoff_hz * t)
    axis = diagnosed(recorded(t, x, rigid(v, a) + wave, noise=0.02))
    assert axis.cutoff_hz == pytest.approx(cutoff_hz, rel=0.05)
    assert axis.causes == ()
    (found,) = axis.external_vibrations
    assert found.frequency_hz == pytest.approx(1.15 * cutoff_hz, rel=1e-3)
    assert found.amplitude == pytest.approx(0.4, rel=0.03)
    assert axis.lines == (), "and it is told once"


SIZES = (((0.1, 0.15), 0.0), ((0.0, 0.15), 40.0), ((0.1, 0.15), 40.0), ((0.0, 0.15), 0.0))


@pytest.mark.parametrize(("sizes", "begins_s"), a_few(SIZES, SIZES[:1]))
def test_of_several_recordings_each_has_vibrations_of_its_own(
    sizes: tuple[float, float], begins_s: float
) -> None:
    """Whether they share a clock or not: no phase goes on from one to the next."""
    recordings = []
    for number, (size, frequency_hz) in enumerate(zip(sizes, (2.13, 2.17), strict=True)):
        t, x, v, a = swing(seed=number, period_s=COARSE_S)
        wave = size * np.sin(2.0 * np.pi * frequency_hz * t + number)
        made = recorded(t, x, rigid(v, a) + wave, noise=0.02, seed=number)
        recordings.append(replace(made, source=f"{number}.csv", begin_s=number * begins_s))
    axis = diagnose(recordings).axes["x"]
    assert axis.verdict is Verdict.UNEXPLAINED
    assert axis.causes == ()
    found = sorted(axis.external_vibrations, key=lambda one: one.recording)
    wanted = [(f"{k}.csv", 2.13 + 0.04 * k, size) for k, size in enumerate(sizes) if size]
    for one, (source, frequency_hz, size) in zip(found, wanted, strict=True):
        assert one.recording == source
        assert one.frequency_hz == pytest.approx(frequency_hz, abs=0.005)
        assert one.amplitude == pytest.approx(size, rel=0.03)
        assert any(f"{frequency_hz:.4g} Hz in {source}" in fact for fact in facts(axis))


ONCE = ((1, 40.0), (0, 40.0), (0, 0.0), (1, 0.0))


@pytest.mark.parametrize(("number", "begins_s"), a_few(ONCE, ONCE[:1]))
def test_what_happens_once_happens_in_one_recording(number: int, begins_s: float) -> None:
    recordings = []
    for k in range(2):
        t, x, v, a = swing(seed=k, period_s=COARSE_S)
        push = np.where((t > 7.0) & (t < 7.6), np.sin(np.pi * (t - 7.0) / 0.6) ** 2, 0.0)
        made = recorded(t, x, rigid(v, a) + 0.6 * (k == number) * push, noise=0.02, seed=k)
        recordings.append(replace(made, source=f"{k}.csv", begin_s=k * begins_s))
    axis = diagnose(recordings).axes["x"]
    (cause,) = axis.causes
    assert axis.verdict is Verdict.EXPLAINED
    assert cause.term.effect == "disturbance_event"
    assert cause.term.values["time"] == pytest.approx(7.0 + number * begins_s, abs=0.1)
    assert cause.shown_in == (f"{number}.csv",)


@pytest.mark.parametrize(("period", "seed"), [(0.5, 1), (0.217, 2), (0.11, 3)])
def test_a_period_is_found_as_closely_as_its_interval_says(period: float, seed: int) -> None:
    """No step of the search is left in it: noise of 0.3 % tells it to 10 parts in a million."""
    t, x, v, a = swing(seed=seed, period_s=COARSE_S)
    ripple = 0.3 * np.cos(2.0 * np.pi / period * x + 0.3)
    axis = diagnosed(recorded(t, x, rigid(v, a) + ripple, noise=0.005, seed=seed))
    (cause,) = axis.causes
    assert abs(cause.term.values["period"] - period) < 3.5 * cause.term.std["period"]


@pytest.mark.parametrize("early_s", [0.2, 0.4])
def test_a_push_while_quantization_aliases_is_found(early_s: float) -> None:
    """At its top speed the axis moves one count a sample, and rounding looks like motion."""
    t = np.arange(0.0, 32.0, PERIOD_S)
    rate, count = 0.3, 1e-3
    x, v, a = np.sin(rate * t) / rate, np.cos(rate * t), -rate * np.sin(rate * t)
    begins, lasts = 2.0 * np.pi / rate - early_s, 0.4
    pushed = (t > begins) & (t < begins + lasts)
    push = np.where(pushed, np.sin(np.pi * (t - begins) / lasts), 0.0)
    record = recorded(t, x, rigid(v, a) - push, noise=0.02, count=count)
    data = prepare_axis([record], "x")
    time_s = data.segments[0].motion.time_s[data.segments[0].sample_index]
    assert not np.any(data.valid[(time_s > begins) & (time_s < begins + lasts)])
    axis = diagnosed(record)
    (cause,) = axis.causes
    assert cause.term.effect == "disturbance_event"
    assert cause.term.values["time"] == pytest.approx(begins, abs=0.2)
    assert axis.extended.held_out < 0.5 * axis.base.held_out, "nobody can foresee a push"


def test_a_controller_that_answers_aliased_rounding_is_no_push() -> None:
    """A loop that is faster than the record answers rounding with a tone, which sampling folds into
    the band where the axis moves a whole number of counts a sample."""
    t = np.arange(0.0, 32.0, PERIOD_S)
    rate, count = 0.3, 1e-3
    x, v, a = np.sin(rate * t) / rate, np.cos(rate * t), -rate * np.sin(rate * t)
    tone = 0.4 * np.cos(2.0 * np.pi * x / count + 1.0)
    record = recorded(t, x, rigid(v, a) + tone, noise=0.02, count=count)
    data = prepare_axis([record], "x")
    assert not np.all(data.valid)
    assert not np.any(data.exceeds_aliasing(np.where(data.valid, 0.02, 0.4), 0.5))
    assert np.array_equal(data.exceeds_aliasing(np.where(data.valid, 0.02, 1.2), 0.5), ~data.valid)
    axis = diagnosed(record)
    assert not axis.causes
    assert not axis.suspected


def test_rounding_aliases_at_the_rate_of_the_recording() -> None:
    """A slow motion needs fewer samples than were recorded. At a fifth of a count a recorded one,
    rounding is far above the band, although it is several counts from one kept sample to the next.
    """
    t = np.arange(0.0, 60.0, PERIOD_S / 4.0)
    rate, count = 0.3, 2.4e-3
    x, v, a = np.sin(rate * t) / rate, np.cos(rate * t), -rate * np.sin(rate * t)
    data = prepare_axis([recorded(t, x, rigid(v, a), noise=0.02, count=count)], "x")
    assert data.segments[0].stride > 1
    assert np.all(data.valid)


def test_friction_that_changes_alone_is_no_payload() -> None:
    t, x, v, a = swing(period_s=COARSE_S)
    step = 0.1 * np.sign(v) * (t > 11.0)
    axis = diagnosed(recorded(t, x, rigid(v, a) + step, noise=0.02))
    assert "payload_change" not in {cause.term.effect for cause in axis.causes}
    with_mass = rigid(v, a) + step + 0.1 * a * (t > 11.0)
    axis = diagnosed(recorded(t, x, with_mass, noise=0.02))
    assert [cause.term.effect for cause in axis.causes] == ["payload_change"]


def test_ripple_is_named_with_its_period_and_nothing_else() -> None:
    t, x, v, a = swing(period_s=COARSE_S)
    effort = rigid(v, a) + 0.08 * np.sin(2.0 * np.pi * x / 0.31 + 0.4)
    axis = diagnose([recorded(t, x, effort, noise=0.05)]).axes["x"]
    assert axis.verdict is Verdict.EXPLAINED
    of_two_axes = ["cross_axis_coupling", "pose_dependent_inertia"]
    assert [effect.effect for effect in axis.not_testable] == of_two_axes
    (cause,) = axis.causes
    assert cause.term.effect == "torque_ripple"
    assert cause.term.values["period"] == pytest.approx(0.31, rel=1e-3)
    assert np.hypot(cause.term.values["cosine"], cause.term.values["sine"]) == pytest.approx(
        0.08, rel=0.05
    )
    assert 0.0 < cause.held_out_gain_interval[0] < cause.held_out_gain


def test_several_recordings_are_fitted_together_and_another_validates() -> None:
    def session(seed: int) -> Recording:
        t, x, v, a = swing(seed=seed, period_s=COARSE_S)
        return recorded(t, x, rigid(v, a) + 0.25 * abs(v), noise=0.05, seed=seed)

    found = diagnose([session(4), session(5)], validate=session(6))
    assert [c.term.effect for c in found.axes["x"].causes] == ["asymmetric_friction"]
    assert found.validation["x"].extended < 0.5 * found.validation["x"].base


def test_a_model_that_knows_the_effect_leaves_nothing_to_find() -> None:
    t, x, v, a = swing(seed=7, period_s=COARSE_S)
    record = recorded(t, x, rigid(v, a) + 0.25 * abs(v), noise=0.05)
    known = Model({"x": diagnosed(record).model})
    again = diagnose([record], model=known).axes["x"]
    assert again.verdict is Verdict.ADEQUATE
    assert [term.effect for term in again.model.terms] == [BASE, "asymmetric_friction"]


def test_an_encoder_that_never_makes_half_a_turn_is_found_off_its_centre() -> None:
    t, x, v, a = swing(period_s=COARSE_S)
    turn = float(np.ptp(x)) / 0.42
    reading = x + 0.006 * turn * np.sin(2.0 * np.pi * x / turn + 1.0)
    axis = diagnosed(recorded(t, reading, rigid(v, a), noise=0.02))
    assert axis.verdict == Verdict.EXPLAINED
    (cause,) = axis.causes
    assert cause.term.effect == "encoder_eccentricity"
