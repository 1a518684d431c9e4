"""Coupling compliance: part of the inertia hangs on a spring and a damper.

The load, of load_inertia J, lags by d = x - x_load: d'' + 2·ζ·ω·d' + ω²·d = a + friction of the
load over J. There ω is the load's resonance with the encoder's side held. The drive feels the
spring instead of the load. It rings at a fixed frequency after reversals. For slow motion it adds
-(J/ω²)·a'', in proportion to the snap, which a smooth slow motion hardly shows. The load has a
share of the axis's friction, which can hold it; the base parameters include that share.
Source: two-mass drive, Ellis, Control System Design Guide, ch. 16.
"""

from typing import Final

import numpy as np

from edge_ident.model.advice import Advice
from edge_ident.model.compensation import Compensation
from edge_ident.model.effect import Array, Effect, Parameter, Values
from edge_ident.model.load_on_spring import lag_states, real_product
from edge_ident.model.motion import Motion
from edge_ident.model.search import SOUND_RESONANCE_HZ, Excitation, Form, SearchSpec, heavier_than
from edge_ident.model.strengths import Draws, Scale

_STOPPING_RATE: Final = 300.0
"""Rate (1/s) with which dry friction stops the load in a simulation."""


class CouplingCompliance(Effect):
    """A load on a spring; memory: how far and how fast it lags."""

    parameters = (
        Parameter("load_inertia", "{inertia}", 1e-12, 1e9, "part of the inertia behind the spring"),
        Parameter("rate", "rad/s", 1e-3, 1e6, "the load's resonance, encoder's side held"),
        Parameter("damping_ratio", "1", 0.0, 0.99, "of that resonance"),
        Parameter(
            "deceleration",
            "{position}/s^2",
            0.0,
            1e9,
            "of the load by its Coulomb friction: that over load_inertia",
            default=0.0,
        ),
        Parameter(
            "damping_rate", "1/s", 0.0, 1e6, "its viscous friction over load_inertia", default=0.0
        ),
        Parameter(
            "weight", "{position}/s^2", -1e9, 1e9, "its share of the offset over it", default=0.0
        ),
    )
    memory_size = 2
    memory_scale = "load_inertia"

    def load(self, at: Motion, values: Values) -> Array:
        """Spring and damper, in place of the viscous friction of a load that is carried along."""
        carried = values["damping_rate"] * at.velocity + values["weight"]
        return values["load_inertia"] * (_pull(at.memory[0], at.memory[1], values) - carried)

    def friction(self, at: Motion, values: Values) -> Array:
        """What is left of it on the encoder's side."""
        return -values["load_inertia"] * values["deceleration"]

    def inertia(self, at: Motion, values: Values) -> Array:
        """What is left of it on the encoder's side."""
        return -values["load_inertia"]

    def start(self, at: Motion, values: Values) -> Array:
        """The load's position and speed are those of the encoder's side."""
        return np.zeros((2, *np.shape(at.position)))

    def rates(self, at: Motion, values: Values) -> Array:
        """Rates of the lag; friction is smoothed where the load would stop at once."""
        lag, lag_speed = at.memory
        speed, deceleration = at.velocity - lag_speed, values["deceleration"]
        slowing = np.minimum(np.maximum(_STOPPING_RATE * speed, -deceleration), deceleration)
        slowing = slowing + values["damping_rate"] * speed + values["weight"]
        return np.array([lag_speed, at.acceleration + slowing - _pull(lag, lag_speed, values)])

    def fastest_rate(self, values: Values, inertia: Array, speed: float) -> Array:
        """Resonance with both sides free."""
        return values["rate"] * np.sqrt(1.0 + values["load_inertia"] / inertia)

    def resistance(self, motion: Motion, values: Values) -> Array:
        """The lag's equation, exact for loads straight between samples and for dry friction that is
        constant between them."""
        rate, friction = values["rate"], values["deceleration"]
        ratio = np.minimum(_damping(values), 0.99)
        pole = rate * (-ratio + 1j * np.sqrt(1.0 - ratio**2))
        viscous = values["damping_rate"] * motion.velocity
        smooth = motion.acceleration + viscous + values["weight"]
        period_s = float(motion.time_s[1] - motion.time_s[0])
        states, response = lag_states(pole, smooth, motion.velocity, friction, period_s)
        # the lag is the imaginary part of u over that of the pole, and its speed the real part
        # of u with pole.real times the lag: so the pull is the real part of a product with u
        by_speed = 2.0 * values["damping_ratio"] * rate
        weight = (by_speed - 1j * (rate**2 + by_speed * pole.real) / pole.imag) * response
        pull = real_product(states, np.broadcast_to(weight, smooth[..., :1].shape).ravel())
        carried = smooth + friction * motion.direction
        return values["load_inertia"] * (pull.T.reshape(smooth.shape) - carried)


