"""Terminal, JSON and page of a run say the same, whatever became of it."""

import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Final

import pytest
from rich.console import Console

import edge_ident
from edge_ident.commissioning.run import Ending, Outcome
from edge_ident.commissioning.verification import GainChange, Tracking, Verification
from edge_ident.estimation.trust import Finding
from edge_ident.model.model import Estimate, Model, base_axis
from edge_ident.report.numbers import interval_texts, to_its_std
from edge_ident.report.page.run_page import write_run_page
from edge_ident.report.render import rendered
from edge_ident.report.run import outcome_view
from edge_ident.report.run_documents import run_document
from tests.edge_ident.report.page import hand_made_run
from tests.edge_ident.report.page.pages import read

COUNT_RAD: Final = 7.48e-4
WEAK: Final = Finding(
    "weak_inertia", "inertia is known only weakly", "accelerate more", blocks=False
)
SIGN: Final = Finding("effort_sign", "negative", "check the sign", blocks=True, contradicts=True)


def measured(before_mrad: float, after_mrad: float, **changed: float) -> Tracking:
    """Errors of one motion, which repeats within 2 % of the error before."""
    within = 0.02e-3 * before_mrad
    return Tracking(
        1e-3 * before_mrad, 1e-3 * after_mrad, within, within, count_rad=COUNT_RAD, **changed
    )


def kept(tracking: Tracking) -> Callable[[Outcome], Outcome]:
    return changed(GainChange(True, verification=Verification({"x": tracking, "z": tracking})))


def taken_back(tracking: Tracking) -> Callable[[Outcome], Outcome]:
    return changed(GainChange(False, verification=Verification({"x": tracking, "z": tracking})))


def changed(change: GainChange) -> Callable[[Outcome], Outcome]:
    return lambda outcome: replace(outcome, change=change, conclusion=change.conclusion)


def contradictory(outcome: Outcome) -> Outcome:
    found = outcome.identification
    found = replace(found, axes={**found.axes, "x": replace(found.axes["x"], findings=(SIGN,))})
    return replace(
        outcome, identification=found, designs={}, change=None, conclusion="nothing was written"
    )


def all_motions(std: float) -> Callable[[Outcome], Outcome]:
    """The first motion shows the inertia weakly, all together to `std`, relative."""

    def changed(outcome: Outcome) -> Outcome:
        found = outcome.identification
        axes = {name: replace(axis, findings=(WEAK,)) for name, axis in found.axes.items()}
        local = {
            name: base_axis(
                Estimate(1.1 * axis.estimate.parameters, std * axis.estimate.parameters)
            )
            for name, axis in axes.items()
        }
        known = replace(found, axes=axes)
        return replace(outcome, identification=known, local=Model(local))

    return changed


RUNS: Final[dict[str, tuple[Callable[[Outcome], Outcome], Ending]]] = {
    "kept": (kept(measured(82.4, 6.05)), Ending.BETTER),
    "kept, below one count": (kept(measured(82.4, 0.18)), Ending.BETTER),
    "kept, no difference": (kept(measured(82.4, 82.0)), Ending.AS_WELL),
    "worse": (taken_back(measured(6.05, 82.4)), Ending.TAKEN_BACK),
    "in doubt": (taken_back(measured(82.4, 81.0, machine_changed=0.1)), Ending.TAKEN_BACK),
    "too lively": (taken_back(measured(82.4, 6.05, liveliness=2.0)), Ending.TAKEN_BACK),
    "not worth it": (changed(GainChange(False, unchanged=True)), Ending.AS_WELL),
    "not worth it, stored": (
        lambda outcome: replace(changed(GainChange(False, unchanged=True))(outcome), stored=True),
        Ending.AS_WELL,
    ),
    "dry": (changed(GainChange(False, dry_run=True)), Ending.FORECAST),
    "contradictory data": (contradictory, Ending.CONTRADICTORY),
    "all motions": (
        lambda outcome: all_motions(0.01)(kept(measured(82.4, 6.05))(outcome)),
        Ending.BETTER,
    ),
    "all motions, weak": (
        lambda outcome: all_motions(0.2)(kept(measured(82.4, 6.05))(outcome)),
        Ending.BETTER,
    ),
}


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> tuple[Outcome, Path]:
    folder = tmp_path_factory.mktemp("run")
    return hand_made_run.run(folder)[0], folder


def terminal(outcome: Outcome) -> list[str]:
    console = Console(width=200, highlight=False)
    with console.capture() as captured:
        console.print(rendered(outcome_view(outcome)), soft_wrap=True)
    return captured.get().splitlines()


@pytest.mark.parametrize("name", RUNS)
def test_all_say_the_same(name: str, made: tuple[Outcome, Path]) -> None:
    change, ending = RUNS[name]
    outcome, folder = change(made[0]), made[1]
    document = run_document(outcome, hand_made_run.BOARD, edge_ident.load_network(), folder)
    page = read(write_run_page(outcome, document, folder))
    first = " ".join(page.by_id("first-screen").text().split()).replace("\N{NO-BREAK SPACE}", " ")
    said = terminal(outcome)

    assert outcome.answer.ending is ending
    assert document["answer"]["ending"] == ending.value
    assert document["answer"]["good"] is ending.good
    assert document["conclusion"] == outcome.conclusion
    assert said[0].startswith(f"{ending.spoken}: ")
    assert outcome.conclusion in said[0]
    assert re.search(rf"\b{ending.spoken}\b", first, re.IGNORECASE)

    whole = " ".join(page.text("script").split())
    weak = name == "all motions, weak"
    assert (WEAK.message in "\n".join(said)) is weak
    assert (WEAK.message[1:] in whole) is weak
    for axis, answer in outcome.answer.axes.items():
        in_json = document["answer"]["axes"][axis]
        inertia = in_json["parameters"]["inertia"]
        assert inertia["value"] == answer.model.estimate.parameters[0]
        shown = to_its_std(inertia["value"], inertia["std"])
        assert "The inertia is {} ± {} ".format(*shown) in first
        row = next(line for line in said if f"│ {axis} " in line and "inertia" in line)
        assert interval_texts(inertia["value"], inertia["std"])[0] in row
        assert in_json["known"] == list(answer.known)
        assert in_json["unknown"] == list(answer.unknown)
        if answer.tracking is None:
            assert "fell from" not in first
            continue
        tracking = answer.tracking
        before, after = (
            f"{1e3 * error:.3g}" for error in (tracking.before_rad, tracking.after_rad)
        )
        table = next(line for line in said if "tracking error, rms" in line)
        assert before in table
        assert after in table
        assert before in first
        if ending is Ending.BETTER:
            assert tracking.fall in said[0]
            ratio_means_something = tracking.after_rad >= tracking.count_rad
            assert ("times smaller" in first) is ratio_means_something
            assert ("times" in said[0]) is ratio_means_something
