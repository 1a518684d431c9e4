"""Whoever stops the machine stops the host that was about to move it, on boards old and new."""

from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import replace

import pytest
from board_bench import NEW, OLD, Bench, long_motion

from edge_ident.commissioning import safety
from edge_ident.commissioning.safety import left_safe, ready_to_move
from firmware_interface import board_session
from firmware_interface.board import Board
from firmware_interface.errors import StoppedError
from firmware_interface.registers import SESSION_LEASE_S, Fault, State
from firmware_interface.virtual.register_file import Session

Verb = Callable[[Board], object]


@pytest.fixture(autouse=True)
def impatient(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(board_session, "POLL_S", 0.0)
    monkeypatch.setattr(safety, "_LEAVE_S", 0.2)


@pytest.fixture(params=["this firmware", "an older one"])
def bench(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> Bench:
    """An older firmware leaves a host its hold where another one stops the machine."""
    if request.param == "an older one":
        monkeypatch.setattr(Session, "stopped_by", lambda self, key: None)
    return Bench()


def enabled(bench: Bench) -> None:
    bench.board.enable()


def armed(bench: Bench) -> None:
    bench.arm(long_motion())


def staged(bench: Bench) -> None:
    bench.board.enable()
    bench.board.stage_gains(NEW)


def committed(bench: Bench) -> None:
    bench.board.enable()
    bench.commit()


def draining(bench: Bench) -> None:
    bench.start(replace(long_motion(), duration_s=0.25))
    while bench.board.status().state is State.MOVING:
        bench.board.heartbeat()


@pytest.mark.parametrize(
    ("before", "verb"),
    [
        (lambda bench: bench.board.claim(), Board.enable),
        (enabled, lambda board: board.write_trajectory(long_motion()) or board.arm()),
        (armed, Board.start),
        (staged, Board.commit),
        (staged, Board.commit_running),
        (committed, Board.confirm),
        (committed, Board.store),
        (draining, Board.finish),
    ],
    ids=["enable", "arm", "start", "commit", "commit_running", "confirm", "store", "finish"],
)
def test_a_host_that_was_stopped_does_not_go_on(
    bench: Bench, before: Callable[[Bench], None], verb: Verb
) -> None:
    before(bench)
    enabled_before = bench.board.status().enabled
    Board.connect(bench.virtual).quick_stop()
    for _ in range(2):  # it does not come back by itself
        with pytest.raises(StoppedError, match="another host or edge-ident stop has stopped") as it:
            verb(bench.board)
    assert "before you start again" in it.value.next_step
    status = bench.board.status()
    assert (status.state, status.enabled) == (State.IDLE, enabled_before)
    assert bench.board.active_gains() == OLD


def test_a_host_that_was_stopped_may_tidy_up_and_come_back_as_a_new_one(bench: Bench) -> None:
    bench.board.enable()
    Board.connect(bench.virtual).quick_stop()
    with pytest.raises(StoppedError):  # it has to learn of it
        bench.board.disable()
    assert not bench.board.status().enabled
    bench.board.disable()
    with pytest.raises(StoppedError):
        bench.board.enable()
    bench.board.release()
    assert bench.board.status().session_remaining_s == 0.0
    bench.board.enable()
    assert bench.board.status().enabled


def test_a_host_that_lets_go_without_knowing_that_it_was_stopped_comes_back(bench: Bench) -> None:
    bench.board.claim()
    Board.connect(bench.virtual).quick_stop()
    bench.board.release()
    bench.board.enable()
    assert bench.board.status().enabled


def test_a_motion_that_another_host_stops_is_said_so(bench: Bench) -> None:
    bench.start(long_motion())
    pages = bench.board.capture_pages()
    next(pages)
    Board.connect(bench.virtual).quick_stop()
    with pytest.raises(StoppedError, match="another host or edge-ident stop has stopped"):
        list(pages)


def test_what_a_stopped_host_began_is_tidied_up(bench: Bench) -> None:
    another = Board.connect(bench.virtual)

    def began() -> None:
        with left_safe(bench.board):
            committed(bench)
            another.quick_stop()
            bench.board.confirm()

    with pytest.raises(StoppedError) as caught:
        began()
    assert not another.status().enabled
    assert another.active_gains() == OLD
    assert caught.value.__notes__ == ["the gains of before are in force"]


def test_the_host_that_stopped_it_is_left_its_hold(bench: Bench) -> None:
    another = Board.connect(bench.virtual)

    def began() -> None:
        with left_safe(bench.board):
            armed(bench)
            another.quick_stop()
            bench.wait(SESSION_LEASE_S + 0.1)
            another.claim()
            bench.board.start()

    with pytest.raises(StoppedError):
        began()
    another.disable()
    assert not another.status().enabled


def test_a_host_that_was_frozen_sees_that_another_one_used_the_board(bench: Bench) -> None:
    bench.board.enable()
    bench.wait(SESSION_LEASE_S + 0.1)
    another = Board.connect(bench.virtual)
    another.stage_gains(NEW)
    another.commit()
    another.confirm()
    another.release()
    bench.board.status()
    with pytest.raises(StoppedError, match="used the board while this one was silent"):
        bench.board.write_trajectory(long_motion())
    assert bench.board.active_gains() == NEW


def test_a_host_that_was_frozen_in_a_motion_is_not_told_of_another_release(bench: Bench) -> None:
    """The motion that another host made since had fewer pages than this one has fetched."""
    bench.start(replace(long_motion(), duration_s=2.0))
    for page in bench.board.capture_pages():
        if page.first_sample > 50:
            break
    bench.wait(SESSION_LEASE_S + 2.0)
    another = Board.connect(bench.virtual)
    another.clear_fault()
    another.enable()
    another.write_trajectory(replace(long_motion(), duration_s=0.05))
    another.arm()
    another.start()
    assert max(page.first_sample for page in another.capture_pages()) < 50
    another.finish()
    another.release()
    with pytest.raises(StoppedError, match="used the board while this one was silent"):
        bench.board.heartbeat()


def test_a_host_that_was_frozen_learns_of_it_at_its_end_at_the_latest(bench: Bench) -> None:
    """It concluded from another host's gains that nothing was to be improved."""
    with ExitStack() as ending:
        ending.enter_context(pytest.raises(StoppedError, match="used the board"))
        ending.enter_context(ready_to_move(bench.board, lambda text: None))
        bench.board.active_gains()
        bench.wait(SESSION_LEASE_S + 0.1)
        another = Board.connect(bench.virtual)
        another.stage_gains(NEW)
        another.commit()
        another.confirm()
        another.release()
    assert not bench.board.status().enabled
    assert bench.board.active_gains() == NEW


def test_a_host_that_was_frozen_goes_on_where_nobody_used_the_board(bench: Bench) -> None:
    bench.board.enable()
    bench.wait(SESSION_LEASE_S + 0.1)
    Board.connect(bench.virtual).active_gains()  # whoever only reads is nobody
    bench.arm(long_motion())
    assert bench.board.status().state is State.ARMED


def test_no_watchdog_ends_the_stop_of_a_host_that_is_no_longer_heard() -> None:
    """Its last sign of life is 0.2 s old, and the shortest stop takes a quarter of a second."""
    bench = Bench()
    bench.board.write_register("watchdog.timeout", 0.3)
    another = Board.connect(bench.virtual)
    bench.start(long_motion())
    bench.board.heartbeat()
    bench.wait(0.2)
    another.quick_stop()
    status = another.status()
    assert (status.state, status.fault, status.enabled) == (State.IDLE, Fault.NONE, True)
