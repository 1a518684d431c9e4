"""Both boards hold the same registers with the same access, ranges and exceptions."""

import pytest
from board_bench import NEW
from conformance_boards import BoardCommand, command, refused, refused_value, serving

from firmware_interface.board import Board
from firmware_interface.board_types import read_limits
from firmware_interface.codec import decode, decode_array, encode
from firmware_interface.errors import BoardError
from firmware_interface.gains import CONSERVATIVE_GAINS
from firmware_interface.register import Register
from firmware_interface.registers import (
    AXES,
    FLOAT_TEST,
    MAGIC,
    MAP_CRC,
    MAP_VERSION,
    PAGE_ADDRESS,
    PAGE_SLOT_REGISTERS,
    PAGE_SLOTS,
    REGISTERS,
    Opcode,
    Result,
    TrajectoryKind,
    WatchdogAction,
)
from firmware_interface.virtual.settings import DEFAULT_LIMITS

ILLEGAL_FUNCTION, ILLEGAL_ADDRESS, ILLEGAL_VALUE = 1, 2, 3
PAGES_END = PAGE_ADDRESS + PAGE_SLOTS * PAGE_SLOT_REGISTERS
COMMAND = REGISTERS["command.opcode"].address
ACTIVE = ("command.", "session.", "capture.")
"""Groups whose registers do something when they are written, or have rules of their own."""


def value(board: Board, name: str) -> float:
    register = REGISTERS[name]
    return decode(name, board._link.read(register.address, register.words))


def words_of(board: Board, register: Register) -> list[int]:
    return board._link.read(register.address, register.words)


def test_identity_is_that_of_the_map(either_board: Board) -> None:
    read = {name: value(either_board, f"identity.{name}") for name in ("magic", "map_version")}
    assert read == {"magic": MAGIC, "map_version": MAP_VERSION}
    assert value(either_board, "identity.map_crc") == MAP_CRC
    assert value(either_board, "identity.float_test") == pytest.approx(FLOAT_TEST, rel=1e-7)
    assert value(either_board, "identity.nonce") == value(either_board, "identity.nonce")
    identity = either_board.identity
    assert (identity.sample_period_s, identity.control_delay_s) == (0.0025, 0.0005)
    assert identity.counts_per_turn == 8400
    assert identity.effort_per_count_nm == pytest.approx(0.004)


def test_power_up_values(either_board: Board) -> None:
    assert value(either_board, "watchdog.timeout") == 1.0
    assert value(either_board, "watchdog.action") == WatchdogAction.QUICK_STOP
    gains = CONSERVATIVE_GAINS.numbers()
    for axis in AXES:
        limits = read_limits(either_board._link.read, axis)
        for name in ("travel_rad", "speed_rad_s", "acceleration_rad_s2", "effort_nm"):
            assert getattr(limits, name) == pytest.approx(getattr(DEFAULT_LIMITS, name))
        assert limits.gain_step == pytest.approx(DEFAULT_LIMITS.gain_step)
        maxima = DEFAULT_LIMITS.gain_maximum.numbers()
        assert limits.gain_maximum.numbers() == pytest.approx(maxima)
        assert either_board.active_gains()[axis].numbers() == pytest.approx(gains)


def test_every_register_reads_and_every_hole_is_an_illegal_address(either_board: Board) -> None:
    taken = {a for r in REGISTERS.values() for a in range(r.address, r.address + r.words)}
    for register in REGISTERS.values():
        assert len(words_of(either_board, register)) == register.words
    edges = {a + d for a in taken for d in (-1, 1)} - taken
    for address in [*sorted(edges & set(range(PAGE_ADDRESS))), PAGES_END, 0xFFFF]:
        with pytest.raises(BoardError, match=r"exception 2\)"):
            either_board._link.read(address, 1)


def test_page_slots_read_from_the_first_to_the_last_word(either_board: Board) -> None:
    for address in (PAGE_ADDRESS, PAGES_END - 125):
        assert len(either_board._link.read(address, 125)) == 125
    for address in (PAGE_ADDRESS - 1, PAGES_END - 124):
        with pytest.raises(BoardError, match=r"exception 2\)"):
            either_board._link.read(address, 125)


def test_read_only_registers_refuse_writes_and_keep_their_words(either_board: Board) -> None:
    for register in REGISTERS.values():
        if register.access == "ro" and register.name.split(".")[0] not in ("status", "capture"):
            before = words_of(either_board, register)
            flipped = [word ^ 0xFFFF for word in before]
            assert refused(either_board, register.address, flipped) == ILLEGAL_ADDRESS
            assert words_of(either_board, register) == before
    assert refused(either_board, REGISTERS["status.state"].address, [0]) == ILLEGAL_ADDRESS
    assert refused(either_board, PAGE_ADDRESS, [0]) == ILLEGAL_ADDRESS


