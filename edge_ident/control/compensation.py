"""How controller gains use the effects of a model, and which effects they leave to feedback.

Each effect states its own use (`edge_ident.model.effect`). There are six:

- Feed-forward at the reference's motion, where the board's law has a field for the parameter
  (`firmware_interface.gains`). Where terms outnumber a field's places, the largest are taken.
- A curve over speed or a table over position, sampled from the effect's own physics
  (`edge_ident.control.law_terms`) in the range in which the term was supported.
- A resonance, of a load on a spring or of a spring before the load, which the loop's margins bear.
- A delay of the recorded effort. The margins bear its size on top of the delay that the board
  measures. A negative delay means that the motion is late: an actuator or an encoder takes time,
  and the loop waits for it too. A positive delay means that the record of the effort is late. That
  alone does not slow the loop, but the loop's clock may then be wrong as well. So the sign does not
  matter.
- Base parameters that change in time. Gains have those of the end of the recording, which is what
  is known of the machine as it is now.
- A limit of the actuator, which feed-forward has to stay below.

Every other effect is left to feedback and reported; of its effort, feed-forward of the base model
takes what it can. So is a term that the board's law has no field for, that is beyond the board's
largest gains, or with which feed-forward at constant speed would exceed the effort limit somewhere
in the supported range. Acceleration is not counted there: how much of it a motion takes is the
motion's choice, and the board refuses a motion whose feed-forward asks for too much.
"""

import math
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from edge_ident.control.law_terms import EffortRange, Placed, Placement
from edge_ident.control.position_loop import LoopHardware, Plant, SeriesSpring, SprungLoad
from edge_ident.model.effects import named
from edge_ident.model.inverse import inertia_of_poses, inverse_effort
from edge_ident.model.model import AxisModel, SupportedRange, Term, regressor
from edge_ident.model.motion import Motion
from firmware_interface.gains import AxisGains

# What a board's law lacks where it lacks a field, in words.
_FIELDS: Final = {
    "friction_forward": "curve of friction over speed",
    "load_table": "table over position",
    "presliding_feedforward": "friction that builds up with the distance",
    "backlash_offset_rad": "term for play",
    "deadband_inverse": "inverse of a deadband",
    "cross_inertia_feedforward": "term for the other axis",
    "transmission_loss": "term for the losses of a transmission",
}
# Fields that take what is sampled.
_SAMPLED: Final = {"speed": ("friction_forward",), "position": ("load_table",)}
_STIFFEST_S2: Final = 1e-12  # one over the square of a resonance that no loop reaches


@dataclass(frozen=True)
class Used:
    """An effect of the model that the gains use.

    Attributes
    ----------
    effect : str
    sentence : str
        What became of it; a part of a sentence.
    """

    effect: str
    sentence: str


@dataclass(frozen=True)
class Unused:
    """An effect of the model that the gains make no use of."""

    effect: str
    reason: str


@dataclass(frozen=True)
class Compensated:
    """Gains that use the effects of a model.

    Attributes
    ----------
    gains : AxisGains
    used : tuple of Used
    unused : tuple of Unused
    """

    gains: AxisGains
    used: tuple[Used, ...]
    unused: tuple[Unused, ...]


def over_poses(axis: AxisModel, others: Mapping[str, AxisModel], deviations: float) -> AxisModel:
    """An axis with the inertia in the middle of its poses, in an interval that holds them all.

    Parameters
    ----------
    axis : AxisModel
    others : mapping of axis name to AxisModel
        Whose positions may change its inertia.
    deviations : float
        From the middle of an interval to its ends.
    """
    least, most = inertia_of_poses(axis, others)
    if least == most:
        return axis
    base, reach = axis.terms[0], 0.5 * (most - least)
    values = {**base.values, "inertia": least + reach}
    std = {**base.std, "inertia": base.std.get("inertia", 0.0) + reach / deviations}
    return replace(axis, terms=(replace(base, values=values, std=std), *axis.terms[1:]))


def plant_of(axis: AxisModel) -> Plant:
    """The axis as the position loop meets it."""
    inertia, viscous, *_ = (float(value) for value in axis.parameters)
    loads, springs = [], []
    for term in axis.terms:
        compensation = named(term.effect).compensation
        if compensation.resonance:
            values = (float(term.values[name]) for name in compensation.resonance)
            loads.append(SprungLoad(*values))
        if compensation.series_resonance:
            _, damping = compensation.series_resonance
            springs.append(SeriesSpring(_resonance_rate(term), float(term.values[damping])))
    return Plant(inertia, viscous, tuple(loads), tuple(springs))


