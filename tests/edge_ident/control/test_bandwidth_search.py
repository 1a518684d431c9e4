"""The search for the bandwidth gives what a plain search gives, which looks at every loop anew."""

import math
from collections.abc import Iterator
from itertools import islice

import numpy as np

from edge_ident.control.gain_design import (
    GAIN_MARGIN,
    PHASE_MARGIN_RAD,
    QUANTIZATION_SHARE,
    design,
    worst_margins,
)
from edge_ident.control.position_loop import LoopHardware, Plant, SprungLoad, law_response
from edge_ident.errors import GainError
from edge_ident.model.model import BASE, PARAMETERS, AxisModel, Term
from firmware_interface.gains import AxisGains
from tests.repetitions import examples

DRIVES = 120
RESOLUTION = 1.02
ROUNDING = 1e-9
"""Margins follow from sums of logarithms and angles here, from those of products there."""


def drives() -> Iterator[tuple[AxisModel, Plant, LoopHardware]]:
    """Axes over four decades of inertia and friction, a third with a load on a spring."""
    rng = np.random.default_rng(20_261_123)
    for number in range(DRIVES):
        inertia, viscous, coulomb = np.exp(
            rng.uniform(np.log([1e-3, 1e-3, 1e-2]), np.log([10.0, 10.0, 10.0]))
        )
        values = dict(zip(PARAMETERS, (inertia, viscous, coulomb, rng.normal()), strict=True))
        terms = [Term(BASE, values, {"inertia": inertia * rng.uniform(0.0, 0.2)})]
        loads: tuple[SprungLoad, ...] = ()
        if number % 3 == 0:
            share, ratio = rng.uniform(0.1, 0.9), rng.uniform(0.002, 0.2)
            rate = math.exp(rng.uniform(math.log(20.0), math.log(3000.0)))
            spring = {"load_inertia": share * inertia, "rate": rate, "damping_ratio": ratio}
            terms.append(Term("coupling_compliance", spring))
            loads = (SprungLoad(share * inertia, rate, ratio),)
        period_s = math.exp(rng.uniform(math.log(1e-4), math.log(5e-3)))
        count_rad = 2.0 * math.pi / math.exp(rng.uniform(math.log(2e3), math.log(1e6)))
        limit_nm = math.exp(rng.uniform(math.log(5.0), math.log(500.0)))
        hardware = LoopHardware(period_s, rng.uniform(0.0, 3.0) * period_s, count_rad, limit_nm)
        yield AxisModel(tuple(terms)), Plant(inertia, viscous, loads), hardware


def margins(
    gains: AxisGains, plant: Plant, hardware: LoopHardware, frequencies: int = 400
) -> tuple[float, float]:
    """Of one loop, on a grid of its own: the phase of the whole product, unwrapped."""
    period = hardware.sample_period_s
    nyquist = math.pi / period
    parts = [np.geomspace(1e-2, 0.999 * nyquist, frequencies)]
    around = np.geomspace(0.05, 300.0, 60)
    for load in plant.loads:
        steps = max(load.damping_ratio, 1e-3) * np.concatenate([-around, [0.0], around])
        free = load.rate_rad_s / math.sqrt(1.0 - load.inertia / plant.inertia)
        for rate in (load.rate_rad_s, free):
            near = rate * (1.0 + steps[np.abs(steps) < 0.5])
            parts.append(np.abs((near + nyquist) % (2.0 * nyquist) - nyquist))
    omega = np.unique(np.concatenate(parts))
    omega = omega[(omega >= 1e-2) & (omega <= 0.999 * nyquist)]
    s = 1j * (omega + 2.0 * nyquist * np.arange(-2, 3)[:, None])
    held = (1.0 - np.exp(-s * period)) / (s * period) * np.exp(-s * hardware.control_delay_s)
    loop = law_response(gains, omega, period) * np.sum(held * plant.response(s), axis=0)
    level, phase = np.log(np.abs(loop)), np.unwrap(np.angle(loop))
    crossing = np.flatnonzero((level[:-1] >= 0.0) != (level[1:] >= 0.0))
    if not len(crossing):
        return 0.0, 0.0
    part = level[crossing] / (level[crossing] - level[crossing + 1])
    at_one = phase[crossing] + part * (phase[crossing + 1] - phase[crossing])
    late = level[1:][phase[1:] <= -np.pi]
    turn = np.flatnonzero((phase[:-1] > -np.pi) != (phase[1:] > -np.pi))
    part = (phase[turn] + np.pi) / (phase[turn] - phase[turn + 1])
    late = np.concatenate([late, level[turn] + part * (level[turn + 1] - level[turn])])
    return max(float(np.min(at_one)) + np.pi, 0.0), (
        math.exp(-float(np.max(late))) if len(late) else math.inf
    )


