"""A board that sends nonsense: every read path ends in an error with a next step, and soon."""

import math
import struct
from collections.abc import Callable
from contextlib import AbstractContextManager, suppress

import numpy as np
import pytest
from board_bench import NEW
from hypothesis import given, settings
from hypothesis import strategies as st

from firmware_interface import board_checks, board_session
from firmware_interface.board import Board
from firmware_interface.codec import RawPage, crc32, decode_page, encode, encode_page
from firmware_interface.connection import open_link
from firmware_interface.errors import BoardError, EdgeIdentError, LinkError
from firmware_interface.motion import Trajectory
from firmware_interface.registers import AXES, PAGE_ADDRESS, REGISTERS
from firmware_interface.virtual.board import VirtualBoard
from tests.repetitions import examples

Served = Callable[[VirtualBoard, str], AbstractContextManager[str]]


class LyingBoard(VirtualBoard):
    """A virtual board that sends other words than it has, from an address on."""

    def __init__(self) -> None:
        super().__init__()
        self.lies: dict[int, list[int]] = {}

    def lie(self, name: str, words: list[int]) -> None:
        self.lies[REGISTERS[name].address] = words

    def read(self, address: int, count: int) -> list[int]:
        words = super().read(address, count)
        for start, lie in self.lies.items():
            for n, word in enumerate(lie):
                if address <= start + n < address + count:
                    words[start + n - address] = word
        return words


def words_of(number: float) -> list[int]:
    return list(struct.unpack(">2H", struct.pack(">f", number)))


NONSENSE = [
    ("identity.sample_period", [0, 0]),
    ("identity.sample_period", [0xFFFF, 0xFFFF]),
    ("identity.control_delay", [0xFFFF, 0]),
    ("identity.counts_per_turn", [0, 0]),
    ("identity.effort_per_count", words_of(math.nan)),
    ("identity.effort_per_count", words_of(-1.0)),
    ("status.state", [99]),
    ("status.fault_code", [0xFFFF]),
    ("status.last_result", [200]),
    ("status.unconfirmed", [2]),
    ("limits.x.travel", words_of(math.inf)),
    ("limits.z.gain_step", words_of(math.nan)),
    ("limits.x.effort", words_of(-12.0)),
    ("gain_maximum.x.derivative", words_of(math.nan)),
    ("active.z.proportional", words_of(math.nan)),
    ("active.x.ripple_cosine", words_of(math.inf)),
    ("shadow.x.inertia_feedforward", words_of(-math.inf)),
    ("gain_maximum.z.load_table", words_of(math.nan)),
    ("active.x.friction_forward", words_of(math.nan)),
    ("shadow.z.transmitted_friction", words_of(math.inf)),
]


@pytest.mark.parametrize(("name", "words"), NONSENSE)
def test_no_value_is_believed_that_cannot_be(name: str, words: list[int]) -> None:
    virtual = LyingBoard()
    virtual.lie(name, words)
    with pytest.raises(BoardError, match=name) as caught:
        read_everything(virtual)
    assert caught.value.next_step


@pytest.mark.parametrize("name", ["active.x.proportional", "active.z.load_table", "active.crc"])
def test_gains_that_were_read_in_part_from_another_bank_are_not_believed(name: str) -> None:
    """They come in several transfers; each of their numbers could be."""
    virtual = LyingBoard()
    board = Board.connect(virtual)
    virtual.lie(name, words_of(0.5))
    with pytest.raises(LinkError, match="change while they are read"):
        board.active_gains()


def test_limits_are_read_once_as_the_identity_is() -> None:
    """They are read-only, and reading them again after a motion would delay new gains."""
    virtual = LyingBoard()
    board = Board.connect(virtual)
    first = board.limits()
    virtual.lie("limits.x.travel", words_of(1.0))
    assert board.limits() == first


def read_everything(virtual: VirtualBoard) -> None:
    board = Board.connect(virtual)
    board.limits()
    board.active_gains()
    board.staged_gains()