def _physical(values: Values, excitation: Excitation) -> bool:
    """No more inertia than the drive moved."""
    return excitation.moved(values["load_inertia"])


def _degenerate(values: Values, inertia: float) -> str:
    """A spring with so much damping that its response has no peak, or with too much behind it."""
    if not np.any(_damping(values) < 0.5**0.5):
        return "it does not ring: a filter or a soft hose lags in the same way"
    return heavier_than(inertia, values)


def _sound(values: Values, excitation: Excitation) -> bool:
    """A chain as stiff as that of any drive."""
    return bool(np.all(values["rate"] > 2.0 * np.pi * SOUND_RESONANCE_HZ))


def _grid(excitation: Excitation) -> dict[str, Array]:
    """Resonances that the filter passes, and those beyond, of which a trace is left."""
    highest = 3.0 * 2.0 * np.pi * excitation.cutoff_hz
    lowest = max(highest / 30.0, 2.0 * np.pi / excitation.duration_s)
    inertia, viscous, coulomb, offset = excitation.base
    inertia, viscous, coulomb = (max(x, 1e-9) for x in (inertia, viscous, coulomb))
    # the lighter the damping, the narrower the resonance
    sets = [
        (rate, ratio, share)
        for ratio, count in ((0.03, 40), (0.1, 16), (0.3, 6), (0.8, 4))
        for rate in np.geomspace(lowest, highest, count)
        for share in (0.3, 1.5)
    ]
    rate, ratio, share = np.array(sets).T
    return {
        "rate": rate,
        "damping_ratio": ratio,
        "deceleration": share * coulomb / inertia,
        "damping_rate": np.full(len(rate), 1.5 * viscous / inertia),
        "weight": np.full(len(rate), 2.0 * offset / inertia),
    }


def _draw(draws: Draws, scale: Scale) -> dict[str, Array]:
    """20 % to 80 % of the inertia at 2 to 30 Hz, hardly to well damped."""
    return {
        "load_inertia": draws.uniform(0.2, 0.8) * scale.inertia,
        "rate": 2.0 * np.pi * draws.log_uniform(2.0, 30.0),
        "damping_ratio": draws.log_uniform(0.01, 0.3),
        "deceleration": draws.uniform(0.0, 1.0) * scale.coulomb_friction / scale.inertia,
        "damping_rate": draws.uniform(0.0, 1.0) * scale.viscous_friction / scale.inertia,
        "weight": np.zeros(draws.shape),
    }


def _damping(values: Values) -> Array:
    """Damping ratio of the load, with its own viscous friction."""
    return values["damping_ratio"] + 0.5 * values["damping_rate"] / values["rate"]


def _pull(lag: Array, lag_speed: Array, values: Values) -> Array:
    """Acceleration that spring and damper give the load."""
    rate = values["rate"]
    return rate * (rate * lag + 2.0 * values["damping_ratio"] * lag_speed)


EFFECT: Final = CouplingCompliance(
    advice=Advice(
        in_words="the drive train is springy: the load swings against the motor",
        part="coupling, belt, screw and their mounts",
        action=(
            "Check the clamps of the coupling and the tension of the belt. Let the controller "
            "avoid the resonance until then."
        ),
    ),
    search=SearchSpec(
        forms=(
            Form(
                ("load_inertia",),
                ("rate", "damping_ratio", "deceleration", "damping_rate", "weight"),
            ),
        ),
        signature="ringing of one frequency, whatever the amplitude, where the acceleration jumps",
        alternatives=(
            "noncollocated_compliance",
            "time_delay",
            "backlash",
            "presliding_hysteresis",
        ),
        experiment="a motion with content up to the resonance: --motion multisine",
        grid=_grid,
        physical=_physical,
        discrepancy=0.4,
        open_ended=("rate", "damping_ratio", "deceleration"),
        essential=("load_inertia",),
        degenerate=_degenerate,
        sound=_sound,
    ),
    draw=_draw,
    compensation=Compensation(resonance=("load_inertia", "rate", "damping_ratio")),
)
