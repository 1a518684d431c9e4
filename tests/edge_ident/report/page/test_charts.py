"""Charts: what is thinned out keeps its peaks, and ticks stand where their labels say."""

import re

import numpy as np
import pytest

from edge_ident.report.chart import (
    HEIGHT,
    WIDTH,
    Chart,
    Layer,
    Scale,
    around,
    dots_path,
    envelope,
    line_path,
    means,
)
from edge_ident.report.numbers import digits, with_interval
from edge_ident.report.page.rendering import picture


def points(path: str) -> list[list[tuple[int, int]]]:
    """Absolute points of each part of a path."""
    parts: list[list[tuple[int, int]]] = []
    for letter, x, y in re.findall(r"([Ml])(-?\d+) ?(-?\d+)", path):
        step = (int(x), int(y))
        if letter == "M":
            parts.append([step])
        else:
            last = parts[-1][-1]
            parts[-1].append((last[0] + step[0], last[1] + step[1]))
    return parts


def test_an_envelope_keeps_every_peak_and_the_order_of_time() -> None:
    x, y = np.linspace(0.0, 1.0, 44_000), np.random.default_rng(1).normal(0.0, 0.1, 44_000)
    y[[7, 31_234]] = 5.0, -4.0
    thin_x, thin_y = envelope(x, y, 1000)
    assert len(thin_y) <= 2000
    assert (thin_y.max(), thin_y.min()) == (5.0, -4.0)
    assert np.all(np.diff(thin_x) >= 0.0)


def test_an_envelope_breaks_only_where_a_whole_bucket_is_missing() -> None:
    x, y = np.linspace(0.0, 1.0, 1000), np.ones(1000)
    y[100:200], y[500] = np.nan, np.nan
    _, thin = envelope(x, y, 100)
    assert np.isnan(thin).sum() == 2 * 10


def test_a_path_goes_through_its_points_and_breaks_at_a_gap() -> None:
    x = np.array([0.0, 0.25, 0.5, 0.75, 1.0])
    y = np.array([0.0, 1.0, np.nan, 0.5, 0.25])
    assert points(line_path(x, y)) == [
        [(0, HEIGHT), (WIDTH // 4, 0)],
        [(3 * WIDTH // 4, HEIGHT // 2), (WIDTH, 3 * HEIGHT // 4)],
    ]


def test_a_cloud_is_thinned_out_evenly() -> None:
    many = dots_path(np.linspace(0.0, 1.0, 9000), np.full(9000, 0.5), dots=450)
    assert many.count("M") == 450


def test_means_leave_out_scarce_bins() -> None:
    x = np.concatenate([np.linspace(0.0, 1.0, 600), [50.0]])
    found, mean = means(x, 2.0 * x)
    assert found.max() <= 1.5
    np.testing.assert_allclose(mean, 2.0 * found)


@pytest.mark.parametrize(
    ("scale", "labels"),
    [
        (Scale(0.0, 10.0), ["0", "2", "4", "6", "8", "10"]),
        (Scale(-0.3, 0.3), ["−0.2", "0.0", "0.2"]),
        (Scale(0.0, 0.004), ["0", "1", "2", "3", "4"]),
        (Scale(1e-3, 1.0, "log"), ["10⁻³", "10⁻²", "10⁻¹", "10⁰"]),
    ],
)
def test_ticks_are_round_values_at_their_places(scale: Scale, labels: list[str]) -> None:
    ticks = scale.ticks(4 if scale.low < 0.0 else 5)
    assert [text for _, text in ticks] == labels
    assert all(-1e-9 <= place <= 1.0 + 1e-9 for place, _ in ticks)


def test_a_power_of_ten_moves_into_the_unit() -> None:
    assert Scale(0.0, 0.004).unit("rad") == "10⁻³ rad"
    assert Scale(0.0, 4.0).unit("rad") == "rad"


def test_a_root_scale_stretches_what_is_near_zero() -> None:
    assert Scale(0.0, 4.0, "root").fraction(np.array([1.0]))[0] == pytest.approx(0.5)


def test_a_signal_that_does_not_change_can_be_drawn() -> None:
    for scale in (around(np.zeros(5)), around(np.full(5, np.nan)), around(np.full(5, 3.0))):
        assert scale.low < scale.high
        assert scale.ticks(4)


def test_text_in_a_chart_is_text() -> None:
    line = Layer("line", "base", np.arange(3.0), np.arange(3.0), "a<b")
    scale = Scale(0.0, 2.0)
    chart = Chart("k", "<i>", "1 & 2", ("time", "s"), ("x<y", "m"), scale, scale, (line,))
    svg = picture("chart", chart)
    assert "&lt;i&gt;" in svg
    assert "1 &amp; 2" in svg
    assert "x&lt;y (m)" in svg


@pytest.mark.parametrize(
    ("value", "significant", "text"),
    [(0.0099999998, 3, "0.0100"), (136.06, 3, "136"), (-0.25, 2, "−0.25"), (0.0, 3, "0")],
)
def test_numbers_have_sensible_digits(value: float, significant: int, text: str) -> None:
    assert digits(value, significant) == text


def test_an_interval_is_written_to_the_digits_of_its_deviation() -> None:
    assert with_interval(0.42913, 0.00077) == "0.42913 (0.42762\u00a0to\u00a00.43064)"
    assert with_interval(0.42913, None) == "0.4291"
