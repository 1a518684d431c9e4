"""The terms of a model, laid out for simulation: which hooks act, and where their states lie."""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from edge_ident.errors import ModelError
from edge_ident.model.effect import Effect, Values
from edge_ident.model.effects import named
from edge_ident.model.model import PARAMETERS, AxisModel, Term
from edge_ident.model.motion import Motion
from edge_ident.model.physical_sums import everywhere
from edge_ident.model.sources import acting, together

Array = NDArray[np.float64]


class Part(NamedTuple):
    """One effect on one axis, with values (D,), what acts on it and the rows of its states."""

    axis: int
    effect: Effect
    values: Values
    source: tuple[tuple[int, int], ...]
    memory: slice

    def at(self, all_axes: Motion, state: Array) -> Motion:
        """The motion (A, D) and state of all, as this effect sees it."""
        return Motion(
            all_axes.time_s,
            all_axes.position[self.axis],
            all_axes.velocity[self.axis],
            all_axes.acceleration[self.axis],
            all_axes.direction[self.axis],
            memory=state[self.memory],
            driven=all_axes.driven[self.axis],
            source=together((_row(all_axes, i), sense) for i, sense in self.source)
            if self.source
            else None,
        )


class Parts:
    """All terms of D drives of one structure.

    Attributes
    ----------
    base : Values
        Of the base terms, (A, D) each.
    all : list of Part
        Axis by axis, in the order of their terms.
    states : int
        Positions and velocities of all axes, and what effects remember.
    """

    def __init__(self, axes: Mapping[str, AxisModel], drives: int) -> None:
        self.names = list(axes)
        self._instants = [everywhere(0.0, axis) for axis in axes.values()]
        terms = [[(term, _values(term, drives)) for term in axis.terms] for axis in axes.values()]
        self.base: Values = {
            name: np.stack([of_axis[0][1][name] for of_axis in terms]) for name in PARAMETERS
        }
        self.all: list[Part] = []
        self.states = 2 * len(axes)
        for i, of_axis in enumerate(terms):
            for term, values in of_axis[1:]:
                effect = named(term.effect)
                memory = slice(self.states, self.states + effect.memory_size)
                self.states = memory.stop
                self.all.append(Part(i, effect, values, self._source(i, term), memory))

    def through(self, hook: str) -> list[Part]:
        """Effects that act through a hook."""
        return [part for part in self.all if part.effect.overrides(hook)]

    def fastest_rate(self, top_speed: Array) -> float:
        """Fastest rate (1/s) of all drives in the equations of motion; infinitesimal if none is.

        Raises
        ------
        ModelError
            Effects take more inertia than there is.
        """
        inertia = self._least_inertia()
        for name, least in zip(self.names, inertia.min(axis=1), strict=True):
            if least <= 0.0:
                raise ModelError(
                    f"axis {name}: its terms leave an inertia of {least:.3g}",
                    "raise the inertia of rigid_body, or lower what effects take from it",
                )
        rate = self.base["viscous_friction"] / inertia
        for part in self.all:
            i = part.axis
            rate[i] += part.effect.fastest_rate(part.values, inertia[i], float(top_speed[i]))
        return max(float(np.max(rate)), float(np.finfo(float).tiny))

    def _least_inertia(self) -> Array:
        """What terms leave of the inertia wherever and whenever the axes may be, (A, D)."""
        inertia = np.repeat(self.base["inertia"][:, None], len(self._instants[0].time_s), axis=1)
        for part in self.through("inertia"):
            at = self._instants[part.axis]
            inertia[part.axis] += part.effect.inertia(at, part.values)
        return np.asarray(inertia.min(axis=1))

    def _source(self, axis: int, term: Term) -> tuple[tuple[int, int], ...]:
        if not named(term.effect).has_source(term.source_axis):
            return ()
        others = {name: i for i, name in enumerate(self.names) if i != axis}
        acts = acting(term.source_axis, others)
        if not acts or not all(one.axis in others for one in acts):
            raise ModelError(
                f"axis {self.names[axis]}, {term.effect}: no other axis is {term.source_axis}",
                f"the axes are {', '.join(self.names)}",
            )
        return tuple((others[one.axis], one.sense) for one in acts)


def _row(motion: Motion, axis: int) -> Motion:
    return Motion(
        motion.time_s,
        motion.position[axis],
        motion.velocity[axis],
        motion.acceleration[axis],
        motion.direction[axis],
    )


def _values(term: Term, drives: int) -> dict[str, Array]:
    return {
        name: np.broadcast_to(np.asarray(value, dtype=np.float64), (drives,))
        for name, value in named(term.effect).complete(term.values).items()
    }
