"""One term of a model in the fields of the board's law."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from typing import Any, Final, Self

import numpy as np

from edge_ident.control.position_loop import LoopHardware
from edge_ident.model.effect import Compensation
from edge_ident.model.effects import named
from edge_ident.model.inverse import steady_effort
from edge_ident.model.model import AxisModel, Term
from edge_ident.model.model_files import unit_of
from edge_ident.model.motion import Array
from edge_ident.model.repeating import Repeating
from firmware_interface.control_law import feedforward_nm
from firmware_interface.gains import FRICTION_ENTRIES, TABLE_ENTRIES, AxisGains
from firmware_interface.motion import Reference

# Terms that each field of the board's law takes.
_PLACES: Final = {
    field.name: len(field.default) if isinstance(field.default, tuple) else 1
    for field in fields(AxisGains)
}
_DOUBT_STD: Final = 2.0  # standard deviations by which a width is in doubt
_NO_RANGE: Final = "the model does not say in which range it is supported"
_NO_MOTION: Final = "the range in which it is supported has no width"


# Curves over speed and tables over position, sampled from an effect's own physics.
#
# An effect whose effort depends on the velocity alone, or on position and direction alone, is asked
# for its effort at constant speeds. The entries of the board's law are the least-squares fit of its
# straight lines to that effort, so what a table leaves is never more than what there was. Nothing
# is sampled outside the range in which the term was supported.

_PER_CELL: Final = 16  # samples of the effort between two entries
# Weight of samples, of the sixteen of an inner entry, from which one can be told: an end of which a
# third of the cell is supported.
_ENOUGH: Final = 1.0
_ROUNDING: Final = 1e-9
LARGEST_REST: Final = 0.5
"""Share of a term's rms that its table may leave; a table that leaves more is too coarse for it."""


# What feed-forward asks for at constant speed, anywhere in the range that supports a model.
#
# Acceleration is not counted: how much of it a motion takes is the motion's choice, and the board
# refuses a motion whose feed-forward asks for more than the effort limit.

_POSITIONS: Final = 400
_SPEEDS: Final = 61


@dataclass(frozen=True)
class EffortRange:
    """Constant speeds that are supported, everywhere along the supported positions.

    Attributes
    ----------
    motion : Reference
        (P·V,) samples without acceleration.
    top_speed, top_acceleration : float
        Largest that are supported, in either direction.
    """

    motion: Reference
    top_speed: float
    top_acceleration: float

    @classmethod
    def of(cls, axis: AxisModel) -> Self | None:
        """The range of all terms of an axis; None where no term says it."""
        known = [term.supported for term in axis.terms if term.supported is not None]
        if not known:
            return None
        low, high = np.transpose([supported.position for supported in known])
        speeds = np.array([supported.speed for supported in known])
        accelerations = np.array([supported.acceleration for supported in known])
        position, velocity = np.meshgrid(
            np.linspace(low.min(), high.max(), _POSITIONS),
            np.linspace(speeds.min(), speeds.max(), _SPEEDS),
        )
        still = np.zeros(position.size)
        return cls(
            Reference(position.ravel(), velocity.ravel(), still),
            float(np.max(np.abs(speeds))),
            float(np.max(np.abs(accelerations))),
        )

    def largest_nm(self, gains: AxisGains) -> float:
        """Largest feed-forward, with what the law adds from its memory and for its actuator.

        The other axis is taken to be as fast as this one.
        """
        alone = float(np.max(np.abs(feedforward_nm(gains, self.motion, np))))
        other = abs(gains.cross_viscous_feedforward) * self.top_speed
        return (
            alone
            + other
            + abs(gains.cross_coulomb_feedforward)
            + gains.presliding_feedforward
            + gains.deadband_inverse
        )


@dataclass(frozen=True)
class Sampled:
    """A term in the entries of the law.

    Attributes
    ----------
    entries : (2, K) array
        Forward and backward levels of a friction curve; load and friction of the tables.
    rest : float
        Share of the term's rms over its range that the entries leave.
    """

    entries: Array
    rest: float


def sampled_over_speed(term: Term, top_rad_s: float) -> Sampled:
    """A term as friction levels forward and backward, up to the speed supported each way."""
    assert term.supported is not None
    backward, forward = term.supported.speed
    nodes: Array = np.arange(FRICTION_ENTRIES) / (
        FRICTION_ENTRIES - 1
    )  # in √(speed/top), in which the law is straight
    fits = []
    for direction, top in ((1.0, forward), (-1.0, -backward)):
        at = _between(nodes, 0.0, np.sqrt(max(top, 0.0) / top_rad_s))
        speed = direction * top_rad_s * at**2
        level = direction * steady_effort(term, np.zeros_like(speed), speed, direction)
        fits.append(_fitted(at, level, nodes))
    return _sampled(fits)