def test_writable_registers_give_back_what_was_written(either_board: Board) -> None:
    for register in REGISTERS.values():
        if register.access == "rw" and not register.name.startswith(ACTIVE):
            before = words_of(either_board, register)
            least = register.minimum if register.minimum is not None else 2.0
            written = encode(register.name, *[least] * register.count)
            assert refused(either_board, register.address, written) == 0, register.name
            assert words_of(either_board, register) == written
            if register.minimum is None or decode_array(register.name, before)[0] >= least:
                refused(either_board, register.address, before)


def test_values_outside_their_range_are_refused(either_board: Board) -> None:
    writable = [register for register in REGISTERS.values() if register.access == "rw"]
    ranged = [r for r in writable if r.minimum is not None and r.maximum is not None]
    assert ranged
    for register in ranged:
        for good in (register.minimum, register.maximum):
            assert refused_value(either_board, register.name, good) == 0
        step, written = register.scale, words_of(either_board, register)
        for bad in (register.minimum - step, register.maximum + step):
            if bad >= 0:
                assert refused_value(either_board, register.name, bad) == ILLEGAL_VALUE
        assert words_of(either_board, register) == written


def test_unknown_codes_are_refused(either_board: Board) -> None:
    for name, codes in (("watchdog.action", WatchdogAction), ("trajectory.kind", TrajectoryKind)):
        for code in codes:
            assert refused_value(either_board, name, code) == 0
        for bad in (0, max(codes) + 1, 0x0101, 0xFFFF):
            assert refused_value(either_board, name, bad) == ILLEGAL_VALUE
        assert value(either_board, name) == max(codes)


def test_a_value_is_written_whole_or_not_at_all(either_board: Board) -> None:
    """One element of an array is a value of its own."""
    capture, amplitude = REGISTERS["trajectory.capture_samples"], "trajectory.x.amplitude"
    assert refused_value(either_board, capture.name, 5000) == 0
    for offset, words in ((0, [0]), (1, [0]), (1, [0, 0]), (-1, [0, 0]), (-2, [0, 40, 0])):
        assert refused(either_board, capture.address + offset, words) == ILLEGAL_ADDRESS
    assert value(either_board, capture.name) == 5000
    third = REGISTERS[amplitude].address + 4
    assert refused(either_board, third, encode("trajectory.x.dwell", 0.5)) == 0
    assert decode_array(amplitude, words_of(either_board, REGISTERS[amplitude]))[2] == 0.5


def test_a_write_is_taken_whole_or_not_at_all(either_board: Board) -> None:
    timeout = REGISTERS["watchdog.timeout"]
    assert refused(either_board, timeout.address, [500, 1, 7]) == ILLEGAL_ADDRESS  # into a hole
    assert refused(either_board, timeout.address, [6000, 2]) == ILLEGAL_VALUE
    assert refused(either_board, timeout.address, [500, 3]) == ILLEGAL_VALUE
    assert value(either_board, timeout.name) == 1.0
    assert value(either_board, "watchdog.action") == WatchdogAction.QUICK_STOP


def test_no_more_pages_are_acknowledged_than_were_written(either_board: Board) -> None:
    """One more, and the board would take the rest of the capture for overwritten."""
    for pages in (1, 255, 2**32 - 1):
        assert refused_value(either_board, "capture.pages_acknowledged", pages) == ILLEGAL_VALUE
    assert refused_value(either_board, "capture.pages_acknowledged", 0) == 0
    assert either_board.status().overflows == 0


def test_the_time_left_to_confirm_says_no_less_than_it_can(
    command_of_either: BoardCommand,
) -> None:
    """In 16 bits of 10 ms; more than that does not begin at zero again."""
    with (
        serving(command_of_either(window_s=1000.0)) as served,
        served.connected() as board,
    ):
        board.stage_gains(NEW)
        board.commit()
        assert board.status().confirm_remaining_s == pytest.approx(655.35)


@pytest.mark.parametrize(("offset", "length"), [(0, 1), (0, 5), (1, 5), (-1, 7), (2, 2)])
def test_a_command_comes_whole_or_not_at_all(either_board: Board, offset: int, length: int) -> None:
    token = either_board.status().last_token
    assert refused(either_board, COMMAND + offset, [Opcode.ARM] * length) == ILLEGAL_ADDRESS
    assert either_board.status().last_token == token


def test_a_token_seen_before_is_ignored_even_if_not_the_last(either_board: Board) -> None:
    assert command(either_board, 99, 30001) is Result.UNKNOWN_COMMAND
    assert command(either_board, Opcode.FINISH, 30002) is Result.WRONG_STATE
    assert command(either_board, 99, 30001) is Result.WRONG_STATE  # still of the one before
    assert either_board.status().last_token == 30002
