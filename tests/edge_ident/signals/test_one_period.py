"""One period as a board conditions it: exact means, and the signals that the whole chain gives."""

import numpy as np
import pytest

import edge_ident
from edge_ident.estimation.image import align
from edge_ident.estimation.network import load_network
from edge_ident.signals.conditioning import condition
from edge_ident.signals.one_period import (
    BLOCKS,
    Blocks,
    KnownMotion,
    choose_cutoff,
    condition_period,
    period_samples,
)

COUNT_RAD, COUNT_NM = 2.0 * np.pi / 8400.0, 0.004
SAMPLING_S = 0.0025
MOTION = load_network("int8").manifest.motion


@pytest.mark.parametrize("samples", [1024, 1025, 2047, 2048, 8742])
def test_blocks_are_means_of_what_is_held_between_samples(samples: int) -> None:
    """A sample at a border belongs to both blocks, in its shares."""
    position, effort = np.random.default_rng(1).integers(-5000, 5000, (2, samples))
    blocks = Blocks.of(position, effort)
    held = np.repeat(effort, BLOCKS).reshape(BLOCKS, samples).mean(axis=1)
    np.testing.assert_allclose(blocks.effort, held, atol=1e-6 * 5000)
    assert blocks.position[0] == pytest.approx(
        np.repeat(position - position[0], BLOCKS)[:samples].mean(), rel=1e-6
    )


def test_the_noise_is_that_of_the_samples() -> None:
    """That of counting where there is no other, and white noise where there is."""
    time = np.arange(8742)
    turning = 8400.0 * np.sin(2.0 * np.pi * time / 8742)
    effort = np.zeros(8742, dtype=np.int64)
    counted = Blocks.of(np.rint(turning).astype(np.int64), effort).noise
    assert counted == pytest.approx(1.0 / np.sqrt(12.0), rel=0.1)
    noisy = turning + np.random.default_rng(2).normal(scale=5.0, size=8742)
    assert Blocks.of(np.rint(noisy).astype(np.int64), effort).noise == pytest.approx(5.0, rel=0.05)


def test_a_period_needs_all_its_samples_but_a_few() -> None:
    assert period_samples(21.855, SAMPLING_S, 8742) == 8742
    assert period_samples(21.855, SAMPLING_S, 20000) == 8742
    assert period_samples(21.855, SAMPLING_S, 8730) == 8730
    assert period_samples(21.855, SAMPLING_S, 8700) == 0
    assert period_samples(2.0, SAMPLING_S, 800) == 0  # fewer samples than blocks


def test_the_cutoff_is_that_of_the_whole_chain() -> None:
    """By the same rule from the known motion: within a tenth."""
    recording = edge_ident.simulate()
    whole = condition(recording.time_s, recording.axes["x"].position, recording.axes["x"].effort)
    noise = COUNT_RAD / np.sqrt(12.0)
    cutoff_hz = choose_cutoff(noise, KnownMotion.of(MOTION.regressor), SAMPLING_S, 21.855)
    assert cutoff_hz == pytest.approx(whole.cutoff_hz, rel=0.1)


@pytest.mark.parametrize(("axis", "limit"), [("x", 0.02), ("z", 0.1)])
def test_the_signals_are_those_of_the_whole_chain(axis: str, limit: float) -> None:
    """Stiff gains leave no standstill. The phases differ by a quarter of a turn from x to z.

    Cut-offs differ by 4 %, which smears reversals otherwise: the columns differ by less than a
    fiftieth. Axis z reverses at the ends of the recording, where the chain reflects its signals and
    a period closes on itself; effort and columns differ alike there. What least squares finds in
    both differs by less than a fiftieth.
    """
    recording = edge_ident.simulate(stiff=True)
    record = recording.axes[axis]
    late_s = recording.effort_shift_s
    whole = align(
        condition(recording.time_s, record.position, record.effort, effort_shift_s=late_s),
        MOTION.regressor[:, 1],
        MOTION.period_s,
    )
    assert whole is not None
    counts = (np.rint(record.position / COUNT_RAD), np.rint(record.effort / COUNT_NM))
    period = condition_period(
        Blocks.of(*(of.astype(np.int64) for of in counts)),
        KnownMotion.of(MOTION.regressor),
        unit=COUNT_RAD,
        effort_unit=COUNT_NM,
        sampling_s=SAMPLING_S,
        period_s=len(recording.time_s) * SAMPLING_S,
        effort_shift_s=late_s,
    )
    scale = np.linalg.norm(whole.regressor, axis=0)
    apart = np.linalg.norm(period.regressor - whole.regressor, axis=0) / scale
    assert np.max(apart) < limit
    found, wanted = (
        np.linalg.lstsq(of.regressor, of.effort, rcond=None)[0] for of in (period, whole)
    )
    np.testing.assert_allclose(found, wanted, rtol=0.02)
