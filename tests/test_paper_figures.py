"""The paper's tables and figures: that the numbers on the page mean what it says of them."""

from pathlib import Path

import numpy as np
import pytest
import scipy.signal
from matplotlib.figure import Figure
from numpy.typing import NDArray
from PIL import Image

pytest.importorskip("torch")
pytest.importorskip("onnx")

from edge_ident.errors import DataError, ModelError
from edge_ident.estimation.manifest import BUILT_IN
from edge_ident.signals.recording import AxisRecord, Recording
from export.configuration import PAPER
from firmware_interface.plant import Recordings
from tests.edge_ident.stand_ins import COLUMNS, MOTION, SCALES, START, StandIn, nothing, reader
from tools import paper
from tools.paper_figures import convolutions, drives, images, kernels, losses, plane
from tools.paper_figures.page import Section, Sources, update

Array = NDArray[np.float64]

SIGNALS = ("position", "effort")
TRUTH = np.array([0.4, 0.9, 1.4, 0.1])


@pytest.fixture
def sources(tmp_path: Path) -> Sources:
    folder = tmp_path / "paper"
    folder.mkdir()
    written = []
    for name, stages in (("paper", ["network"]), ("improved", ["head", "network"])):
        rows = [f"{s},{n},{1.0 / n},{2.0 / n}" for s in stages for n in (1, 2, 4)]
        path = tmp_path / f"{name}.csv"
        path.write_text("\n".join(["stage,step,train,test", *rows]) + "\n")
        written.append(path)
    network = BUILT_IN.with_name("feed_drive_fp32.onnx")
    return Sources(folder, network, (written[0], written[1]))


# ---- convolutions


@pytest.mark.parametrize("layer", convolutions.LAYERS, ids=lambda layer: layer.name)
def test_every_way_to_convolve_gives_the_same_to_rounding(layer: convolutions.Layer) -> None:
    costs = convolutions.measure(layer, repetitions=1)
    assert ("rank one" in costs) == (layer.inputs == 1)
    assert max(cost.error for cost in costs.values()) < 1e-5


def test_what_they_are_compared_with_is_a_convolution() -> None:
    task = convolutions.Task.random(convolutions.Layer("small", 3, 12, 5))
    wanted = [
        sum(
            scipy.signal.correlate(image, kernel, mode="valid", method="direct")
            for image, kernel in zip(task.image, kernels, strict=True)
        )
        for kernels in task.kernels
    ]
    np.testing.assert_allclose(convolutions.im2col(task)(), wanted, rtol=1e-4, atol=1e-4)


def test_the_layers_are_the_networks() -> None:
    read = kernels.read_layers(BUILT_IN.with_name("feed_drive_fp32.onnx"))
    for layer, known in zip(convolutions.LAYERS, read, strict=True):
        assert known.kernels.shape == (convolutions.MAPS, layer.inputs, layer.kernel, layer.kernel)


# ---- kernels


def test_the_network_has_the_papers_210_kernels() -> None:
    layers = kernels.read_layers(BUILT_IN.with_name("feed_drive_fp32.onnx"))
    assert [layer.count for layer in layers] == [10, 100, 100]


@pytest.mark.parametrize(
    ("sign", "smoothing", "low"), [(1.0, 1.0, (0.8, 1.0)), (-1.0, 0.0, (0.0, 0.2))]
)
def test_a_mean_smooths_and_an_alternating_kernel_does_not(
    sign: float, smoothing: float, low: tuple[float, float]
) -> None:
    row = sign ** np.arange(5)
    layer = kernels.Layer("one", np.outer(row, row)[None, None])
    assert layer.smoothing_share == smoothing
    assert low[0] <= layer.low_share <= low[1]


def test_white_kernels_have_a_quarter_of_their_energy_in_the_lower_half() -> None:
    random = np.random.default_rng(5).normal(size=(40, 40, 5, 5))
    assert kernels.Layer("white", random).low_share == pytest.approx(0.25, abs=0.01)


def test_training_begins_with_pairs_of_opposite_kernels() -> None:
    for layer in kernels.layers_at_start():
        np.testing.assert_array_equal(layer.kernels[::2], -layer.kernels[1::2])
        assert layer.moved_from(layer) == 0.0
        opposite = kernels.Layer(layer.name, -layer.kernels)
        assert opposite.moved_from(layer) == pytest.approx(2.0)


