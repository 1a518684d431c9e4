"""A motion that ends once its parameters are known: when, what is kept of it, how it stops."""

import _thread
import html
import threading
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from edge_ident.commissioning import identification_motions
from edge_ident.commissioning.capture import capture_motion, come_to_rest, partial_file
from edge_ident.commissioning.drawn_loads import beginning
from edge_ident.commissioning.gain_change import MotionBefore
from edge_ident.commissioning.identification_motions import (
    CAPTURE_FILE,
    Budget,
    Looks,
    OutOfTimeError,
    Plan,
    Progress,
    Study,
    Widest,
    computed,
    earliest_s,
)
from edge_ident.commissioning.run import Outcome, commission
from edge_ident.drive.description import load_drive
from edge_ident.drive.motions import named_trajectory
from edge_ident.errors import BoardError, DataError, ModelError
from edge_ident.estimation.network import load_network
from edge_ident.identification.identify import identify
from edge_ident.identification.result import Identification
from edge_ident.report.page.run_page import write_run_page
from edge_ident.report.run_documents import run_document
from edge_ident.signals.recording import Recording
from edge_ident.signals.recording_files import load_recording
from firmware_interface.board import Board
from firmware_interface.motion import Multisine, SineComponent, Staircase, Trajectory
from firmware_interface.plant import Hidden
from firmware_interface.plant.feed_drive import FEED_DRIVE
from firmware_interface.registers import State
from firmware_interface.virtual.board import VirtualBoard
from tests.short_runs import Listening, Silent, brief_drive

DRIVE = brief_drive()
PERIOD_S = named_trajectory(DRIVE, "sinusoid", 1).duration_s
SAMPLE_S = 0.0025


def run(folder: Path, until: float | None, virtual: VirtualBoard | None = None, **plan: object):
    board, listener = Board.connect(virtual or VirtualBoard()), Listening()
    wanted = Plan(**{"until": until, "most_motions": 1, "write": False, **plan})  # type: ignore[arg-type]
    return commission(board, DRIVE, None, wanted, folder, listener), listener, board


@pytest.fixture(scope="module")
def short(tmp_path_factory: pytest.TempPathFactory) -> tuple[Outcome, Listening, Board, Path]:
    """A whole run of two periods, whose first motion is to end early; its gains are written."""
    folder = tmp_path_factory.mktemp("short")
    return *run(folder, 0.03, cycles=2, write=True), folder


def test_the_motion_ends_once_every_interval_is_narrow(short) -> None:
    outcome, listener, board, folder = short
    early, recording = outcome.early, outcome.capture.recording
    assert early.reached
    assert outcome.capture.ended_early
    captured_s = len(recording.time_s) * SAMPLE_S
    assert early.share == pytest.approx(captured_s / (2 * PERIOD_S), abs=1e-3)
    assert 7.0 / 12.0 * PERIOD_S < captured_s < 1.95 * PERIOD_S
    assert early.widest == Widest.of(outcome.identification)
    assert early.widest.half_width <= 0.03
    assert early.sentence in listener.said
    assert board.status().state is State.IDLE
    assert not partial_file(folder / CAPTURE_FILE).exists()


def test_the_part_that_was_captured_is_identified_within_its_intervals(short) -> None:
    for name, axis in short[0].identification.axes.items():
        assert axis.trusted
        assert axis.adequacy.adequate
        truth = [getattr(FEED_DRIVE[name], of) for of in identification_motions.PARAMETERS]
        # four parameters of two axes at once: 99.7 % intervals
        assert np.all(abs(axis.estimate.parameters - truth) < 3.0 * axis.estimate.std)


def test_the_last_look_is_the_answer_that_the_recording_gives(short) -> None:
    again = identify(load_recording(short[3] / CAPTURE_FILE), diagnose=False)
    for name, axis in short[0].identification.axes.items():
        assert np.array_equal(axis.estimate.parameters, again.axes[name].estimate.parameters)
        assert np.array_equal(axis.estimate.std, again.axes[name].estimate.std)


def test_gains_are_designed_and_verified_as_after_a_whole_motion(short) -> None:
    outcome = short[0]
    assert outcome.confirmed, outcome.conclusion
    made = outcome.separation.motions[0]
    assert made.trajectory.duration_s == len(made.recording.time_s) * SAMPLE_S


