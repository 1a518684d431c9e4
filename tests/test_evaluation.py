"""How the diagnosis is judged: pairs of recordings, scores on the other one, what counts."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from edge_ident.diagnosis.prepare.preparation import prepare_axis
from edge_ident.model.model import AxisModel, Estimate, Term, base_axis
from edge_ident.signals.recording import Recording
from edge_ident.signals.recording_files import save_recording
from tests.edge_ident.diagnosis.select.test_search_parts import recorded, rigid, swing
from tools.diagnosis_benchmark.outcome import Named, Outcome
from tools.real_machines.pairs import disturbed, halves, pairs_in
from tools.real_machines.scores import Score, lasting, residual
from tools.real_machines.tables import summary

TRUTH = base_axis(Estimate(np.array([0.5, 0.8, 1.1, 0.2]), np.zeros(4)))


def swung(noise: float = 0.0, offset: float = 0.0, push: float = 0.0) -> Recording:
    """The machine of TRUTH, with another offset or a push for a while."""
    t, x, v, a = swing(period_s=1e-3, seconds=10.0)
    effort = rigid(v, a) + offset + push * ((t > 4.0) & (t < 4.5))
    return recorded(t, x, effort, noise=noise, count=1e-7)


def left(model: AxisModel, recording: Recording) -> float:
    return residual(prepare_axis([recording], "x"), model)


def test_the_score_knows_neither_offset_nor_clock() -> None:
    assert left(TRUTH, swung()) < 0.002
    assert left(TRUTH, swung(offset=3.0)) < 0.002
    event = Term("disturbance_event", {"time": 4.0, "duration": 0.5, "level": 2.0})
    pushed = replace(TRUTH, terms=(*TRUTH.terms, event))
    assert left(lasting(prepare_axis([swung(push=2.0)], "x"), pushed), swung()) < 0.002
    assert left(TRUTH, swung(push=2.0)) > 0.05
    friction = Term("asymmetric_friction", {"difference": 0.2})
    assert left(replace(TRUTH, terms=(*TRUTH.terms, friction)), swung()) > 0.05


def test_without_a_warm_up_friction_is_what_it_was_on_average() -> None:
    warm_up = Term("warm_up", {"excess": 0.6, "time_constant": 4.0, "dry_excess": 0.0})
    cold = lasting(prepare_axis([swung()], "x"), replace(TRUTH, terms=(*TRUTH.terms, warm_up)))
    assert len(cold.terms) == 1
    average = 0.6 * 4.0 / 10.0 * (1.0 - np.exp(-10.0 / 4.0))
    assert cold.parameters == pytest.approx([0.5, 0.8 + average, 1.1, 0.2], rel=0.15)
    assert cold.parameters[[0, 3]].tolist() == TRUTH.parameters[[0, 3]].tolist()


def test_files_of_a_folder_are_paired_by_their_names(tmp_path: Path) -> None:
    for stem in ("arm_first", "arm_second", "motor", "motor_second", "lift"):
        save_recording(swung(), tmp_path / f"{stem}.csv")
    other = swung()
    axes = {name: replace(axis, effort_unit="A") for name, axis in other.axes.items()}
    save_recording(replace(other, axes=axes), tmp_path / "motor_second.csv")
    names = [pair.name for pair in pairs_in(tmp_path)]
    assert names == ["arm_first and arm_second", "lift, halves"]


def test_halves_hold_all_rows_once_and_begin_at_zero() -> None:
    whole = swung()
    pair = halves(whole, "it")
    parts = [pair.first.axes["x"].position, pair.second.axes["x"].position]
    assert np.array_equal(np.concatenate(parts), whole.axes["x"].position)
    assert pair.first.time_s[0] == pair.second.time_s[0] == 0.0


def test_copies_are_disturbed_by_the_noise_that_is_asked_for() -> None:
    whole = swung()
    *noisy, even, odd = disturbed(whole, (1, 2), 0.001)
    effort = whole.axes["x"].effort
    for copy in noisy:
        added = copy.axes["x"].effort - effort
        assert np.std(added) == pytest.approx(0.001 * np.sqrt(np.mean(effort**2)), rel=0.1)
    assert np.array_equal(even.axes["x"].effort, effort[::2])
    assert np.array_equal(odd.axes["x"].effort, effort[1::2])


def test_the_summary_counts_who_is_harmed_and_who_still_names() -> None:
    harmed = Score("a", "x", "explained", causes=("ripple",), base=0.1, extended=0.2)
    helped = Score("b", "x", "unexplained", causes=("ripple",), base=0.1, extended=0.05)
    silent = Score("c", "x", "adequate", base=0.1, extended=0.1)
    failed = Score("d", "x", note="too short")
    columns = summary([harmed, helped, silent, failed]).columns
    cells = [next(iter(column.cells)) for column in columns]
    assert cells == ["3 of 4", "1", "1", "2", "1.25", "2.00"]


def outcome(*causes: Named, share: float = 0.02, verdict: str = "explained") -> Outcome:
    return Outcome(
        "case", "single", "paper", 1.0, ("backlash",), (9.0,), (9.0,), share=(share,),
        verdict=verdict, causes=causes,
    )  # fmt: skip


BACKLASH = Named("backlash", ())
TIE = Named("presliding_hysteresis", ("backlash",))
OPEN = Named("presliding_hysteresis", ("backlash", "warm_up"))
OTHER = Named("warm_up", ())


def test_a_tie_is_not_right_but_nothing_else_is_named() -> None:
    assert outcome(BACKLASH).right
    assert outcome(BACKLASH).alone
    assert not outcome(TIE).right
    assert outcome(TIE).met
    assert outcome(TIE).alone
    assert not outcome(OPEN).met
    assert not outcome(OPEN).alone


def test_a_delay_that_a_finding_says_is_named() -> None:
    clocks = replace(outcome(verdict="unexplained"), findings=("effort_late",))
    assert not clocks.right
    delayed = replace(clocks, hidden=("time_delay",))
    assert delayed.right
    assert delayed.alone
    assert not replace(delayed, causes=(OTHER,)).alone


def test_what_is_suspected_or_minor_neither_helps_nor_harms() -> None:
    assert replace(outcome(BACKLASH), suspected=(OTHER,), minor=(OTHER,)).alone
    silent = replace(outcome(), suspected=(BACKLASH,))
    assert not silent.right
    assert silent.suspects
    assert not outcome(BACKLASH, OTHER).alone


def test_a_case_counts_from_the_tolerance_on() -> None:
    assert outcome(share=0.0101).counts
    assert not outcome(share=0.0099).counts
    assert not outcome(BACKLASH, verdict="unexplained").exact
