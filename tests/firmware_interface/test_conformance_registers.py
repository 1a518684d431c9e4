"""Both boards hold the same registers with the same access, ranges and exceptions."""

import time

import pytest
from conformance_boards import Line, Served, command, framed, refused

from firmware_interface.board import Board
from firmware_interface.board_types import read_limits
from firmware_interface.codec import decode, decode_array, encode
from firmware_interface.errors import BoardError
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
    WatchdogAction,
)
from firmware_interface.virtual.settings import CONSERVATIVE_GAINS, DEFAULT_LIMITS

ILLEGAL_FUNCTION, ILLEGAL_ADDRESS, ILLEGAL_VALUE = 1, 2, 3
PAGES_END = PAGE_ADDRESS + PAGE_SLOTS * PAGE_SLOT_REGISTERS
COMMAND = REGISTERS["command.opcode"].address
SILENCE_S = 0.1
"""Longer than both boards take to see the end of a frame on a pseudo-terminal."""


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
        assert limits.travel_rad == pytest.approx(DEFAULT_LIMITS.travel_rad)
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
        if register.access == "rw" and not register.name.startswith("command."):
            before = words_of(either_board, register)
            least = register.minimum if register.minimum is not None else 2.5
            written = encode(register.name, *[least] * register.count)
            assert refused(either_board, register.address, written) == 0, register.name
            assert words_of(either_board, register) == written
            if register.minimum is None or decode_array(register.name, before)[0] >= least:
                either_board._link.write(register.address, before)


def test_values_outside_their_range_are_refused(either_board: Board) -> None:
    writable = [register for register in REGISTERS.values() if register.access == "rw"]
    ranged = [r for r in writable if r.minimum is not None and r.maximum is not None]
    assert ranged
    for register in ranged:
        for good in (register.minimum, register.maximum):
            assert refused(either_board, register.address, encode(register.name, good)) == 0
        step, written = register.scale, words_of(either_board, register)
        for bad in (register.minimum - step, register.maximum + step):
            if bad >= 0:
                words = encode(register.name, bad)
                assert refused(either_board, register.address, words) == ILLEGAL_VALUE
        assert words_of(either_board, register) == written
    either_board._link.write(REGISTERS["watchdog.timeout"].address, encode("watchdog.timeout", 1.0))


def test_half_a_value_cannot_leave_the_range_either(either_board: Board) -> None:
    register = REGISTERS["trajectory.capture_samples"]
    either_board._link.write(register.address, encode(register.name, 5000))
    assert refused(either_board, register.address, [0xFFFF]) == ILLEGAL_VALUE
    assert refused(either_board, register.address + 1, [0]) == ILLEGAL_VALUE
    assert value(either_board, register.name) == 5000


def test_a_write_is_taken_whole_or_not_at_all(either_board: Board) -> None:
    timeout = REGISTERS["watchdog.timeout"]
    assert refused(either_board, timeout.address, [500, 1, 7]) == ILLEGAL_ADDRESS  # into a hole
    assert refused(either_board, timeout.address, [6000, 2]) == ILLEGAL_VALUE
    assert value(either_board, timeout.name) == 1.0
    assert value(either_board, "watchdog.action") == WatchdogAction.QUICK_STOP


@pytest.mark.parametrize(("offset", "length"), [(0, 1), (0, 3), (1, 3), (-1, 5), (2, 2)])
def test_a_command_comes_whole_or_not_at_all(either_board: Board, offset: int, length: int) -> None:
    token = either_board.status().last_token
    assert refused(either_board, COMMAND + offset, [Opcode.ARM] * length) == ILLEGAL_ADDRESS
    assert either_board.status().last_token == token


@pytest.mark.parametrize(
    ("request_body", "reply"),
    [
        ("0103 0000 0002", "010304" + f"{MAGIC:08x}"),
        ("0103 0000 0000", "018303"),  # no registers
        ("0103 0000 007e", "018303"),  # more than a reply holds
        ("0103 ffff 0002", "018302"),  # beyond the last address
        ("0103 0f00 0001", "018302"),
        ("0106 00a0 01f4", "010600a001f4"),
        ("0106 00a0 0001", "018603"),
        ("0106 0000 0001", "018602"),
        ("0110 00a0 0001 02 01f4", "011000a00001"),
        ("0110 00a0 0000 00", "019003"),
        ("0110 00a0 0001 04 01f4 0001", "019003"),  # count and length differ
        ("0110 00a0 0001 02 0001", "019003"),
        ("0101 0000 0001", "018101"),
        ("0104 0000 0002", "018401"),
        ("012b 0e01 00", "01ab01"),
        ("0117 0000 0001 0080 0001 02 00ff", "019701"),
    ],
)
def test_requests_and_their_replies(either_kind: Served, request_body: str, reply: str) -> None:
    with Line(either_kind.url) as line:
        assert line.ask(request_body, len(reply) // 2 + 2) == reply
        line.ask("0106 00a0 03e8", 8)


READ_MAGIC = framed("0103 0000 0002")
MAGIC_REPLY = framed(f"010304{MAGIC:08x}")
BROKEN = {
    "wrong CRC": READ_MAGIC[:-1] + bytes([READ_MAGIC[-1] ^ 1]),
    "cut short": READ_MAGIC[:5],
    "too short, with a right CRC": framed("0106 00a0"),
    "no address at all, with a right CRC": framed("0106"),
    "another device": framed("0203 0000 0002"),
    "broadcast": framed("0010 00a0 0001 02 01f4"),
    "noise": bytes(range(1, 41)),
    "longer than any frame": b"\x01" * 300,
}


@pytest.mark.parametrize("what", BROKEN)
def test_a_broken_frame_is_neither_answered_nor_in_the_way_of_the_next(
    either_kind: Served, what: str
) -> None:
    with Line(either_kind.url) as line:
        line.send(BROKEN[what])
        assert line.replies(1, SILENCE_S) == b""
        line.send(READ_MAGIC)
        assert line.replies(9) == MAGIC_REPLY


def test_a_silence_ends_a_frame(either_kind: Served) -> None:
    """Two halves with a pause between them are no request."""
    with Line(either_kind.url) as line:
        line.send(READ_MAGIC[:4])
        time.sleep(SILENCE_S)
        line.send(READ_MAGIC[4:])
        assert line.replies(1, SILENCE_S) == b""
        line.send(READ_MAGIC)
        assert line.replies(9) == MAGIC_REPLY


def test_a_frame_in_pieces_without_a_silence_is_a_request(
    either_kind: Served,
) -> None:
    with Line(either_kind.url) as line:
        for byte in READ_MAGIC:
            line.send(bytes([byte]))
        assert line.replies(9) == MAGIC_REPLY


def test_a_token_seen_before_is_ignored_even_if_not_the_last(either_board: Board) -> None:
    assert command(either_board, 99, 30001) is Result.UNKNOWN_COMMAND
    assert command(either_board, Opcode.FINISH, 30002) is Result.WRONG_STATE
    assert command(either_board, 99, 30001) is Result.WRONG_STATE  # still of the one before
    assert either_board.status().last_token == 30002
