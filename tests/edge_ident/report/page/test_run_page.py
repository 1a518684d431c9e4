"""The HTML page of a run: what was written, gains and tracking before and after."""

import hashlib
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from edge_ident.commissioning.promise import Errors, Expected, ExpectedErrors, Promise, Promised
from edge_ident.commissioning.run import Outcome
from edge_ident.commissioning.verification import GainChange, Tracking, Verification
from edge_ident.control.compensation import Unused, Used
from edge_ident.diagnosis.measures import Verdict
from edge_ident.estimation.trust import Finding
from edge_ident.report.gains import promise_document, promise_rows
from edge_ident.report.page.run_page import write_run_page
from edge_ident.signals.recording_files import save_recording
from tests.edge_ident.diagnosis import hand_made
from tests.edge_ident.report.page import hand_made_run
from tests.edge_ident.report.page.pages import Element, check_numbers, check_structure, read

Run = tuple[Outcome, dict[str, Any], Path]


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Run:
    folder = tmp_path_factory.mktemp("run")
    return *hand_made_run.run(folder), folder


def first_screen(page: Path) -> str:
    return " ".join(read(page).by_id("first-screen").text().split())


def test_the_page_says_what_was_written_and_how_the_axis_follows(run: Run) -> None:
    outcome, document, folder = run
    page = write_run_page(outcome, document, folder)
    tree = check_structure(page)
    assert len(check_numbers(tree)) > 20
    first = first_screen(page)
    fell = "The error from the path fell from 82.4 mrad to 6.05 mrad, 13.6 times smaller."
    assert f"New gains are in force. {fell}" in first.replace("\N{NO-BREAK SPACE}", " ")
    assert "read back and confirmed by a motion. They are lost without power." in first
    old, new = [row for row in tree.rows() if row[0] in ("old", "new")][:2]
    assert old[1:3] == ["82.4\N{NO-BREAK SPACE}mrad", "30.0"]
    assert new[1] == "6.05\N{NO-BREAK SPACE}mrad"
    sha = hashlib.sha256((folder / "capture.npz").read_bytes()).hexdigest()
    assert sha in tree.text("script")
    assert document["network_sha256"] in tree.text("script")
    drawn = {svg.all("title")[0].text() for svg in tree.all("svg") if svg.all("title")}
    assert "How far the axis is from its path" in drawn


@pytest.mark.parametrize(
    ("tracking", "said"),
    [
        (
            Tracking(0.0824, 0.0006, 0.001648, 0.001648),
            "1.65 mrad, 2 % of the error before, counts",
        ),
        (Tracking(0.0001, 0.0006, 3.7e-5, 3.7e-5), "mrad, what the encoder resolves, counts"),
        (
            Tracking(0.0824, 0.0006, 0.002, 0.001648),
            "The motion repeats within 2.00 mrad: a smaller",
        ),
    ],
)
def test_the_smallest_change_that_counts_says_where_it_comes_from(
    run: Run, tracking: Tracking, said: str
) -> None:
    outcome, document, folder = run
    assert outcome.change is not None
    change = replace(outcome.change, verification=Verification({"x": tracking, "z": tracking}))
    first = first_screen(write_run_page(replace(outcome, change=change), document, folder))
    assert said in first.replace("\N{NO-BREAK SPACE}", " ")


def test_a_trial_run_says_that_nothing_was_written(tmp_path: Path) -> None:
    outcome, document = hand_made_run.run(tmp_path, confirmed=False)
    page = write_run_page(outcome, document, tmp_path)
    check_numbers(check_structure(page))
    assert "Nothing was written to the board." in first_screen(page)
    assert "New gains are in force" not in first_screen(page)


