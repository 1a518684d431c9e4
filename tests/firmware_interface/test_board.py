"""The board's verbs over the in-memory board: what works, what is refused, and what is said."""

import numpy as np
import pytest
from board_bench import NEW, OLD

from firmware_interface.board import Board
from firmware_interface.connection import open_link
from firmware_interface.errors import BoardError, LinkError, NoReplyError
from firmware_interface.link import Link
from firmware_interface.motion import Multisine, SineComponent, Staircase, Trajectory
from firmware_interface.registers import MAP_CRC, PAGE_ADDRESS, REGISTERS, Fault, Result, State
from firmware_interface.virtual.board import VirtualBoard
from firmware_interface.virtual.settings import DEFAULT_LIMITS, BoardSettings


def enabled(link: Link) -> Board:
    """A host on the board, with the effort on."""
    board = Board.connect(link)
    board.enable()
    return board


def run(board: Board, motion: Trajectory) -> np.ndarray:
    board.write_trajectory(motion)
    board.arm()
    board.start()
    pages = list(board.capture_pages())
    board.finish()
    return np.vstack([page.position_rad for page in pages])


def test_identity_comes_in_si_units() -> None:
    identity = Board.connect(open_link("virtual")).identity
    assert identity.map_crc == MAP_CRC
    assert identity.sample_period_s == pytest.approx(0.0025)
    assert identity.control_delay_s == pytest.approx(0.0005)
    assert identity.counts_per_turn == 8400
    assert identity.firmware_version == "2.0"


def test_limits_come_by_axis() -> None:
    limits = Board.connect(open_link("virtual")).limits()
    assert set(limits) == {"x", "z"}
    assert limits["z"].effort_nm == DEFAULT_LIMITS.effort_nm
    maxima = limits["x"].gain_maximum.numbers()
    assert maxima == pytest.approx(DEFAULT_LIMITS.gain_maximum.numbers())


def test_wrong_map_crc_is_an_error_that_names_both() -> None:
    with pytest.raises(BoardError) as caught:
        Board.connect(VirtualBoard(BoardSettings(map_crc=0x1234ABCD)))
    assert "0x1234abcd" in caught.value.cause
    assert f"{MAP_CRC:#010x}" in caught.value.cause
    assert caught.value.exit_code == 4


def tampered(name: str, words: list[int]) -> VirtualBoard:
    board, register = VirtualBoard(), REGISTERS[name]
    read = board.read

    def lying(address: int, count: int) -> list[int]:
        return (
            words if address == register.address and count == len(words) else read(address, count)
        )

    board.read = lying  # type: ignore[method-assign]
    return board


def test_another_device_and_swapped_words_are_told_apart() -> None:
    with pytest.raises(BoardError, match="not an edge-ident board"):
        Board.connect(tampered("identity.magic", [0, 7]))
    with pytest.raises(BoardError, match="float test"):
        Board.connect(tampered("identity.float_test", [0x0FDB, 0x4049]))


@pytest.mark.parametrize(
    ("words", "swapped"),
    [
        ([0x4453, 0x4D46], "words"),
        ([0x464D, 0x5344], "bytes"),
        ([0x5344, 0x464D], "words and bytes"),
    ],
)
def test_a_gateway_that_swaps_is_told_by_the_magic_number(words: list[int], swapped: str) -> None:
    """It comes first: with it swapped, no other value is looked at."""
    with pytest.raises(BoardError, match=f"^{swapped} of each value come in the wrong") as caught:
        Board.connect(tampered("identity.magic", words))
    assert f"swapping of {swapped} in the gateway" in caught.value.next_step


def test_a_capture_is_complete_and_follows_the_motion(short_motion: Trajectory) -> None:
    board = enabled(VirtualBoard())
    board.write_trajectory(short_motion)
    board.arm()
    board.start()
    pages = list(board.capture_pages())
    assert [page.first_sample for page in pages] == list(range(0, 421, 14))
    assert len(pages[-1].position_rad) == 1  # 30 full pages and the rest
    position = np.vstack([page.position_rad for page in pages])
    error = np.vstack([page.following_error_rad for page in pages])
    times = np.arange(421) * 0.0025
    wanted = np.column_stack([0.5 * np.sin(2 * times), 0.4 * np.cos(2 * times)])
    np.testing.assert_allclose(position + error, wanted, atol=2 * np.pi / 8400)
    board.finish()
    assert board.status().state is State.IDLE
    assert board.read_last_page().first_sample == 420


def test_the_machine_is_at_rest_after_a_motion(short_motion: Trajectory) -> None:
    virtual = VirtualBoard()
    run(enabled(virtual), short_motion)
    assert np.all(np.abs(virtual.machine.drive.plant.output_rad_s) < 1e-3)


def test_a_motion_repeats_from_where_the_last_one_ended(short_motion: Trajectory) -> None:
    board = enabled(VirtualBoard())
    first, second = run(board, short_motion), run(board, short_motion)
    assert first.shape == second.shape
    # soft feedback: the lag at the first sample depends on the start, the rest does not
    np.testing.assert_allclose(first[200:], second[200:], atol=0.01)


def test_staircase_runs_at_its_speeds() -> None:
    stairs = {"x": Staircase((0.5, -0.5), 1.0, 2.0), "z": Staircase((-0.4, 0.8), 1.0, 2.0)}
    position = run(enabled(VirtualBoard()), Trajectory(stairs, 2.4, 0.5))
    speed = np.gradient(position, 0.0025, axis=0)
    np.testing.assert_allclose(speed[200:380].mean(axis=0), [0.5, -0.4], atol=0.01)
    np.testing.assert_allclose(speed[760:900].mean(axis=0), [-0.5, 0.8], atol=0.02)


