"""Charts over position, speed, distance and frequency: where a model is wrong, and what fits."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.diagnosis.present.document import (
    acceleration_at,
    correlation_ratio,
    groups,
    running_time,
)
from edge_ident.diagnosis.result import AxisDiagnosis, Cause
from edge_ident.model.effects import named
from edge_ident.report.page.chart import Chart, Layer
from edge_ident.report.page.paths import PER_BIN, means
from edge_ident.report.page.scale import Scale, across, around
from edge_ident.report.page.time_charts import models, noise_band, reach
from edge_ident.report.page.wording import digits, effort_word, unit_text
from edge_ident.signals.metrics import quantile
from edge_ident.support.words import spoken

Array = NDArray[np.float64]
Axes = Mapping[str, AxisDiagnosis]

_FOLLOWS: Final = 0.1
"""Share of the variance from which a signal is said to follow a quantity."""
_OF_A_FORMULA: Final = 4
"""Samples of a bin of a contribution, which has no noise to average."""


@dataclass(frozen=True)
class Quantity:
    """What a residual is drawn over: its name, unit and values at all samples."""

    name: str
    unit: str
    values: Array
    both_ways: bool = True


def quantities(name: str, axes: Axes) -> dict[str, Quantity]:
    """What a residual is drawn over, by the names of `groups`."""
    axis, traces = axes[name], axes[name].traces
    unit = axis.model.position_unit
    return {
        "position": Quantity("position", unit, traces.position),
        "velocity": Quantity("velocity", f"{unit}/s", traces.velocity),
        "distance_since_reversal": Quantity(
            "distance since the axis turned back", unit, traces.since_reversal
        ),
        "time": Quantity("time", "s", running_time(traces), both_ways=False),
    } | {
        f"acceleration_of_{other}": Quantity(
            f"acceleration of axis {other}",
            f"{its.model.position_unit}/s²",
            acceleration_at(traces, its.traces),
        )
        for other, its in axes.items()
        if other != name
    }


def followed(name: str, axes: Axes, signal: Array) -> str | None:
    """The quantity that explains most of a signal's variance; None where none explains enough."""
    valid = axes[name].traces.valid
    shares = {
        of: correlation_ratio(signal[valid], group) for of, group in groups(name, axes).items()
    }
    best = max(shares, key=lambda of: shares[of])
    return best if shares[best] >= _FOLLOWS else None


def cause_chart(key: str, name: str, axes: Axes, cause: Cause) -> Chart:
    """What is left without a cause, and what the cause says, over what shows it best.

    A component and residual plot: Larsen and McCleary, Technometrics 14 (1972) 781.
    """
    axis, traces = axes[name], axes[name].traces
    part = traces.contributions[cause.term.effect]
    without = traces.effort - traces.extended_effort + part
    over = _best_view(name, axes, cause, part)
    valid, word = traces.valid, effort_word(axis.model.effort_unit)
    x, effect = over.values[valid], spoken(cause.term.effect)
    low, high = _most(part[valid]) if np.any(valid) else (0.0, 0.0)
    return Chart(
        key,
        f"What the cause explains: {effect}, over {over.name}",
        f"Grey dots: the {word} that the model misses without this cause. Lines: what the cause "
        f"adds, from {digits(float(low), 2)} to {digits(float(high), 2)} "
        f"{unit_text(axis.model.effort_unit)}. It makes up {digits(100 * cause.share, 2)} % of "
        f"the {word}.",
        (over.name, over.unit),
        (f"missed {word}", unit_text(axis.model.effort_unit)),
        across(x, "root" if over.name.startswith("distance") else "linear"),
        _most_of(without[valid]),
        (
            Layer("dots", "without", x, without[valid], "missed without this cause"),
            *_mean_layers(
                x, part[valid], traces.velocity[valid], over.both_ways, "cause", _OF_A_FORMULA
            ),
        ),
        caption="The formula is right where the dots scatter around the lines.",
    )


def _best_view(name: str, axes: Axes, cause: Cause, part: Array) -> Quantity:
    """Time for what is tied to time; one period for what repeats; else what explains most."""
    known = quantities(name, axes)
    if named(cause.term.effect).tied_to_time:
        return known["time"]
    period = cause.term.values.get("period")
    position = known["position"]
    if period is not None and np.ptp(position.values) > float(np.max(period)):
        folded = np.mod(position.values, float(np.max(period)))
        return Quantity("position within one repetition", position.unit, folded)
    return known[followed(name, axes, part) or "time"]


def _most_of(values: Array) -> Scale:
    """A scale that shows zero and all but the farthest values."""
    return around(np.array(_most(np.append(values, 0.0))), margin=0.15)


def _most(values: Array) -> tuple[float, float]:
    """Ends of an interval with all but the farthest values."""
    return quantile(values, 0.005), quantile(values, 0.995)


def residual_charts(key: str, name: str, axes: Axes) -> list[tuple[Chart, ...]]:
    """For each quantity, what the simple model misses, and what the model with the causes does."""
    traces = axes[name].traces
    shown = reach((traces.effort - traces.base_effort)[traces.valid])
    return [
        tuple(
            residual_map(f"{key}-{of}-{style}", axes[name], over, label, effort, shown)
            for style, label, effort in models(axes[name])
        )
        for of, over in quantities(name, axes).items()
    ]


def residual_map(
    key: str, axis: AxisDiagnosis, over: Quantity, model: str, effort: Array, shown: float
) -> Chart:
    """What a model misses, over a quantity; forward and backward apart."""
    valid, unit = axis.traces.valid, unit_text(axis.model.effort_unit)
    x, left = over.values[valid], (axis.traces.effort - effort)[valid]
    lines = _mean_layers(x, left, axis.traces.velocity[valid], over.both_ways, "mean")
    farthest = max((float(np.max(np.abs(layer.y), initial=0.0)) for layer in lines), default=0.0)
    return Chart(
        key,
        f"Error over {over.name}: {model}",
        f"Each dot is a sample. Means reach {digits(farthest, 2)} {unit} from zero; noise alone "
        f"leaves {digits(float(noise_band(axis).y[0]), 2)} {unit}.",
        (over.name, over.unit),
        ("error", unit),
        across(x, "root" if over.name.startswith("distance") else "linear"),
        Scale(-shown, shown),
        (noise_band(axis), Layer("dots", "without", x, left), *lines),
        height=180,
    )


def _mean_layers(
    x: Array, y: Array, velocity: Array, both_ways: bool, what: str, per_bin: int = PER_BIN
) -> tuple[Layer, ...]:
    """Means over bins, forward and backward apart where the direction matters."""
    if not both_ways:
        return (Layer("marks", "backward solid", *means(x, y, per_bin), what),)
    found = {
        way: means(x[moving], y[moving], per_bin)
        for way, moving in (("forward", velocity > 0.0), ("backward", velocity < 0.0))
    }
    return tuple(
        Layer("marks", way, *mean, f"{what}, {way}") for way, mean in found.items() if len(mean[0])
    )
