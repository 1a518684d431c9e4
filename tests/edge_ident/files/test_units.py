"""Units as headings spell them, by their definitions."""

from math import pi

import pytest

from edge_ident.files.table import split_heading, split_unknown
from edge_ident.files.units import known_unit

POUND_N = 4.4482216152605
"""NIST SP 811, B.8: pound-force, exact."""


@pytest.mark.parametrize(
    ("spellings", "base", "factor"),
    [
        ("oz-in,ozf-in,oz·in,ozin,oz_in,in-oz,oz in,ounce-inches", "N*m", POUND_N / 16.0 * 0.0254),
        ("lb-in,lbf·in,lbf-in,in-lb,in-lbs,in·lbf,lb in,LB-IN", "N*m", POUND_N * 0.0254),
        ("ft-lb,ft-lbs,ft·lbf,lbf-ft,lb-ft,lbs-ft,foot-pounds", "N*m", POUND_N * 0.3048),
        ("kgf·cm,kgf-cm,kgf*cm,kg-cm,kgcm,kp·cm", "N*m", 0.0980665),
        ("kgf·m,kp m", "N*m", 9.80665),
        ("N·mm,Nmm,N.mm,N mm", "N*m", 1e-3),
        ("N m,N-m,N·m,Newton meters,newton-meters", "N*m", 1.0),
        ("lbf,lb,lbs,lbs.,pounds", "N", POUND_N),
        ("ozf,oz", "N", POUND_N / 16.0),
        ("kgf", "N", 9.80665),
        ("in,inch,inches", "m", 0.0254),
        ("ft", "m", 0.3048),
        ("Grad,deg,°", "rad", pi / 180.0),
        ("gon", "rad", pi / 200.0),
    ],
)
def test_a_unit_has_its_exact_factor(spellings: str, base: str, factor: float) -> None:
    for text in spellings.split(","):
        unit = known_unit(text)
        assert unit is not None, text
        assert (unit.base, unit.factor) == (base, pytest.approx(factor, rel=1e-14)), text


@pytest.mark.parametrize("text", ["lbm", "kg", "kgm2", "grad", "GRAD", "fnord", ""])
def test_what_is_no_unit_of_a_signal_is_none(text: str) -> None:
    assert known_unit(text) is None


def test_a_unit_of_two_words_may_stand_after_an_underscore() -> None:
    assert split_heading("torque_oz_in") == ("torque", "oz_in")
    assert split_heading("x_torque_ft_lb") == ("x_torque", "ft_lb")
    assert split_heading("left_foot") == ("left_foot", None)
    assert known_unit("ft_lb") == known_unit("lbf·ft")


@pytest.mark.parametrize(
    ("heading", "unknown"),
    [
        ("Torque [fnord]", "fnord"),
        ("Torque (Nm)", None),
        ("Axis[1]", None),
        ("Position (X)", None),
        ("pos_grad", "grad"),
        ("pos_fnord", None),
    ],
)
def test_brackets_hold_a_unit_that_may_not_be_known(heading: str, unknown: str | None) -> None:
    assert split_unknown(heading)[1] == unknown
