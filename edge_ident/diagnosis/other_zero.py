"""Whether the position of one recording counts from another zero than that of another.

What depends on the position, such as a weight or a ripple, then stands elsewhere, and no model of
both recordings has it. With one shift, a model of the first recording fits the other about as well
as one of its own. A ripple alone tells the shift but for whole periods: the smallest is named.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np
import scipy.optimize

from edge_ident.diagnosis.fit.discrepancy import model_discrepancy
from edge_ident.diagnosis.fit.fitting import FittedModel, fit
from edge_ident.diagnosis.fit.summary import nonzero_rms
from edge_ident.diagnosis.model_elsewhere import fitted_anew, residual_elsewhere
from edge_ident.diagnosis.prepare.axis_data import AxisData
from edge_ident.diagnosis.select.acceptance import about_alike
from edge_ident.diagnosis.select.criterion import independent_samples
from edge_ident.diagnosis.select.selection import Selected, selected_model
from edge_ident.diagnosis.select.thresholds import DECISIVE
from edge_ident.diagnosis.structure_elsewhere import lasting_terms
from edge_ident.estimation.trust import Finding
from edge_ident.model.effects import named
from edge_ident.signals.metrics import rms
from edge_ident.signals.recording import Recording

_PER_LENGTH: Final = 0.5
"""Step of the shifts that are tried, of the length over which a model bends."""
_MOST_STEPS: Final = 200
"""To either side."""
_MOST_REFINED: Final = 12
"""Least misfits along the shifts, the nearest to none, that are made exact."""
_PROBE: Final = 1e-4
"""Of the travel: a shift that shows how a model bends along the position."""


@dataclass(frozen=True)
class OtherZero:
    """The position of a recording reads more than it would from the zero of another.

    Attributes
    ----------
    place : int
        Of the recording, or of its first part.
    shift : float
        In the unit of the position.
    """

    place: int
    shift: float


def zero_instead(selected: Selected, tolerance: float) -> OtherZero | None:
    """Another zero of one recording than of the first, by which the model of the first alone fits
    the other about as well as one of its own would; None where there is none.

    Parameters
    ----------
    selected : Selected
        A model of all recordings that leaves structure.
    tolerance : float
        Smallest share of the rms effort that is worth naming.
    """
    data = selected.search.data
    clocks = [s.motion.clock for s in data.segments]
    reference, *others = dict.fromkeys(clocks)
    if not others:
        return None
    first = data.of_clock(reference)
    alone = selected_model(first, selected.start.template).supported.model
    for clock in others:
        shift = shift_of_zero(first, data.of_clock(clock), alone, tolerance)
        if shift is not None:
            return OtherZero(clocks.index(clock), shift)
    return None


def zero_differs(
    recording: Recording, reference: Recording, name: str, shift: float, *, blocks: bool
) -> Finding:
    """What is said of an axis whose position another zero shifts, and may forbid to name causes:
    it would hide them or make them up."""
    unit = reference.axes[name].position_unit
    return Finding(
        "zero_differs",
        f"the position of {recording.source} is {shift:+.3g} {unit} from that of "
        f"{reference.source} at the same place: so shifted, one model fits both",
        f"give both the same zero: add {-shift:.3g} {unit} to the position of {recording.source}",
        blocks=blocks,
    )


def shift_of_zero(
    first: AxisData, other: AxisData, model: FittedModel, tolerance: float
) -> float | None:
    """By how much the position of another recording reads more than that of the first.

    Parameters
    ----------
    model : FittedModel
        Of the first alone.

    Returns
    -------
    float or None
        None where one model fits both without a shift, or what the shift changes is not worth
        naming; and where models of their own leave less than one with a shift does by more than is
        worth naming, or than a small share of what it explains: what its formulas may be off.
    """
    zero = _Zero(other, model)
    terms = lasting_terms(model)
    if (near := zero.near()) is None:
        return None

    def both(shift: float) -> AxisData:
        return first.joined(other.from_zero(shift))

    def of_both(shift: float) -> FittedModel:
        return fit(both(shift), model.template, model.base, terms)

    best = scipy.optimize.minimize_scalar(
        lambda shift: of_both(shift).error, bounds=near, method="bounded"
    )
    shift = float(best.x)
    shifted, unshifted = of_both(shift), of_both(0.0)
    gain, count = unshifted.error - shifted.error, np.count_nonzero(other.valid)
    least = tolerance * nonzero_rms(other.effort[other.valid])
    if gain <= count * least**2 or not _decided(both(shift), shifted, unshifted):
        return None
    compared = count + np.count_nonzero(first.valid)
    here, there = (fit(data, model.template, model.base, terms).error for data in (first, other))
    if not terms:  # known ripples have no size of their own
        there = min(there, here * count / (compared - count))
    effects = [t.effect for t in model.axis.terms[1:]]
    off = max(named(effect).search.discrepancy for effect in effects)
    alike = about_alike(shifted.error - here - there, gain, off, compared * least**2)
    return shift if alike else None


def _decided(data: AxisData, shifted: FittedModel, unshifted: FittedModel) -> bool:
    """Whether the criterion decidedly prefers the model with a shift."""
    samples, off = independent_samples(data, shifted), model_discrepancy(data, shifted)
    gain = samples * np.log((unshifted.error + off) / (shifted.error + off))
    return bool(gain - np.log(samples) > DECISIVE.value)


@dataclass(frozen=True)
class _Zero:
    """Another recording beside a model, along the shifts of its position."""

    other: AxisData
    model: FittedModel

    def left(self, shift: float) -> float:
        """Sum of squares that the model leaves, with an offset and a timing of the recording."""
        anew = fitted_anew(self.model)
        left = residual_elsewhere(self.other, self.model, anew, self.other.from_zero(shift))
        return float(left @ left)

    def near(self) -> tuple[float, float] | None:
        """Two shifts around the smallest that leaves about least; None where no shift does anything
        that no offset does."""
        found = [*self._refined()]
        if not found:
            return None
        alike = 1.0 + DECISIVE.value / np.count_nonzero(self.other.valid)
        most = alike * min(error for _, _, error in found)
        around, _, _ = min((e for e in found if e[2] <= most), key=lambda e: abs(e[1]))
        return around

    def _refined(self) -> Iterator[tuple[tuple[float, float], float, float]]:
        """The shifts nearest to none that leave less than two around them: those, it, and what it
        leaves."""
        travel = float(np.ptp(self.other.of_motion("position")))
        reach = max(travel, np.pi) if self.model.axis.position_unit == "rad" else travel
        length = self._length(_PROBE * travel)
        if not 0.0 < length <= reach:
            return
        step = _PER_LENGTH * length
        count = min(int(reach / step), _MOST_STEPS) + 1
        shifts = step * np.arange(-count, count + 1)
        left = np.array([self.left(float(shift)) for shift in shifts])
        inner = np.nonzero((left[1:-1] <= left[:-2]) & (left[1:-1] <= left[2:]))[0] + 1
        for k in sorted(inner, key=lambda k: abs(shifts[k]))[:_MOST_REFINED]:
            around = (float(shifts[k - 1]), float(shifts[k + 1]))
            best = scipy.optimize.minimize_scalar(self.left, bounds=around, method="bounded")
            yield around, float(best.x), float(best.fun)

    def _length(self, probe: float) -> float:
        """Over which what depends on the position bends: of a ripple, its period over 2 pi;
        zero where nothing depends on it, and very long where nothing bends."""
        less, here, more = (
            self.other.from_zero(s).predicted(self.model.axis) for s in (-probe, 0.0, probe)
        )
        slope, bend = (more - less) / 2.0, more - 2.0 * here + less
        at = self.other.valid
        return probe * rms(slope[at]) / max(rms(bend[at]), np.finfo(float).eps * rms(here[at]))
