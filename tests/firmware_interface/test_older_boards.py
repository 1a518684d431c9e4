"""A board of an older register map is driven with what its control law has."""

from dataclasses import replace

import pytest
from board_bench import BETTER, OLD, Bench, long_motion

from edge_ident.commissioning.gain_transfer import check_gains, write_gains
from firmware_interface.board_types import MAP_CRCS
from firmware_interface.codec import crc32
from firmware_interface.errors import BoardError
from firmware_interface.gains import GAIN_FIELDS, AxisGains, bank_spans, encode_gains, span_of
from firmware_interface.generate import load_map
from firmware_interface.registers import MAP_VERSION, Opcode, Result, State
from firmware_interface.virtual.settings import BoardSettings

KNOWN = {axis: AxisGains.of_numbers(list(BETTER.numbers().values())[:24]) for axis in "xz"}
"""With the terms of map 3 alone."""


@pytest.mark.parametrize("version", [3, 4])
def test_what_stood_in_an_older_map_stands_where_it_stood(version: int) -> None:
    """Else its CRC would not be the one that its boards have."""
    now = load_map()
    then = tuple(register for register in now.registers if register.since <= version)
    assert replace(now, version=version, registers=then).crc == MAP_CRCS[version]


def test_the_host_knows_what_each_boards_law_has() -> None:
    old, new = (Bench(map_version=version).board.identity for version in (3, MAP_VERSION))
    assert (old.map_version, old.map_crc) == (3, MAP_CRCS[3])
    assert "ripple_period_rad" in old.gain_fields
    assert "load_table" not in old.gain_fields
    assert new.gain_fields == tuple(AxisGains.__dataclass_fields__) == GAIN_FIELDS[4]


def test_gains_of_a_board_of_map_3_are_changed_in_its_24_numbers() -> None:
    bench = Bench(map_version=3)
    board, banks = bench.board, bench.virtual.machine.banks
    assert board.active_gains() == OLD
    check_gains(KNOWN, OLD, board.limits())
    write_gains(board, KNOWN)
    board.confirm()
    board.store()
    assert board.active_gains() == board.staged_gains() == banks.stored == KNOWN
    words = encode_gains(KNOWN, 3)
    assert len(words) == 96
    assert board.register_values("shadow.crc") == (crc32(words),)


@pytest.mark.parametrize(
    "term",
    [
        {"load_table": (0.0,) * 23 + (0.5,)},
        {"presliding_feedforward": 0.125},
        {"table_step_rad": 0.5},
        {"ripple_fade_speed_rad_s": (0.0, 0.5, 0.0, 0.0)},
    ],
    ids=lambda term: next(iter(term)),
)
def test_a_term_that_the_board_has_not_is_refused_before_anything_is_written(
    term: dict[str, object],
) -> None:
    bench = Bench(map_version=3)
    wanted = KNOWN | {"z": replace(KNOWN["z"], **term)}  # type: ignore[arg-type]
    shadow = [*bank_spans("shadow", 3), span_of("shadow.crc")]
    before = bench.virtual._registers.spans(shadow)
    with pytest.raises(BoardError, match=rf"axis z: .* has no {next(iter(term))}.*map 3"):
        bench.board.stage_gains(wanted)
    assert bench.virtual._registers.spans(shadow) == before
    assert not bench.board.status().session_remaining_s


def test_a_motion_is_started_with_the_crc_of_the_boards_own_map() -> None:
    bench = Bench(map_version=3)
    bench.wait(0.1)
    bench.arm(long_motion())
    assert bench.command(Opcode.START, 30900, MAP_CRCS[MAP_VERSION]) is Result.WRONG_ARGUMENT
    bench.board.start()
    assert bench.board.status().state is State.MOVING


def test_registers_that_came_later_are_not_there() -> None:
    bench = Bench(map_version=3)
    for group in ("active", "shadow", "gain_maximum"):
        address, _ = bank_spans(group)[2]
        with pytest.raises(BoardError, match="no registers"):
            bench.virtual.read(address, 2)
    assert bench.board.limits()["x"].gain_maximum.load_table == (0.0,) * 24


@pytest.mark.parametrize(
    "settings", [{"map_version": 3, "map_crc": 1}, {"map_crc": MAP_CRCS[3]}], ids=str
)
def test_a_map_whose_crc_is_another_is_refused(settings: dict[str, int]) -> None:
    with pytest.raises(BoardError, match=rf"{MAP_CRCS[3]:#010x}"):
        Bench(**settings)


def test_the_settings_know_their_maps_crc() -> None:
    assert BoardSettings().claimed_crc == MAP_CRCS[MAP_VERSION]
    assert BoardSettings(map_version=3).claimed_crc == MAP_CRCS[3]
