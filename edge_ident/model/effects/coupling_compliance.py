"""Coupling compliance: part of the inertia hangs on a spring and a damper.

The load, of load_inertia J, lags by d = x - x_load: d'' + 2·ζ·ω·d' + ω²·d = a + friction of the
load over J, where ω is the load's resonance with the encoder's side fixed. It rings after
reversals. For slow motion it adds -(J/ω²)·a'', which a smooth motion hardly shows. The base
parameters include the load's share of inertia and friction.
Source: two-mass drive, Ellis, Control System Design Guide, ch. 16.
"""

from itertools import pairwise
from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.model import search
from edge_ident.model.effect import Advice, Compensation, Draws, Effect, Parameter, Scale
from edge_ident.model.motion import Array, Motion, Values

_STOPPING_RATE: Final = 300.0  # rate (1/s) with which dry friction stops the load in a simulation


class CouplingCompliance(Effect):
    """A load on a spring; memory: how far and how fast it lags."""

    parameters = (
        Parameter("load_inertia", "{inertia}", 1e-12, 1e9, "part of the inertia behind the spring"),
        Parameter("rate", "rad/s", 1e-3, 1e6, "the load's resonance, encoder's side fixed"),
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


def _degenerate(values: Values, inertia: float) -> str:
    """A spring with so much damping that its response has no peak, or with too much behind it."""
    if not np.any(_damping(values) < 0.5**0.5):
        return "it does not ring: a filter or a soft hose lags in the same way"
    return search.heavier_than(inertia, values)


def _sound(values: Values, excitation: search.Excitation) -> bool:
    """A chain as stiff as that of any drive."""
    return bool(np.all(values["rate"] > 2.0 * np.pi * search.SOUND_RESONANCE_HZ))


def _grid(excitation: search.Excitation) -> dict[str, Array]:
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
        action="Check the clamps of the coupling and the tension of the belt. Let the controller "
        "avoid the resonance until then.",
    ),
    search=search.SearchSpec(
        forms=(
            search.Form(
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
        largest=(search.Largest(("load_inertia",), 1.0, search.Yardstick.INERTIA),),
        discrepancy=0.4,
        open_ended=("rate", "damping_ratio", "deceleration"),
        essential=("load_inertia",),
        degenerate=_degenerate,
        sound=_sound,
    ),
    draw=_draw,
    compensation=Compensation(resonance=("load_inertia", "rate", "damping_ratio")),
)


# The lag of a load on a spring, with dry friction of its own, along a given motion.
#
# Between samples the drive of the lag is straight and its dry friction constant, so each step is
# exact. All sets of values are computed side by side, time first.

Complex = NDArray[np.complex128]

# Over the whole response. A load that rings or settles within a sample is stopped by friction of
# the motion's direction; the response at the end of the sample alone would say the opposite.
_LEAST_MOBILITY: Final = 1e-9
_BLOCK: Final = 64  # samples that are computed at once
_CACHED: Final = 8192  # numbers that are multiplied at once, in a processor's cache
_STEPS: Final = 8  # samples that are computed one by one where friction changes


def lag_states(
    pole: Complex, load: Array, velocity: Array, most: Array, period_s: float
) -> tuple[Complex, Complex]:
    """States of a lag d that obeys u' = pole·u + load + friction, for u = d' - conj(pole)·d.

    Dry friction is constant over a sample: what stops the load at its end, or all there is.
    Friction reaches the motion through a linear filter. So the sequence of friction is found first,
    beside the motion that there would be without it.

    Parameters
    ----------
    pole : (D, 1) array of complex
        Of the load with the encoder's side fixed, in 1/s.
    load : (D, N) array
        Acceleration that drives the lag, but for dry friction.
    velocity : (N,) array
        Of the encoder's side.
    most : (D, 1) array
        Largest deceleration of the load by dry friction.
    period_s : float

    Returns
    -------
    states : (N, D) array of complex
        From the steady lag on, in units of the response.
    response : (D, 1) array of complex
        u at the end of a sample, from rest, to an acceleration of one.
    """
    step = pole * period_s
    decay = np.exp(step)
    # response to a load that rises to one, and one that falls from it, over a sample
    rising = (decay - 1.0 - step) / (pole * step)
    falling = (decay - 1.0) / pole - rising
    response = rising + falling  # to friction
    lean = pole.real / pole.imag
    mobility = response.real + lean * response.imag
    mobility = np.maximum(mobility, _LEAST_MOBILITY * np.abs(response))
    # the real part of a product with it: what stops the load
    stopped = (1.0 - 1j * lean) / mobility * response
    start = -(load[..., :1] + most * np.sign(velocity[..., :1])) / (pole * response)
    decays, gain, limit, stops, free, before, now, first = (
        np.broadcast_to(x, load[..., :1].shape).ravel()
        for x in (
            decay, stopped * decay, most, stopped, mobility, falling / response, rising / response,
            start,
        )
    )  # fmt: skip
    # time first: a step reads and writes what lies together
    load = np.ascontiguousarray(load.reshape(-1, load.shape[-1]).T)
    added = np.empty(load.shape, dtype=np.complex128)
    added[0] = first
    parts = (added.real, before.real, now.real), (added.imag, before.imag, now.imag)
    for part, earlier, later in parts:
        np.multiply(load[1:], later, out=part[1:])
        part[1:] += load[:-1] * earlier
    wanted = velocity[..., 1:].reshape(-1, len(load) - 1).T / free - real_product(added[1:], stops)
    wanted -= real_product(_filtered(added, decays)[:-1], gain)
    added.real[1:] += _friction(wanted, decays, gain, limit)
    return _filtered(added, decays), response


def real_product(states: Complex, factor: Complex) -> Array:
    """Real part of products of states (N, D) with a factor (D,) each, a few samples at once."""
    product, count = np.empty(states.shape), max(1, _CACHED // len(factor))
    for first in range(0, len(states), count):
        part, found = states[first : first + count], product[first : first + count]
        np.multiply(part.real, factor.real, out=found)
        found -= part.imag * factor.imag
    return product


def _filtered(added: Complex, decay: Complex) -> Complex:
    """States (N, D) that decay from one sample to the next, where (N, D) is added.

    Blocks of samples are filtered side by side, and then what each begins with is added.
    """
    count = -(-len(added) // _BLOCK)
    states = np.zeros((count, _BLOCK, len(decay)), dtype=np.complex128)
    states.reshape(-1, len(decay))[: len(added)] = added
    left = np.empty((count, len(decay)), dtype=np.complex128)
    for k in range(1, _BLOCK):
        states[:, k] += np.multiply(decay, states[:, k - 1], out=left)
    powers = decay ** np.arange(1, _BLOCK + 1)[:, None]
    for before, block in pairwise(states):
        block += powers * before[-1]
    return states.reshape(-1, len(decay))[: len(added)]


def _friction(wanted: Array, decay: Complex, gain: Complex, most: Array) -> Array:
    """Dry friction (N, D) on loads, sample by sample.

    While friction keeps its sign and size on all of them, its effect is known in closed form.

    Parameters
    ----------
    wanted : (N, D) array
        Friction that would stop the load if there had been none before.
    decay, gain : (D,) arrays
        What friction of one leaves at the next sample, and the friction that this asks for there.
    most : (D,) array
    """
    friction, state = np.empty_like(wanted), np.zeros_like(decay)
    powers = decay ** np.arange(_BLOCK + 1)[:, None]
    shares = gain * powers[:-1]
    cosine, sine = shares.real.copy(), shares.imag.copy()
    least, left, k = -most, 1.0 / (1.0 - decay), 0
    while k < len(wanted):
        for target, now in zip(wanted[k : k + _STEPS], friction[k : k + _STEPS], strict=True):
            stopping = target - (gain * state).real
            np.minimum(np.maximum(stopping, least), most, out=now)
            state = decay * state + now
        k += _STEPS
        if (np.abs(stopping) >= most).all():
            steady = left * now
            off = state - steady
            ahead = wanted[k : k + _BLOCK]
            stopping = ahead - (gain * steady).real - cosine[: len(ahead)] * off.real
            stopping += sine[: len(ahead)] * off.imag
            kept = np.minimum(np.maximum(stopping, least), most) == now
            same = np.append(kept.all(axis=1), False)
            count = int(same.argmin())
            friction[k : k + count] = now
            state = steady + powers[count] * off
            k += count
    return friction
