"""Gains and setpoints drawn from a seed, and the control law once more, term by term as documented.

The terms are written for one number at a time, with numpy's own interpolation, and share nothing
with `firmware_interface.control_law`.
"""

import math
from dataclasses import replace

import numpy as np

from firmware_interface.gains import GAIN_FIELDS, POSITIVE, SIGNED, AxisGains
from firmware_interface.motion import Multisine, Reference, SineComponent, reference
from firmware_interface.virtual.controller import Setpoint
from firmware_interface.virtual.settings import DEFAULT_LIMITS

PERIOD_S = 0.0025
NEUTRAL = AxisGains.of_numbers([0.0] * 7 + [0.05, 0.0])
"""No effort at all."""


def drawn_gains(rng: np.random.Generator, **fixed: object) -> AxisGains:
    """All numbers on: anywhere within what a board allows, distances short enough to matter."""
    largest = DEFAULT_LIMITS.gain_maximum.numbers()
    numbers = {}
    for name, maximum in largest.items():
        low = 0.01 if name in POSITIVE else -1.0 if name in SIGNED else 0.0
        numbers[name] = float(np.float32(rng.uniform(low, 1.0) * maximum))
    gains = AxisGains.of_numbers(list(numbers.values()))
    short = {
        "table_start_rad": -1.0,
        "table_step_rad": 0.09375,
        "presliding_distance_rad": 0.015625,
        "backlash_offset_rad": 0.0078125,
        "backlash_distance_rad": 0.03125,
        "friction_top_speed_rad_s": 2.0,
        "table_fade_speed_rad_s": 1.0,
        "ripple_fade_speed_rad_s": (1.0, 0.0, 0.5, 2.0),
        "ripple_period_rad": (0.25, 0.5, 1.0, 6.25),
    }
    return replace(gains, **{**short, **fixed})  # type: ignore[arg-type]


def of_map_3(gains: AxisGains) -> AxisGains:
    """The same with all that came later off."""
    later = set(GAIN_FIELDS[4]) - set(GAIN_FIELDS[3])
    return replace(gains, **{name: getattr(NEUTRAL, name) for name in later})


def drawn_way(rng: np.random.Generator, duration_s: float = 4.0) -> Reference:
    """A motion with many reversals, over the tables and beyond them, in 32-bit floats."""
    sines = [
        SineComponent(float(rng.uniform(0.1, 0.7)), float(w), float(rng.uniform(0.0, 6.0)))
        for w in rng.uniform(0.5, 6.0, 4)
    ]
    times = np.arange(0.0, duration_s, PERIOD_S)
    way = reference(Multisine(tuple(sines)), times, 1.0, 0.0)
    return Reference(*(np.float64(np.float32(column)) for column in vars(way).values()))


def rows(way: Reference) -> list[Setpoint]:
    """Sample by sample."""
    return [Setpoint(*row) for row in zip(*(c.tolist() for c in vars(way).values()), strict=True)]


def documented_feedforward(
    gains: AxisGains, own: Setpoint, other: Setpoint, z: float, b: float
) -> float:
    """All terms of the feed-forward."""
    return math.fsum(
        (
            old_feedforward(gains, own._replace(position_rad=own.position_rad + b)),
            curve(gains, own),
            position_tables(gains, own.position_rad + b, own.velocity_rad_s),
            gains.presliding_feedforward * z,
            gains.cross_inertia_feedforward * other.acceleration_rad_s2,
            gains.cross_viscous_feedforward * other.velocity_rad_s,
            gains.cross_coulomb_feedforward * direction(gains, other.velocity_rad_s),
            lost(gains, own),
        )
    )


def direction(gains: AxisGains, velocity: float) -> float:
    return math.tanh(velocity / gains.coulomb_smoothing_rad_s)


def old_feedforward(gains: AxisGains, own: Setpoint) -> float:
    """The law of map 3, but for the fading of ripples."""
    velocity = own.velocity_rad_s
    slowness = velocity / gains.stribeck_speed_rad_s
    effort = (
        gains.inertia_feedforward * own.acceleration_rad_s2
        + gains.viscous_feedforward * velocity
        + gains.viscous_difference_feedforward * abs(velocity)
        + (gains.coulomb_feedforward + gains.stribeck_feedforward * math.exp(-slowness * slowness))
        * direction(gains, velocity)
        + gains.offset_feedforward
    )
    for k, period in enumerate(gains.ripple_period_rad):
        angle = 2.0 * math.pi * own.position_rad / period
        share = fade(velocity, gains.ripple_fade_speed_rad_s[k])
        effort = effort + share * gains.ripple_cosine[k] * math.cos(angle)
        effort = effort + share * gains.ripple_sine[k] * math.sin(angle)
    return effort


def fade(velocity: float, up_to: float) -> float:
    return float(np.interp(abs(velocity), [up_to, 2.0 * up_to], [1.0, 0.0])) if up_to else 1.0


def curve(gains: AxisGains, own: Setpoint) -> float:
    top, velocity = gains.friction_top_speed_rad_s, own.velocity_rad_s
    table = gains.friction_forward if velocity > 0.0 else gains.friction_backward
    at = [k / 11.0 for k in range(13)]
    level = np.interp(math.sqrt(abs(velocity) / top), at, [*table, 0.0])
    return float(level) * direction(gains, velocity)


def position_tables(gains: AxisGains, position: float, velocity: float) -> float:
    at = gains.table_start_rad + gains.table_step_rad * np.arange(-1, 25)
    load, friction = (
        float(np.interp(position, at, [0.0, *table, 0.0]))
        for table in (gains.load_table, gains.local_friction_table)
    )
    share = fade(velocity, gains.table_fade_speed_rad_s)
    return share * (load + friction * direction(gains, velocity))


def lost(gains: AxisGains, own: Setpoint) -> float:
    d = direction(gains, own.velocity_rad_s)
    y = (
        gains.transmitted_inertia * own.acceleration_rad_s2
        + gains.offset_feedforward
        + gains.transmitted_friction
        * (gains.viscous_feedforward * own.velocity_rad_s + gains.coulomb_feedforward * d)
    )
    return y / (1.0 - gains.transmission_loss * d * np.sign(y)) - y


def stepped(gains: AxisGains, z: float, b: float, dx: float) -> tuple[float, float]:
    """Both states one sample later."""
    s = float(np.sign(dx))
    if s == 0.0:
        return z, b
    reached = s * gains.backlash_offset_rad
    return (
        s - (s - z) * math.exp(-abs(dx) / gains.presliding_distance_rad),
        reached - (reached - b) * math.exp(-abs(dx) / gains.backlash_distance_rad),
    )