def test_document_and_page_tell_how_much_was_needed(short) -> None:
    outcome, _, board, folder = short
    network = type("Network", (), {"sha256": ""})()
    document = run_document(outcome, board.identity, network, folder)
    told = document["until"]
    assert told["asked"] == 0.03
    assert told["reached"]
    assert told["share"] == outcome.early.share
    assert set(told["widest"]) == {"axis", "parameter", "half_width"}
    page = write_run_page(outcome, document, folder).read_text("utf-8")
    assert outcome.early.sentence in html.unescape(page)


def test_a_bound_that_is_not_reached_leaves_the_motion_whole(tmp_path: Path) -> None:
    outcome, listener, _ = run(tmp_path, 1e-4)
    early = outcome.early
    assert not early.reached
    assert early.share == 1.0
    assert early.sentence in listener.said
    assert early.sentence.startswith("the whole motion was needed: not every parameter is known")
    assert str(early.widest) in early.sentence


def test_nothing_ends_early_where_the_base_model_is_not_enough(tmp_path: Path) -> None:
    hidden = Hidden.of(["asymmetric_friction=0.3"], "x")
    outcome, *_ = run(tmp_path, 0.9, VirtualBoard(plant=hidden.plant()), diagnose=False)
    assert not outcome.early.reached
    assert "the base model is not enough for axis x" in outcome.early.sentence


def test_without_the_option_nothing_is_said(tmp_path: Path) -> None:
    outcome, listener, _ = run(tmp_path, None)
    assert outcome.early is None
    assert not [line for line in listener.said if "known" in line]


# ---- when a look is worth it


def sines(*phases_rad: float) -> Trajectory:
    axes = {
        name: Multisine((SineComponent(1.0, 1.0, phase),))
        for name, phase in zip("xz", phases_rad, strict=False)
    }
    return Trajectory(axes, duration_s=4.0 * np.pi, lead_in_s=1.0)


def test_no_look_comes_before_half_the_highest_speed_both_ways() -> None:
    # x, a sine, has gone both ways at half its speed after 4/12 of the period, z after 7/12
    assert earliest_s(sines(0.0), SAMPLE_S) == pytest.approx(np.pi)
    found = earliest_s(sines(0.0, np.pi / 2), SAMPLE_S)
    assert found == pytest.approx(2.0 * np.pi * 7.0 / 12.0, abs=2.0 * SAMPLE_S)


def test_no_look_comes_where_an_axis_goes_one_way_only() -> None:
    stairs = Staircase((0.5, 1.0), dwell_s=1.0, acceleration_rad_s2=2.0)
    assert earliest_s(Trajectory({"x": stairs}, duration_s=3.0), SAMPLE_S) == np.inf


def test_two_good_looks_in_a_row_are_needed(monkeypatch: pytest.MonkeyPatch) -> None:
    board = Board.connect(VirtualBoard())
    study = Study(Plan(), board, DRIVE, None, Path(), Silent())
    looks = Looks(study, named_trajectory(DRIVE, "sinusoid", 2), 0.02)
    said = iter([True, False, True, True])
    monkeypatch.setattr(looks, "_ok", lambda recording: next(said))
    every = round(PERIOD_S / SAMPLE_S / 20)
    first = round(0.59 * PERIOD_S / SAMPLE_S)
    assert not looks.enough(first - every, lambda: None)
    ended = [looks.enough(first + count * every, lambda: None) for count in range(4)]
    assert ended == [False, False, False, True]


def test_no_look_comes_where_the_motion_is_over_before_the_next() -> None:
    board = Board.connect(VirtualBoard())
    study = Study(Plan(), board, DRIVE, None, Path(), Silent())
    looks = Looks(study, named_trajectory(DRIVE, "sinusoid", 1), 0.02)
    assert not looks.enough(round(0.97 * PERIOD_S / SAMPLE_S), lambda: pytest.fail("a look"))


# ---- the board meanwhile


