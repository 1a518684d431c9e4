"""Whole fleets of the independent plant: the sound ones stay silent, faults are found."""

from collections.abc import Sequence

import pytest

from edge_ident.fleet.analysis import Options, analyse_recording
from edge_ident.fleet.comparison import compare_units
from edge_ident.fleet.result import Comparison, SurveyedRecording
from edge_ident.signals.read_options import ReadOptions
from edge_ident.signals.recording import Recording
from tests.fleets import fleet_drives, fleet_recordings
from tests.plant import multisine, paper

UNITS = 10
OPTIONS = Options(ReadOptions(), None, diagnose=True)


def named(recordings: Sequence[Recording]) -> tuple[set[tuple[str, str]], tuple[Comparison, ...]]:
    """Units that stand out, each with its quantity; and all comparisons."""
    rows = [
        SurveyedRecording("", f"unit {n}", "", analyse_recording(recording, OPTIONS), None, 0.0)
        for n, recording in enumerate(recordings, start=1)
    ]
    compared = compare_units(rows)
    out = {
        (unit, one.quantity)
        for one in compared
        for unit, value in one.units.items()
        if value.stands_out
    }
    return out, compared


@pytest.mark.parametrize("motion", [paper, multisine])
@pytest.mark.parametrize("seed", [1, 2])
def test_no_unit_of_a_sound_fleet_stands_out(seed: int, motion) -> None:
    recordings = fleet_recordings(fleet_drives(UNITS, seed), seed, motion())
    out, compared = named(recordings)
    assert not out
    assert all(one.centre is not None for one in compared)


@pytest.mark.parametrize("seed", [1, 2])
def test_a_fifth_more_friction_is_found(seed: int) -> None:
    drives = fleet_drives(UNITS, seed, spread=0.02, first_coulomb=1.2)
    out, compared = named(fleet_recordings(drives, seed))
    assert out == {("unit 1", "coulomb_friction")}
    friction = next(one for one in compared if one.quantity == "coulomb_friction")
    assert friction.centre == pytest.approx(friction.units["unit 1"].value / 1.2, rel=0.05)
    assert friction.between == pytest.approx(0.02 * friction.centre, rel=0.8)


def test_an_effect_that_one_unit_alone_has_is_found() -> None:
    drives = fleet_drives(UNITS, seed=1)
    out, compared = named(fleet_recordings(drives, 1, hidden=["torque_ripple"]))
    assert ("unit 1", "torque_ripple") in out
    assert {unit for unit, _ in out} == {"unit 1"}
    ripple = next(one for one in compared if one.quantity == "torque_ripple")
    assert ripple.of_effect
    assert ripple.centre == pytest.approx(0.0, abs=0.002)


def test_a_fault_that_all_units_have_makes_none_stand_out() -> None:
    drives = fleet_drives(UNITS, seed=2, spread=0.02)
    drives.chain.coulomb[:] *= 1.2
    out, _ = named(fleet_recordings(drives, 2))
    assert not out
