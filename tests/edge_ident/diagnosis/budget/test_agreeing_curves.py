"""Which curves hold in every part of a recording, beside the base model alone."""

import numpy as np
import pytest

from edge_ident.diagnosis.budget.account import missed
from edge_ident.diagnosis.budget.agreement import agreeing_curves
from edge_ident.diagnosis.fit.noise_floor import noise_floor
from edge_ident.diagnosis.prepare.preparation import prepare_axis
from edge_ident.diagnosis.select.selection import fitted_base
from edge_ident.model.model import Estimate, base_axis
from edge_ident.signals.recording import Recording
from tests.edge_ident.diagnosis.test_curves_in_model import SIZES, hidden, sound


def curves_of(recording: Recording) -> list[str]:
    data = prepare_axis([recording], "x")
    none = Estimate(np.zeros(4), np.zeros(4))
    base = fitted_base(data, base_axis(none))
    found = agreeing_curves(missed(data, base, noise_floor(data, base), ("rad", "N*m"), {}))
    return [curve.term.effect for curve in found]


@pytest.mark.parametrize("name", SIZES)
def test_the_hidden_curve_holds_and_no_other(name: str) -> None:
    assert curves_of(hidden(name)[0]) == [name]


def test_a_sound_axis_has_none() -> None:
    assert curves_of(sound()) == []
