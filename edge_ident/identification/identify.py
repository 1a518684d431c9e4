"""From a recording to parameters: the base model where it is enough, else the diagnosis' model.

Network and least squares estimate side by side. Whether the base model is adequate is asked first;
where it is not, the axis is diagnosed, and the parameters of the extended model are the answer.
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property, partial
from os import PathLike
from typing import TYPE_CHECKING, Final, Protocol

import numpy as np

from edge_ident.diagnosis.measures import Verdict
from edge_ident.diagnosis.prepare.bandwidth import white_noise
from edge_ident.errors import DataError
from edge_ident.estimation import least_squares
from edge_ident.estimation.compensated import CompensatedAxis
from edge_ident.estimation.compensation import compensate_effects
from edge_ident.estimation.image import Subsampled, align
from edge_ident.estimation.least_squares import EstimationPart
from edge_ident.estimation.network import Network, given_network
from edge_ident.estimation.network_estimate import estimate_together, motion_mismatch
from edge_ident.identification.adequacy import Adequacy, ComparedSignals, judge
from edge_ident.identification.answer import AxisEstimates, answer
from edge_ident.identification.result import Identification
from edge_ident.model.model import Estimate, Model
from edge_ident.model.motion import EVEN_SHIFT, LARGEST_SHIFT, NO_SHIFT, Array, Timing
from edge_ident.signals import conditioning, data_checks, metrics, recording_files
from edge_ident.signals.filters import LONG, any_of, decimate, kept, parts_of
from edge_ident.signals.recording import AxisRecord, Recording, Sampling
from edge_ident.signals.time_stamps import EvenGrid, with_mended_stamps
from edge_ident.signals.timing import smallest_at, within_limits
from edge_ident.support.stopwatch import Stopwatch

if TYPE_CHECKING:
    from edge_ident.diagnosis.result import AxisDiagnosis
    from edge_ident.model.model_files import GivenModel


Progress = Callable[[str, int, int], None]


def identify(
    recording: "recording_files.Given | Iterable[recording_files.Given]",
    network: Network | str | PathLike[str] | None = None,
    *,
    model: "GivenModel | None" = None,
    seed: int = 0,
    diagnose: bool = True,
    diagnosed: "Mapping[str, AxisDiagnosis] | None" = None,
    on_progress: Progress = lambda stage, done, of: None,
    stopwatch: Stopwatch | None = None,
) -> Identification:
    """Identify the parameters of every axis of a recording.

    Parameters
    ----------
    recording : Recording, str, Path or data frame
        One recording, or what `load_recording` makes one of.
    network : Network, str, Path or None
        Without one, least squares alone; a path is that of its ONNX file.
    model : Model, result with a model, str or Path, optional
        The effort is compensated for its effects before the base parameters are estimated.
    seed : int
        Of the network's random starting points.
    diagnose : bool
        Whether axes whose base model is inadequate are diagnosed; this takes seconds.
    diagnosed : mapping of axis name to AxisDiagnosis, optional
        Diagnoses that are there already, of this recording with others of the same machine.
    on_progress : callable
        Gets the stage of the diagnosis, and how many of its parts are done and there are: axes,
        runs on disturbed data, simulated motions.
    stopwatch : Stopwatch, optional
        Continued if given, so that the caller's stages are reported too.

    Returns
    -------
    Identification

    Raises
    ------
    DataError
        Hardly any sample shows an axis in motion.
    ModelError
        The model does not fit the recording.

    Examples
    --------
    >>> import edge_ident
    >>> found = edge_ident.identify(edge_ident.simulate())
    >>> found.trusted
    True
    >>> inertia, viscous, coulomb, offset = found.axes["x"].estimate.parameters
    >>> round(float(inertia), 2), found.axes["x"].units[0]
    (0.43, 'kg*m^2')
    """
    recording, model = _given(recording, model)
    network = None if network is None else given_network(network)
    data_checks.check_usable(recording)
    watch = stopwatch or Stopwatch()
    with watch.stage("signals"):
        recording = with_mended_stamps(recording)
        needed = at_needed_rate(recording)
    axes = {}
    for names in _network_batches(needed):
        estimated = {name: _estimated(needed, name, network, model, watch) for name in names}
        inputs = {name: seen for name, (_, seen) in estimated.items()}
        read = run_network(inputs, network, seed, watch)
        for name in names:
            estimate, reason = read[name]
            estimates = replace(estimated.pop(name)[0], network=estimate, network_reason=reason)
            outcome: AxisDiagnosis | DataError | None = (diagnosed or {}).get(name)
            if diagnose and outcome is None and not estimates.adequacy.adequate:
                with watch.stage("diagnosis"):
                    outcome = _diagnosed(recording, name, model, on_progress)
            with watch.stage("estimate"):
                axes[name] = answer(_in_step_as_diagnosed(estimates, outcome, model), outcome)
            del estimates
    return Identification(axes, watch.timing_ms())


def _given(
    recording: "recording_files.Given | Iterable[recording_files.Given]", model: "GivenModel | None"
) -> tuple[Recording, Model | None]:
    """The recording and the model that are meant; what finds that out loads where it has to."""
    if not isinstance(recording, Recording):
        from edge_ident.signals.recording_files import given_recording

        recording = given_recording(recording, "identify")
    if model is None:
        return recording, None
    from edge_ident.model.model_files import given_model

    return recording, given_model(model)


def _network_batches(recording: Recording) -> list[list[str]]:
    """Axes that the network reads in one batch: all, unless their signals are large."""
    names = list(recording.axes)
    return [names] if len(recording.time_s) <= LONG else [[name] for name in names]


def _diagnosed(
    recording: Recording, name: str, model: Model | None, on_progress: Progress
) -> "AxisDiagnosis | DataError":
    """Diagnose an axis, or say why its recording is too short for that.

    The diagnosis needs scipy, which an adequate axis does without.
    """
    from edge_ident.diagnosis.diagnose import diagnose

    try:
        found = diagnose([recording], model=model, only=[name], on_progress=on_progress)
    except DataError as error:
        return error
    return found.axes[name]


def _estimated(
    recording: Recording, name: str, network: Network | None, model: Model | None, watch: Stopwatch
) -> tuple[AxisEstimates, Subsampled | str]:
    """What is estimated of an axis before network and diagnosis, and what the network is to read.

    In place of the latter, why no network can read this axis.
    """
    axis = recording.axes[name]
    with watch.stage("signals"):
        compensated = compensate_effects(recording, name, model)
        part = least_squares.estimation_part(compensated.signals)
    with watch.stage("adequacy"):
        found = in_step(recording, name, model, compensated)
        compensated, compared, timing = found.compensated, found.compared, found.timing
    with watch.stage("signals"):
        seen = compensated
        if network is not None and network.manifest.motion.effects:
            seen = compensate_effects(
                recording, name, None, late_s=timing.shift_s, of_motion=compensated.signals
            )
    with watch.stage("cnn"):
        subsampled = network_input(seen.signals, axis, network, watch)
    with watch.stage("estimate"):
        linear, adequacy = _fitted(compensated, part, found.adequacy)
    estimates = AxisEstimates(
        recording, name, compensated, part, linear, compared, None, "", adequacy, timing
    )
    return estimates, subsampled


def _in_step_as_diagnosed(
    estimates: AxisEstimates, outcome: "AxisDiagnosis | DataError | None", model: Model | None
) -> AxisEstimates:
    """An adequate axis with the shift that its diagnosis found, where that is another; where a
    delay is in the diagnosis' model, the shift is not asked for."""
    if outcome is None or isinstance(outcome, DataError) or outcome.verdict is not Verdict.ADEQUATE:
        return estimates
    if outcome.timing == NO_SHIFT:
        return estimates
    known, timing = estimates.compensated, outcome.timing
    apart_s = abs(timing.shift_s - estimates.timing.shift_s)
    if apart_s < SMALLEST_SHIFT * known.signals.recorded_period_s:
        return estimates
    compensated = compensate_effects(
        estimates.recording, estimates.name, model, late_s=timing.shift_s, of_motion=known.signals
    )
    compared = estimates.compared.with_effort(compensated)
    linear, adequacy = _fitted(compensated, estimates.part, judge(compared))
    return replace(
        estimates,
        compensated=compensated,
        compared=compared,
        linear=linear,
        timing=timing,
        adequacy=adequacy,
    )