def found_plainly(axis: AxisModel, plant: Plant, hardware: LoopHardware) -> tuple[float, ...]:
    """Bandwidth, margins and effort of quantization; no bandwidth where none is acceptable.

    The slowest filter is the first; a faster one is taken as long as that raises the bandwidth.
    """
    best: tuple[float, ...] = (math.nan,)
    for ratio in (5.0, 6.0, 7.0, 8.0, 10.0):
        found = found_with(ratio, axis, plant, hardware)
        if math.isnan(found[0]):
            continue
        if found[0] <= best[0] * RESOLUTION:
            break
        best = found
    return best


def found_with(
    ratio: float, axis: AxisModel, plant: Plant, hardware: LoopHardware
) -> tuple[float, ...]:
    """The same with one filter, whose corner is this many bandwidths of the lightest axis."""
    spread = 2.0 * axis.terms[0].std["inertia"]
    plants = [plant.with_inertia(plant.inertia + change) for change in (-spread, 0.0, spread)]
    corner = ratio * plant.inertia / plants[0].inertia

    def asked(bandwidth: float) -> tuple[float, ...]:
        derivative = max(2.0 * plant.inertia * bandwidth - plant.viscous_friction, 0.0)
        feedback = (plant.inertia * bandwidth**2, derivative, 0.0, 1.0 / (corner * bandwidth))
        gains = AxisGains(*feedback, 0.0, 0.0, 0.0, 1.0, 0.0)
        phase, gain = zip(*(margins(gains, one, hardware) for one in plants), strict=True)
        omega = np.linspace(1e-3, np.pi, 400) / hardware.sample_period_s
        noise = hardware.encoder_resolution_rad / math.sqrt(12.0)
        response = np.abs(law_response(gains, omega, hardware.sample_period_s))
        return min(phase), min(gain), float(noise * np.sqrt(np.mean(response**2)))

    def acceptable(bandwidth: float) -> bool:
        phase, gain, effort = asked(bandwidth)
        quiet = effort <= QUANTIZATION_SHARE * hardware.effort_limit_nm
        return phase >= PHASE_MARGIN_RAD and gain >= GAIN_MARGIN and quiet

    lowest = max(1.0, plant.viscous_friction / plant.inertia)
    highest = 0.5 / hardware.sample_period_s
    while not acceptable(lowest):
        lowest *= 1.5
        if lowest >= highest:
            return (math.nan,)
    while highest / lowest > RESOLUTION:
        middle = math.sqrt(lowest * highest)
        lowest, highest = (middle, highest) if acceptable(middle) else (lowest, middle)
    return lowest, *asked(lowest)


def found_quickly(axis: AxisModel, hardware: LoopHardware) -> tuple[float, ...]:
    """The same of the design."""
    try:
        found = design(axis, hardware)
    except GainError:
        return (math.nan,)
    return (
        found.bandwidth_rad_s,
        found.phase_margin_rad,
        found.gain_margin,
        found.quantization_effort_nm,
    )


def test_every_drive_gets_the_bandwidth_and_margins_of_the_plain_search() -> None:
    designed = 0
    for axis, plant, hardware in drives():
        found = found_quickly(axis, hardware)
        np.testing.assert_allclose(found, found_plainly(axis, plant, hardware), rtol=ROUNDING)
        designed += len(found) > 1
    assert 0.5 * DRIVES < designed < DRIVES  # drives of both kinds were compared


def test_margins_of_a_law_with_integral_action_are_those_of_each_loop_alone() -> None:
    """Its phase begins a quarter of a turn later; banks that a board has may be such."""
    for axis, plant, hardware in drives():
        integral = AxisGains(20.0 * plant.inertia, 8.0 * plant.inertia, 5.0 * plant.inertia,
                             hardware.sample_period_s, 0.0, 0.0, 0.0, 1.0, 0.0)  # fmt: skip
        spread = 2.0 * axis.terms[0].std["inertia"]
        each = [
            margins(integral, plant.with_inertia(plant.inertia + change), hardware)
            for change in (-spread, 0.0, spread)
        ]
        expected = [min(of_all) for of_all in zip(*each, strict=True)]
        found = worst_margins(integral, axis, hardware)
        np.testing.assert_allclose(found, expected, rtol=ROUNDING, atol=ROUNDING)


def test_margins_are_those_of_a_grid_a_hundred_times_as_fine() -> None:
    """At 400 points to the Nyquist frequency the next point is up to 6 % quieter than -180°."""
    for axis, plant, hardware in islice(drives(), examples(DRIVES)):
        try:
            found = design(axis, hardware)
        except GainError:
            continue
        spread = 2.0 * axis.terms[0].std["inertia"]
        each = [
            margins(found.gains, plant.with_inertia(plant.inertia + change), hardware, 40_000)
            for change in (-spread, 0.0, spread)
        ]
        phase, gain = (min(of_all) for of_all in zip(*each, strict=True))
        assert abs(found.phase_margin_rad - phase) < math.radians(0.1)
        assert abs(found.gain_margin / gain - 1.0) < 0.002
