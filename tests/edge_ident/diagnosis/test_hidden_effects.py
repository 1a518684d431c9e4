"""Faults hidden in drives of a simulation that knows no effect file: what must be said of them.

Effects, strengths, drives, noise and the axis that is hit come from a seed taken blindly.
`tools/diagnosis_benchmark` does the same to hundreds of drives (docs/diagnosis_accuracy.md),
and `tests/accuracy/test_floors.py` hides each effect alone. The bounds here are looser: few drives
tell a broken diagnosis from a working one, no more.
"""

from dataclasses import replace

import numpy as np
import pytest

from edge_ident.diagnosis.measures import Verdict
from edge_ident.model.motion import TURNS_RAD
from firmware_interface.plant import EFFECTS, UNKNOWN, multisine
from tests.hidden_drives import Batch, report
from tests.repetitions import a_few
from tools.diagnosis_benchmark.outcome import all_named

SEED = 1
PAIR, FAINT, CLEAN = 5, 3, 2  # drives of each kind
SINGLES = slice(0, len(EFFECTS))  # drawn, and not asked for
PAIRS = slice(SINGLES.stop, SINGLES.stop + PAIR)
UNKNOWNS = slice(PAIRS.stop, PAIRS.stop + len(UNKNOWN))
FAINTS = slice(UNKNOWNS.stop, UNKNOWNS.stop + FAINT)
CLEANS = slice(FAINTS.stop, FAINTS.stop + CLEAN)


@pytest.fixture(scope="module")
def batch() -> Batch:
    """On a multisine: pairs of effects, each unknown, faint effects, and nothing."""
    rng = np.random.default_rng(SEED)
    some = rng.permutation(EFFECTS).tolist()
    hidden: list[tuple[str, ...]] = [(name,) for name in EFFECTS]
    hidden += list(zip(some[:PAIR], some[PAIR : 2 * PAIR], strict=True))
    hidden += [(name,) for name in UNKNOWN]
    hidden += [(name,) for name in some[2 * PAIR : 2 * PAIR + FAINT]]
    hidden += [()] * CLEAN
    strength = rng.uniform(0.6, 1.0, len(hidden))
    strength[PAIRS] = rng.uniform(0.8, 1.0, PAIR)
    strength[FAINTS] = 0.0
    return Batch(multisine(5000, SEED), hidden, strength, SEED, asked=slice(PAIRS.start, None))


@pytest.mark.thorough
def test_two_effects_on_one_axis_are_both_named(batch: Batch) -> None:
    shown = batch.shown(PAIRS)
    assert len(shown) >= 2
    missed = [drive for drive in shown if not all_named(drive.hidden, drive.causes)]
    assert len(missed) <= len(shown) / 4, report(missed)


def test_a_disturbance_that_nothing_known_explains_is_not_explained(
    batch: Batch, thorough: bool
) -> None:
    shown = batch.shown(UNKNOWNS if thorough else slice(UNKNOWNS.start, UNKNOWNS.start + 3))
    assert shown
    assert all(drive.faulty.verdict == Verdict.UNEXPLAINED for drive in shown), report(shown)
    assert not any(cause.confident for drive in shown for cause in drive.causes), report(shown)


def test_an_effect_below_the_noise_draws_no_false_name(batch: Batch) -> None:
    faint = batch.diagnosed(FAINTS)
    wrong = [d for d in faint if not all(cause.meets(d.hidden[0]) for cause in d.causes)]
    assert not wrong, report(wrong)


def test_a_sound_drive_is_adequate(batch: Batch) -> None:
    one = [drive.faulty for drive in batch.diagnosed(CLEANS)]
    for axis in (*one, *batch.sound(CLEANS)):
        assert axis.verdict == Verdict.ADEQUATE
        assert axis.causes == ()


@pytest.mark.parametrize("seed", a_few([3, 4], [3]))
def test_an_encoder_on_a_quarter_turn_is_found_off_its_centre(seed: int) -> None:
    """So short a travel does not determine the period; the angle itself says that it is a turn, or
    half a one where the scale is tilted, too.

    Off by 3.5°: more than a hundredth of a turn is no machine.
    """
    motion = multisine(5000, seed)
    travel = np.max(np.ptp(motion.position[:, 0], axis=0))
    part = 0.26 * 2.0 * np.pi / travel
    moved = {
        name: part * getattr(motion, name) for name in ("position", "velocity", "acceleration")
    }
    batch = Batch(replace(motion, **moved), [("encoder_eccentricity",)], np.full(1, 0.905), seed)
    (drive,) = batch.diagnosed(slice(None))
    assert drive.exact, report([drive])
    axis = drive.faulty
    assert np.min(np.abs(axis.causes[0].term.values["period"] - np.array(TURNS_RAD))) < 1e-9
    assert axis.extended.fitted < 1.1 * axis.noise_floor < axis.base.fitted
