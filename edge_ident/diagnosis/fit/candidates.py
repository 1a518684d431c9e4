"""What each effect would add to the effort, per unit of its amplitudes: columns to regress on.

A column is the difference that a small amplitude makes to what the present model predicts, so one
rule serves loads, friction, memory, actuator, encoder and clock alike.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.diagnosis.prepare.view import View
from edge_ident.model.effects import catalogue, named
from edge_ident.model.model import AxisModel, Term
from edge_ident.model.search import Excitation, Form

Array = NDArray[np.float64]

_SMALL: Final = 1e-6
"""Amplitude of a difference; most effects are linear in it, the others nearly so."""
_ROW_LIMIT: Final = 1_000_000
"""Samples computed at once, to stay within a processor's cache and a small board's memory."""


@dataclass(frozen=True)
class Candidate:
    """An effect in one of its forms, from one axis where it couples axes."""

    effect: str
    form: Form
    source: str | None = None

    @property
    def size(self) -> int:
        """Number of free parameters."""
        return len(self.form.linear) + len(self.form.nonlinear)


def candidates(view: View, rotary: bool) -> tuple[Candidate, ...]:
    """All that could befall the axis of a view; `rotary` where its positions are angles."""
    found = []
    for name, effect in catalogue().items():
        if effect.search.needs_reversals and not view.reverses:
            continue
        for form in effect.search.forms:
            if not form.rotary or rotary:
                sources = view.other_axes if form.coupled else (None,)
                found += [Candidate(name, form, source) for source in sources]
    return tuple(found)


def grid(candidate: Candidate, excitation: Excitation) -> dict[str, Array]:
    """Shapes to try, arrays (D,); of length one for a form without any."""
    values = named(candidate.effect).search.grid(excitation)
    if not candidate.form.nonlinear:
        return {name: array[:1] for name, array in values.items()}
    return values


def term(
    candidate: Candidate,
    shapes: Mapping[str, float] | Mapping[str, Array],
    amplitudes: Mapping[str, float] | Mapping[str, Array],
) -> Term:
    """A term of the model: its shapes, its amplitudes, and zero for those of other forms."""
    effect = named(candidate.effect)
    values = {p.name: amplitudes.get(p.name, shapes.get(p.name, 0.0)) for p in effect.parameters}
    return Term(candidate.effect, values, source_axis=candidate.source)


def unit_columns(
    view: View, axis: AxisModel, candidate: Candidate, shapes: Mapping[str, float]
) -> Array:
    """Columns (k, n) of an additive candidate at one set of shapes, made once for a view."""
    key = (candidate, tuple(sorted(shapes.items())))
    if key not in view.kept:
        view.kept[key] = columns(view, replace(axis, terms=axis.terms[:1]), candidate, shapes)[0]
    return view.kept[key]


def columns(
    view: View,
    axis: AxisModel,
    candidate: Candidate,
    shapes: Mapping[str, float] | Mapping[str, Array],
) -> Array:
    """Columns of a candidate at one set of shapes, or at D of them, on top of a model.

    Returns
    -------
    (D, k, n) array
        Effort per unit of each of the k amplitudes; for a form without amplitudes (D, 1, n), the
        effort that the shapes alone add.
    """
    shapes = {name: np.atleast_1d(value) for name, value in shapes.items()}
    count = len(next(iter(shapes.values()))) if shapes else 1
    names = candidate.form.linear or (None,)
    rows = max(1, _ROW_LIMIT // view.samples)
    result = np.empty((count, len(names), len(view.effort)))
    if all(named(t.effect).additive for t in axis.terms) and named(candidate.effect).additive:
        axis = replace(axis, terms=axis.terms[:1])
    present = view.predicted(axis)
    for first in range(0, count, rows):
        part = {name: array[first : first + rows] for name, array in shapes.items()}
        for k, name in enumerate(names):
            amplitudes = {} if name is None else {name: _SMALL}
            added = replace(axis, terms=(*axis.terms, term(candidate, part, amplitudes)))
            step = 1.0 if name is None else _SMALL
            result[first : first + rows, k] = (view.predicted(added) - present) / step
    return result
