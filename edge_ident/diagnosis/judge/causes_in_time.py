"""Causes in time that friction or an extreme of the motion may imitate, or that are too many.

Friction at a stop answers whatever pushes, up to its level in either direction. So what the
effort does there (`held`), within twice the Coulomb friction, is no evidence of an event: a sound
axis does it, too.

An event shows in that the same motion did without it at another time. At a higher speed or under
more effort than ever else, any law that bends or ends there may look like an event. A push moves
the axis, too: where it describes the effort better than such a law, it is one. An end stop that
is reached once stays one: it acts then, and what is tied to time is not carried on.
"""

from collections import defaultdict
from itertools import chain, pairwise
from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.diagnosis.fit.fitting import FittedModel
from edge_ident.diagnosis.fit.linear import orthonormal
from edge_ident.diagnosis.fit.summary import Extremes, along, error_with, measured
from edge_ident.diagnosis.prepare.axis_data import REACH_PERIODS, AxisData, Segment
from edge_ident.diagnosis.select.acceptance import separable
from edge_ident.diagnosis.select.cross_validation import tied_to_time
from edge_ident.diagnosis.select.thresholds import HELD, MOST_EVENTS
from edge_ident.model.effects import named
from edge_ident.model.search import SOUND_RESONANCE_HZ, Excitation

Array = NDArray[np.float64]
_TINY: Final = float(np.finfo(float).tiny)


def imitated(data: AxisData, model: FittedModel, excitation: Excitation) -> dict[int, str]:
    """Reasons against terms tied to time that something else may imitate, by their places."""
    doubts = never_repeated(data, model) | at_standstill(data, model)
    return doubts | brief(data, model, excitation)


def at_standstill(data: AxisData, model: FittedModel) -> dict[int, str]:
    """Reasons against terms tied to time that friction at a stop may imitate.

    A term is doubtful where half of its energy acts while the axis may be held; where it is shorter
    than the band resolves, and any of it does. Those that overlap are one.

    Returns
    -------
    mapping of place to str
        Places are those of `model.terms`.
    """
    most, travel = most_friction(model), held_travel(model)
    doubts: dict[int, str] = {}
    for event in chain.from_iterable(overlapping(model).values()):
        efforts = [np.abs(sum(_of_term(s, model, k) for k in event)) for s in data.segments]
        largest = max(float(np.max(effort)) for effort in efforts)
        held = any(
            _held_while(s, effort * s.direction_weight[:: s.stride], travel)
            for s, effort in zip(data.segments, efforts, strict=True)
        )
        if held and largest <= most:
            reason = "it acts while the axis stands or nearly stops, and friction may do as much"
            doubts |= dict.fromkeys(event, reason)
    return doubts


def never_repeated(data: AxisData, model: FittedModel) -> dict[int, str]:
    """Reasons against events that act at a speed or under an effort that there is at no other time.

    An event is doubtful where half of its energy follows from how far the speed or the effort lies
    beyond all that it is where nothing happened, unless no such law describes the record as well.
    Those that overlap are one. An effort counts that is so with the event and without: the one
    alone the push itself may have raised, the other alone a collision that stops the axis.

    Returns
    -------
    mapping of place to str
        Places are those of `model.terms`.
    """
    every = chain.from_iterable(overlapping(model).values())
    events = [event for event in every if "duration" in model.terms[event[0]].nonlinear]
    if not events:
        return {}
    pushes = np.array([sum(_everywhere(data, model, k) for k in event) for event in events])
    signals = [
        (s.motion.velocity, measured(s), s.direction_weight[:: s.stride]) for s in data.segments
    ]
    velocity, effort, weight = np.concatenate(signals, axis=1)
    quiet = ~np.any(pushes, axis=0)
    if not np.any(quiet):
        return {}
    without = effort - np.sum(pushes, axis=0)
    extremes = {
        "faster": Extremes(velocity[None], quiet),
        "under more effort": Extremes(np.stack([effort, without]), quiet),
    }
    doubts: dict[int, str] = {}
    for where, extreme in extremes.items():
        excess = extreme.excess()
        law = orthonormal(weight[:, None] * np.stack([excess, excess**2], axis=1))
        for event, push in zip(events, pushes * weight, strict=True):
            follows = np.sum(np.square(law.T @ push)) > HELD * np.sum(np.square(push))
            if follows and not _told_apart(data, model, event, extreme.laws):
                reason = f"it acts where the axis is {where} than at any other time"
                doubts |= dict.fromkeys(event, reason)
    return doubts


def _told_apart(data: AxisData, model: FittedModel, event: list[int], laws: Array) -> bool:
    """Whether an event, by the places of its terms, describes the effort better than laws do."""
    ratio = error_with(data, model, event, laws) / max(model.error, _TINY)
    return separable(np.count_nonzero(data.valid) * np.log(max(ratio, _TINY)))


def recurring(data: AxisData, model: FittedModel) -> dict[int, str]:
    """Reasons against events of one recording that are too many for each to have happened once.

    Events that overlap are one: a pulse of another shape takes several. So are changes that the
    filter of the comparison reaches at once: a mass is not taken up in no time.

    Returns
    -------
    mapping of place to str
        Places are those of `model.terms`.
    """
    doubts: dict[int, str] = {}
    for events in overlapping(model, _reach_s(data)).values():
        if len(events) > MOST_EVENTS:
            reason = (
                f"{len(events)} of them are in one recording: something recurs that no effect "
                "describes"
            )
            doubts |= dict.fromkeys((k for event in events for k in event), reason)
    return doubts


