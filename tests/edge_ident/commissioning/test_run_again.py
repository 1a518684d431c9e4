"""A run after another one: interrupted or killed at any phase, or on a board already tuned."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from interrupted_link import PHASES, InterruptedLink, Killed

from edge_ident.commissioning import safety, verification
from edge_ident.commissioning.capture import with_lead_in
from edge_ident.commissioning.identification_motions import Plan
from edge_ident.commissioning.run import Outcome, commission
from edge_ident.commissioning.verification import compare_motions
from edge_ident.drive.description import Drive, load_drive
from edge_ident.errors import BoardError
from edge_ident.signals.recording import AxisRecord, Recording
from edge_ident.signals.recording_files import load_recording
from firmware_interface import board_session
from firmware_interface.board import Board
from firmware_interface.errors import BusyError
from firmware_interface.gains import CONSERVATIVE_GAINS, Bank
from firmware_interface.link import Link
from firmware_interface.motion import Multisine, SineComponent, Trajectory
from firmware_interface.registers import State
from firmware_interface.virtual.board import VirtualBoard
from tests.short_runs import Listening, Silent, brief_drive

ENDED = ("identification lead-in", "stage", "after commit", "before confirm")
"""Moving, with gains in no bank, in the shadow bank and in force."""
COUNT_RAD = 2 * np.pi / 8400


def run(
    link: Link,
    folder: Path,
    observer: Silent | None = None,
    drive: Drive | None = None,
    **plan: object,
) -> Outcome:
    """A new host with the built-in drive on a brief motion, unless others are given."""
    board = Board.connect(link)
    folder.mkdir(exist_ok=True)
    try:
        return commission(
            board,
            drive or brief_drive(),
            None,
            Plan(**plan),
            folder,
            observer or Silent(),  # type: ignore[arg-type]
        )
    finally:
        board.close()


@pytest.fixture
def impatient(monkeypatch: pytest.MonkeyPatch) -> None:
    """Ask the board as fast as it answers: its time goes by requests."""
    monkeypatch.setattr(board_session, "POLL_S", 0.0)
    monkeypatch.setattr(safety, "_STOP_S", 0.0)
    monkeypatch.setattr(safety, "_LEAVE_S", 0.2)


def assert_start_up_gains(gains: Bank) -> None:
    assert gains["x"].numbers() == pytest.approx(CONSERVATIVE_GAINS.numbers(), rel=1e-6)


@pytest.mark.usefixtures("impatient")
def test_a_host_interrupted_at_any_phase_leaves_the_machine_as_it_found_it(
    tmp_path: Path, thorough: bool
) -> None:
    """Each run gets as far as its predecessor and one phase further; the last gets to its end."""
    virtual = VirtualBoard()
    for phase in PHASES if thorough else ENDED:
        link = InterruptedLink(virtual, phase, KeyboardInterrupt)
        with pytest.raises(KeyboardInterrupt):
            run(link, tmp_path)
        assert link.struck, phase
        board = Board.connect(virtual)
        status = board.status()
        assert status.state is State.IDLE, phase
        assert not status.unconfirmed, phase
        assert not status.enabled, phase
        assert status.session_remaining_s == 0.0, phase
        assert_start_up_gains(board.active_gains())
    assert run(virtual, tmp_path).confirmed


@pytest.mark.usefixtures("impatient")
def test_after_a_host_that_died_at_any_phase_the_next_run_works(
    tmp_path: Path, thorough: bool
) -> None:
    """Each run gets as far as its predecessor and one phase further; the last gets to its end."""
    virtual = VirtualBoard()
    for phase in PHASES if thorough else ENDED:
        link = InterruptedLink(virtual, phase, Killed)
        with pytest.raises(Killed):
            run(link, tmp_path)
        assert link.struck, phase
    outcome = run(virtual, tmp_path)
    assert outcome.confirmed
    assert_start_up_gains(outcome.gains_before)
    assert not Board.connect(virtual).status().enabled


def test_a_place_just_inside_the_travel_is_reached_slowly_enough_to_stop_before_its_end() -> None:
    board = Board.connect(VirtualBoard())
    target_rad = board.limits()["x"].travel_rad - 1e-4
    there = {axis: Multisine((SineComponent(target_rad, 0.0, np.pi / 2),)) for axis in board.axes}
    board.enable()
    board.write_trajectory(with_lead_in(board, Trajectory(there, 0.02, lead_in_s=6.0)))
    board.arm()  # which refuses a way that leaves the travel if it is stopped


class TakenError(BusyError):
    """What another host's hold means, or a device in between says."""

    def __init__(self) -> None:
        super().__init__("busy", "wait")


