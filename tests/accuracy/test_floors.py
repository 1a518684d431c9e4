"""Floors under the accuracy of `identify` and `diagnose`, on drives that never change.

The seed is neither one of development (1 to 99) nor that of the published figures (2002 for the
diagnosis, 700,000 for the estimators), and nothing is ever tuned to it. The drives are the same
in every run, so a figure moves only with the code. A floor of the diagnosis lies one case below
what was measured when it was set, because another machine's arithmetic may flip one.

Each effect is hidden once on a multisine, and shows in 13 drives. A slip of two of them is seen: of
a change that misses each case with a chance of 10, 20 and 30 %, in 38, 77 and 94 of 100 changes.
`--thorough` hides each once more, on the paper's motion or on the staircase. Hundreds of drives on
all three motions are for `tools/diagnosis_benchmark`.
"""

import numpy as np
import pytest

from edge_ident.estimation.network import load_network
from firmware_interface.plant import EFFECTS, multisine, paper
from tests.hidden_drives import Batch, Drive, report
from tools.diagnosis_benchmark import cases, hiding
from tools.diagnosis_benchmark.bias import mean_parameters
from tools.diagnosis_benchmark.outcome import SHOWS, Outcome
from tools.diagnosis_benchmark.running import diagnose_case
from tools.network_figures import Case as Identified
from tools.network_figures import Setting

SEED = 5077
ROWS = {"paper": range(10), "staircase": range(10, 20)}
"""Drives of a batch; each of the twenty hides another effect."""
SHOWING, FIRST, EXACT = 13, 13, 9
"""Cases in which the effect shows, and measured: first cause right, and nothing else named."""
SHOWING_OF_TWO, FIRST_OF_TWO, EXACT_OF_TWO = 14, 11, 11
"""The same on the two motions of `ROWS`."""


@pytest.fixture(scope="module")
def identified() -> list[Identified]:
    """A hundred axes with 2 % effort noise and nothing hidden."""
    setting = Setting(load_network("fp32"), paper(), noise=0.02, axes=2)
    return list(setting.cases(None, axes=100, seed=SEED))


@pytest.mark.parametrize(
    ("method", "median", "p95"), [("network", 0.029, 0.125), ("least squares", 0.021, 0.105)]
)
def test_parameters_are_as_near_the_truth_as_published(
    identified: list[Identified], method: str, median: float, p95: float
) -> None:
    """Errors in % of the range; 0.027, 0.113 and 0.019, 0.095 were measured.

    Of another seed docs/accuracy.md tells 0.03, 0.12 and 0.02, 0.10.
    """
    assert len(identified) == 100
    errors = 100.0 * np.array([case.error(method) for case in identified])
    assert np.median(errors) < median
    assert np.quantile(errors, 0.95) < p95


@pytest.fixture(scope="module")
def batch() -> Batch:
    """Each effect in one drive, on a multisine."""
    strength = np.random.default_rng(SEED).uniform(0.6, 1.0, len(EFFECTS))
    return Batch(multisine(5000, SEED), [(name,) for name in EFFECTS], strength, SEED)


@pytest.fixture(scope="module")
def singles(batch: Batch) -> list[Drive]:
    """Those in which the effect shows."""
    return batch.shown(slice(None))


def test_an_effect_that_shows_is_named(singles: list[Drive]) -> None:
    assert len(singles) == SHOWING
    assert sum(drive.right for drive in singles) >= FIRST - 1, report(singles)
    assert sum(drive.exact for drive in singles) >= EXACT - 1, report(singles)


def test_the_extension_takes_the_bias_out_of_the_base_parameters(singles: list[Drive]) -> None:
    before = [drive.errors(drive.faulty.base.estimate.parameters) for drive in singles]
    after = [
        drive.errors(mean_parameters(drive.faulty.model, drive.duration_s)) for drive in singles
    ]
    left = np.median(after, axis=0) / np.median(before, axis=0)
    # several effects hardly touch the inertia: what is left of that bias is noise
    assert np.all(left <= [1 / 2, 1 / 3, 1 / 3]), left


def test_no_sound_axis_beside_it_is_accused(batch: Batch) -> None:
    assert not [axis.causes for axis in batch.sound(slice(0, 5)) if axis.causes]


@pytest.fixture(scope="module")
def diagnosed(tmp_path_factory: pytest.TempPathFactory) -> list[Outcome]:
    """Of each motion, the drives in which the hidden effect shows."""
    outcomes = []
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(hiding, "FOLDER", tmp_path_factory.mktemp("batches"))
        for motion, rows in ROWS.items():
            batch = cases.Batch(cases.SINGLE, motion, SEED, 0, drives=rows.stop)
            hiding.simulate_batch(batch)
            shows = hiding.load_batch(batch).shows[:, 0] >= SHOWS
            outcomes += [diagnose_case(cases.Case(batch, row)) for row in rows if shows[row]]
    return outcomes


@pytest.mark.thorough
def test_the_hidden_effect_is_the_first_cause(diagnosed: list[Outcome]) -> None:
    """The first cause is the hidden effect itself: an inseparable alternative does not count.

    An effect that shows above the noise counts here also where it is below the tolerance: then it
    is only minor.
    """
    assert len(diagnosed) == SHOWING_OF_TWO
    named = [one for one in diagnosed if one.causes and one.causes[0].effect in one.hidden]
    missed = [str(one.case) for one in diagnosed if one not in named]
    assert len(named) >= FIRST_OF_TWO - 1, missed
    assert sum(one.exact for one in diagnosed) >= EXACT_OF_TWO - 1, missed


@pytest.mark.thorough
def test_no_axis_is_accused_in_which_nothing_is_hidden(diagnosed: list[Outcome]) -> None:
    assert not [str(one.case) for one in diagnosed if one.sound_causes]
