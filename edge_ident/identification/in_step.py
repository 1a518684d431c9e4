"""The effort of an axis in step with its motion, before anything is known but the base model."""

from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Final, Protocol

import numpy as np

from edge_ident.estimation.compensated_axis import CompensatedAxis
from edge_ident.estimation.compensation import compensate_effects
from edge_ident.identification.adequacy import Adequacy, judge
from edge_ident.identification.compared_signals import ComparedSignals
from edge_ident.model.model import Model
from edge_ident.model.timing import EVEN_SHIFT, LARGEST_SHIFT, Timing
from edge_ident.signals.recording import Recording
from edge_ident.signals.timing import smallest_at, within_limits

SMALLEST_SHIFT: Final = 0.02
"""Shift in sampling periods that moves no parameter, so that the signals need no second look."""
_CERTAIN: Final = 3.0
"""Its standard deviations up to which a second look would follow noise."""
_LOOKS: Final = 3
"""Looks at the signals: a shift of a sample is known to a hundredth after two."""


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