def test_a_trial_run_says_what_new_gains_would_be_worth(tmp_path: Path) -> None:
    outcome, document = hand_made_run.run(tmp_path, confirmed=False)
    promise = Promise({"sinusoid": {axis: promised(0.0824, 0.0006, None) for axis in "xz"}})
    change = GainChange(False, dry_run=True, promise=promise)
    document["promise"] = promise_document(promise)
    page = write_run_page(replace(outcome, change=change), document, tmp_path)
    tree = check_structure(page)
    check_numbers(tree)
    first = first_screen(page)
    assert "error from the path from 82.4 mrad to 0.600 mrad (rms)" in first
    assert "Run it again without --dry-run" in first
    assert ["sinusoid", "x", "rms", "82.4", "0.6 (0.54 to 0.66)"] in tree.rows()
    assert "not tried" in "".join(caption.text() for caption in tree.all("caption"))


def test_data_that_contradict_themselves_say_so_and_what_next(run: Run) -> None:
    outcome, document, folder = run
    sign = Finding("effort_sign", "all negative", "multiply by -1", blocks=True, contradicts=True)
    axes = dict(outcome.identification.axes)
    axes["x"] = replace(axes["x"], findings=(sign,))
    found = replace(outcome.identification, axes=axes)
    outcome = replace(outcome, identification=found, designs={}, change=None)
    page = write_run_page(outcome, document, folder)
    first = first_screen(page)
    assert "The data of this axis contradict themselves. Nothing was written" in first
    assert "Multiply by -1." in first
    assert "The data of another contradict themselves, so nothing was written" in first


def test_a_diagnosed_axis_brings_its_causes(run: Run) -> None:
    outcome, document, folder = run
    axes = dict(outcome.identification.axes)
    axis = hand_made.axis(Verdict.EXPLAINED, hand_made.ripple())
    axes["x"] = replace(axes["x"], diagnosis=axis)
    found = replace(outcome.identification, axes=axes)
    tree = check_structure(write_run_page(replace(outcome, identification=found), document, folder))
    first = " ".join(tree.by_id("first-screen").text().split())
    assert "The diagnosis found: a force repeats with the position." in first
    assert "Motor magnets (cogging), gear teeth, a coupling or a bent screw." in first
    assert any("torque ripple" in li.text() for li in tree.all("li"))


def test_gains_that_were_rolled_back_are_not_called_new(run: Run) -> None:
    outcome, document, folder = run
    assert outcome.change is not None
    change = replace(outcome.change, confirmed=False)
    first = first_screen(write_run_page(replace(outcome, change=change), document, folder))
    assert "The new gains followed worse. The old gains are in force again." in first
    assert "Nothing that stays: the new gains were taken back." in first
    assert "Look for play or a resonance" in first


def test_a_recording_without_a_reference_shows_the_effort_instead(tmp_path: Path) -> None:
    outcome, document = hand_made_run.run(tmp_path, confirmed=False)
    recording = outcome.capture.recording
    axes = {name: replace(axis, reference=None) for name, axis in recording.axes.items()}
    save_recording(replace(recording, axes=axes), tmp_path / "capture.npz")
    tree = check_structure(write_run_page(outcome, document, tmp_path))
    assert tree.all("figure")[0].all("title")[0].text().startswith("Measured torque")


def promised(now: float, after: float, measured: float | None) -> Promised:
    def near(value: float) -> ExpectedErrors:
        expected = Expected(value, 0.9 * value, 1.1 * value)
        return ExpectedErrors(expected, expected)

    found = None if measured is None else Errors(measured, measured)
    return Promised(Errors(now, now), near(now), near(after), 1e-5, found)


def promise_of(after: float, measured: float | None) -> Promise:
    axis = promised(0.0824, after, measured)
    return Promise({motion: {"x": axis, "z": axis} for motion in ("sinusoid", "multisine")})


def with_change(run: Run, **changed: object) -> Element:
    outcome, document, folder = run
    assert outcome.change is not None
    change = replace(outcome.change, **changed)  # type: ignore[arg-type]
    page = write_run_page(replace(outcome, change=change), document, folder)
    check_numbers(check_structure(page))
    return read(page)


