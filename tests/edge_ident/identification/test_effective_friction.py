"""What identification says of friction that bends: its parts, its line, and what is known."""

import numpy as np
import pytest
from numpy.typing import NDArray

from edge_ident.diagnosis.result import Diagnosis
from edge_ident.estimation.least_squares import Columns
from edge_ident.estimation.trust import check_estimate
from edge_ident.identification.identify import identify
from edge_ident.identification.result import Identification
from edge_ident.model.model import PARAMETERS, Estimate
from edge_ident.report.documents import identification_document
from edge_ident.report.page.axis_details import axis_details
from tests.edge_ident.diagnosis.select.test_search_parts import COARSE_S, recorded, rigid, swing

Array = NDArray[np.float64]


def bent(velocity: Array) -> Array:
    """A Stribeck bump as wide as a third of the range of speeds."""
    return 0.9 * np.exp(-((velocity / 0.9) ** 2)) * np.sign(velocity)


@pytest.fixture(scope="module")
def found() -> Identification:
    t, x, v, a = swing(seconds=25.0, period_s=COARSE_S)
    return identify(recorded(t, x, rigid(v, a) + bent(v), noise=0.02))


@pytest.fixture(scope="module")
def line() -> Array:
    """Through the whole curve: viscous friction, Coulomb friction and offset."""
    _, _, v, _ = swing(seconds=25.0, period_s=COARSE_S)
    columns = np.stack([v, np.sign(v), np.ones_like(v)], axis=1)
    added = np.linalg.lstsq(columns, bent(v), rcond=None)[0]
    return np.asarray(added + np.array([0.8, 1.1, 0.2]))


def test_the_line_stands_beside_the_parts(found: Identification, line: Array) -> None:
    (axis,) = found.axes.values()
    assert axis.line is not None
    assert axis.effective.parameters[1:] == pytest.approx(line, rel=0.03, abs=0.01)
    assert axis.effective_known == (True, True, True, True)
    assert abs(axis.effective.parameters[1] - axis.estimate.parameters[1]) > 0.1


def test_the_document_says_of_each_value_which_it_is(found: Identification) -> None:
    (document,) = identification_document(found)["axes"].values()
    effective, parameters = document["effective"], document["physical"]
    kinds = [entry["kind"] for entry in document["parameters"].values()]
    assert kinds == ["physical", *["physical" if all(found.axes["x"].known) else "effective"] * 3]
    assert effective["from"] == "line_through_friction_curve"
    assert all(isinstance(entry["known"], bool) for entry in parameters.values())
    viscous = effective["viscous_friction"]
    low, high = viscous["interval"]
    assert low == pytest.approx(viscous["value"] - 1.96 * viscous["std"])
    assert low < viscous["value"] < high
    assert viscous["unit"] == parameters["viscous_friction"]["unit"]


def test_the_line_of_a_known_model_is_that_of_the_whole_curve(
    found: Identification, line: Array
) -> None:
    """What was found is given as known: the base parameters are fitted beside it."""
    t, x, v, a = swing(seconds=25.0, period_s=COARSE_S)
    again = identify(recorded(t, x, rigid(v, a) + bent(v), noise=0.02), model=found.model)
    (axis,) = again.axes.values()
    assert axis.effective.parameters[1:] == pytest.approx(line, rel=0.04, abs=0.02)


def test_friction_that_is_a_line_is_its_own() -> None:
    t, x, v, a = swing(seconds=25.0, period_s=COARSE_S)
    axis = identify(recorded(t, x, rigid(v, a), noise=0.02)).axes["x"]
    assert axis.line is None
    assert axis.effective is axis.estimate
    assert axis.known == axis.effective_known == (True, True, True, True)


@pytest.mark.parametrize(("std_of_line", "blocks"), [(0.01, False), (2.0, True)])
def test_parts_that_are_not_known_block_only_where_their_line_is_not(
    std_of_line: float, blocks: bool
) -> None:
    rng = np.random.default_rng(4)
    columns = Columns(rng.standard_normal((500, 4)))
    physical = Estimate(np.ones(4), np.array([0.01, 2.0, 0.01, 0.01]))
    line = Estimate(np.ones(4), np.array([0.01, std_of_line, 0.01, 0.01]))
    effort = columns.values @ physical.parameters
    (finding,) = check_estimate(physical, columns, effort, 0.0, line)
    assert finding.code == f"undetermined_{PARAMETERS[1]}"
    assert finding.blocks is blocks
    assert ("line through the friction curve" in finding.message) is not blocks


def test_table_and_page_show_the_line_beside_its_parts(found: Identification) -> None:
    (axis,) = found.axes.values()
    text = str(found)
    assert "effective viscous friction" in text
    assert axis.diagnosis is not None
    details = axis_details("a", "x", Diagnosis({"x": axis.diagnosis}, (), {}))
    rows = {row[0]: row[1:] for row in details.parameters.rows}
    assert {"effective viscous friction", "viscous friction"} <= set(rows)
    *_, shown, unit = rows["effective coulomb friction"]
    line = axis.diagnosis.extended.effective
    assert line is not None
    assert float(shown.split()[0]) == pytest.approx(line.parameters[2], abs=1e-4)
    assert unit == "N·m"