def _fitted(
    axis: CompensatedAxis, part: EstimationPart, judged: Adequacy
) -> tuple[Estimate, Adequacy]:
    """Least squares on all samples, and the adequacy with what it leaves there."""
    linear = least_squares.fit(axis.signals, part)
    return linear, replace(judged, everywhere=_left(linear, axis, part))


def _left(estimate: Estimate, axis: CompensatedAxis, part: EstimationPart) -> float:
    """Relative residual of an estimate on a part of the samples, as a share of the whole effort."""
    known = axis.effects_effort[part.samples]
    modelled = part.columns.values @ estimate.parameters
    return metrics.relative_residual(axis.signals.effort[part.samples] + known, modelled + known)


# The effort of an axis in step with its motion, before anything is known but the base model.

SMALLEST_SHIFT: Final = 0.02
"""Shift in sampling periods that moves no parameter, so that the signals need no second look."""
_CERTAIN: Final = 3.0  # its standard deviations up to which a second look would follow noise
_LOOKS: Final = 3  # looks at the signals: a shift of a sample is known to a hundredth after two


class _Shifted(Protocol):
    def __call__(self, *, late_s: float) -> CompensatedAxis:
        """The axis with an effort that is recorded so late."""


@dataclass(frozen=True)
class InStep:
    """An axis whose effort is in step with its motion.

    Attributes
    ----------
    compensated : CompensatedAxis
    compared : ComparedSignals
    timing : Timing
        Beyond what the recording states.
    """

    compensated: CompensatedAxis
    compared: ComparedSignals
    timing: Timing

    @cached_property
    def adequacy(self) -> Adequacy:
        """How the base model does."""
        return judge(self.compared)

    @property
    def as_fitted(self) -> "InStep":
        """The same with the deviation of a shift at which the base model leaves least."""
        sampling_s = self.compensated.signals.recorded_period_s
        known = within_limits(self.timing.shift_s, self.compared.fitted_shift_std, sampling_s)
        timing = replace(self.timing, std_samples=known.std_s / sampling_s)
        return replace(self, timing=timing)

    def at(self, shifted: _Shifted, late_s: float) -> "InStep":
        """The same axis with another shift, whose deviation is as large."""
        compensated = shifted(late_s=late_s)
        samples = late_s / compensated.signals.recorded_period_s
        timing = replace(self.timing, shift_s=late_s, shift_samples=samples)
        return InStep(compensated, self.compared.with_effort(compensated), timing)


