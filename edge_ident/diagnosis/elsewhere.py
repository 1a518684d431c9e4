"""What a model leaves of another recording, and whether that has structure."""

from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.diagnosis.fit.candidates import base_regressor, own_columns, own_limits
from edge_ident.diagnosis.fit.fitting import FittedModel, FittedTerm, delayed, fit
from edge_ident.diagnosis.fit.held_out import model_discrepancy
from edge_ident.diagnosis.fit.linear import orthonormal, solve_within
from edge_ident.diagnosis.fit.noise_floor import noise_floor
from edge_ident.diagnosis.fit.summary import nonzero_rms
from edge_ident.diagnosis.prepare.axis_data import AxisData
from edge_ident.diagnosis.select.acceptance import structure_left
from edge_ident.diagnosis.select.thresholds import LARGEST_DISCREPANCY
from edge_ident.model.effects import named
from edge_ident.model.model import BASE, PARAMETERS, POSITIVE, AxisModel
from edge_ident.signals.conditioning import unit_length

Array = NDArray[np.float64]


# What a model leaves of another recording, where what differs between days is fitted anew.


def fitted_anew(model: FittedModel) -> list[int]:
    """Places of the base parameters that differ between recordings: the offset, and what terms of
    the model that are tied to time change."""
    effects = [named(t.candidate.effect) for t in model.terms]
    changed = {name for e in effects if e.tied_to_time for name in e.changes_base}
    return [k for k, name in enumerate(PARAMETERS) if name in {"offset", *changed}]


def residual_elsewhere(other: AxisData, model: FittedModel, anew: list[int]) -> Array:
    """What a model leaves at the valid samples of another recording, its timing fitted anew.

    Parameters
    ----------
    anew : list of int
        Places of base parameters that are fitted anew, too.
    """
    axis = _carried_axis(model.axis)
    residual = (other.effort - other.predicted(axis))[other.valid]
    columns = np.hstack([base_regressor(other)[:, anew], own_columns(other)])[other.valid]
    own_low, own_high = own_limits(other, shifted=not delayed(axis))
    least = [-axis.parameters[k] if POSITIVE[k] else -np.inf for k in anew]
    low, high = np.array([*least, *own_low]), np.array([*np.full(len(anew), np.inf), *own_high])
    return np.asarray(residual - columns @ solve_within(columns, residual, low, high).solution)


def _carried_axis(axis: AxisModel) -> AxisModel:
    """The physical axis, without the terms that are tied to the time of their recording."""
    base = axis.terms[0]
    values = {
        name: max(float(base.values[name]), low) for name, (low, _) in named(BASE).bounds.items()
    }
    terms = [t for t in axis.terms[1:] if not named(t.effect).tied_to_time]
    return replace(axis, terms=(replace(base, values=values), *terms))


# Whether a model that was fitted to one recording leaves structure of another one.
#
# What it leaves there is more than noise of that recording. Noise of the recording that it was
# fitted to has moved its parameters, and with them what it predicts: that is no structure either.
# Nor is a drift or a warm-up that the model has: the other recording may have one of its own.


_RANK: Final = 1e-7
_DEVIATIONS: Final = 2.0
"""Standard deviations by which a prediction may be off: few parameters make most of it, so one in
twenty is off by more."""


def structure_elsewhere(
    data: AxisData, other: AxisData, model: FittedModel, tolerance: float
) -> bool:
    """Whether a model leaves structure of another recording than that to which it was fitted.

    Parameters
    ----------
    data, other : AxisData
        The recording to which the model was fitted, and the other one.
    """
    anew, left = fitted_anew(model), residual_elsewhere(other, model, fitted_anew(model))
    lasting, drifting = _lasting(model), _drifting(model)
    terms = tuple(model.terms[k] for k in (*lasting, *drifting))
    there = fit(other, model.template, model.base, terms)
    places = [there.columns_of(k) for k in range(len(terms))]
    seen, own = there.derivatives[other.valid], own_columns(other)[other.valid]
    free = np.r_[tuple([anew, *places[len(lasting) :]])]
    basis = orthonormal(np.hstack([seen[:, free], own]))
    if drifting:  # another recording may drift likewise, by another amount and at another pace
        left = left - basis @ (basis.T @ left)
    kept = np.array([k for k in range(len(PARAMETERS)) if k not in anew], dtype=np.intp)
    seen = seen[:, np.r_[tuple([kept, *places[: len(lasting)]])]]
    here = np.r_[tuple([kept, *(model.columns_of(k) for k in lasting)])]
    unsure = _unsure(data, model, here, seen - basis @ (basis.T @ seen))
    base = fit(other, model.template, model.base, ())
    return leaves_structure(
        other, base, replace(there, error=float(left @ left)), tolerance, unsure
    )


def leaves_structure(
    data: AxisData,
    base: FittedModel,
    model: FittedModel,
    tolerance: float,
    unsure: float = 0.0,
) -> bool:
    """Whether a model leaves structure of a recording, to which the base model was fitted.

    Parameters
    ----------
    unsure : float
        Rms by which its prediction may be off for the noise of another recording.
    """
    samples = np.count_nonzero(data.valid)
    floor = noise_floor(data, base, float(model.base[0]))
    left, discrepancy = (
        float(np.sqrt(square / samples)) for square in (model.error, model_discrepancy(data, model))
    )
    scale = nonzero_rms(data.effort[data.valid])
    noise = float(np.hypot(floor.rms, min(unsure, LARGEST_DISCREPANCY * scale)))
    return structure_left(left, noise, floor.uncertainty, discrepancy, tolerance * scale, scale)


def _unsure(
    data: AxisData, model: FittedModel, columns: NDArray[np.intp], derivatives: Array
) -> float:
    """Rms by which noise in the recording that a model was fitted to may move what it predicts of
    another one, by these (K,) columns of its Jacobian and their derivatives (m, K) there."""
    fitted = model.jacobian[data.valid]
    freedom = max(len(fitted) - np.linalg.matrix_rank(fitted), 1)
    unit, length = unit_length(fitted)
    moved = np.linalg.pinv(unit, rcond=_RANK)[columns] / length[columns, None]
    variance = model.error / freedom * np.sum((derivatives @ moved) ** 2)
    return _DEVIATIONS * float(np.sqrt(variance / len(derivatives)))


def lasting_terms(model: FittedModel) -> tuple[FittedTerm, ...]:
    """The terms of a model that another recording has as well."""
    return tuple(model.terms[k] for k in _lasting(model))


def _lasting(model: FittedModel) -> list[int]:
    """Places of the terms that another recording has as well."""
    return [k for k, t in enumerate(model.terms) if not named(t.candidate.effect).tied_to_time]


def _drifting(model: FittedModel) -> list[int]:
    """Places of the terms that go on over a recording, and are tied to its time."""
    lasting = _lasting(model)
    names = [t.candidate.form.nonlinear for t in model.terms]
    return [k for k, each in enumerate(names) if k not in lasting and "time" not in each]
