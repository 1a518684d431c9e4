"""Noncollocated compliance: a spring between the motor and the encoder, which is on the load.

A linear scale, or an encoder behind belt, coupling or gear, reads the load. The motor has to wind
the spring up first: command = effort + 2·ζ·effort'/ω + effort''/ω², where ω is the resonance with
both sides free. lag_per_acceleration is 1/ω². Inertia and friction are taken to be shared alike
between both sides; derivatives are taken over steps of 1/ω.
Source: two-mass drive with a load encoder, Ellis, Control System Design Guide, ch. 16.
"""

from typing import Final

import numpy as np

from edge_ident.model.effect import Advice, Compensation, Draws, Effect, Parameter, Scale
from edge_ident.model.motion import Array, Motion, Values
from edge_ident.model.search import SOUND_RESONANCE_HZ, Excitation, Form, SearchSpec

# Damping ratio of drive trains of metal. Along a motion, damping is a delay, and belongs to the
# shift of the effort: no recording of the load's encoder tells it.
_USUAL_DAMPING: Final = 0.03
_FASTEST: Final = 1e4  # resonance in rad/s above which nothing is integrated
# Fourth-order second derivative: weights of the values 0, 1 and 2 steps to either side.
_SECOND: Final = (-15.0 / 12.0, 16.0 / 12.0, -1.0 / 12.0)


class NoncollocatedCompliance(Effect):
    """A spring before the encoder; memory: the effort that passes it, and its rate."""

    parameters = (
        Parameter("lag_per_acceleration", "s^2", 0.0, 1.0, "1/ω² of the free resonance ω in rad/s"),
        Parameter("damping_ratio", "1", 0.0, 0.99, "of that resonance", default=_USUAL_DAMPING),
    )
    memory_size = 2

    def command(self, torque: Array, time_s: Array, values: Values) -> Array:
        """What the motor gives so that this much passes the spring."""
        shape = np.broadcast_shapes(values["lag_per_acceleration"].shape, torque.shape)
        rows = np.broadcast_to(torque, shape).reshape(-1, shape[-1])
        square, damping = (
            np.broadcast_to(values[name], (*shape[:-1], 1)).reshape(-1, 1)
            for name in ("lag_per_acceleration", "damping_ratio")
        )
        period_s, result = float(time_s[1] - time_s[0]), rows.copy()
        steps = np.maximum(np.rint(np.sqrt(square[:, 0]) / period_s).astype(np.intp), 1)
        for step in np.unique(steps):
            here = steps == step
            first, second = _derivatives(rows[here], int(step), period_s)
            result[here] += 2.0 * damping[here] * np.sqrt(square[here]) * first
            result[here] += square[here] * second
        return result.reshape(shape)

    def transmitted(self, at: Motion, values: Values) -> Array:
        """What passes the spring."""
        return np.asarray(at.memory[0])

    def start(self, at: Motion, values: Values) -> Array:
        """Wound up by what holds the axis."""
        return np.stack([at.driven, np.zeros_like(at.driven)])

    def rates(self, at: Motion, values: Values) -> Array:
        """Rates of the effort that passes, and of its rate."""
        passing, rate = at.memory
        omega = _resonance(values)
        missing = omega * (at.driven - passing) - 2.0 * values["damping_ratio"] * rate
        return np.array([rate, omega * missing])

    def fastest_rate(self, values: Values, inertia: Array, speed: float) -> Array:
        """The resonance."""
        return _resonance(values)


def _derivatives(rows: Array, step: int, period_s: float) -> tuple[Array, Array]:
    """First and second derivative of rows (K, N) by time, over steps of so many samples."""
    count, reach, width_s = rows.shape[-1], 2 * step, step * period_s
    if count <= reach:
        return np.zeros_like(rows), np.zeros_like(rows)
    around = np.pad(rows, ((0, 0), (reach, reach)), mode="reflect", reflect_type="odd")

    def moved(steps: int) -> Array:
        return around[:, reach + steps * step :][:, :count]

    first = (moved(1) - moved(-1)) / (2.0 * width_s)
    sides = np.stack([moved(k) + moved(-k) for k in range(len(_SECOND))])
    return first, np.tensordot(_SECOND, sides, axes=1) / width_s**2


def _resonance(values: Values) -> Array:
    """Resonance with both sides free, in rad/s."""
    return 1.0 / np.sqrt(np.maximum(values["lag_per_acceleration"], _FASTEST**-2))


def _sound(values: Values, excitation: Excitation) -> bool:
    """A chain as stiff as that of any drive."""
    return bool(np.all(_resonance(values) > 2.0 * np.pi * SOUND_RESONANCE_HZ))


def _physical(values: Values, excitation: Excitation) -> bool:
    """A motion stays below the resonance: what turns faster would leave the load behind."""
    return bool(np.all(_resonance(values) > excitation.turning_rate))


def _draw(draws: Draws, scale: Scale) -> dict[str, Array]:
    """2 to 30 Hz, hardly to well damped."""
    rate = 2.0 * np.pi * draws.log_uniform(2.0, 30.0)
    return {"lag_per_acceleration": rate**-2.0, "damping_ratio": draws.log_uniform(0.01, 0.3)}


EFFECT: Final = NoncollocatedCompliance(
    advice=Advice(
        in_words="the motor winds up a spring before the load, and with it the encoder, follows",
        part="belt, screw, coupling or gear between the motor and the encoder of the load",
        action="Close the speed loop on the motor's own encoder where there is one, and the "
        "position loop well below the resonance. Check the clamps of the coupling and the tension "
        "of the belt.",
    ),
    search=SearchSpec(
        forms=(Form(("lag_per_acceleration",)),),
        signature="grows with the second derivative of the whole effort, and leads it",
        alternatives=("coupling_compliance", "time_delay", "backlash"),
        experiment="a motion with content up to the resonance: --motion multisine",
        physical=_physical,
        discrepancy=0.25,
        sound=_sound,
    ),
    draw=_draw,
    compensation=Compensation(series_resonance=("lag_per_acceleration", "damping_ratio")),
)