@settings(max_examples=examples(60))
@given(data=st.data())
def test_any_words_at_all_end_in_values_or_in_an_error(data: st.DataObject) -> None:
    """Whole groups of random words, behind an identity that is in order."""
    virtual = LyingBoard()
    board = Board.connect(virtual)
    names = ("status.state", "limits.x.travel", "active.x.proportional", "identity.sample_period")
    name = data.draw(st.sampled_from(names))
    virtual.lie(name, data.draw(st.lists(st.integers(0, 0xFFFF), min_size=6, max_size=24)))
    looks = (board.status, board.limits, board.active_gains, lambda: Board.connect(virtual))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(board_session, "REST_TIMEOUT_S", 0.01)  # a lie may be an endless self-test
        for look in looks:
            with suppress(EdgeIdentError):
                look()


@pytest.mark.parametrize("count", [0, 15, 0xFFFF])
def test_a_page_with_an_impossible_number_of_samples_is_none(count: int) -> None:
    none = np.zeros((0, len(AXES)), dtype=np.int64)
    words = encode_page(RawPage(0, 0, none, none, none))[:-2]
    words[4] = count
    crc = crc32(words)
    with pytest.raises(ValueError, match="samples"):
        decode_page([*words, crc >> 16, crc & 0xFFFF])


def test_a_page_that_fails_its_crc_each_time_is_lost(short_motion: Trajectory) -> None:
    virtual = LyingBoard()
    board = moving(virtual, short_motion)
    virtual.lies[PAGE_ADDRESS + 7] = [0xDEAD, 0xBEEF]
    with pytest.raises(LinkError, match="page 0 is lost"):
        list(board.capture_pages())


def moving(virtual: VirtualBoard, motion: Trajectory) -> Board:
    board = Board.connect(virtual)
    board.enable()
    board.write_trajectory(motion)
    board.arm()
    board.start()
    return board


def test_a_board_whose_clock_stands_still_is_not_waited_for(
    short_motion: Trajectory, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(board_checks, "_CLOCK_STALL_S", 0.05)
    virtual = LyingBoard()
    board = moving(virtual, short_motion)
    virtual.lie("status.board_clock", [0, 1234])
    virtual.lie("capture.pages_written", [0, 0, 0, 0])
    virtual.lie("status.state", encode("status.state", 3))
    with pytest.raises(BoardError, match="does not end"):
        list(board.capture_pages())


def test_a_motion_that_is_overdue_is_given_up(short_motion: Trajectory) -> None:
    virtual = LyingBoard()
    board = moving(virtual, short_motion)
    virtual.lie("capture.pages_written", [0, 0, 0, 0])
    virtual.lie("status.state", encode("status.state", 3))
    with pytest.raises(BoardError, match="does not end"):
        list(board.capture_pages())


def test_more_pages_than_the_motion_has_samples_are_not_fetched(short_motion: Trajectory) -> None:
    virtual = LyingBoard()
    board = moving(virtual, short_motion)
    virtual.lie("capture.pages_written", [0x1249, 0x2492, 0xFFFF, 0xFFFC])  # and samples
    with pytest.raises(BoardError, match="306783378 pages"):
        list(board.capture_pages())


def test_gains_that_read_back_differently_are_not_committed() -> None:
    virtual = LyingBoard()
    board = Board.connect(virtual)
    virtual.lie("shadow.x.proportional", words_of(500.0))
    with pytest.raises(LinkError, match="read back differently"):
        board.stage_gains(NEW)
    assert board.status().last_token == 0  # no command was sent


def test_nonsense_over_a_real_line_is_an_error_too(served: Served) -> None:
    virtual = LyingBoard()
    virtual.lie("identity.counts_per_turn", [0, 0])
    with served(virtual, "tcp") as url:
        link = open_link(url)
        with pytest.raises(BoardError, match=r"identity\.counts_per_turn"):
            Board.connect(link)
        link.close()


@pytest.mark.parametrize("name", ["identity.counts_per_turn", "limits.x.effort"])
def test_a_word_that_the_line_changes_once_is_no_identity_and_no_limit(name: str) -> None:
    """No checksum of the board covers them."""
    virtual, changed = VirtualBoard(), REGISTERS[name].address
    read, spoiled = virtual.read, [changed]

    def flipping(address: int, count: int) -> list[int]:
        words = read(address, count)
        if spoiled and address <= changed < address + count:
            words[spoiled.pop() - address] ^= 0x80
        return words

    virtual.read = flipping  # type: ignore[method-assign]
    with pytest.raises(LinkError, match="differs from one reading to the next"):
        Board.connect(virtual).limits()