def test_commands_in_the_wrong_state_are_refused(short_motion: Trajectory) -> None:
    board = enabled(VirtualBoard())
    with pytest.raises(BoardError, match="not allowed in the board's present state"):
        board.start()
    board.write_trajectory(short_motion)
    board.arm()
    board.stage_gains(NEW)
    with pytest.raises(BoardError, match=r"present state \(board is ARMED\)"):
        board.commit()
    board.quick_stop()
    assert board.status().state is State.IDLE


@pytest.mark.parametrize(("amplitude_rad", "rate"), [(10.5, 0.2875), (2.0, 2.5)])
def test_motions_outside_travel_or_speed_are_not_armed(amplitude_rad: float, rate: float) -> None:
    sine = Multisine((SineComponent(amplitude_rad, rate, 0.0),))
    board = enabled(VirtualBoard())
    board.write_trajectory(Trajectory({"x": sine, "z": sine}, 5.0, 5.0))
    with pytest.raises(BoardError, match="leave the limits of travel"):
        board.arm()


@pytest.mark.parametrize(
    "motion",
    [
        Multisine(()),
        Multisine((SineComponent(float("inf"), 1.0, 0.0),)),
        Staircase((1.0,), 1.0, 0.0),
        Staircase((1.0,), float("nan"), 1.0),
    ],
)
def test_incomplete_motions_are_not_armed(motion: Multisine) -> None:
    board = enabled(VirtualBoard())
    board.write_trajectory(Trajectory({"x": motion, "z": motion}, 5.0, 5.0))
    with pytest.raises(BoardError, match="incomplete, not finite"):
        board.arm()


def test_a_motion_that_the_board_cannot_hold_is_refused_before_the_line() -> None:
    sine = Multisine((SineComponent(0.1, 1.0, 0.0),) * 9)
    with pytest.raises(BoardError, match="at most 8"):
        enabled(VirtualBoard()).write_trajectory(Trajectory({"x": sine, "z": sine}, 1.0))


def test_a_board_in_fault_says_which(short_motion: Trajectory) -> None:
    board = Board.connect(VirtualBoard(BoardSettings(fault=Fault.STO)))
    status = board.status()
    assert (status.state, status.fault) == (State.FAULT, Fault.STO)
    board.write_trajectory(short_motion)
    with pytest.raises(BoardError, match="emergency stop cut the effort") as caught:
        board.arm()
    assert "release" in caught.value.next_step
    for _ in range(30):
        board.status()  # time passes; the board sees that the axes stand still
    board.clear_fault()
    assert not board.status().enabled
    board.enable()
    run(board, short_motion)


def test_a_lost_page_is_a_link_error(short_motion: Trajectory) -> None:
    virtual = VirtualBoard()
    board = enabled(virtual)
    board.write_trajectory(short_motion)
    board.arm()
    board.start()
    read = virtual.read

    def broken(address: int, count: int) -> list[int]:
        words = read(address, count)
        return [*words[:-1], words[-1] ^ 1] if address == PAGE_ADDRESS + 5 * 128 else words

    virtual.read = broken  # type: ignore[method-assign]
    with pytest.raises(LinkError, match="page 5 is lost"):
        list(board.capture_pages())


def test_a_motion_that_somebody_stopped_ends_the_capture(short_motion: Trajectory) -> None:
    board = enabled(VirtualBoard())
    board.write_trajectory(short_motion)
    board.arm()
    board.start()
    pages = board.capture_pages()
    next(pages)
    board.quick_stop()
    with pytest.raises(BoardError, match="stopped before its end"):
        list(pages)


class LosingLink:
    """Loses replies to writes, or the writes themselves, at will."""

    def __init__(self, board: VirtualBoard) -> None:
        self.board = board
        self.lose = ""
        self.writes: list[tuple[int, list[int]]] = []

    def read(self, address: int, count: int) -> list[int]:
        return self.board.read(address, count)

    def write(self, address: int, words: list[int]) -> None:
        self.writes.append((address, words))
        if self.lose != "request":
            self.board.write(address, words)
        if self.lose:
            raise NoReplyError("no reply", "check the cable")

    def close(self) -> None:
        self.board.close()


def armed(motion: Trajectory) -> tuple[Board, LosingLink]:
    link = LosingLink(VirtualBoard())
    board = enabled(link)
    board.write_trajectory(motion)
    board.arm()
    link.writes.clear()
    return board, link


def test_a_lost_reply_neither_repeats_nor_fails_a_command(short_motion: Trajectory) -> None:
    board, link = armed(short_motion)
    link.lose = "reply"
    board.start()
    assert len(link.writes) == 1
    assert board.status().last_result is Result.DONE
    assert sum(len(page.position_rad) for page in board.capture_pages()) == 421


def test_a_lost_command_is_reported_and_not_sent_again(short_motion: Trajectory) -> None:
    board, link = armed(short_motion)
    link.lose = "request"
    with pytest.raises(LinkError, match="nothing was carried out"):
        board.start()
    assert len(link.writes) == 1
    assert board.status().state is State.ARMED


def test_staging_survives_a_lost_reply_but_not_a_lost_write() -> None:
    link = LosingLink(VirtualBoard())
    board = Board.connect(link)
    link.lose = "reply"
    board.stage_gains(NEW)
    assert board.staged_gains() == NEW
    link.lose = "request"
    with pytest.raises(LinkError, match="read back differently"):
        board.stage_gains(OLD)


def test_a_host_begins_with_tokens_that_the_board_does_not_remember() -> None:
    """Sixty-four hosts with one command each fill the board's memory; the next is heard."""
    virtual = VirtualBoard()
    for _ in range(200):
        Board.connect(virtual).quick_stop()