def sampled_over_position(term: Term, start_rad: float, step_rad: float) -> Sampled:
    """A term as a load and a friction level along its range of positions."""
    assert term.supported is not None
    nodes: Array = start_rad + step_rad * np.arange(TABLE_ENTRIES, dtype=np.float64)
    at = _between(nodes, *term.supported.position)
    forward, backward = (steady_effort(term, at, np.full_like(at, way), way) for way in (1.0, -1.0))
    halves = (0.5 * (forward + backward), 0.5 * (forward - backward))
    return _sampled([_fitted(at, half, nodes) for half in halves])


def _between(nodes: Array, low: float, high: float) -> Array:
    """Samples in the middle of even parts of the cells, as far as a range goes."""
    step = (nodes[1] - nodes[0]) / _PER_CELL
    at = nodes[0] + step * (np.arange(_PER_CELL * (len(nodes) - 1)) + 0.5)
    return np.asarray(at[(at > low) & (at < high)])


def _fitted(at: Array, level: Array, nodes: Array) -> tuple[Array, Array, Array]:
    """Entries at the nodes, what they leave, and the level itself."""
    entries = np.zeros(len(nodes))
    if not len(at):
        return entries, level, level
    place = (at - nodes[0]) / (nodes[1] - nodes[0])
    hats = np.maximum(1.0 - np.abs(place[:, None] - np.arange(len(nodes))), 0.0)
    reached = hats.sum(axis=0) >= _ENOUGH
    inside = hats @ reached > 1.0 - _ROUNDING  # between entries that can be told
    if np.any(inside):
        known = hats[np.ix_(inside, reached)]
        entries[reached] = np.linalg.lstsq(known, level[inside], rcond=None)[0]
    return entries, level - hats @ entries, level


def _sampled(fits: list[tuple[Array, Array, Array]]) -> Sampled:
    left, whole = (
        float(np.sqrt(np.sum([np.sum(np.square(fit[k])) for fit in fits]))) for k in (1, 2)
    )
    return Sampled(np.array([fit[0] for fit in fits]), left / whole if whole else 0.0)


@dataclass(frozen=True)
class Placed:
    """Gains with one term more.

    Attributes
    ----------
    gains : AxisGains
    sentence : str
        What became of the term; a part of a sentence.
    """

    gains: AxisGains
    sentence: str