def in_step(
    recording: Recording, name: str, model: Model | None, compensated: CompensatedAxis
) -> InStep:
    """Take off the shift between effort and position.

    The slow part of the effort is asked first: noise that the controller answers imitates a shift
    of the rest. Where the base model is not adequate then, it may be at the shift at which it
    leaves least; a motion of short moves has no slow part that tells.

    Parameters
    ----------
    recording : Recording
    name : str
        Of the axis.
    model : Model or None
        Known effects.
    compensated : CompensatedAxis
        The axis with the shift that the recording states.
    """
    signals = compensated.signals
    shifted: _Shifted = partial(compensate_effects, recording, name, model, of_motion=signals)
    found = _as_slow_part(shifted, compensated)
    if found.adequacy.adequate:
        return found
    sampling_s = signals.recorded_period_s
    limits = [late * LARGEST_SHIFT * sampling_s for late in (-1.0, 0.0, 1.0)]
    residuals = [found.at(shifted, late_s).compared.residual for late_s in limits]
    left = [float(residual @ residual) for residual in residuals]
    fitting = found.at(shifted, smallest_at(left, sampling_s)).as_fitted
    return fitting if fitting.adequacy.adequate else found


def _as_slow_part(shifted: _Shifted, compensated: CompensatedAxis) -> InStep:
    """Take off the shift of the effort's slow part; to first order, so look at what is left."""
    sampling_s = compensated.signals.recorded_period_s
    largest_s = LARGEST_SHIFT * sampling_s
    unknown = Timing(0.0, 0.0, EVEN_SHIFT)
    stated = seen = InStep(compensated, ComparedSignals.of(compensated), unknown)
    for _ in range(_LOOKS):
        further = seen.compared.shift(sampling_s)
        late_s = seen.timing.shift_s
        step_s = float(np.clip(further.shift_s, -largest_s - late_s, largest_s - late_s))
        seen = replace(seen, timing=replace(seen.timing, std_samples=further.std_s / sampling_s))
        if abs(step_s) < SMALLEST_SHIFT * sampling_s:
            break
        seen = seen.at(shifted, late_s + step_s)
        if abs(seen.timing.shift_s) >= largest_s:  # on the edge: what asks for it is no shift
            return stated
        if abs(step_s) < _CERTAIN * further.std_s:
            break
    return seen


# Long recordings, at the rate that the bandwidth of their identification needs.
#
# A recording of hours holds far more samples than its estimate needs. What only the samples as
# recorded tell, which are noise, encoder and gaps, is kept beside the decimated ones.


# Samples per period of the highest cut-off: at half this rate its filter passes 0.07 %.
_RATE: Final = 5.0
_ROUNDING: Final = 1e-9  # rounding error of a stride