def _resonance_rate(term: Term) -> float:
    """Resonance in rad/s of what is soft in a term."""
    compensation = named(term.effect).compensation
    if compensation.resonance:
        return float(term.values[compensation.resonance[1]])
    square, _ = compensation.series_resonance
    return 1.0 / math.sqrt(max(float(term.values[square]), _STIFFEST_S2))


def loop_delay_s(axis: AxisModel) -> float:
    """Delay that margins must bear beyond what the board measures."""
    delays = ((term, named(term.effect).compensation.loop_delay) for term in axis.terms)
    return abs(sum(float(term.values[name]) for term, name in delays if name))


def compensated(
    gains: AxisGains,
    axis: AxisModel,
    hardware: LoopHardware,
    gain_margin: float,
    at_s: float | None,
) -> Compensated:
    """Gains with what the board's law feeds forward of the axis's effects.

    Parameters
    ----------
    gains : AxisGains
        Of the base model.
    axis : AxisModel
    hardware : LoopHardware
    gain_margin : float
        That the loop keeps.
    at_s : float or None
        Time of the recording whose base parameters the gains have, where that is known.
    """
    late_s = hardware.control_delay_s + 0.5 * hardware.sample_period_s + loop_delay_s(axis)
    limited = replace(hardware, effort_limit_nm=effort_limit_nm(axis, hardware))
    reach = EffortRange.of(axis)
    placement = Placement(axis, limited, late_s, gain_margin, reach)
    used: list[Used] = []
    left_out: list[tuple[Term, Unused]] = []
    for term in _largest_first(axis):
        number = sum(earlier.effect == term.effect for earlier in used)
        found = _not_fed(term, hardware, at_s) or placement.placed(gains, term, number)
        if isinstance(found, Placed):
            found = _beyond(found.gains, gains, limited, reach) or found
        if isinstance(found, str):
            left_out.append((term, Unused(term.effect, found)))
        else:
            gains = found.gains
            used.append(Used(term.effect, found.sentence))
    gains = gains_without(gains, axis, [term for term, _ in left_out])
    used += [Used(term.effect, sentence) for term, sentence in _borne(axis, gains, limited, reach)]
    return Compensated(gains, tuple(used), tuple(unused for _, unused in left_out))


def _largest_first(axis: AxisModel) -> list[Term]:
    """Terms that are to be fed forward or left out: those of one effect by size, the largest
    first, and else in the order of the model."""
    terms = [term for term in axis.terms[1:] if not named(term.effect).compensation.borne]
    order = list(dict.fromkeys(term.effect for term in terms))
    return sorted(terms, key=lambda term: (order.index(term.effect), -_size(term)))


def _size(term: Term) -> float:
    linear = named(term.effect).search.linear
    return math.hypot(*(float(value) for name, value in term.values.items() if name in linear))


def _not_fed(term: Term, hardware: LoopHardware, at_s: float | None) -> str:
    """Why no board, or not this one, has fields for a term; empty where it has."""
    compensation = named(term.effect).compensation
    if compensation.without:
        return compensation.without
    if compensation.at_end:
        return "" if at_s is not None else "nobody says for which time of the recording gains are"
    over = compensation.sampled(term.values)
    needed = _SAMPLED.get(over, tuple(compensation.feedforward.values()))
    for gain in needed:
        if gain not in hardware.law:
            return f"the board's register map {hardware.map_version} has no {_FIELDS[gain]}"
    return ""


def _beyond(
    wanted: AxisGains, present: AxisGains, hardware: LoopHardware, reach: EffortRange | None
) -> str:
    """Why a board takes no such gains; empty where it does.

    The gains that are present are not judged: those of the base model are checked elsewhere.
    """
    if hardware.gain_maximum is not None:
        largest, before = hardware.gain_maximum.numbers(), present.numbers()
        for name, value in wanted.numbers().items():
            if value != before[name] and abs(value) > largest[name]:
                return f"its {name} would be {value:.3g}, and the board takes {largest[name]:.3g}"
    if reach is not None:
        most = reach.largest_nm(wanted)
        if most > max(hardware.effort_limit_nm, reach.largest_nm(present)):
            return (
                f"with it, constant speed could take {most:.3g} N·m of the "
                f"{hardware.effort_limit_nm:.3g} N·m that there are"
            )
    return ""


def effort_limit_nm(axis: AxisModel, hardware: LoopHardware) -> float:
    """Effort limit of the board, or of an actuator that gives less."""
    limits = ((term, named(term.effect).compensation.limit) for term in axis.terms)
    given = (float(term.values[name]) for term, name in limits if name)
    return min(hardware.effort_limit_nm, *given, math.inf)


