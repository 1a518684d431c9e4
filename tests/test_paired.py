"""Two versions on the same cases: what counts as lost, and what chance makes."""

from dataclasses import replace
from pathlib import Path

import pytest
from rich.console import Console

from tests.test_evaluation import BACKLASH, OTHER, outcome
from tools.diagnosis_benchmark.__main__ import main as benchmark
from tools.diagnosis_benchmark.outcome import Outcome
from tools.diagnosis_benchmark.tables import questions
from tools.diagnosis_benchmark.two_versions import compare_outcomes, paired_outcomes
from tools.paired import CHANCE, Paired, paired
from tools.real_machines.scores import Score
from tools.real_machines.tables import compare_scores

FIRST_RIGHT = "single: first cause right"


def changed(lost: int, won: int, *, wanted: bool | None = True) -> Paired:
    answers = {f"lost {k}": (True, False) for k in range(lost)}
    answers |= {f"won {k}": (False, True) for k in range(won)}
    return paired("?", {**answers, "both": (True, True), "no": (False, False)}, wanted=wanted)


def test_the_probability_is_that_of_a_fair_coin() -> None:
    assert changed(0, 0).p == 1.0
    assert changed(1, 0).p == 1.0
    assert changed(5, 0).p == pytest.approx(2 / 2**5)
    assert changed(1, 9).p == pytest.approx(2 * (1 + 10) / 2**10)
    assert (changed(1, 9).cases, changed(1, 9).both, changed(1, 9).neither) == (12, 1, 1)


def test_nine_of_nine_are_within_chance_and_ten_of_ten_beyond() -> None:
    assert changed(9, 0).p > CHANCE > changed(10, 0).p
    assert not changed(9, 0).is_loss
    assert changed(10, 0).is_loss
    assert not changed(0, 10).is_loss


def test_where_it_is_not_wanted_what_is_new_is_lost() -> None:
    assert changed(0, 10, wanted=False).is_loss
    assert changed(0, 1, wanted=False).lost == ("won 0",)
    assert not changed(10, 0, wanted=False).is_loss
    assert not changed(10, 0, wanted=None).is_loss
    assert changed(10, 0, wanted=None).lost == ()


def cases(*outcomes: Outcome) -> list[Outcome]:
    return [replace(o, case=f"case {k}") for k, o in enumerate(outcomes)]


RIGHT, WRONG = outcome(BACKLASH), outcome(OTHER)


def printed(old: list[Outcome], new: list[Outcome]) -> tuple[int, str]:
    console = Console(width=180)
    with console.capture() as text:
        code = compare_outcomes(old, new, console)
    return code, text.get()


def test_outcomes_are_compared_case_by_case() -> None:
    old, new = cases(RIGHT, RIGHT, WRONG, WRONG), cases(RIGHT, WRONG, RIGHT, WRONG)
    found = {row.question: row for row in paired_outcomes(old, new)}
    right = found[FIRST_RIGHT]
    assert (right.both, right.only_old, right.only_new, right.neither) == (
        1, ("case 1",), ("case 2",), 1,
    )  # fmt: skip
    assert found["single: another effect first"].lost == ("case 1",)
    assert [q.title for q in questions(old)] == [row.question for row in found.values()]


def test_a_loss_beyond_chance_ends_with_1_and_is_named() -> None:
    code, text = printed(cases(*[RIGHT] * 10), cases(*[WRONG] * 10))
    assert code == 1
    assert "lost: case 9" in text
    code, text = printed(cases(*[RIGHT] * 9), cases(*[WRONG] * 9))
    assert code == 0
    assert "lost: case 8" in text
    assert printed(cases(*[WRONG] * 10), cases(*[RIGHT] * 10))[0] == 0


def test_a_case_that_hides_something_else_is_another_case() -> None:
    old = cases(RIGHT)
    assert "1 cases in common, of 1 old and 2 new" in printed(old, cases(RIGHT, RIGHT))[1]
    for other in (replace(old[0], share=(0.03,)), replace(old[0], hidden=("warm_up",))):
        text = printed(old, [other])[1]
        assert "1 cases of the same name hide something else now" in text
        assert "lost" not in text


def test_a_diagnosis_that_fails_now_is_lost() -> None:
    failed = replace(outcome(verdict=""), failure="DataError")
    lost = {row.question for row in paired_outcomes(cases(RIGHT), cases(failed)) if row.lost}
    assert {FIRST_RIGHT, "ended with an error"} <= lost


def test_the_command_reads_two_files(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    names = []
    for name, every in (("old", RIGHT), ("new", WRONG)):
        path = tmp_path / f"{name}.jsonl"
        path.write_text("\n".join(o.line() for o in cases(*[every] * 10)), "utf-8")
        names.append(str(path))
    monkeypatch.setattr("sys.argv", ["benchmark", "compare", *names])
    assert benchmark() == 1
    assert "10 cases in common" in capsys.readouterr().out
    monkeypatch.setattr("sys.argv", ["benchmark", "compare", names[0], names[0]])
    assert benchmark() == 0


def test_scores_are_compared_axis_by_axis() -> None:
    better, harmed, same = (
        Score("pair", "x", base=0.1, extended=left) for left in (0.08, 0.103, 0.1)
    )
    unjudged = Score("pair", "x", note="too short")

    def compared(old: Score, new: Score, count: int = 10) -> tuple[int, str]:
        console = Console(width=180)
        scores = [[replace(s, axis=f"x{k}") for k in range(count)] for s in (old, new)]
        with console.capture() as text:
            code = compare_scores(*scores, console)
        return code, text.get()

    assert compared(better, same)[0] == 1
    assert compared(better, same, 9)[0] == 0
    assert compared(same, harmed)[0] == 1
    assert compared(better, unjudged)[0] == 1
    assert compared(harmed, better)[0] == 0
    text = compared(same, harmed, 1)[1]
    assert "1.03 harmed" in text
    assert "lost: pair, axis x0" in text