@pytest.mark.parametrize(
    ("phase", "name"),
    [("identification capture", "capture"), ("verification capture", "verification")],
)
@pytest.mark.parametrize("error", [KeyboardInterrupt, TakenError])
def test_a_capture_cut_short_is_kept_and_said(
    phase: str, name: str, error: type[BaseException], tmp_path: Path
) -> None:
    virtual, observer = VirtualBoard(), Listening()
    with pytest.raises(error):
        run(InterruptedLink(virtual, phase, error), tmp_path, observer)
    kept = load_recording(tmp_path / f"{name}_partial.npz")
    assert len(kept.time_s) > 800
    assert any(f"{name}_partial.npz" in said for said in observer.said)
    assert not (tmp_path / f"{name}.npz").exists()


def test_a_whole_capture_is_saved_before_the_machine_has_come_to_rest(tmp_path: Path) -> None:
    """The board stays DRAINING and the host gives up: the samples are in hand all the same."""

    class NeverDone(VirtualBoard):
        def read(self, address: int, count: int) -> list[int]:
            if self.machine.state is State.DRAINING and (tmp_path / "capture.npz").exists():
                raise BoardError("the board does not come to rest", "look at it")
            return super().read(address, count)

    with pytest.raises(BoardError):
        run(NeverDone(), tmp_path)
    assert len(load_recording(tmp_path / "capture.npz").time_s) == 2185


# ---- a board that is tuned already


def test_on_a_tuned_board_a_run_changes_nothing_and_stores_where_that_is_asked_for(
    tmp_path: Path,
) -> None:
    virtual = VirtualBoard()
    assert run(virtual, tmp_path).confirmed
    tuned = virtual.machine.banks.active
    for store in (False, True):
        again = run(virtual, tmp_path / f"{store}", store=store)
        assert again.good
        assert again.stored is store
        assert again.change is not None
        assert again.change.unchanged
        assert "nothing changed" in again.conclusion
        assert virtual.machine.banks.active == tuned
    assert virtual.machine.banks.stored == tuned


def recorded(errors_rad: Mapping[str, np.ndarray]) -> Recording:
    """Axes that stand still but for an error."""
    return Recording(
        0.0025 * np.arange(len(errors_rad["x"])),
        {
            axis: AxisRecord(-error, np.zeros(len(error)), "rad", "N*m", np.zeros(len(error)))
            for axis, error in errors_rad.items()
        },
        "made up",
    )


def noise(rms_rad: float, seed: int, samples: int = 8742) -> np.ndarray:
    return rms_rad * np.random.default_rng(seed).standard_normal(samples)


