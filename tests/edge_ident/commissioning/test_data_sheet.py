"""Data sheets become a drive description: conversions, doubts, and a motion within the limits."""

import math
from collections.abc import Mapping

import pytest

from edge_ident.commissioning.data_sheet import (
    SHEET_ENTRIES,
    AxisSheet,
    fill_sheet,
    period_doubts,
    sheet_doubts,
)
from edge_ident.commissioning.described_drive import describe_drive, sampling_period_s
from edge_ident.errors import DataError
from firmware_interface.motion import stop_duration_s

ENTRIES = {entry.name: entry for entry in SHEET_ENTRIES}
PAPER = {
    "lead": "4",
    "gear_ratio": "131.25",
    "encoder_at": "output",
    "encoder": "8400",
    "torque": "0.0914",
    "travel": "11.4",
    "speed": "5000",
}
STAGE = {
    "lead": "5mm",
    "gear_ratio": "1",
    "encoder_at": "table",
    "encoder": "0.5",
    "torque_constant": "0.21",
    "torque": "3A",
    "travel": "300",
    "speed": "250 mm/s",
}
TABLE = {
    "kind": "rotary",
    "gear_ratio": "90",
    "encoder_at": "motor",
    "encoder": "17 bit",
    "torque": "2.4",
    "travel": "720",
    "speed": "60deg/s",
}


def sheet_of(answers: Mapping[str, str], **changed: str) -> AxisSheet:
    sheet = AxisSheet()
    for name, text in ({"kind": "linear"} | dict(answers) | changed).items():
        sheet = fill_sheet(sheet, ENTRIES[name], text)
    return sheet


def ordered(answers: Mapping[str, str]) -> dict[str, str]:
    """In the order of the entries, as they are asked."""
    return {name: answers[name] for name in ENTRIES if name in answers}


@pytest.mark.parametrize(
    ("answers", "name", "text", "key", "value"),
    [
        # a turn of the screw is 2π rad
        (PAPER, "lead", "4", "screw_lead_m_per_rad", 0.004 / (2 * math.pi)),
        (PAPER, "lead", "0.2 in", "screw_lead_m_per_rad", 0.00508 / (2 * math.pi)),
        (PAPER, "gear_ratio", "131.25:1", "gear_ratio", 131.25),
        # 64 counts of the motor are 8400 of a gearbox output that turns 131.25 times slower
        (PAPER | {"encoder_at": "motor"}, "encoder", "64", "encoder_counts_per_turn", 8400.0),
        (PAPER | {"encoder_at": "motor"}, "encoder", "16 lines", "encoder_counts_per_turn", 8400.0),
        (PAPER, "encoder", "2100 lines", "encoder_counts_per_turn", 8400.0),
        (PAPER, "encoder", "17 bit", "encoder_counts_per_turn", 131072.0),
        # half a micrometre of a 5 mm lead: ten thousandths of a turn
        (STAGE, "encoder", "0.5", "encoder_counts_per_turn", 10_000.0),
        (STAGE, "encoder", "2000/mm", "encoder_counts_per_turn", 10_000.0),
        (PAPER, "torque", "91.4 mNm", "effort_limit_nm", 0.0914 * 131.25),
        (STAGE, "torque", "3", "effort_limit_nm", 3.0),
        (STAGE, "torque", "3 A", "effort_limit_nm", 0.63),
        (STAGE, "travel", "0.3 m", "travel_limit_rad", 30 * 2 * math.pi),
        (TABLE, "travel", "2 turns", "travel_limit_rad", 2 * math.pi),
        (PAPER, "speed", "3000 1/min", "speed_limit_rad_s", 3000 / 131.25 * math.pi / 30),
        (STAGE, "speed", "15 m/min", "speed_limit_rad_s", 50 * 2 * math.pi),
        (TABLE, "speed", "1500 rpm", "speed_limit_rad_s", 1500 / 90 * math.pi / 30),
        (TABLE, "speed", "60deg/s", "speed_limit_rad_s", math.pi / 3),
        (STAGE, "acceleration", "0.5 g", "acceleration_rad_s2", 4.903325 / (0.005 / 2 / math.pi)),
        (TABLE, "acceleration", "180 deg/s²", "acceleration_rad_s2", math.pi),
        # inertia grows with the square of the ratio, a mass counts with that of the lead
        (PAPER, "rotor_inertia", "0.245", "rotor_inertia", 2.45e-5 * 131.25**2),
        (PAPER, "rotor_inertia", "245 g·cm²", "rotor_inertia", 2.45e-5 * 131.25**2),
        (STAGE, "load", "40", "load_inertia", 40 * (0.005 / 2 / math.pi) ** 2),
        (TABLE, "load", "0.8", "load_inertia", 0.8),
        (STAGE, "friction", "40 N", "friction_nm", 40 * 0.005 / 2 / math.pi),
        (PAPER, "friction", "0.01", "friction_nm", 1.3125),
    ],
)
def test_an_answer_in_the_units_of_a_data_sheet(
    answers: dict[str, str], name: str, text: str, key: str, value: float
) -> None:
    sheet = fill_sheet(sheet_of(answers), ENTRIES[name], text)
    assert getattr(sheet, key) == pytest.approx(value, rel=1e-12)


