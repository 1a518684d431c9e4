"""Gains as rows for people: a table is one row, and so is a ripple."""

from dataclasses import replace

import pytest

from edge_ident.report.gains import GainRow, gain_rows
from firmware_interface.gains import TABLE_ENTRIES, AxisGains

PLAIN = AxisGains(30.0, 4.0, 0.0, 0.002, 0.25, 0.9, 1.4, 0.002, 0.03)
TABLE = tuple(-0.08235 + 0.165 * k / (TABLE_ENTRIES - 1) for k in range(TABLE_ENTRIES))
CURED = replace(PLAIN, proportional=60.0, load_table=TABLE, table_step_rad=0.18)


def row(name: str, *banks: AxisGains) -> GainRow:
    (found,) = [row for row in gain_rows(banks) if row.name == name]
    return found


def test_a_table_is_one_row_with_its_entries_and_its_ends() -> None:
    table = row("load_table", CURED, PLAIN)
    assert table.label == "load table (24)"
    assert table.cells(4) == ["-0.082 to 0.083", "0"]
    assert not any("[" in row.name for row in gain_rows([CURED]))


@pytest.mark.parametrize(
    ("name", "label"),
    [
        ("proportional", "proportional"),
        ("velocity_filter_s", "velocity filter (s)"),
        ("coulomb_smoothing_rad_s", "coulomb smoothing (rad/s)"),
        ("table_step_rad", "table step (rad)"),
    ],
)
def test_a_unit_stands_in_brackets_behind_the_name(name: str, label: str) -> None:
    assert row(name, CURED).label == label


def test_a_table_that_nobody_uses_has_no_row() -> None:
    assert all(row.entries == 0 and len(row.values[0]) == 1 for row in gain_rows([PLAIN]))


@pytest.mark.parametrize(
    ("name", "change"),
    [
        ("proportional", "× 2"),
        ("table_step_rad", "/ 5.56"),
        ("load_table", "by up to 0.083"),
        ("derivative", ""),
    ],
)
def test_what_a_second_bank_changes(name: str, change: str) -> None:
    assert row(name, PLAIN, CURED).change == change


def test_one_entry_that_moves_is_a_change_although_the_ends_stay() -> None:
    moved = replace(CURED, load_table=(*TABLE[:5], TABLE[5] + 0.01, *TABLE[6:]))
    table = row("load_table", CURED, moved)
    assert len(set(table.cells(4))) == 1
    assert table.change == "by up to 0.01"


def test_a_ripple_is_its_amplitude_and_period() -> None:
    off, gone = (0.0, 0.0, 0.0), (1.0, 1.0, 1.0)
    rippled = replace(
        PLAIN,
        ripple_cosine=(0.3, *off),
        ripple_sine=(0.4, *off),
        ripple_period_rad=(6.283, *gone),
    )
    ripple = row("ripple 1", PLAIN, rippled)
    assert ripple.cells(4) == ["", "0.5 N·m every 6.283 rad"]
    assert ripple.change == "changed"