def brief(data: AxisData, model: FittedModel, excitation: Excitation) -> dict[int, str]:
    """Reasons against changes that last, of which the next takes one back too soon.

    A mass tells itself from a push by costing effort both ways, so it stays for a cycle.

    Returns
    -------
    mapping of place to str
        Places are those of `model.terms`.
    """
    cycle_s = 2.0 * np.pi / excitation.turning_rate
    doubts: dict[int, str] = {}
    for events in overlapping(model, _reach_s(data)).values():
        lasting = [
            event
            for event in events
            if {*model.terms[event[0]].nonlinear} & {"time", "duration"} == {"time"}
        ]
        for one, other in pairwise(lasting):
            ends_s, begins_s = (model.terms[k].nonlinear["time"] for k in (other[0], one[-1]))
            if ends_s - begins_s < cycle_s:
                reason = (
                    f"what lasts for {ends_s - begins_s:.3g} s alone, less than a cycle of the "
                    f"motion ({cycle_s:.3g} s), may be a push"
                )
                doubts |= dict.fromkeys((*one, *other), reason)
    return doubts


def _reach_s(data: AxisData) -> float:
    """For how long the filter of the comparison holds two changes to be one."""
    return REACH_PERIODS / max(s.cutoff_hz for s in data.segments)


def overlapping(
    model: FittedModel, lasts_s: float = 0.0
) -> dict[tuple[str, float | None], list[list[int]]]:
    """Terms tied to time that are one event, because each overlaps the next.

    Parameters
    ----------
    lasts_s : float
        For which a change that lasts is still the same one.

    Returns
    -------
    mapping of (effect, clock) to list of lists of int
        Places of the terms in `model.terms`, event by event.
    """
    places = defaultdict(list)
    for k, t in enumerate(model.terms):
        if tied_to_time(t):
            begins_s = t.nonlinear.get("time", 0.0)
            ends_s = begins_s + t.nonlinear.get("duration", lasts_s)
            places[t.candidate.effect, t.nonlinear.get("clock")].append((begins_s, ends_s, k))
    found = {}
    for kind, several in places.items():
        events: list[list[int]] = []
        over_s = -np.inf
        for begins_s, ends_s, k in sorted(several):
            if begins_s > over_s:
                events.append([])
            events[-1].append(k)
            over_s = max(over_s, ends_s)
        found[kind] = events
    return found


def _of_term(segment: Segment, model: FittedModel, index: int) -> Array:
    """Effort (N,) of one added term along the motion, unfiltered."""
    return along(segment, model.axis) - along(segment, model.axis_without([index]))


def _everywhere(data: AxisData, model: FittedModel, index: int) -> Array:
    """Effort (N,) of one added term along all motions, one after the other."""
    return np.concatenate([_of_term(s, model, index) for s in data.segments])


def _held_while(segment: Segment, effort: Array, travel: float) -> bool:
    """Whether friction may hold the axis while an effort (N,) acts, as far as it is compared."""
    energy = np.square(effort)
    held = float(np.sum(energy[may_be_held(segment, travel)]))
    lasts_s = segment.period_s * np.sum(energy) / max(float(np.max(energy)), _TINY)
    resolved = lasts_s > 1.0 / segment.band.cutoff_hz
    return held > (HELD * float(np.sum(energy)) if resolved else 0.0)


# Where friction may hold the axis: at a stop, and as far from it as a sound chain winds up.
#
# While the table sticks, its chain winds up, and an encoder on the motor sees it creep; so does one
# on a guide with presliding.


def most_friction(model: FittedModel) -> float:
    """Largest change of the friction at a stop: from one direction to the other."""
    return 2.0 * max(float(model.axis.parameters[2]), _TINY)


def held_travel(model: FittedModel) -> float:
    """Travel from a stop on within which friction may hold the axis."""
    inertia = max(float(model.axis.parameters[0]), _TINY)
    wound_up = most_friction(model) / (inertia * (2.0 * np.pi * SOUND_RESONANCE_HZ) ** 2)
    presliding = (named(t.candidate.effect).held_travel(t.values) for t in model.terms)
    return wound_up + sum(map(float, presliding))


def may_be_held(segment: Segment, travel: float) -> NDArray[np.bool_]:
    """Samples (N,) no farther from a stop than some travel, or than the encoder resolves.

    Smoothing over a time τ changes a speed by its second derivative times τ²/2. An axis that is
    slower than that may have stopped.
    """
    motion = segment.motion
    step_s = float(motion.time_s[1] - motion.time_s[0])
    smoothed_s = 1.0 / (2.0 * np.pi * segment.motion_hz)
    hidden = 0.5 * np.abs(np.gradient(motion.acceleration, step_s)) * smoothed_s**2
    backwards = np.signbit(motion.velocity)
    turned = np.diff(backwards, prepend=backwards[:1])
    stops = np.flatnonzero((np.abs(motion.velocity) < hidden) | turned)
    if not len(stops):
        return np.zeros(len(motion.velocity), dtype=bool)
    after = np.minimum(np.searchsorted(stops, np.arange(len(turned))), len(stops) - 1)
    neighbours = motion.position[stops[[after, np.maximum(after - 1, 0)]]]
    near = np.min(np.abs(motion.position - neighbours), axis=0)
    resolved = segment.position_noise * np.sqrt(12.0)
    return np.asarray(near <= max(travel, resolved))