@pytest.mark.parametrize(
    ("answers", "name", "text", "message"),
    [
        (PAPER, "kind", "square", "not known here"),
        (PAPER, "lead", "", "an answer is needed"),
        (PAPER, "lead", "-4", "not a positive number"),
        (PAPER, "lead", "4,5", "has a comma"),
        (PAPER, "lead", "1e999", "not a positive number"),
        (PAPER, "lead", "4 kg", "'kg' is not a unit of this quantity"),
        (PAPER, "lead", "0", "is 0 m/rad"),
        (PAPER, "gear_ratio", "0", "is 0"),
        (PAPER, "encoder", "1 um", "not the resolution of an encoder on a shaft"),
        (PAPER, "encoder", "0", "not the resolution"),
        (STAGE, "encoder", "8192/turn", "not the resolution of a linear scale"),
        (TABLE, "encoder_at", "table", "not known here"),
        (PAPER, "torque", "3A", "the torque constant is not known"),
        (TABLE, "travel", "300 mm", "not a unit"),
        (TABLE, "friction", "40 N", "not a unit"),
        (PAPER, "acceleration", "0", "is 0 rad/s"),
        (PAPER, "friction", "0.0914", "the axis cannot move"),
    ],
)
def test_what_cannot_be_is_refused(
    answers: dict[str, str], name: str, text: str, message: str
) -> None:
    with pytest.raises(DataError, match=message) as error:
        fill_sheet(sheet_of(answers), ENTRIES[name], text)
    assert error.value.next_step


@pytest.mark.parametrize(
    ("answers", "name", "text", "question"),
    [
        (PAPER, "lead", "4 m", "moves the table by 4000 mm"),
        (PAPER, "gear_ratio", "0.007619", "turns of the motor per turn of the screw, 131.3?"),
        # counts of the motor's encoder, said to be of the output: 62 micrometres a count
        (PAPER, "encoder", "64", "one count is 62.5 um at the table"),
        (STAGE, "encoder", "0.5 nm", "one count is 0.0005 um"),
        (TABLE, "encoder", "4", "one count is 1 degrees"),
        (STAGE, "torque", "2000 Nm", "the motor gives 2e+03 Nm"),
        (STAGE, "travel", "30 m", "the axis travels 30 m"),
        (TABLE, "travel", "720 rad", "turns by 4.125e+04 degrees"),
        (PAPER, "speed", "5000 rev/s", "the motor turns at 3e+05 rpm"),
        (PAPER, "speed", "1", "s from end to end at top speed"),
        (STAGE, "acceleration", "0.001", "s to its top speed"),
    ],
)
def test_what_no_feed_drive_has_is_questioned(
    answers: dict[str, str], name: str, text: str, question: str
) -> None:
    entry = ENTRIES[name]
    (doubt,) = sheet_doubts(fill_sheet(sheet_of(answers), entry, text), entry)
    assert question in doubt


