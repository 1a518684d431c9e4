"""The register table, single registers, and what stands before a write."""

import json
import struct

import pytest
from typer.testing import CliRunner

from edge_ident.cli import app
from edge_ident.commissioning.register_access import registers_named
from firmware_interface.registers import REGISTERS, State
from tests.edge_ident.shared_board import SharedBoard


@pytest.fixture
def shared(monkeypatch: pytest.MonkeyPatch) -> SharedBoard:
    return SharedBoard(monkeypatch)


def test_the_table_has_every_register_with_scale_unit_and_range() -> None:
    result = CliRunner().invoke(app, ["registers", "--json"])
    rows = {row["name"]: row for row in json.loads(result.stdout)["registers"]}
    assert set(rows) == set(REGISTERS)
    timeout = rows["watchdog.timeout"]
    assert (timeout["scale"], timeout["unit"]) == (0.001, "s")
    assert (timeout["minimum"], timeout["maximum"]) == (0.1, 5.0)
    assert "values" not in timeout


def test_values_come_scaled_and_codes_by_name(shared: SharedBoard) -> None:
    rows = shared.json("registers")["registers"]
    assert all(row["believable"] for row in rows)
    (period,) = shared.json("registers", "identity.sample_period")["registers"]
    assert period["values"] == [pytest.approx(0.0025)]
    _, text, _ = shared.run("registers", "status.state")
    assert "IDLE" in text


def test_a_group_by_its_name() -> None:
    assert [r.name for r in registers_named("watchdog")] == ["watchdog.timeout", "watchdog.action"]
    assert len(registers_named("limits.x")) == 6
    assert registers_named("watch") == []


def test_a_write_is_scaled_and_read_back(shared: SharedBoard) -> None:
    (row,) = shared.json("registers", "watchdog.timeout", "--write", 0.5, "--yes")["registers"]
    assert row["values"] == [0.5]
    assert shared.virtual.read(REGISTERS["watchdog.timeout"].address, 1) == [500]
    shared.json("registers", "watchdog.action", "--write", "COAST", "--yes")
    assert shared.virtual.read(REGISTERS["watchdog.action"].address, 1) == [2]
    phases = [word for k in range(8) for word in ("--write", k)]
    (row,) = shared.json("registers", "trajectory.x.phase", *phases, "--yes")["registers"]
    assert row["values"] == list(range(8))


def test_nothing_is_written_without_the_word(shared: SharedBoard) -> None:
    code, _, errors = shared.run("registers", "watchdog.timeout", "--write", 0.5)
    assert code == 2
    assert "--yes" in errors
    assert shared.virtual.read(REGISTERS["watchdog.timeout"].address, 1) == [1000]


@pytest.mark.parametrize(
    ("name", "value", "code"),
    [
        ("watchdog.timeout", "50", 4),
        ("watchdog.timeout", "nan", 4),
        ("watchdog.action", "7", 4),
        ("watchdog.timeout", "soon", 2),
        ("watchdog.timeout", "0_5", 2),
        ("command.token", "-1", 4),
        ("command.opcode", "2", 4),
        ("shadow.crc", "-1", 4),
        ("shadow.x.proportional", "inf", 4),
        ("identity.magic", "0", 4),
        ("trajectory.x.phase", "0", 2),
        ("watchdog", "1", 2),
        ("nothing", "1", 2),
    ],
)
def test_writes_that_are_refused(shared: SharedBoard, name: str, value: str, code: int) -> None:
    before = shared.virtual._registers._words[:]
    done, stdout, errors = shared.run("registers", name, f"--write={value}", "--yes")
    assert (done, stdout) == (code, "")
    assert errors
    writable = [r for r in REGISTERS.values() if r.access == "rw"]
    for register in writable:
        span = slice(register.address, register.address + register.words)
        assert shared.virtual._registers._words[span] == before[span]


def test_a_code_that_is_none_is_answered_with_those_that_are(shared: SharedBoard) -> None:
    code, _, errors = shared.run("registers", "watchdog.action", "--write=HALT", "--yes")
    assert code == 2
    assert "QUICK_STOP and COAST" in errors


def test_a_board_that_is_busy_is_not_written_to(
    shared: SharedBoard, monkeypatch: pytest.MonkeyPatch
) -> None:
    shared.virtual.machine.state = State.DONE
    code, _, errors = shared.run("registers", "watchdog.timeout", "--write", 0.5, "--yes")
    assert code == 4
    assert "the board is DONE" in errors


def test_values_that_cannot_be_are_shown_as_such(shared: SharedBoard) -> None:
    limit = REGISTERS["limits.x.travel"]
    nan = list(struct.unpack(">2H", struct.pack(">f", float("nan"))))
    shared.virtual._registers.put_words(limit.address, nan)
    (row,) = shared.json("registers", limit.name)["registers"]
    assert (row["values"], row["believable"]) == ([None], False)
    assert "invalid" in shared.run("registers", limit.name)[1]
