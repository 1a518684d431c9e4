"""What of a model's effects the gains make use of, and what not.

Fed forward at the reference's motion, since the board's law has terms for them
(`firmware_interface.gains`): Stribeck friction, friction by direction, and the largest orders of
torque ripple. Borne by the margins: coupling compliance, as the resonance it is, and time delay.
Every other effect is left to the feedback, and named.

Which delay is in the loop: `time_delay` says how late the effort is recorded against the
position. Negative, the motion comes late after the effort: an actuator or an encoder that takes
time, and the loop waits for it too. Positive, the record of the effort is late, which alone does
not slow the loop; but then nothing vouches for the clock that the loop runs by either. So margins
bear its size, whatever the sign, on top of the delay that the board measures.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Final

from edge_ident.control.position_loop import Plant, SprungLoad
from edge_ident.model.model import AxisModel, Term
from firmware_interface.gains import RIPPLES, AxisGains

_STRIBECK: Final = "stribeck_friction"
_DIRECTION: Final = "asymmetric_friction"
_RIPPLE: Final = "torque_ripple"
_DELAY: Final = "time_delay"
_COMPLIANCE: Final = "coupling_compliance"
_ROOM: Final[Mapping[str, int]] = MappingProxyType({_STRIBECK: 1, _DIRECTION: 1, _RIPPLE: RIPPLES})
"""Terms of each kind that the board's law takes."""
_SIZES: Final[Mapping[str, Callable[[Term], float]]] = MappingProxyType(
    {
        _STRIBECK: lambda term: float(term.values["level"]),
        _DIRECTION: lambda term: abs(float(term.values["difference"])),
        _RIPPLE: lambda term: math.hypot(term.values["cosine"], term.values["sine"]),
    }
)


@dataclass(frozen=True)
class Unused:
    """An effect of the model that the gains make no use of."""

    effect: str
    reason: str


def plant_of(axis: AxisModel) -> Plant:
    """The axis as the position loop meets it."""
    inertia, viscous, *_ = (float(value) for value in axis.parameters)
    loads = tuple(
        SprungLoad(*(float(term.values[key]) for key in ("load_inertia", "rate", "damping_ratio")))
        for term in axis.terms
        if term.effect == _COMPLIANCE
    )
    return Plant(inertia, viscous, loads)


def loop_delay_s(axis: AxisModel) -> float:
    """Delay that margins must bear beyond what the board measures."""
    return abs(sum(float(term.values["delay"]) for term in axis.terms if term.effect == _DELAY))


def with_feedforward(gains: AxisGains, axis: AxisModel) -> AxisGains:
    """Gains with what the law feeds forward of the axis's effects."""
    for term in _largest(axis, _STRIBECK):
        gains = replace(
            gains,
            stribeck_feedforward=float(term.values["level"]),
            stribeck_speed_rad_s=float(term.values["speed"]),
        )
    for term in _largest(axis, _DIRECTION):
        gains = replace(gains, viscous_difference_feedforward=float(term.values["difference"]))
    ripples = _largest(axis, _RIPPLE)

    def table(key: str, unused: tuple[float, ...]) -> tuple[float, ...]:
        return (*(float(term.values[key]) for term in ripples), *unused[len(ripples) :])

    return replace(
        gains,
        ripple_cosine=table("cosine", gains.ripple_cosine),
        ripple_sine=table("sine", gains.ripple_sine),
        ripple_period_rad=table("period", gains.ripple_period_rad),
    )


def unused_effects(axis: AxisModel) -> tuple[Unused, ...]:
    """The others, with the reason."""
    found = []
    for term in axis.terms[1:]:
        room = _ROOM.get(term.effect, 0)
        if room and term not in _largest(axis, term.effect):
            found.append(Unused(term.effect, f"the board takes {room}, and this one is smaller"))
        elif not room and term.effect not in (_DELAY, _COMPLIANCE):
            found.append(Unused(term.effect, "the board's law has no term for it"))
    return tuple(found)


def _largest(axis: AxisModel, effect: str) -> list[Term]:
    """The terms of one kind that the board's law takes."""
    terms = [term for term in axis.terms if term.effect == effect]
    return sorted(terms, key=_SIZES[effect], reverse=True)[: _ROOM[effect]]
