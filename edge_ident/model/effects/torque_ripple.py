"""Torque ripple: periodic in position at any speed, as of cogging, gear mesh or a bent screw.

f = cosine·cos(2π·x/period) + sine·sin(2π·x/period), the same in both directions. Each order is a
term of its own.
Source: Holtz and Springob, IEEE Trans. Industrial Electronics 43 (1996) 309.
"""

from typing import Final

import numpy as np

from edge_ident.model.effect import Advice, Compensation, Draws, Effect, Parameter, Scale
from edge_ident.model.motion import Array, Motion, Values, wave
from edge_ident.model.search import Excitation, Form, Largest, SearchSpec, Yardstick


class TorqueRipple(Effect):
    """One order of a load that repeats with the position."""

    parameters = (
        Parameter("cosine", "{effort}", -1e9, 1e9, "amplitude in phase with position zero"),
        Parameter("sine", "{effort}", -1e9, 1e9, "amplitude a quarter period later"),
        Parameter("period", "{position}", 1e-9, 1e9, "travel after which it repeats"),
    )

    def load(self, at: Motion, values: Values) -> Array:
        """A sinusoid of position."""
        angle = 2.0 * np.pi / values["period"] * at.position
        return wave(angle, values["cosine"], values["sine"])

    def fastest_rate(self, values: Values, inertia: Array, speed: float) -> Array:
        """Resonance on its steepest slope, or passing its periods at top speed."""
        rate = 2.0 * np.pi / values["period"]
        slope = np.hypot(values["cosine"], values["sine"]) * rate
        return np.maximum(np.sqrt(slope / inertia), rate * speed)


def _grid(excitation: Excitation) -> dict[str, Array]:
    """From about one wave over the travel, which looks like a load along it, to what the filter
    passes."""
    return {"period": excitation.periods(0.75, 2000.0)}


def _draw(draws: Draws, scale: Scale) -> dict[str, Array]:
    """2 % to 30 % of the effort, 2 to 400 periods in the travel, any phase."""
    amplitude = np.sqrt(2.0) * draws.strength() * scale.effort
    cosine, sine = draws.phase()
    return {
        "cosine": amplitude * cosine,
        "sine": amplitude * sine,
        "period": scale.travel / draws.log_uniform(2.0, 400.0),
    }


EFFECT: Final = TorqueRipple(
    advice=Advice(
        in_words="a force repeats with the position",
        part="motor magnets (cogging), gear teeth, a coupling or a bent screw",
        action="Compare the number of repetitions per turn with pole pairs, teeth and lead. The "
        "part with that number is the cause.",
    ),
    search=SearchSpec(
        forms=(Form(("cosine", "sine"), ("period",)),),
        signature="repeats with the position, the same at all speeds and in both directions",
        alternatives=(
            "encoder_eccentricity",
            "position_dependent_load",
            "position_dependent_friction",
        ),
        experiment="several speeds over the same stroke: --motion staircase",
        grid=_grid,
        largest=(Largest(("cosine", "sine"), 1.0, Yardstick.EFFORT),),
        essential=("period",),
        repeats=True,
    ),
    draw=_draw,
    compensation=Compensation(
        feedforward={
            "cosine": "ripple_cosine",
            "sine": "ripple_sine",
            "period": "ripple_period_rad",
        }
    ),
)
