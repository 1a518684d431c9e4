"""Coupling compliance: part of the inertia hangs on a spring and a damper.

The load, of load_inertia J, lags by d = x - x_load: d'' + 2·ζ·ω·d' + ω²·d = a, where ω is the
load's resonance with the encoder's side held. The drive feels J·(a - d'') instead of J·a: ringing
of fixed frequency after reversals, and for slow motion -(J/ω²)·a'', the snap, which a smooth slow
motion hardly shows. The base model's inertia includes the load's; all friction is on the
encoder's side.
Source: two-mass drive, Ellis, Control System Design Guide, ch. 16.
"""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.effect import Array, Effect, Extent, Form, Motion, Parameter, Values
from edge_ident.strengths import Draws, Scale

Complex = NDArray[np.complex128]


class CouplingCompliance(Effect):
    """A load on a spring; memory: how far and how fast it lags."""

    parameters = (
        Parameter("load_inertia", "{inertia}", 1e-12, 1e9, "part of the inertia behind the spring"),
        Parameter("rate", "rad/s", 1e-3, 1e6, "the load's resonance, encoder's side held"),
        Parameter("damping_ratio", "1", 0.0, 0.99, "of that resonance"),
    )
    discrepancy = 0.1
    forms = (Form(("load_inertia",), ("rate", "damping_ratio")),)
    signature = "ringing of one frequency, whatever the amplitude, where the acceleration jumps"
    rivals = ("time_delay", "backlash", "presliding_hysteresis")
    experiment = "a motion with content up to the resonance: --motion multisine"
    memory_size = 2

    def load(self, at: Motion, values: Values) -> Array:
        """Spring and damper."""
        return values["load_inertia"] * _pull(at.memory[0], at.memory[1], values)

    def inertia(self, at: Motion, values: Values) -> Array:
        """What is left of it on the encoder's side."""
        return -values["load_inertia"]

    def start(self, at: Motion, values: Values) -> Array:
        """The load's position and speed are those of the encoder's side."""
        return np.zeros((2, *np.shape(at.position)))

    def rates(self, at: Motion, values: Values) -> Array:
        """In the lag's coordinates, with the axis's own acceleration."""
        lag, lag_speed = at.memory
        return np.array([lag_speed, at.acceleration - _pull(lag, lag_speed, values)])

    def fastest_rate(self, values: Values, inertia: Array, speed: float) -> Array:
        """Resonance with both sides free."""
        return values["rate"] * np.sqrt(1.0 + values["load_inertia"] / inertia)

    def resistance(self, motion: Motion, values: Values) -> Array:
        """The lag's equation solved exactly for accelerations straight between samples."""
        rate, ratio = values["rate"], values["damping_ratio"]
        pole = rate * (-ratio + 1j * np.sqrt(1.0 - ratio**2))
        # u = d' - conj(pole)·d obeys u' = pole·u + a
        u = _one_pole(pole, motion)
        lag = u.imag / pole.imag
        lag_speed = u.real + pole.real * lag
        pull = _pull(lag, lag_speed, values)
        return values["load_inertia"] * (pull - motion.acceleration)

    def grid(self, extent: Extent) -> dict[str, Array]:
        """Resonances that the filter passes, and those beyond, of which a trace is left."""
        highest = 2.0 * np.pi * extent.cutoff_hz
        rates, ratios = np.meshgrid(
            np.geomspace(highest / 20.0, 4.0 * highest, 16), np.array([0.02, 0.08, 0.3])
        )
        return {"rate": rates.ravel(), "damping_ratio": ratios.ravel()}

    def draw(self, draws: Draws, scale: Scale) -> dict[str, Array]:
        """20 % to 80 % of the inertia at 2 to 30 Hz, hardly to well damped."""
        return {
            "load_inertia": draws.uniform(0.2, 0.8) * scale.inertia,
            "rate": 2.0 * np.pi * draws.log_uniform(2.0, 30.0),
            "damping_ratio": draws.log_uniform(0.01, 0.3),
        }


def _pull(lag: Array, lag_speed: Array, values: Values) -> Array:
    """Acceleration that spring and damper give the load."""
    rate = values["rate"]
    return rate * (rate * lag + 2.0 * values["damping_ratio"] * lag_speed)


def _one_pole(pole: Complex, motion: Motion) -> Complex:
    """u' = pole·u + a from the steady lag at the first acceleration."""
    step = pole * (motion.time_s[1] - motion.time_s[0])
    decay = np.exp(step)
    # response to an acceleration that rises to one, and one that falls from it, over a sample
    rising = (decay - 1.0 - step) / (pole * step)
    falling = (decay - 1.0) / pole - rising
    acceleration = motion.acceleration
    forcing = falling * acceleration[..., :-1] + rising * acceleration[..., 1:]
    u = np.empty((*forcing.shape[:-1], forcing.shape[-1] + 1), dtype=np.complex128)
    u[..., 0] = -acceleration[..., 0] / pole[..., 0]
    u[..., 1:] = forcing
    # u[k] += decay·u[k-1], by doubling the span that each sample has summed up
    span = 1
    while span < u.shape[-1]:
        u[..., span:] += decay * u[..., :-span]
        decay = decay**2
        span *= 2
    return u


EFFECT: Final = CouplingCompliance()