def test_a_file_without_kernels_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(ModelError, match="no kernels"):
        kernels.read_layers(tmp_path / "missing.onnx")


# ---- images


def test_min_max_alone_hides_the_scale_of_a_guess() -> None:
    made = {(one.kind, one.guess): one.image for one in images.make_images()}
    for kind, hides in (("min-max", True), ("effort-scale", False), ("remainder", False)):
        match, twice = made[kind, "the guess matches"], made[kind, "twice the match"]
        assert np.allclose(match, twice, atol=1e-6) == hides


def test_a_matching_guess_leaves_noise_and_another_guess_its_error() -> None:
    made = {(one.kind, one.guess): one.image for one in images.make_images()}

    def smoothness(guess: str) -> float:
        row = made["remainder", guess][0]
        return float(np.corrcoef(row[1:], row[:-1])[0, 1])

    assert smoothness("the guess matches") < 0.5
    assert smoothness("another guess") > 0.9


# ---- drives


def recording() -> Recording:
    """The paper's motion under a drive that the model describes, without noise."""
    columns = np.stack(
        [MOTION.acceleration, MOTION.velocity, np.sign(MOTION.velocity), np.ones(8742)], axis=1
    )
    count = MOTION.count
    position = count * np.round(MOTION.position / count)
    axis = AxisRecord(position, columns @ TRUTH, MOTION.position_unit, MOTION.effort_unit)
    return Recording(MOTION.time_s, {"1 x": axis}, "made up")


def test_a_network_that_reads_well_scores_above_random_search() -> None:
    case = drives.identify(recording(), "1 x", TRUTH, StandIn(reader(), START))
    for method in ("network", "least squares"):
        np.testing.assert_allclose(case.found[method], TRUTH, rtol=0.02, atol=0.005)
        assert np.max(case.error(method)) < 0.01
    assert case.metric["network"].relative_residual < 0.02
    assert case.metric["random search"].relative_residual > 0.05


def test_the_networks_arm_is_the_network_alone() -> None:
    case = drives.identify(recording(), "1 x", TRUTH, StandIn(nothing, START))
    np.testing.assert_allclose(case.found["network"], case.unit * np.array(START), atol=1e-3)
    assert np.max(case.error("least squares")) < 0.01


def test_lenient_metrics_pass_more_guesses() -> None:
    case = drives.identify(recording(), "1 x", TRUTH, StandIn(nothing, START))
    passed, strictly = drives.guesses_that_pass(case)
    assert 0.0 < strictly < passed < 1.0


def test_a_network_for_another_motion_is_refused() -> None:
    still = recording()
    slow = Recording(2.0 * still.time_s, still.axes, still.source)
    with pytest.raises(DataError, match="another motion"):
        drives.identify(slow, "1 x", TRUTH, StandIn(nothing, START))


def test_two_of_the_five_drives_are_outside_as_in_the_paper() -> None:
    parameters = drives.draw_five().chain.rigid_body
    assert parameters.shape == (5, 2, 4)
    assert np.count_nonzero(np.any(np.abs(parameters) > 1.0, axis=(1, 2))) == 2


def test_errors_are_shares_of_root_two_times_the_rms_effort() -> None:
    case = drives.identify(recording(), "1 x", TRUTH, StandIn(nothing, START))
    effort = COLUMNS @ TRUTH
    np.testing.assert_allclose(case.unit, np.sqrt(2.0 * np.mean(effort**2)) / SCALES, rtol=0.01)


def test_both_axes_of_every_drive_are_tabulated_and_drawn() -> None:
    one = recording()
    both = {name: np.stack([[getattr(a, name)] * 2 for a in one.axes.values()]) for name in SIGNALS}
    made = Recordings(
        time_s=one.time_s,
        **both,
        reference=both["position"],
        effort_shift_s=np.zeros(1),
        true_angle=both["position"],
        true_velocity=both["position"],
        true_command=both["effort"],
        quiet_effort=both["effort"],
        base=np.tile(TRUTH, (1, 2, 1)),
        truth=np.tile(TRUTH, (1, 2, 1)),
    )
    cases = list(drives.identified(made, StandIn(reader(), START)))
    assert [case.name for case in cases] == ["1 x", "1 z"]
    assert drives.parameter_table(cases).count("**1.400** → 1.") == 2
    assert isinstance(drives.draw(cases), Figure)


