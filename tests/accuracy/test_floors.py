"""Floors under the accuracy of `identify` and `diagnose`, on drives that never change.

The seed is neither one of development (1 to 99) nor that of the published figures (2002 for the
diagnosis, 700,000 for the estimators), and nothing is ever tuned to it. The drives are the same
in every run, so a figure moves only with the code. A floor of the diagnosis lies one case below
what was measured when it was set: another machine's arithmetic may flip one case, and a slip of two
cases, of the 11 or 13 of a motion, is seen. Each effect is hidden once.
"""

from pathlib import Path

import numpy as np
import pytest

from edge_ident.estimation.network import load_network
from firmware_interface.plant import paper
from tools.diagnosis_benchmark import hiding
from tools.diagnosis_benchmark.cases import SINGLE, Batch, Case
from tools.diagnosis_benchmark.outcome import SHOWS, Outcome
from tools.diagnosis_benchmark.running import diagnose_case
from tools.network_figures import Case as Identified
from tools.network_figures import Setting

SEED = 5077


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

    Of another seed README tells 0.03, 0.12 and 0.02, 0.10.
    """
    assert len(identified) == 100
    errors = 100.0 * np.array([case.error(method) for case in identified])
    assert np.median(errors) < median
    assert np.quantile(errors, 0.95) < p95


def diagnosed(motion: str, drives: int) -> list[Outcome]:
    """The first drives of a batch in which the hidden effect shows."""
    batch = Batch(SINGLE, motion, SEED, 0)
    hiding.simulate_batch(batch)
    shows = hiding.load_batch(batch).shows[:drives, 0] >= SHOWS
    return [diagnose_case(Case(batch, int(row))) for row in np.flatnonzero(shows)]


@pytest.mark.parametrize(
    ("motion", "drives", "showing", "first", "exact"),
    [
        # measured: 8 and 8
        ("multisine", 20, 11, 7, 7),
        # measured: 10 and 10
        ("paper", 20, 13, 9, 9),
    ],
)
def test_the_hidden_effect_is_the_first_cause(
    motion: str,
    drives: int,
    showing: int,
    first: int,
    exact: int,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The first cause is the hidden effect itself: an inseparable alternative does not count.

    An effect that shows above the noise counts here also where it is below the tolerance: then it
    is only minor.
    """
    monkeypatch.setattr(hiding, "FOLDER", tmp_path)
    outcomes = diagnosed(motion, drives)
    assert len(outcomes) == showing
    named = [one for one in outcomes if one.causes and one.causes[0].effect in one.hidden]
    missed = [str(one.case) for one in outcomes if one not in named]
    assert len(named) >= first, missed
    assert sum(one.exact for one in outcomes) >= exact, missed
    assert not any(one.sound_causes for one in outcomes), "an axis left alone is accused"
