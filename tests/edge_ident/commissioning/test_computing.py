"""A long computation beside a board ends when time is up, or with Ctrl-C."""

import _thread
import threading

import pytest

from edge_ident.commissioning.identification_motions import (
    Budget,
    OutOfTimeError,
    Progress,
    computed,
)


def nothing(stage: str, done: int, total: int) -> None: ...


def test_what_is_computed_comes_back_and_its_time_is_taken_from_the_budget() -> None:
    def work(progress: Progress) -> str:
        progress("diagnosis", 0, 1)
        return "found"

    budget = Budget(60.0)
    assert computed(work, budget, nothing) == "found"
    assert 0.0 < budget.left_s < 60.0


def test_an_error_of_the_work_is_raised_where_it_is_waited_for() -> None:
    def work(progress: Progress) -> None:
        raise ValueError("it")

    with pytest.raises(ValueError, match="it"):
        computed(work, Budget(), nothing)


def test_out_of_time_it_ends_at_its_next_progress_and_nothing_is_left_of_the_budget() -> None:
    go, ended = threading.Event(), threading.Event()

    def work(progress: Progress) -> None:
        go.wait(10.0)
        try:
            progress("diagnosis", 1, 2)
        finally:
            ended.set()

    budget = Budget(0.0)
    with pytest.raises(OutOfTimeError, match="not done within 0 s"):
        computed(work, budget, nothing)
    go.set()
    assert ended.wait(10.0)
    assert budget.left_s < 0.0


def test_an_interruption_ends_it_too() -> None:
    go, ended = threading.Event(), threading.Event()

    def work(progress: Progress) -> None:
        _thread.interrupt_main()
        go.wait(10.0)
        try:
            progress("diagnosis", 1, 2)
        finally:
            ended.set()

    with pytest.raises(KeyboardInterrupt):
        computed(work, Budget(), nothing)
    go.set()
    assert ended.wait(10.0)