def test_a_difference_within_what_the_motion_repeats_is_none(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Noise that lasts for a tenth of a second, as friction's does.

    One comparison in twenty is beyond two standard errors; 30 of 300 are twice as many.
    Machines that change have tests of their own.
    """
    monkeypatch.setattr(verification, "changed_share", lambda *_: 0.0)
    found = []
    for seed in range(300):
        slow = [np.repeat(noise(0.01, seed + n, 220), 40)[:8742] for n in (0, 1000)]
        compared = compare_motions(recorded({"x": slow[0]}), recorded({"x": slow[1]}), COUNT_RAD)
        found.append(compared.axes["x"])
    assert sum(of.verdict in ("equal", "in doubt") for of in found) > 270


def test_a_growth_that_may_be_chance_counts_against_the_new_gains() -> None:
    """A twentieth worse, in noise that differs from one segment to the next by a third."""
    slow = np.repeat(noise(0.01, 5, 220), 40)[:8742]
    compared = compare_motions(recorded({"x": slow}), recorded({"x": 1.05 * slow}), COUNT_RAD)
    assert compared.verdict == "worse"
    scattered = np.where(np.arange(8742) // 137 % 2, 1.3, 0.8) * slow
    doubted = compare_motions(recorded({"x": slow}), recorded({"x": scattered}), COUNT_RAD)
    assert doubted.verdict == "in doubt"
    assert not doubted.keeps


def test_worse_on_one_axis_is_worse() -> None:
    before = {"x": noise(0.01, 1), "z": noise(0.01, 2)}
    after = {"x": noise(0.001, 3), "z": noise(0.012, 4)}
    assert compare_motions(recorded(before), recorded(after), COUNT_RAD).verdict == "worse"


def test_worse_in_one_place_of_the_cycle_only_is_worse() -> None:
    """What the gains do differs along the cycle; that is no scatter."""
    after = noise(0.001, 2)
    after[4000:5500] *= 6.0
    compared = compare_motions(
        recorded({"x": noise(0.001, 1)}), recorded({"x": after}), 0.1 * COUNT_RAD
    )
    assert compared.verdict == "worse"


def test_less_than_a_twentieth_of_a_count_is_no_difference() -> None:
    before = np.full(8742, 0.5 * COUNT_RAD)
    compared = compare_motions(
        recorded({"x": before}), recorded({"x": before + 0.04 * COUNT_RAD}), COUNT_RAD
    )
    assert compared.verdict == "equal"


def test_several_cycles_are_compared_with_one() -> None:
    before = {"x": noise(0.01, 1, 5 * 8742)}
    compared = compare_motions(recorded(before), recorded({"x": noise(0.001, 2)}), COUNT_RAD)
    assert compared.verdict == "better"


# ---- the way into the motion


@pytest.mark.parametrize("start_rad", [-8.5, -6.2, 0.0, 6.2, 9.5])
@pytest.mark.parametrize("motion", ["sinusoid", "multisine", "staircase"])
def test_from_anywhere_within_the_travel_the_default_motions_are_armed(
    start_rad: float, motion: str
) -> None:
    from edge_ident.drive.motions import named_trajectory

    virtual = VirtualBoard()
    board = at(virtual, start_rad)
    wanted = named_trajectory(load_drive(), motion)  # type: ignore[arg-type]
    reachable = with_lead_in(board, wanted)
    assert reachable.lead_in_s >= wanted.lead_in_s
    board.write_trajectory(reachable)
    if motion == "staircase" and abs(start_rad) > 6.0:
        return  # it starts from there and leaves the travel: the board says so
    board.arm()
    assert board.status().state is State.ARMED


def at(virtual: VirtualBoard, position_rad: float) -> Board:
    """A board whose axes stand at a position."""
    from edge_ident.commissioning.homing import move_to

    board = Board.connect(virtual)
    if position_rad:
        move_to(board, dict.fromkeys(board.axes, position_rad), Silent(), 4.0)
    board.enable()
    return board


def test_a_lead_in_that_suffices_is_left_as_it_is() -> None:
    board = at(VirtualBoard(), 0.0)
    sine = Multisine((SineComponent(0.5, 1.0, 0.0),))
    near = Trajectory({"x": sine, "z": sine}, 2.0, 5.0)
    assert with_lead_in(board, near) == near


def test_a_motion_that_no_lead_in_reaches_says_what_to_do(monkeypatch: pytest.MonkeyPatch) -> None:
    board = at(VirtualBoard(), 1.0)
    limits = {
        axis: replace(of_axis, acceleration_rad_s2=0.0) for axis, of_axis in board.limits().items()
    }
    monkeypatch.setattr(board, "limits", lambda: limits)
    still = Multisine((SineComponent(0.0, 0.0, 0.0),))
    with pytest.raises(BoardError, match="cannot be reached") as caught:
        with_lead_in(board, Trajectory({"x": still, "z": still}, 2.0, 5.0))
    assert "edge-ident home" in caught.value.next_step