# ---- losses


def test_losses_are_read_stage_by_stage(sources: Sources) -> None:
    curve = losses.read_curve(sources.losses[1])
    assert curve.stages == ("head",) * 3 + ("network",) * 3
    np.testing.assert_array_equal(curve.of("network").test, [2.0, 1.0, 0.5])


@pytest.mark.parametrize("content", [None, "", "stage,step,train,test\n", "stage,step\na,1\n"])
def test_missing_losses_are_an_error_that_says_what_to_do(
    tmp_path: Path, content: str | None
) -> None:
    path = tmp_path / "losses.csv"
    if content is not None:
        path.write_text(content)
    with pytest.raises(DataError, match="losses") as raised:
        losses.read_curve(path)
    assert "--losses" in raised.value.next_step


def test_no_constant_answer_has_a_smaller_loss() -> None:
    loss = losses.constant_loss(PAPER)
    # sigmoids lie in (0, 1), so that their variance is below 1/4
    assert 0.0 < loss < 0.5 * 4 * 0.25
    assert losses.constant_loss(PAPER) == loss


# ---- plane


def test_the_path_is_measured_at_the_tables() -> None:
    turn = np.linspace(0.0, 2.0 * np.pi, 400)
    x, z = 2.0 * np.pi * np.sin(turn), 2.0 * np.pi * np.cos(turn)
    axes = {
        "x": AxisRecord(1.01 * x, x, "rad", "N*m", reference=x),
        "z": AxisRecord(1.01 * z, z, "rad", "N*m", reference=z),
    }
    path = plane.path_of(Recording(turn, axes, "made up"), "some gains")
    np.testing.assert_allclose(np.hypot(*path.commanded), 4e-3, rtol=1e-3)  # 4 mm a turn
    np.testing.assert_allclose(path.error, 4e-5, rtol=1e-3)
    np.testing.assert_allclose(path.radial, path.error)
    # a hundredth of the radius, shown as an eighth of it
    assert path.magnification == 10.0
    assert isinstance(plane.draw([path, path]), Figure)


# ---- page


def test_sections_write_pictures_that_the_page_shows(sources: Sources) -> None:
    for make in (images.section, kernels.section, losses.section):
        text = str(make(sources))
        name = make.__module__.rsplit(".", 1)[-1]
        assert f"(paper/{name}.png)" in text
        picture = sources.pictures / f"{name}.png"
        assert picture.stat().st_size < 150_000
        with Image.open(picture) as opened:
            assert len(opened.getcolors()) > 10


def test_a_section_is_replaced_alone_and_in_its_place(tmp_path: Path) -> None:
    page, order = tmp_path / "page.md", ["one", "two", "three"]

    def section(text: str) -> Section:
        return Section("Title", "This.", f"{text}\n\n| a |\n| --- |", "Nothing.")

    update(page, {"three": section("last"), "one": section("first")}, order)
    before = page.read_text()
    assert before.index("first") < before.index("last")
    update(page, {"two": section("middle")}, order)
    after = page.read_text()
    assert after.index("first") < after.index("middle") < after.index("last")
    update(page, {"two": section("other")}, order)
    assert page.read_text() == after.replace("middle", "other")
    update(page, {}, order)
    assert page.read_text() == after.replace("middle", "other")


def test_what_cannot_be_made_is_named_and_left_as_it_was(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    page, missing = tmp_path / "page.md", str(tmp_path / "missing.csv")
    update(page, {"losses": Section("Losses", "This.", "As it was.", "Nothing.")}, ["losses"])
    before = page.read_text()
    given = ["paper.py", "--only", "losses", "--losses", missing, missing, "--page", str(page)]
    monkeypatch.setattr("sys.argv", given)
    assert paper.main() == 1
    assert page.read_text() == before
    said = capsys.readouterr().err
    assert missing in said
    assert "train with that configuration" in said