@dataclass(frozen=True)
class Placement:
    """What decides how terms of an axis enter the law.

    Attributes
    ----------
    axis : AxisModel
    hardware : LoopHardware
    late_s : float
        From a sample to the middle of the period in which its effort acts.
    gain_margin : float
        That the loop keeps.
    reach : EffortRange or None
    """

    axis: AxisModel
    hardware: LoopHardware
    late_s: float
    gain_margin: float
    reach: EffortRange | None

    def placed(self, gains: AxisGains, term: Term, number: int) -> Placed | str:
        """Gains with a term, or the reason why they cannot have it.

        Parameters
        ----------
        gains : AxisGains
        term : Term
        number : int
            Terms of the same effect that the gains have already.
        """
        if named(term.effect).compensation.at_end:
            return Placed(gains, "the gains fit the machine as it was at the end of the recording")
        over = named(term.effect).compensation.sampled(term.values)
        if over and term.supported is None:
            return _NO_RANGE
        if over == "speed":
            return self._in_curve(gains, term)
        if over == "position":
            return self._in_tables(gains, term)
        return self._in_fields(gains, term, number)

    # ---- a curve and tables

    def _in_curve(self, gains: AxisGains, term: Term) -> Placed | str:
        assert self.reach is not None
        top = self.reach.top_speed
        if not top:
            return _NO_MOTION
        found = sampled_over_speed(term, top)
        if found.rest > LARGEST_REST:
            return _too_coarse(found, FRICTION_ENTRIES)
        present = np.array([gains.friction_forward, gains.friction_backward])
        forward, backward = (present + found.entries).tolist()
        changed = replace(
            gains,
            friction_top_speed_rad_s=top,
            friction_forward=tuple(forward),
            friction_backward=tuple(backward),
        )
        unit = self.axis.position_unit
        return Placed(
            changed,
            f"friction curve of {FRICTION_ENTRIES} entries each way up to {top:.3g} {unit}/s"
            + _leaves(found),
        )

    def _in_tables(self, gains: AxisGains, term: Term) -> Placed | str:
        if named(term.effect).has_source(term.source_axis):
            return "it depends on another axis's position, and the board's tables on one alone"
        start, step = self._grid()
        if not step:
            return _NO_MOTION
        found = sampled_over_position(term, start, step)
        if found.rest > LARGEST_REST:
            return _too_coarse(found, TABLE_ENTRIES)
        present = np.array([gains.load_table, gains.local_friction_table])
        tables = present + found.entries
        load, friction = tables.tolist()
        fade = min(table_fade_speed(table, step, self.late_s) for table in tables)
        changed = replace(
            gains,
            table_start_rad=start,
            table_step_rad=step,
            load_table=tuple(load),
            local_friction_table=tuple(friction),
            table_fade_speed_rad_s=self._fade(fade, "table_fade_speed_rad_s"),
        )
        assert term.supported is not None
        low, high = term.supported.position
        along = f"from {low:.3g} to {high:.3g} {self.axis.position_unit}"
        return Placed(changed, f"table of {TABLE_ENTRIES} entries {along}{_leaves(found)}")

    def _grid(self) -> tuple[float, float]:
        """First entry and step of both tables, over the ranges of all terms that enter them."""
        ranges = [
            term.supported.position
            for term in self.axis.terms
            if named(term.effect).compensation.over == "position" and term.supported is not None
        ]
        start = min(low for low, _ in ranges)
        return start, (max(high for _, high in ranges) - start) / (TABLE_ENTRIES - 1)

    # ---- fields that take parameters

    def _in_fields(self, gains: AxisGains, term: Term, number: int) -> Placed | str:
        effect = named(term.effect)
        compensation = effect.compensation
        if number >= places(term.effect):
            return f"the board takes {places(term.effect)}, and this one is smaller"
        values = {name: float(value) for name, value in effect.complete(term.values).items()}
        top_speed = 0.0 if self.reach is None else self.reach.top_speed
        if objection := compensation.objection(values, top_speed):
            return objection
        fed = {p: values[p] * self._factor(compensation, p) for p in compensation.feedforward}
        for parameter, gain in compensation.feedforward.items():
            gains = _with(gains, gain, number, fed[parameter])
        for parameter, gain in compensation.takes_over.items():
            left = max(getattr(gains, gain) - values[parameter], 0.0)
            gains = _with(gains, gain, number, left)
        tuned = self._tuned(gains, term, number)
        if isinstance(tuned, str):
            return tuned
        sentence = f"fed forward with {self._listed(term, values)}{tuned.sentence}"
        note = f"; {compensation.note}" if compensation.note else ""
        return Placed(tuned.gains, sentence + note)

    def _factor(self, compensation: Compensation, parameter: str) -> float:
        factor = compensation.times.get(parameter, 1.0)
        if isinstance(factor, str):
            return float(self.axis.terms[0].values[factor])
        return factor

    def _listed(self, term: Term, values: Mapping[str, float]) -> str:
        effect, axis = named(term.effect), self.axis
        listed = []
        for parameter in effect.parameters:
            if parameter.name in effect.compensation.feedforward:
                unit = unit_of(parameter, *axis.units).replace("*", "·")
                number = f"{parameter.name} {values[parameter.name]:.3g}"
                listed.append(number if unit == "1" else f"{number} {unit}")
        return ", ".join(listed)

    def _tuned(self, gains: AxisGains, term: Term, number: int) -> Placed | str:
        """Gains with the numbers that the loop decides, for the fields that a term has taken."""
        taken = {g: p for p, g in named(term.effect).compensation.feedforward.items()}
        if "ripple_period_rad" in taken and "ripple_fade_speed_rad_s" in self.hardware.law:
            name = "ripple_fade_speed_rad_s"
            speed = wave_fade_speed(gains.ripple_period_rad[number], self.late_s)
            kept = self._fade(speed, name, number)
            unit = self.axis.position_unit
            return Placed(_with(gains, name, number, kept), f", whole up to {kept:.3g} {unit}/s")
        if "backlash_offset_rad" in taken:
            return self._spread(gains)
        if "deadband_inverse" in taken:
            std = term.std.get(taken["deadband_inverse"], 0.0)
            apart = named(term.effect).search.discrepancy * gains.deadband_inverse
            doubt = math.hypot(_DOUBT_STD * std, apart)
            smoothing = deadband_smoothing(doubt, self.gain_margin)
            smoothed = replace(gains, deadband_smoothing=smoothing)
            unit = self.axis.effort_unit.replace("*", "·")
            return Placed(smoothed, f", smoothed over {smoothing:.2g} {unit}")
        return Placed(gains, "")

    def _spread(self, gains: AxisGains) -> Placed | str:
        """Play, made up for over a distance."""
        if self.reach is None:
            return _NO_RANGE
        left = self.hardware.effort_limit_nm - self.reach.largest_nm(gains)
        if left <= 0.0:
            return "feed-forward leaves no effort to cross the gap with"
        gap, acceleration = 2.0 * gains.backlash_offset_rad, self.reach.top_acceleration
        inertia = float(self.axis.parameters[0])
        distance = backlash_distance(gap, inertia, acceleration, left)
        spread = replace(gains, backlash_distance_rad=distance)
        return Placed(spread, f", spread over {distance:.2g} {self.axis.position_unit}")

    def _fade(self, speed: float, gain: str, number: int = 0) -> float:
        """A fade speed: at most the speed that was supported, and what the board takes."""
        most = [speed]
        if self.reach is not None:
            most.append(self.reach.top_speed)
        if (largest := self.hardware.gain_maximum) is not None:
            bound = getattr(largest, gain)
            most.append(bound[number] if isinstance(bound, tuple) else bound)
        return min(most)


