"""The answer that stands first: trust, gains, model, next step."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

import edge_ident
from edge_ident.commissioning.run import Outcome
from edge_ident.commissioning.verification import GainChange, Tracking, Verification
from edge_ident.diagnosis.measures import Verdict
from edge_ident.diagnosis.result import OutsideVibration
from edge_ident.estimation.trust import Finding
from edge_ident.identification.result import Identification
from edge_ident.report.diagnosis import diagnosis_answer
from edge_ident.report.gains import GainReport, gain_report_view
from edge_ident.report.identification import identification_answer
from edge_ident.report.numbers import interval_texts
from edge_ident.report.render import rendered
from edge_ident.report.run import outcome_view
from edge_ident.report.view import Parts
from tests.edge_ident.diagnosis import hand_made
from tests.edge_ident.report.page import hand_made_run

WORSE = Tracking(0.001, 0.1, 0.0001, 0.0001)
POOR = Finding("poor_fit", "the model leaves 20% of the effort", "check the units", blocks=True)


def lines(view: Parts) -> list[str]:
    console = Console(width=200, highlight=False)
    with console.capture() as captured:
        console.print(rendered(view), soft_wrap=True)
    return captured.get().splitlines()


def block(view: Parts) -> list[str]:
    """The lines before the first table."""
    shown = lines(view)
    return shown[: shown.index("parameters")]


@pytest.fixture(scope="module")
def outcome(tmp_path_factory: pytest.TempPathFactory) -> Outcome:
    return hand_made_run.run(tmp_path_factory.mktemp("run"))[0]


@pytest.fixture(scope="module")
def identified(outcome: Outcome) -> Identification:
    return outcome.identification


def doubted(found: Identification, axis: str) -> Identification:
    return replace(found, axes={**found.axes, axis: replace(found.axes[axis], findings=(POOR,))})


def test_a_run_tells_both_verdicts_model_and_next_step_in_four_lines(outcome: Outcome) -> None:
    better, known, model, step = block(outcome_view(outcome))
    assert better == "better: new gains confirmed"
    assert known == "known: every parameter of x and z"
    assert model.startswith("model: rigid body and friction are enough on axes x and z, compared")
    assert step.startswith("next: keep the new gains over a power cycle: edge-ident gains store")


def test_the_table_of_gains_leaves_out_what_stays(outcome: Outcome) -> None:
    shown = lines(outcome_view(outcome))
    text = "\n".join(shown[shown.index("gains, in N·m, rad and s; the new ones are in force") :])
    assert "inertia feedforward" in text
    assert "stribeck" not in text
    assert "│ tracking error, rms (mrad) │   82.4 │" in text


def test_a_trial_run_says_that_nothing_was_written(tmp_path: Path) -> None:
    dry, _ = hand_made_run.run(tmp_path, confirmed=False)
    shown = lines(outcome_view(dry))
    assert "gains, in N·m, rad and s; the new ones were not written" in shown
    assert "next: run it again without --dry-run to write these gains" in shown


def test_data_that_contradict_themselves_stand_first_and_what_to_do_last(outcome: Outcome) -> None:
    sign = Finding("effort_sign", "negative", "check the sign", blocks=True, contradicts=True)
    found = outcome.identification
    found = replace(found, axes={**found.axes, "z": replace(found.axes["z"], findings=(sign,))})
    nothing = replace(outcome, identification=found, designs={}, change=None, conclusion="so it is")
    shown = block(outcome_view(nothing))
    assert shown[0] == "nothing written: so it is"
    assert shown[1] == "parameters: axis x, every parameter is known"
    assert shown[2].startswith("parameters: axis z, not known: inertia, viscous friction")
    assert shown[-1] == "next: check the sign"


@pytest.mark.parametrize("diagnosed", [{}, {"x": ("backlash",)}])
def test_gains_that_were_taken_back_say_so_first(
    diagnosed: dict[str, tuple[str, ...]], outcome: Outcome
) -> None:
    change = GainChange(
        False, verification=Verification({"x": WORSE, "z": WORSE}), diagnosed=diagnosed
    )
    shown = lines(outcome_view(replace(outcome, change=change, conclusion=change.conclusion)))
    assert shown[0].startswith("taken back: new gains increased the tracking error")
    assert ("does not confirm the diagnosis (axis x: backlash)" in shown[0]) is bool(diagnosed)
    assert shown[1] == "known: every parameter of x and z"
    assert f"next: {change.next_step}" in shown
    assert "gains, in N·m, rad and s; the new ones were rolled back" in shown


def test_details_follow_the_answer_and_drop_nothing(outcome: Outcome) -> None:
    short, long = (lines(outcome_view(outcome, details=details)) for details in (False, True))
    assert len(short) < 40 < len(long)
    assert long[:25] == short[:25]
    text = "\n".join(long)
    for what in ("least squares (used)", "time-spectral", "bandwidth (rad/s)", "no change below"):
        assert what in text
        assert what not in "\n".join(short)


def test_each_remark_is_said_once_for_all_axes(identified: Identification) -> None:
    shown = [line for line in lines(identification_answer(identified)) if "standstill" in line]
    assert len(shown) <= 1
    assert all("likewise on z. Next: " in line for line in shown)


def test_an_identification_ends_with_what_to_do(identified: Identification) -> None:
    assert block(identification_answer(identified))[-1].startswith(
        "next: design gains from this recording: edge-ident gains"
    )
    assert block(identification_answer(doubted(identified, "x")))[-1] == "next: check the units"


def test_what_became_of_committed_gains_stands_before_the_tables(outcome: Outcome) -> None:
    change = GainChange(False, verification=Verification({"x": WORSE, "z": WORSE}))
    report = GainReport(4711, outcome.gains_before, outcome.gains_before, change=change)
    first, second, *tables = lines(gain_report_view(report))
    assert first == f"gains: {change.conclusion}"
    assert second == f"next: {change.next_step}"
    assert tables[0].startswith("board 4711, axis x: gains")


def test_what_is_not_told_apart_is_said_once_of_two_causes_alike() -> None:
    found = hand_made.diagnosis()
    axis = found.axes["x"]
    (cause,) = (c for c in axis.causes if c.inseparable)
    twice = replace(found, axes={"x": replace(axis, causes=(cause, cause))})
    said = "\n".join(block(diagnosis_answer(twice)))
    assert said.count("do not tell asymmetric friction") == 1


def test_a_diagnosis_tells_causes_validation_and_where_to_look() -> None:
    found = hand_made.diagnosis(unexplained=True)
    shown = block(diagnosis_answer(found))
    assert shown[0].startswith("axis x explained by torque ripple and asymmetric friction")
    assert "  the recordings do not tell asymmetric friction from nonlinear viscous" in shown
    assert any(line.startswith("on the recording for validation: axis x") for line in shown)
    assert any(line.startswith("next: on axis x, look at: motor magnets") for line in shown)
    assert "torque ripple: period" in "\n".join(lines(diagnosis_answer(found)))


def test_what_forbids_a_cause_is_said_with_its_reason() -> None:
    found = hand_made.diagnosis(unexplained=True)
    axis = replace(found.axes["x"], verdict=Verdict.UNEXPLAINED, causes=(), findings=(POOR,))
    shown = block(diagnosis_answer(replace(found, axes={"x": axis})))
    assert f"no cause is named: axis x, poor_fit: {POOR.message}" in shown
    assert [line for line in shown if line.startswith("next: ")] == ["next: check the units"]


def test_what_another_recording_alone_contradicts_says_so() -> None:
    found = hand_made.diagnosis(unexplained=True)
    axis = replace(found.axes["x"], verdict=Verdict.UNEXPLAINED, causes=(), findings=(), lines=())
    axis = replace(axis, extended=replace(axis.extended, fitted=axis.noise_floor))
    *said, step = block(diagnosis_answer(replace(found, axes={"x": axis})))
    assert "  what is left here is noise, but not what is left of the other recording" in said
    assert step.startswith("next: diagnose both recordings together")
    shaken = replace(axis, external_vibrations=(OutsideVibration(3.0, 0.1, "a.csv"),))
    *said, step = block(diagnosis_answer(replace(found, axes={"x": shaken})))
    assert not any("the other recording" in line for line in said)
    assert any(line.startswith("  an external vibration acts on it") for line in said)
    assert not step.startswith("next: diagnose both")


def test_a_sound_machine_needs_nothing() -> None:
    shown = block(diagnosis_answer(edge_ident.diagnose([edge_ident.simulate()])))
    assert shown[-1] == "next: nothing to repair; keep this recording, to compare with later ones"


@pytest.mark.parametrize(
    ("value", "std", "texts"),
    [
        (0.4285, 0.003, ("0.4285", "0.4226", "0.4344")),
        (1234.5, 150.0, ("1234", "940", "1528")),
        (0.3, None, None),
        (0.3, np.inf, None),
        (1e-12, 1e-14, None),
    ],
)
def test_an_interval_has_the_digits_that_its_deviation_leaves(
    value: float, std: float | None, texts: tuple[str, str, str] | None
) -> None:
    assert interval_texts(value, std) == texts