def test_an_inertia_of_no_axis_and_one_that_the_torque_cannot_move() -> None:
    entry = ENTRIES["load"]
    heavy = sheet_of(TABLE, rotor_inertia="10", load="6e7")
    assert "6e+07 kg*m^2 is that of no axis" in sheet_doubts(heavy, entry)[0]
    # 2.4 N·m times 90 turns 100 kg·m² at 2.2 rad/s² at most
    slow = sheet_of(TABLE, acceleration="2", rotor_inertia="10", load="100")
    fast = sheet_of(TABLE, acceleration="20", rotor_inertia="10", load="100")
    assert sheet_doubts(slow, entry) == []
    assert "times its torque" in sheet_doubts(fast, entry)[0]


@pytest.mark.parametrize("answers", [PAPER, STAGE, TABLE])
def test_plain_drives_are_not_questioned(answers: dict[str, str]) -> None:
    sheet = AxisSheet()
    for name, text in ordered({"kind": "linear"} | answers).items():
        sheet = fill_sheet(sheet, ENTRIES[name], text)
        assert sheet_doubts(sheet, ENTRIES[name]) == []


def test_a_sample_rate_or_a_period() -> None:
    assert [sampling_period_s(text) for text in ("400", "0.4 kHz", "2.5 ms")] == [0.0025] * 3
    assert period_doubts(0.0025) == []
    assert "25 Hz" in period_doubts(0.04)[0]
    for text in ("0", "2.5", "0.0025", "1 MHz", "fast"):
        with pytest.raises(DataError):
            sampling_period_s(text)


@pytest.mark.parametrize(
    ("answers", "changed"),
    [
        (PAPER, {}),
        (STAGE, {}),
        (TABLE, {}),
        (STAGE, {"speed": "2 mm/s"}),
        (STAGE, {"travel": "4 m", "speed": "1 m/s"}),
        (STAGE, {"acceleration": "0.002"}),
        (STAGE, {"rotor_inertia": "0.26", "load": "40", "friction": "200 N"}),
        (TABLE, {"rotor_inertia": "10", "load": "6000"}),
    ],
)
def test_the_first_motion_stays_within_every_limit(
    answers: dict[str, str], changed: dict[str, str]
) -> None:
    sheet = sheet_of(answers, **changed)
    drive = describe_drive("drive", 0.001, {"x": sheet}).drive
    axis, rate = drive.axes["x"], drive.angular_frequency_rad_s
    speed = axis.amplitude_rad * rate
    assert speed <= 0.7001 * axis.speed_limit_rad_s
    # a stop begins anywhere in the sine and takes half its duration at the speed there
    way = 0.5 * rate * stop_duration_s(speed)
    assert axis.amplitude_rad * math.hypot(1.0, way) <= axis.travel_limit_rad
    if sheet.acceleration_rad_s2 is not None:
        assert speed * rate <= 0.7001 * sheet.acceleration_rad_s2
    if sheet.inertia is not None:
        friction = sheet.friction_nm or 0.5 * axis.effort_limit_nm
        assert sheet.inertia * speed * rate + friction <= axis.effort_limit_nm


def test_what_stands_in_for_the_unknown_is_said_once() -> None:
    both = {"x": sheet_of(PAPER), "z": sheet_of(PAPER)}
    zero, acceleration = describe_drive("drive", 0.0025, both).assumed
    assert "middle of the travel" in zero
    assert acceleration.startswith("axis x, z: acceleration not known")
    known = {"x": sheet_of(PAPER, rotor_inertia="0.245", load="40")}
    assert "friction not known" in describe_drive("drive", 0.0025, known).assumed[1]
    known = {"x": sheet_of(PAPER, acceleration="1")}
    assert len(describe_drive("drive", 0.0025, known).assumed) == 1


def test_the_axes_are_a_quarter_period_apart() -> None:
    sheets = {name: sheet_of(PAPER) for name in ("x", "y", "z")}
    drive = describe_drive("drive", 0.0025, sheets).drive
    phases = [axis.phase_rad for axis in drive.axes.values()]
    assert phases == pytest.approx([0.0, math.pi / 2, math.pi])