def test_a_look_that_fails_stops_the_machine(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    identify = identification_motions.identify

    def fails(recording: Recording, *given: object, **how: object) -> Identification:
        if recording.source == "rehearsal":
            return identify(recording, *given, **how)  # type: ignore[arg-type]
        raise ModelError("no such axis", "give another model")

    monkeypatch.setattr(identification_motions, "identify", fails)
    virtual = VirtualBoard()
    with pytest.raises(ModelError, match="no such axis"):
        run(tmp_path, 0.02, virtual)
    assert virtual.machine.state is State.IDLE
    assert not virtual.machine.moving
    assert not virtual.machine.enabled
    assert partial_file(tmp_path / CAPTURE_FILE).exists()


def test_a_fault_at_the_early_end_is_told() -> None:
    virtual = VirtualBoard()
    board = Board.connect(virtual)
    board.enable()
    trajectory = named_trajectory(DRIVE, "sinusoid", 1)
    capture = capture_motion(board, trajectory, Silent().samples, enough=lambda *_: True)
    assert len(capture.recording.time_s) == 14
    virtual.inputs.press_stop()
    with pytest.raises(BoardError, match="fault STO"):
        come_to_rest(board, capture)


# ---- what gains are judged on


@pytest.mark.parametrize(("cycles", "judged", "verified"), [(1.6, 1.0, 1.0), (0.8, 0.8, 0.8)])
def test_gains_are_judged_on_whole_cycles_or_on_what_there_is(
    short, cycles: float, judged: float, verified: float
) -> None:
    outcome = short[0]
    axes = outcome.capture.recording.axes
    count = round(cycles * PERIOD_S / SAMPLE_S)
    repeated = {
        name: replace(
            axis,
            position=np.resize(axis.position, count),
            effort=np.resize(axis.effort, count),
            reference=np.resize(axis.reference, count),
        )
        for name, axis in axes.items()
    }
    recording = replace(
        outcome.capture.recording, time_s=SAMPLE_S * np.arange(count), axes=repeated
    )
    capture = replace(outcome.capture, recording=recording)
    before = MotionBefore.of(DRIVE, "sinusoid", capture, outcome.identification)
    samples = len(before.capture.recording.time_s)
    assert samples * SAMPLE_S == pytest.approx(judged * PERIOD_S, abs=SAMPLE_S)
    assert before.first.trajectory.duration_s == pytest.approx(verified * PERIOD_S, abs=SAMPLE_S)


def test_the_beginning_of_a_recording_keeps_its_axes(short) -> None:
    recording = short[0].capture.recording
    first = beginning(recording, 100)
    assert len(first.time_s) == len(first.axes["x"].reference) == 100
    assert np.array_equal(first.axes["z"].effort, recording.axes["z"].effort[:100])


# The identification before the motion: on as many samples, and of no consequence.


@pytest.fixture
def looked_at(monkeypatch: pytest.MonkeyPatch) -> list[tuple[Recording, Identification]]:
    """Recordings that are identified, and what is found."""
    seen: list[tuple[Recording, Identification]] = []

    def seeing(recording: Recording, *given: object, **named: object) -> Identification:
        found = identify(recording, *given, **named)
        seen.append((recording, found))
        return found

    monkeypatch.setattr(identification_motions, "identify", seeing)
    return seen


def test_a_run_rehearses_on_as_many_samples_as_it_captures(
    looked_at: list[tuple[Recording, Identification]], tmp_path: Path
) -> None:
    board = Board.connect(VirtualBoard())
    commission(board, brief_drive(), None, Plan(write=False), tmp_path, Silent())
    (rehearsed, _), (captured, _) = looked_at[:2]
    assert rehearsed.source == "rehearsal"
    assert captured.source != "rehearsal"
    np.testing.assert_allclose(rehearsed.time_s, captured.time_s)


def test_everything_that_follows_a_motion_is_rehearsed_the_network_too(
    looked_at: list[tuple[Recording, Identification]], tmp_path: Path
) -> None:
    drive, board = load_drive(), Board.connect(VirtualBoard())
    study = Study(Plan(), board, drive, load_network(), tmp_path, Silent())
    identification_motions.rehearse(study, named_trajectory(drive, "sinusoid", None))
    [(_, found)] = looked_at
    assert all(axis.network is not None for axis in found.axes.values())


def test_a_motion_that_tells_nothing_is_not_refused_by_its_rehearsal(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """The recording may be better, and says itself what it lacks."""

    def refused(*_: object, **__: object) -> Identification:
        raise DataError("only 3 independent samples show the axis in motion", "move longer")

    drive, board = load_drive(), Board.connect(VirtualBoard())
    study = Study(Plan(), board, drive, None, tmp_path, Silent())
    monkeypatch.setattr(identification_motions, "identify", refused)
    identification_motions.rehearse(study, named_trajectory(drive, "sinusoid", None))


# A long computation beside a board ends when time is up, or with Ctrl-C.


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
