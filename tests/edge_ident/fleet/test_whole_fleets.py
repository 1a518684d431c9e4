"""Whole fleets of the independent plant: the sound ones stay silent, faults are found."""

from collections.abc import Sequence

import pytest
from scipy import stats

from edge_ident.fleet.analysis import Options, analyse_recording
from edge_ident.fleet.between_units import FALSE_ALARM, compare_units
from edge_ident.fleet.result import Comparison, SurveyedRecording
from edge_ident.signals.read_columns import ReadOptions
from edge_ident.signals.recording import Recording
from firmware_interface.plant import multisine, paper
from tests.fleets import fleet_drives, fleet_recordings, recordings_of_each

UNITS = 8
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


@pytest.mark.thorough
def test_sound_fleets_are_named_no_more_often_than_promised() -> None:
    """More than two of six, where one in 20 may be: by chance once in 450 times."""
    fleets = [fleet_drives(UNITS, seed) for seed in range(1, 7)]
    made = recordings_of_each(fleets[::2], 1, multisine(4000))
    made += recordings_of_each(fleets[1::2], 2, paper())
    named_fleets = 0
    for recordings in made:
        out, compared = named(recordings)
        assert all(one.centre is not None for one in compared)
        named_fleets += bool(out)
    assert named_fleets <= stats.binom.isf(0.0125, len(fleets), FALSE_ALARM)


@pytest.mark.thorough
def test_a_fifth_more_friction_is_found() -> None:
    found = []
    fleets = [fleet_drives(UNITS, seed, spread=0.02, first_coulomb=1.2) for seed in (1, 2, 3)]
    for recordings in recordings_of_each(fleets, 1, multisine()):
        out, compared = named(recordings)
        found.append(("unit 1", "coulomb_friction") in out)
        friction = next(one for one in compared if one.quantity == "coulomb_friction")
        centre, between = friction.centre, friction.between
        assert centre is not None
        assert between is not None
        assert centre == pytest.approx(friction.units["unit 1"].value / 1.2, rel=0.1)
        assert between == pytest.approx(0.02 * centre, rel=0.8)
    assert sum(found) >= 2


def test_an_effect_that_one_unit_alone_has_is_found() -> None:
    drives = fleet_drives(UNITS, seed=1)
    out, compared = named(fleet_recordings(drives, 1, hidden=["torque_ripple"]))
    assert ("unit 1", "torque_ripple") in out
    assert {unit for unit, _ in out} == {"unit 1"}
    ripple = next(one for one in compared if one.quantity == "torque_ripple")
    assert ripple.of_effect
    assert ripple.centre == pytest.approx(0.0, abs=0.002)


@pytest.mark.thorough
def test_a_fault_that_all_units_have_makes_none_stand_out() -> None:
    drives = fleet_drives(UNITS, seed=2, spread=0.02)
    without, _ = named(fleet_recordings(drives, 2))
    drives.chain.coulomb[:] *= 1.2
    out, _ = named(fleet_recordings(drives, 2))
    assert out == without
