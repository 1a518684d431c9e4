"""How controller gains use the effects of a model, and which effects they leave to feedback.

Each effect states its own use (`edge_ident.model.compensation`). There are three:

- Feed-forward at the reference's motion, where the board's law has a field for the parameter
  (`firmware_interface.gains`). Where terms outnumber a field's places, the largest are taken.
- A resonance, which the loop's margins bear.
- A delay of the recorded effort. The margins bear its size on top of the delay that the board
  measures. A negative delay means that the motion is late: an actuator or an encoder takes time,
  and the loop waits for it too. A positive delay means that the record of the effort is late. That
  alone does not slow the loop, but the loop's clock may then be wrong as well. So the sign does not
  matter.

Every other effect is left to feedback, and reported.
"""

import math
from dataclasses import dataclass, fields, replace
from typing import Any, Final

from edge_ident.control.position_loop import Plant, SprungLoad
from edge_ident.model.effects import named
from edge_ident.model.model import AxisModel, Term
from firmware_interface.gains import AxisGains

_PLACES: Final = {
    field.name: len(field.default) if isinstance(field.default, tuple) else 1
    for field in fields(AxisGains)
}
"""Terms that each field of the board's law takes."""


@dataclass(frozen=True)
class Unused:
    """An effect of the model that the gains make no use of."""

    effect: str
    reason: str


def plant_of(axis: AxisModel) -> Plant:
    """The axis as the position loop meets it."""
    inertia, viscous, *_ = (float(value) for value in axis.parameters)
    loads = []
    for term in axis.terms:
        if resonance := named(term.effect).compensation.resonance:
            loads.append(SprungLoad(*(float(term.values[name]) for name in resonance)))
    return Plant(inertia, viscous, tuple(loads))


def loop_delay_s(axis: AxisModel) -> float:
    """Delay that margins must bear beyond what the board measures."""
    delays = ((term, named(term.effect).compensation.loop_delay) for term in axis.terms)
    return abs(sum(float(term.values[name]) for term, name in delays if name))


def with_feedforward(gains: AxisGains, axis: AxisModel) -> AxisGains:
    """Gains with what the law feeds forward of the axis's effects."""
    for effect in {term.effect: None for term in axis.terms}:
        terms = _fed_forward(axis, effect)
        for parameter, gain in named(effect).compensation.feedforward.items():
            values = [float(term.values[parameter]) for term in terms]
            placed: Any = _placed(getattr(gains, gain), values)
            gains = replace(gains, **{gain: placed})
    return gains


def unused_effects(axis: AxisModel) -> tuple[Unused, ...]:
    """Effects that gains make no use of, with the reason."""
    found = []
    for term in axis.terms[1:]:
        compensation = named(term.effect).compensation
        if not compensation.used:
            found.append(Unused(term.effect, "the control law of the board has no term for it"))
        elif compensation.feedforward and term not in _fed_forward(axis, term.effect):
            places = _places(term.effect)
            found.append(Unused(term.effect, f"the board takes {places}, and this one is smaller"))
    return tuple(found)


def _fed_forward(axis: AxisModel, effect: str) -> list[Term]:
    """The largest terms of one effect, as many as the board's law takes."""
    linear = named(effect).search.linear
    terms = [term for term in axis.terms if term.effect == effect]
    terms.sort(key=lambda term: _size(term, linear), reverse=True)
    return terms[: _places(effect)]


def _size(term: Term, linear: frozenset[str]) -> float:
    return math.hypot(*(float(value) for name, value in term.values.items() if name in linear))


def _places(effect: str) -> int:
    return min(
        (_PLACES[gain] for gain in named(effect).compensation.feedforward.values()), default=0
    )


def _placed(present: float | tuple[float, ...], values: list[float]) -> float | tuple[float, ...]:
    """A field of the gains with values in its first places."""
    return (*values, *present[len(values) :]) if isinstance(present, tuple) else values[0]
