"""The page for a person: what is said, and figures that can be looked at."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from edge_ident.diagnosis.present import page
from edge_ident.diagnosis.present.effort_figure import effort_figure
from edge_ident.diagnosis.present.explained_variance import running_time
from edge_ident.diagnosis.present.page import write_page
from edge_ident.diagnosis.present.residual_maps import residual_maps
from edge_ident.diagnosis.present.share_figure import share_figure
from edge_ident.diagnosis.result import Diagnosis, NotTestable, Verdict
from tests.edge_ident.diagnosis import hand_made

PNG = b"\x89PNG"


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("page")
    found = hand_made.diagnosis(doubtful=True)
    found = replace(found, axes={"x": found.axes["x"]})
    write_page(found, ["monday.csv", "tuesday.csv"], folder)
    return folder


def text(folder: Path) -> str:
    return (folder / "report.md").read_text(encoding="utf-8")


def test_the_page_says_what_the_terminal_says(folder: Path) -> None:
    said = text(folder)
    assert said.startswith("# What the model gets wrong about monday.csv and tuesday.csv")
    assert "stamps stray by 0.3 sampling periods" in said
    assert "**Explained by torque ripple and asymmetric friction:" in said
    assert "| torque ripple | 31 % | 27 to 35 % | 12.0 % | cosine 0.2 ± 0.01 N\\*m<br>" in said
    assert "this motion does not distinguish it from nonlinear viscous" in said
    assert "accepted: without it the criterion is 412 units worse" in said
    assert "| relative residual, validation | 12.0 % | 4.00 % |" in said
    assert "| distance since reversal |" in said
    assert "| load dependent friction | the load is constant | two payloads |" in said


def test_every_figure_that_the_page_names_lies_beside_it(folder: Path) -> None:
    named = re.findall(r"\]\((.+?)\)", text(folder))
    assert named == ["x_effort.png", "x_residual_maps.png", "x_shares.png"]
    assert {file.name for file in folder.glob("*.png")} == set(named)
    assert all((folder / name).read_bytes().startswith(PNG) for name in named)


@pytest.fixture
def no_matplotlib(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(page, "find_spec", lambda name: None)


def test_what_would_break_a_table_does_not(tmp_path: Path, no_matplotlib: None) -> None:
    found = hand_made.diagnosis()
    odd = NotTestable("backlash", "|v| stays above 1", "a|b")
    axes = {"z": replace(found.axes["z"], not_testable=(odd,))}
    write_page(replace(found, axes=axes, validation={}), ["a.csv"], tmp_path)
    rows = [line for line in text(tmp_path).splitlines() if line.startswith("| backlash")]
    assert [row.count("|") for row in rows] == [4]


def test_without_matplotlib_the_page_comes_without_figures(
    tmp_path: Path, no_matplotlib: None
) -> None:
    write_page(hand_made.diagnosis(), ["a.csv"], tmp_path)
    assert "pip install 'edge-ident[report]'" in text(tmp_path)
    assert not list(tmp_path.glob("*.png"))


def labels(figure) -> list[str]:
    return [axes.get_xlabel() for axes in figure.axes if axes.get_xlabel()]


def test_every_quantity_has_a_map_and_its_unit() -> None:
    found = hand_made.diagnosis()
    linear = replace(found.axes["x"], model=replace(found.axes["x"].model, position_unit="m"))
    figure = residual_maps("x", {"x": linear, "z": found.axes["z"]})
    assert labels(figure)[::2] == [
        "position (m)",
        "velocity (m/s)",
        "distance since reversal (m); grey: not valid",
        "time (s)",
        "acceleration of axis z (rad/s²)",
        "frequency (Hz)",
    ]


def test_before_and_after_have_the_same_scale() -> None:
    found = hand_made.diagnosis()
    figure = residual_maps("x", found.axes)
    before, after = figure.axes[0].get_ylim(), figure.axes[1].get_ylim()
    assert before == after
    residual = found.axes["x"].traces.effort - found.axes["x"].traces.base_effort
    assert before[1] > np.quantile(np.abs(residual), 0.95)


def test_a_share_lies_on_what_is_left_without_it() -> None:
    found = hand_made.diagnosis().axes["x"]
    panel = share_figure("x", found).axes[2]  # ripple over velocity, position, time: last
    left, forward, backward = (line.get_xydata()[:, 1] for line in panel.get_lines()[:3])
    amplitude = np.hypot(*(hand_made.RIPPLE.values[part] for part in ("cosine", "sine")))
    assert max(forward.max(), backward.max()) == pytest.approx(amplitude, rel=0.01)
    assert np.std(left) == pytest.approx(np.std(np.concatenate([forward, backward])), rel=0.1)


def two_files(found: Diagnosis) -> Diagnosis:
    """The same samples as two recordings, the second of which starts its clock anew."""
    traces = found.axes["x"].traces
    half = len(traces.time_s) // 2
    second = np.arange(len(traces.time_s)) >= half
    time = np.where(second, traces.time_s - traces.time_s[half], traces.time_s)
    split = replace(traces, file=second.astype(np.intp), time_s=time)
    return replace(found, axes={"x": replace(found.axes["x"], traces=split)})


def test_several_recordings_are_drawn_one_after_the_other_with_a_gap() -> None:
    found = two_files(hand_made.diagnosis())
    traces = found.axes["x"].traces
    assert np.allclose(np.diff(running_time(traces)), hand_made.PERIOD_S)
    measured = effort_figure("x", found.axes["x"]).axes[0].get_lines()[0].get_ydata()
    assert np.isnan(measured).sum() == 1


def test_long_recordings_and_hardly_moving_axes_can_be_drawn(tmp_path: Path) -> None:
    long = hand_made.axis(Verdict.ADEQUATE, samples=20_000)
    blind = replace(long.traces, valid=np.zeros(20_000, dtype=np.bool_))
    for name, axis in {"x": long, "z": replace(long, traces=blind)}.items():
        effort_figure(name, axis).savefig(tmp_path / f"{name}.png")
        residual_maps(name, {name: axis})
    assert len(list(tmp_path.glob("*.png"))) == 2
