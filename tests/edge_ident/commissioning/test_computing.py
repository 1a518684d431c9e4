"""A long computation beside a board keeps its hold, and ends when time is up."""

import threading

import pytest

from edge_ident.commissioning.study.computing import Budget, OutOfTimeError, Progress, computed


def nothing(stage: str, done: int, total: int) -> None: ...


def test_what_is_computed_comes_back_and_the_board_is_beaten() -> None:
    beats: list[int] = []
    go = threading.Event()

    def work(progress: Progress) -> str:
        progress("diagnosis", 0, 1)
        go.wait(10.0)
        return "found"

    def beat() -> None:
        beats.append(1)
        go.set()

    assert computed(work, Budget(60.0), nothing, beat) == "found"
    assert beats


def test_an_error_of_the_work_is_raised_where_it_is_waited_for() -> None:
    def work(progress: Progress) -> None:
        raise ValueError("it")

    with pytest.raises(ValueError, match="it"):
        computed(work, Budget(), nothing, lambda: None)


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
        computed(work, budget, nothing, lambda: None)
    go.set()
    assert ended.wait(10.0)
    assert budget.left_s < 0.0


def test_an_interruption_ends_it_too() -> None:
    go, ended = threading.Event(), threading.Event()

    def work(progress: Progress) -> None:
        go.wait(10.0)
        try:
            progress("diagnosis", 1, 2)
        finally:
            ended.set()

    def beat() -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        computed(work, Budget(), nothing, beat)
    go.set()
    assert ended.wait(10.0)
