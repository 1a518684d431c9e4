"""Charts of a diagnosis: over time, as loops, over position, speed and frequency."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.diagnosis.measures import Traces
from edge_ident.diagnosis.result import AxisDiagnosis, Cause
from edge_ident.model.effects import named
from edge_ident.report.chart import (
    PER_BIN,
    Array,
    Chart,
    Layer,
    Scale,
    across,
    around,
    means,
    reach,
)
from edge_ident.report.numbers import digits, effort_word, unit_text
from edge_ident.signals.metrics import quantile
from edge_ident.support.words import spoken

# Charts over time: measured and modelled effort, and what the models miss.

_DETAIL: Final = 0.08  # share of the samples in the detail
_GAP: Final = 2.0  # step of the time over its usual one from which samples are missing
_FEWEST: Final = 200  # samples of the detail


def effort_chart(key: str, axis: AxisDiagnosis, part: slice = slice(None)) -> Chart:
    """Measured effort and what the models say, over all of the time or a part of it."""
    traces, unit = axis.traces, axis.model.effort_unit
    time, effort = running_time(traces)[part], broken(traces, traces.effort)[part]
    layers = [Layer("line", "measured", time, effort, "measured")]
    layers += [
        Layer("line", style, time, broken(traces, signal)[part], label)
        for style, label, signal in models(axis)
    ]
    word = effort_word(unit)
    return Chart(
        key,
        f"Measured {word} and what the model says",
        f"From {digits(float(time[0]), 3)} s to {digits(float(time[-1]), 3)} s the measured {word} "
        f"goes from {_number(np.nanmin(effort), unit)} to {_number(np.nanmax(effort), unit)}. "
        f"{_missed(axis)}",
        ("time", "s"),
        (word, unit_text(unit)),
        across(time),
        around(np.concatenate([layer.y for layer in layers])),
        tuple(layers),
    )


def residual_chart(key: str, axis: AxisDiagnosis, part: slice = slice(None)) -> Chart:
    """What both models miss over all of the time or a part of it, at the valid samples."""
    traces, unit = axis.traces, axis.model.effort_unit
    time = running_time(traces)[part]
    valid = traces.valid
    missed = {
        style: (label, broken(traces, np.where(valid, traces.effort - signal, np.nan)))
        for style, label, signal in models(axis)
    }
    height = reach(np.concatenate([signal[valid] for _, signal in missed.values()]))
    layers = [noise_band(axis)]
    layers += [
        Layer("line", f"{style} thin", time, signal[part], label)
        for style, (label, signal) in missed.items()
    ]
    return Chart(
        key,
        "What the model misses",
        f"Difference between measured and modelled {effort_word(unit)}. {_missed(axis)} "
        f"Noise alone leaves {digits(100 * axis.noise_floor, 2)} %.",
        ("time", "s"),
        ("error of the model", unit_text(unit)),
        across(time),
        Scale(-height, height),
        tuple(layers),
        height=170,
        caption="The grey band is what noise alone leaves. Gaps are samples that do not count: the "
        "direction of motion is unknown there, or the encoder's steps are too coarse.",
    )


def busiest(axis: AxisDiagnosis) -> slice:
    """The part of the time in which the models differ most, or the effort is largest."""
    traces = axis.traces
    changed = traces.extended_effort if axis.extends_base else traces.effort
    samples = len(changed)
    width = min(samples - 1, max(_FEWEST, round(_DETAIL * samples)))
    energy = np.cumsum(np.where(traces.valid, changed - traces.base_effort, 0.0) ** 2)
    first = int(np.argmax(energy[width:] - energy[:-width]))
    return slice(first, first + width)


def models(axis: AxisDiagnosis) -> list[tuple[str, str, Array]]:
    """Style, label and prediction of each model."""
    base = ("base", "simple model", axis.traces.base_effort)
    extended = ("extended", "model with the causes", axis.traces.extended_effort)
    return [base, extended] if axis.extends_base else [base]


def noise_band(axis: AxisDiagnosis) -> Layer:
    """One standard deviation of the noise floor to either side of zero."""
    effort = axis.traces.effort[axis.traces.valid]
    rms = axis.noise_floor * float(np.sqrt(np.mean(effort**2))) if len(effort) else 0.0
    return Layer("band", "noise", np.zeros(2), np.array([rms, -rms]), "noise alone")


def broken(traces: Traces, signal: Array) -> Array:
    """A signal whose line breaks between recordings, and where samples are missing."""
    steps_s = np.diff(traces.time_s)
    ends = (np.diff(traces.file) != 0) | (steps_s > _GAP * np.median(steps_s))
    return np.where(np.append(False, ends), np.nan, signal)


def _missed(axis: AxisDiagnosis) -> str:
    missed = f"The simple model misses {digits(100 * axis.base.fitted, 2)} % of it (rms)"
    if not axis.extends_base:
        return f"{missed}."
    return f"{missed}, the model with the causes {digits(100 * axis.extended.fitted, 2)} %."


def _number(value: float, unit: str) -> str:
    return f"{digits(float(value), 3)} {unit_text(unit)}"


# A cause that shows where the axis turns back, as a loop of effort against position.


def loop_chart(key: str, axis: AxisDiagnosis, cause: Cause) -> Chart | None:
    """Effort against position, once to and fro: where the cause acts most.

    None where the recording has no two reversals one after the other.
    """
    traces = axis.traces
    part = traces.contributions[cause.term.effect]
    way = _to_and_fro(traces, part)
    if way is None:
        return None
    position, word = traces.position[way], effort_word(axis.model.effort_unit)
    layers = [Layer("line", "measured", position, traces.effort[way], "measured")]
    layers += [
        Layer("line", style, position, signal[way], label) for style, label, signal in models(axis)
    ]
    unit, acts = unit_text(axis.model.effort_unit), part[way]
    return Chart(
        key,
        f"{word.capitalize()} against position, once to and fro",
        f"The cause, {spoken(cause.term.effect)}, adds from {digits(float(np.min(acts)), 2)} to "
        f"{digits(float(np.max(acts)), 2)} {unit} here. It makes up "
        f"{digits(100 * cause.share, 2)} % of the {word}.",
        ("position", axis.model.position_unit),
        (word, unit),
        across(position),
        around(np.concatenate([layer.y for layer in layers])),
        tuple(layers),
        caption="The axis goes round the loop once. The cause shows at its ends, where the axis "
        "turns back: there the simple model leaves the measured line.",
    )


def _to_and_fro(traces: Traces, part: Array) -> slice | None:
    """From a reversal to the next but one, in one recording, where a contribution is largest."""
    turns = np.flatnonzero(np.diff(np.sign(traces.velocity)) != 0) + 1
    energy = np.append(0.0, np.cumsum(part**2))
    best, found = 0.0, None
    for first, last in zip(turns[:-2], turns[2:], strict=True):
        whole = traces.file[first] == traces.file[last]
        # a long way with the cause at both ends counts more than a small one
        size = (energy[last] - energy[first]) * np.ptp(traces.position[first : last + 1])
        if whole and last - first >= 8 and size > best:
            best, found = size, slice(int(first), int(last) + 1)
    return found


# Charts over position, speed, distance and frequency: where a model is wrong, and what fits.

Axes = Mapping[str, AxisDiagnosis]

_FOLLOWS: Final = 0.1  # share of the variance from which a signal is said to follow a quantity
_OF_A_FORMULA: Final = 4  # samples of a bin of a contribution, which has no noise to average


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


# Chart over frequency: effort and what the model misses, as amplitude densities.


_SEGMENTS: Final = 8  # fewest segments over which a spectrum is averaged
# Highest frequency, over the bandwidth. Samples are 2.5 per period of the bandwidth at least, so
# their spectrum ends at 1.25 times the bandwidth or above.
_BAND: Final = 1.5


def spectrum_chart(key: str, axis: AxisDiagnosis) -> Chart:
    """Densities of the effort and of both residuals, up to 1.5 times the bandwidth."""
    traces, unit = axis.traces, unit_text(axis.model.effort_unit)
    word = effort_word(axis.model.effort_unit)
    signals = [("measured", f"measured {word}", traces.effort)]
    signals += [
        (style, f"error, {label}", traces.effort - effort) for style, label, effort in models(axis)
    ]
    layers = []
    for style, label, signal in signals:
        frequency, density = _density(traces, signal)
        seen = (frequency > 0.0) & (frequency <= _BAND * axis.cutoff_hz) & (density > 0.0)
        layers.append(Layer("line", style, frequency[seen], density[seen], label))
    edge = np.array([axis.cutoff_hz])
    layers.append(Layer("bound", "edge", edge, edge, "end of the compared band"))
    every = np.concatenate([layer.y for layer in layers[:-1]])
    last = layers[len(signals) - 1]
    peak = float(last.x[np.argmax(last.y)]) if len(last.x) else 0.0
    return Chart(
        key,
        "Over frequency",
        f"What is left is largest near {digits(peak, 2)} Hz. Compared up to "
        f"{digits(axis.cutoff_hz, 3)} Hz.",
        ("frequency", "Hz"),
        ("density", f"{unit}/√Hz"),
        across(np.append(layers[0].x, 0.0)),
        Scale(float(np.min(every)), 1.5 * float(np.max(every)), "log"),
        tuple(layers),
        height=200,
        caption="A narrow peak is a resonance or a vibration in time.",
    )


def _density(traces: Traces, signal: Array) -> tuple[Array, Array]:
    """Frequencies in Hz, and the square root of the power density (Welch 1967)."""
    from scipy.signal import welch  # the page of a run does without

    period_s = quantile(np.diff(traces.time_s), 0.5)
    length = max(16, 2 * len(signal) // _SEGMENTS)
    frequency, power = welch(signal, 1.0 / period_s, nperseg=min(length, len(signal)))
    return frequency, np.sqrt(power)


# How much of a residual's variance each quantity explains.

_BINS: Final = 40
"""Most bins of a quantity, in each direction."""
_PER_BIN: Final = 20
"""Fewest samples of a bin, of both directions."""
_TIME_BINS: Final = 10
"""Few, so that time does not stand for whatever changes slowly."""


def explained_variance(
    name: str, diagnosed: Mapping[str, AxisDiagnosis]
) -> dict[str, dict[str, float]]:
    """Variance of the residual that each quantity explains, as a share (correlation ratio).

    Pearson's correlation ratio η², adjusted for the number of bins: zero where the quantity
    explains nothing, one where it explains all. Each direction of motion has its own bins, except
    for time. Quantities that move together explain the same share.

    Parameters
    ----------
    name : str
        Of the axis.
    diagnosed : mapping of axis name to AxisDiagnosis
        All axes.

    Returns
    -------
    dict
        By "base" and "extended", then by quantity.
    """
    traces, valid = diagnosed[name].traces, diagnosed[name].traces.valid
    residuals = {"base": traces.base_effort, "extended": traces.extended_effort}
    by = groups(name, diagnosed)
    return {
        model: {
            of: correlation_ratio((traces.effort - effort)[valid], group)
            for of, group in by.items()
        }
        for model, effort in residuals.items()
    }


def groups(name: str, diagnosed: Mapping[str, AxisDiagnosis]) -> dict[str, NDArray[np.intp]]:
    """Numbers of bins of the valid samples, by quantity; each direction has its own, time not."""
    traces = diagnosed[name].traces
    valid, forward = traces.valid, (traces.velocity > 0.0)[traces.valid]
    quantities = {
        "position": traces.position,
        "velocity": traces.velocity,
        "distance_since_reversal": traces.since_reversal,
    } | {
        f"acceleration_of_{other}": acceleration_at(traces, diagnosed[other].traces)
        for other in diagnosed
        if other != name
    }
    bins = min(_BINS, len(forward) // _PER_BIN)
    found = {of: 2 * _bins(values[valid], bins) + forward for of, values in quantities.items()}
    return found | {"time": _bins(running_time(traces)[valid], _TIME_BINS)}


def acceleration_at(traces: Traces, other: Traces) -> Array:
    """Acceleration (N,) of another axis at this axis's times, recording by recording; 0 where it
    rests."""
    found = np.zeros_like(traces.time_s)
    for number in np.intersect1d(traces.recording, other.recording):
        here, there = traces.recording == number, other.recording == number
        found[here] = np.interp(traces.time_s[here], other.time_s[there], other.acceleration[there])
    return found


def running_time(traces: Traces) -> Array:
    """Seconds (N,) since the first sample, one recording after the other."""
    steps = np.diff(traces.time_s, prepend=traces.time_s[0])
    first = np.flatnonzero(np.diff(traces.file)) + 1
    steps[first] = np.median(steps)
    return np.asarray(np.cumsum(steps))


def correlation_ratio(residual: Array, group: NDArray[np.intp]) -> float:
    """Share of the variance between groups of samples, adjusted for their number."""
    _, index, count = np.unique(group, return_inverse=True, return_counts=True)
    free = len(residual) - len(count)
    if free <= 0 or np.ptp(residual) == 0.0:
        return 0.0
    means = np.bincount(index, weights=residual) / count
    within = float(np.sum((residual - means[index]) ** 2)) / free
    return round(max(0.0, 1.0 - within / float(np.var(residual, ddof=1))), 4)


def _bins(values: Array, bins: int) -> NDArray[np.intp]:
    """Numbers of bins that hold equally many samples."""
    rank = np.argsort(np.argsort(values, kind="stable"), kind="stable")
    return np.asarray(rank * bins // max(len(values), 1))