def _borne(
    axis: AxisModel, gains: AxisGains, hardware: LoopHardware, reach: EffortRange | None
) -> Iterator[tuple[Term, str]]:
    """Terms that the design bears, and how."""
    for term in axis.terms[1:]:
        compensation = named(term.effect).compensation
        if compensation.resonance or compensation.series_resonance:
            rate_hz = _resonance_rate(term) / (2.0 * math.pi)
            yield term, f"the margins bear its resonance at {rate_hz:.3g} Hz"
        elif compensation.loop_delay:
            late_ms = 1e3 * abs(float(term.values[compensation.loop_delay]))
            yield term, f"the margins bear its {late_ms:.3g} ms"
        elif compensation.limit:
            yield term, _room(gains, hardware, reach, axis)


def _room(
    gains: AxisGains, hardware: LoopHardware, reach: EffortRange | None, axis: AxisModel
) -> str:
    """Which motion fits below the limit of an actuator."""
    limit = hardware.effort_limit_nm
    sentence = f"feed-forward stays below {limit:.3g} {axis.effort_unit.replace('*', '·')}"
    if reach is None:
        return sentence
    left = max(limit - reach.largest_nm(gains), 0.0) / float(axis.parameters[0])
    return (
        f"{sentence}; motions fit that accelerate by up to {left:.3g} {axis.position_unit}/s² at "
        f"any speed up to {reach.top_speed:.3g} {axis.position_unit}/s"
    )


# Feed-forward of the base model in gains that leave terms of a model out.
#
# The base parameters of a model are those beside all of its terms. Friction that bends with the
# speed, say, leaves little for viscous friction. Gains that must do without that term follow better
# if the base model takes what it can of it. That share is fitted along a made-up motion through the
# supported range, on which the model itself says what the term takes.


# Frequencies of the made-up motion, over the slowest: they never repeat together.
_RATES: Final = np.array([1.0, np.sqrt(7.0), np.sqrt(41.0)])
_TURNS: Final = 12  # periods of the slowest sinusoid
_SAMPLES: Final = 6000


def gains_without(gains: AxisGains, axis: AxisModel, left_out: Collection[Term]) -> AxisGains:
    """Gains whose feed-forward of the base model takes what it can of terms that are left out.

    Parameters
    ----------
    gains : AxisGains
        For all other terms.
    axis : AxisModel
        With all of its terms.
    left_out : collection of Term
        Those that depend on another axis or on time change nothing, nor do any where nobody says
        in which range the model is supported.
    """
    supported = axis.terms[0].supported
    moving = [term for term in left_out if _acts_on_a_motion(term)]
    if supported is None or not moving:
        return gains
    motion = _made_up(supported)
    kept = tuple(term for term in axis.terms if _acts_on_a_motion(term) and term not in left_out)
    both = (replace(axis, terms=terms) for terms in ((*kept, *moving), kept))
    taken = np.subtract(*(inverse_effort(some, motion) for some in both))
    columns = regressor(motion.velocity, motion.acceleration)
    inertia, viscous, coulomb, offset = np.linalg.lstsq(columns, taken, rcond=None)[0].tolist()
    return replace(
        gains,
        inertia_feedforward=max(gains.inertia_feedforward + inertia, 0.0),
        viscous_feedforward=max(gains.viscous_feedforward + viscous, 0.0),
        coulomb_feedforward=max(gains.coulomb_feedforward + coulomb, 0.0),
        offset_feedforward=gains.offset_feedforward + offset,
    )


def _acts_on_a_motion(term: Term) -> bool:
    effect = named(term.effect)
    return not (effect.tied_to_time or effect.effort_delay or effect.has_source(term.source_axis))


def _made_up(supported: SupportedRange) -> Motion:
    """Three sinusoids of equal speed that stay inside the range of position and speed."""
    low, high = supported.position
    top_speed = max(abs(speed) for speed in supported.speed)
    speed = top_speed / len(_RATES)
    travel = 0.5 * (high - low)
    slowest = speed * float(np.sum(1.0 / _RATES)) / travel
    time_s = np.linspace(0.0, 2.0 * np.pi * _TURNS / slowest, _SAMPLES)
    rates = slowest * _RATES[:, None]
    sine, cosine = np.sin(rates * time_s), np.cos(rates * time_s)
    return Motion.known(
        time_s,
        0.5 * (low + high) + speed * np.sum(sine / rates, axis=0),
        speed * np.sum(cosine, axis=0),
        -speed * np.sum(rates * sine, axis=0),
    )