def places(effect: str) -> int:
    """Terms of an effect that the board's law takes."""
    return min(
        (_PLACES[gain] for gain in named(effect).compensation.feedforward.values()), default=0
    )


def _with(gains: AxisGains, gain: str, number: int, value: float) -> AxisGains:
    """Gains with another number in a field, or in one place of it."""
    present: Any = getattr(gains, gain)
    if isinstance(present, tuple):
        value = (*present[:number], value, *present[number + 1 :])  # type: ignore[assignment]
    changed: Any = {gain: value}
    return replace(gains, **changed)


def _leaves(found: Sampled) -> str:
    return f", which leaves {found.rest:.0%} of it"


def _too_coarse(found: Sampled, entries: int) -> str:
    return f"{entries} entries over the supported range leave {found.rest:.0%} of it"


# Numbers of the board's law that follow from the loop, not from the effect that they serve.
#
# **Fade speeds.** Feed-forward over position arrives late by the time τ from the sample to the
# middle of the period in which its effort acts. At the speed v a wave of period p is then late by
# the phase φ = 2π·v·τ/p. Taken off in full, it leaves 2·sin(φ/2) of itself, which beyond 60° is
# more than there was. So a wave acts whole up to 30°, and not at all from 60° on. A table is taken
# for a wave whose slope is as large: rms slope over rms value about the mean, for 2π/p.
#
# **Play** is crossed while the reference moves over a distance. The motor cannot cross the gap g
# faster than the effort E that is left allows, in the time T = √(4·J·g/E). A reference that turns
# back with the acceleration a moves a·T²/2 meanwhile. It is at most a third of the gap: after three
# distances 95 % are made up for, and after the gap the motor would meet the load by itself.
# Measured accelerations hold impacts, so the first bound alone would be too long. The loop smooths
# what is faster than itself, and the motor without this meets the load at √(2·a·g), which is no
# softer.
#
# **The inverse of a deadband** leaves the loop as it was designed, whatever the noise: the actuator
# takes off again what it adds. Only a width that is wrong by δ acts, like a relay. Smoothed, it
# raises the loop's gain at small efforts by 1 + δ/smoothing. That may take half of the gain margin,
# in decibels.

# Phase by which a wave may be late and still act whole; at twice that it no longer acts.
_WHOLE_UP_TO_RAD: Final = math.pi / 6.0
_DISTANCES_IN_GAP: Final = 3.0


def wave_fade_speed(period_rad: float, late_s: float) -> float:
    """Speed up to which a wave over position is fed forward whole."""
    return _WHOLE_UP_TO_RAD * period_rad / (2.0 * math.pi * late_s)


def table_fade_speed(table: Array, step_rad: float, late_s: float) -> float:
    """Speed up to which a table (K,) is fed forward whole; infinite where it is level."""
    slope = np.diff(table) / step_rad
    swing = float(np.std(table))
    if not slope.any() or not swing:
        return math.inf
    return _WHOLE_UP_TO_RAD * swing / (float(np.sqrt(np.mean(slope**2))) * late_s)