def at_needed_rate(recording: Recording) -> Recording:
    """Decimate a recording that is long, after a low-pass filter without delay.

    Shorter ones are returned as they are.

    Parameters
    ----------
    recording : Recording

    Returns
    -------
    Recording
        Evenly sampled; its axes have a `Sampling`.
    """
    if len(recording.time_s) <= LONG:
        return recording
    grid = EvenGrid.of(recording.time_s)
    told = {name: _sampling(axis, grid) for name, axis in recording.axes.items()}
    highest_hz = max(sampling.cutoff_hz for sampling in told.values())
    stride = int(1.0 / (_RATE * highest_hz * grid.period_s) + _ROUNDING)
    if stride < 2:
        return recording
    axes = {
        name: _decimated(axis, grid, told[name], stride) for name, axis in recording.axes.items()
    }
    passive = {
        name: replace(axis, position=_slower(grid.resampled(axis.position), stride))
        for name, axis in recording.passive.items()
    }
    time_s = grid.time_s[kept(len(grid.time_s), stride)].copy()
    return replace(recording, time_s=time_s, axes=axes, passive=passive)


def _sampling(axis: AxisRecord, grid: EvenGrid) -> Sampling:
    """What the samples as recorded tell, before decimation."""
    position, effort = grid.resampled(axis.position), grid.resampled(axis.effort)
    count, noise = conditioning.count_and_noise(position)
    cutoff_hz = conditioning.choose_cutoff(position, grid.period_s, noise)
    effort_noises = [
        white_noise(*parts, cutoff_hz, grid.period_s)
        for parts in zip(parts_of(effort), parts_of(position), strict=True)
    ]
    return Sampling(
        period_s=grid.period_s,
        jitter=grid.jitter,
        count=count,
        position_noise=noise,
        effort_noise=float(np.median(effort_noises)),
        cutoff_hz=cutoff_hz,
        begin_s=0.0,
        unknown=grid.unknown(axis.effort),
    )


def _slower(signal: Array, stride: int) -> Array:
    return decimate(signal, signal, stride)[0]


def _decimated(axis: AxisRecord, grid: EvenGrid, sampling: Sampling, stride: int) -> AxisRecord:
    position, effort = decimate(grid.resampled(axis.position), grid.resampled(axis.effort), stride)
    rows = kept(len(axis.position), stride)
    others = (axis.reference, axis.velocity, axis.temperature_c)
    reference, velocity, temperature_c = (
        None if column is None else grid.resampled(column)[rows] for column in others
    )
    return replace(
        axis,
        position=position,
        effort=effort,
        reference=reference,
        velocity=velocity,
        temperature_c=temperature_c,
        sampling=replace(
            sampling, begin_s=rows.start * grid.period_s, unknown=any_of(sampling.unknown, stride)
        ),
    )


# What the network says of the axes of a recording: all that it can read, in one batch.


def network_input(
    signals: conditioning.Signals, axis: AxisRecord, network: Network | None, watch: Stopwatch
) -> Subsampled | str:
    """What the network is to read of an axis, or why it cannot read it.

    Parameters
    ----------
    signals : Signals
    axis : AxisRecord
        Tells the units.
    network : Network or None
    watch : Stopwatch
        Gets the stage "align".
    """
    if network is None:
        return "no network was given"
    motion = network.manifest.motion
    if axis.units != (motion.position_unit, motion.effort_unit):
        return (
            f"the network was trained for {motion.position_unit} and {motion.effort_unit}, "
            f"not {axis.position_unit} and {axis.effort_unit}"
        )
    with watch.stage("align"):
        found = align(signals, motion.regressor[:, 1], motion.period_s)
    if found is None:
        samples = round(motion.period_s / signals.period_s)
        if samples < len(motion.regressor):
            return f"the recording has {samples} samples a period of its motion: too few"
        return f"the recording is shorter than the {motion.period_s:.4g} s of its motion"
    mismatch, limit = motion_mismatch(found.regressor, network), network.manifest.mismatch_limit
    if mismatch > limit:
        return (
            "the axis moved otherwise than the network was trained for: "
            f"{mismatch:.0%} apart (limit {limit:.0%})"
        )
    return found


def run_network(
    inputs: Mapping[str, Subsampled | str], network: Network | None, seed: int, watch: Stopwatch
) -> dict[str, tuple[Estimate | None, str]]:
    """The network's estimate of each axis, or none, and why.

    Parameters
    ----------
    inputs : mapping of axis name to Subsampled or str
        From `network_input`.
    network : Network or None
    seed : int
        Of random starting points.
    watch : Stopwatch
        Gets the stages "cnn", and within it "image" and "network".
    """
    answers: dict[str, tuple[Estimate | None, str]] = {
        name: (None, seen) for name, seen in inputs.items() if isinstance(seen, str)
    }
    read = {name: seen for name, seen in inputs.items() if isinstance(seen, Subsampled)}
    if network is None or not read:
        return answers
    with watch.stage("cnn"):
        results = estimate_together(list(read.values()), network, seed=seed, stopwatch=watch)
    for name, result in zip(read, results, strict=True):
        estimate = Estimate(result.parameters, result.std) if result.trusted else None
        answers[name] = estimate, result.reason
    return answers