def test_the_page_says_what_was_promised_and_what_was_measured(run: Run) -> None:
    tree = with_change(run, promise=promise_of(0.0006, 0.000605))
    part = tree.by_id("worth")
    assert part.text() == "What was promised, and what was measured"
    row = ["multisine", "x", "rms", "82.4", "0.6 (0.54 to 0.66)", "0.694", "0.605", "yes"]
    assert row in tree.rows()
    (picture,) = [f for f in tree.all("figure") if f.attributes.get("id") == "promise"]
    said = [svg.all("title")[0].text() for svg in picture.all("svg")]
    assert len(said) == 4
    assert said[0].startswith("axis x, sinusoid: 82.4 mrad with the old gains, promised 0.540")
    assert "measured 0.605" in said[0]
    assert "◀" not in picture.all("ul")[0].text()


def test_an_error_beyond_its_interval_is_kept_up_to_the_limit_beside_it() -> None:
    """Of eight errors of right forecasts one is often above its 90 % interval."""
    rows = list(promise_rows(promise_of(0.0006, 0.00068)))
    assert rows[0] == ("sinusoid", "x", "rms", "82.4", "0.6 (0.54 to 0.66)", "0.694", "0.68", "yes")
    (axis, *_) = promise_of(0.0006, None).motions["sinusoid"].values()
    rms_alone = replace(axis, measured=Errors(0.0008, 0.00066))
    kept = [row[-1] for row in promise_rows(Promise({"sinusoid": {"x": rms_alone}}))]
    assert kept == ["no", "yes"]


def test_a_promise_that_was_not_kept_is_marked(run: Run) -> None:
    """It takes no gains back."""
    tree = with_change(run, promise=promise_of(0.0006, 0.002))
    first = " ".join(tree.by_id("first-screen").text().split())
    assert "New gains are in force." in first
    (picture,) = [f for f in tree.all("figure") if f.attributes.get("id") == "promise"]
    assert picture.all("ul")[0].text().count("◀") == 4
    assert tree.by_id("gains").text() == "What was written"


def test_a_diagnosis_that_a_motion_contradicts_is_said_at_the_top(run: Run) -> None:
    diagnosed = {"x": ("torque_ripple",), "z": ()}
    tree = with_change(run, confirmed=False, promise=promise_of(0.0006, 0.002), diagnosed=diagnosed)
    said = [p.text() for p in tree.by_id("first-screen").all("p") if ".notice" in p.kinds]
    assert len(said) == 2
    assert said[1].startswith(
        "The motion does not confirm what was found on axis x: torque ripple."
    )


@pytest.mark.parametrize(
    ("after", "why"),
    [
        (0.0820, "The axes are tuned already"),
        (0.2000, "New gains would follow worse."),
        (0.0700, "New gains promise no more than the forecast itself may be off."),
    ],
)
def test_nothing_worth_a_write_is_said_at_the_top(run: Run, after: float, why: str) -> None:
    tree = with_change(
        run, confirmed=False, unchanged=True, verification=None, promise=promise_of(after, None)
    )
    (said,) = [p.text() for p in tree.by_id("first-screen").all("p") if ".notice" in p.kinds]
    assert said.startswith(why)
    assert said.endswith("Nothing was written; the board has the gains that it had.")


def test_what_became_of_each_effect_is_said_in_sentences(run: Run) -> None:
    outcome, document, folder = run
    designs = dict(outcome.designs)
    ripple = {"ripple_cosine": (0.1, 0.0, 0.0, 0.0), "ripple_period_rad": (0.5, 1.0, 1.0, 1.0)}
    designs["x"] = replace(
        designs["x"],
        gains=replace(designs["x"].gains, **ripple),
        used=(Used("torque_ripple", "fed forward at every speed"),),
        unused=(Unused("backlash", "its size is not known well enough"),),
    )
    tree = check_structure(write_run_page(replace(outcome, designs=designs), document, folder))
    said = [item.text() for item in tree.all("li")]
    assert "Axis x, torque ripple: fed forward at every speed." in said
    assert "Axis x, backlash is not used: its size is not known well enough." in said
    assert "They make up for: torque ripple." in said
    assert ["ripple 1", "", "0.1 N·m every 0.5 rad"] in [row[:3] for row in tree.rows()]
