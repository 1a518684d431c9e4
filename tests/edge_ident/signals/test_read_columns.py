"""What headings of common programs say of their columns."""

import pytest

from edge_ident.signals.read_columns import axis_names, role_of


@pytest.mark.parametrize(
    ("heading", "quantity", "axis"),
    [
        ("X.ActPos", "position", ("x",)),
        ("Axis1.ActualPosition", "position", ("1",)),
        ("Current Position", "position", ()),
        ("Achse X Lageistwert", "position", ("x",)),
        ("Achse X Lagesollwert", "reference", ("x",)),
        ("X.SetPos", "reference", ("x",)),
        ("AXIS_X.TorqueReference", "torque", ("x",)),
        ("Motorstrom", "current", ()),
        ("xpos", "position", ("x",)),
        ("Drehmoment", "torque", ()),
        ("Following Error", "other", ()),
        ("Schleppabstand", "other", ()),
        ("ActVelo", "velocity", ()),
        ("Motor Temperature", "temperature", ()),
        ("Zeitstempel", "time", ()),
        ("offset", "", ("offset",)),
        ("q1", "position", ("1",)),
        ("q_2_ref", "reference", ("2",)),
        ("dq1", "velocity", ("1",)),
        ("ddq[1]", "other", ("1",)),
        ("iq", "current", ()),
        ("i_q", "", ("i", "q")),
        ("current_q", "current", ("q",)),
        ("u_q [V]", "", ("u", "q", "v")),
        ("field.position0", "position", ("0",)),
        ("field.header.stamp", "time", ()),
        ("header.seq", "other", ()),
        ("Temps", "time", ()),
        ("Weg", "position", ()),
        ("Position réelle X", "position", ("reelle", "x")),
        ("posición", "position", ()),
        ("par motor", "torque", ()),
        ("Coppia", "torque", ()),
        ("Температура", "temperature", ()),
        ("Положение", "position", ()),
        ("指令位置", "reference", ()),
        ("实际转矩", "torque", ()),
        ("モータ回転数", "velocity", ()),
        ("Größe", "", ("grosse",)),
    ],
)
def test_a_heading_says_quantity_and_axis(
    heading: str, quantity: str, axis: tuple[str, ...]
) -> None:
    assert (role_of(heading).quantity, role_of(heading).axis) == (quantity, axis)


def test_axes_are_named_by_what_tells_them_apart() -> None:
    keys = [("plc", "prg", "x"), ("plc", "prg", "z")]
    assert list(axis_names(keys).values()) == ["x", "z"]
    assert axis_names([("plc", "prg")]) == {("plc", "prg"): "x"}
    assert axis_names([("1",)]) == {("1",): "axis1"}