def backlash_distance(
    gap_rad: float, inertia: float, acceleration_rad_s2: float, effort_nm: float
) -> float:
    """Distance of the reference over which play is made up for.

    Parameters
    ----------
    gap_rad : float
    inertia : float
        Of the axis.
    acceleration_rad_s2 : float
        Of the reference, where it turns back; the largest.
    effort_nm : float
        That is left for it.
    """
    needed = 2.0 * acceleration_rad_s2 * inertia * gap_rad / effort_nm
    return min(needed, gap_rad / _DISTANCES_IN_GAP)


def deadband_smoothing(width_doubt_nm: float, gain_margin: float) -> float:
    """Effort over which the inverse of a deadband changes its sign.

    Parameters
    ----------
    width_doubt_nm : float
        By which its width may be wrong.
    gain_margin : float
        Of the loop, as a factor.
    """
    return width_doubt_nm / (math.sqrt(gain_margin) - 1.0)


# Effort that repeats over speed and stroke, in the curve and the tables of the board's law.
#
# They may hold named effects already. Then what repeats is added on their grid: the law is straight
# between entries. It fades out with the speed as they do (`edge_ident.control.law_terms`), and no
# entry goes beyond what the board takes.

_CURVE, _TABLES = "friction_forward", "load_table"
"""Fields of the law, by which its curve and its tables are known."""


def with_repeating(
    gains: AxisGains, repeating: Repeating, hardware: LoopHardware, late_s: float
) -> tuple[AxisGains, list[str]]:
    """Gains with what repeats, and what became of it, a sentence each.

    Parameters
    ----------
    gains : AxisGains
    repeating : Repeating
    hardware : LoopHardware
    late_s : float
        From a sample to the middle of the period in which its effort acts.
    """
    forward, backward, load, friction = repeating.tables
    said = []
    if _CURVE in hardware.law and (forward.any() or backward.any()):
        gains = _in_curve(gains, repeating, hardware)
        said.append(f"friction over speed, up to {max(map(abs, [*forward, *backward])):.2g} N·m")
    if _TABLES in hardware.law and (load.any() or friction.any()):
        gains = _in_tables(gains, repeating, hardware, late_s)
        said.append(f"effort over position, up to {max(map(abs, [*load, *friction])):.2g} N·m")
    return gains, said


def _in_curve(gains: AxisGains, repeating: Repeating, hardware: LoopHardware) -> AxisGains:
    used = any((*gains.friction_forward, *gains.friction_backward))
    top = gains.friction_top_speed_rad_s if used else repeating.grid.top_speed
    apart = math.sqrt(top / repeating.grid.top_speed)
    nodes = apart * np.arange(FRICTION_ENTRIES, dtype=np.float64)
    forward, backward, *_ = repeating.tables
    return replace(
        gains,
        friction_top_speed_rad_s=top,
        friction_forward=_added(gains, "friction_forward", forward, nodes, hardware),
        friction_backward=_added(gains, "friction_backward", backward, nodes, hardware),
    )


def _in_tables(
    gains: AxisGains, repeating: Repeating, hardware: LoopHardware, late_s: float
) -> AxisGains:
    used = any((*gains.load_table, *gains.local_friction_table))
    start, step = repeating.grid.start, repeating.grid.step
    if used:
        start, step = gains.table_start_rad, gains.table_step_rad
    at = start + step * np.arange(TABLE_ENTRIES, dtype=np.float64)
    nodes = (at - repeating.grid.start) / repeating.grid.step
    *_, load, friction = repeating.tables
    changed = replace(
        gains,
        table_start_rad=start,
        table_step_rad=step,
        load_table=_added(gains, "load_table", load, nodes, hardware),
        local_friction_table=_added(gains, "local_friction_table", friction, nodes, hardware),
    )
    tables = np.array([changed.load_table, changed.local_friction_table])
    fade = min(table_fade_speed(table, step, late_s) for table in tables)
    if hardware.gain_maximum is not None:
        fade = min(fade, hardware.gain_maximum.table_fade_speed_rad_s)
    return replace(changed, table_fade_speed_rad_s=min(fade, repeating.grid.top_speed))


def _added(
    gains: AxisGains, name: str, entries: Array, nodes: Array, hardware: LoopHardware
) -> tuple[float, ...]:
    """A table of the law with entries that lie elsewhere."""
    found = np.array(getattr(gains, name)) + np.interp(
        nodes, np.arange(len(entries), dtype=np.float64), entries, left=0.0, right=0.0
    )
    if hardware.gain_maximum is not None:
        most = np.array(getattr(hardware.gain_maximum, name))
        found = np.clip(found, -most, most)
    return tuple(found.tolist())
