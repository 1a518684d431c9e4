"""Inertia that depends on position: a crank, a reel that is wound, a load that a joint swings out.

J(x) = slope·y + curvature·y² + cosine·cos(2π·x/period) + sine·sin(2π·x/period) with y = x - centre,
beside the inertia in the middle of the travel. The effort is J(x)·a + J'(x)·v²/2: what turns faster
where it is lighter costs effort at constant speed. A crank repeats once or twice per turn. Along
one sinusoid the same effort is that of a load along the stroke.
Source: Lagrange's equation of the kinetic energy J(x)·v²/2.
"""

from typing import Final

import numpy as np

from edge_ident.model.effect import Advice, Compensation, Draws, Effect, Parameter, Scale
from edge_ident.model.motion import TURNS_RAD, Array, Motion, Values, added, polynomial, wave
from edge_ident.model.search import Excitation, Form, SearchSpec

# Most waves over the travel, beside those of a turn. What repeats more often is rather an error of
# the encoder, whose effort also grows with the acceleration and with the speed squared.
_MOST_WAVES: Final = 2.0
_ROUNDING: Final = 1e-9


class PositionDependentInertia(Effect):
    """Inertia with a parabola and one wave over the stroke."""

    parameters = (
        Parameter("slope", "{inertia}/{position}", -1e9, 1e9, "rise of the inertia"),
        Parameter("curvature", "{inertia}/{position}^2", -1e9, 1e9, "rise towards the ends"),
        Parameter("cosine", "{inertia}", -1e9, 1e9, "in phase with position zero"),
        Parameter("sine", "{inertia}", -1e9, 1e9, "a quarter period later"),
        Parameter("period", "{position}", 1e-9, 1e9, "travel after which the wave repeats"),
        Parameter("centre", "{position}", -1e9, 1e9, "middle of the travel", default=0.0),
    )

    def load(self, at: Motion, values: Values) -> Array:
        """What a change of the inertia costs at speed."""
        rate = 2.0 * np.pi / values["period"]
        away = at.position - values["centre"]
        slope = values["slope"] + 2.0 * values["curvature"] * away
        angle = rate * at.position
        slope = slope + rate * wave(angle, values["sine"], -values["cosine"])
        return np.asarray(0.5 * slope * at.velocity**2)

    def inertia(self, at: Motion, values: Values) -> Array:
        """What is moved beside the inertia of the base model."""
        away = at.position - values["centre"]
        angle = 2.0 * np.pi / values["period"] * at.position
        moved = polynomial(away, values["slope"], values["curvature"])
        return added(moved, wave(angle, values["cosine"], values["sine"]))

    def fastest_rate(self, values: Values, inertia: Array, speed: float) -> Array:
        """Passing the waves at top speed."""
        return np.asarray(2.0 * np.pi / values["period"] * speed)


def _grid(excitation: Excitation) -> dict[str, Array]:
    """No more waves than a mechanism of a few links has."""
    return excitation.waves(_MOST_WAVES)


def _physical(values: Values, excitation: Excitation) -> bool:
    """No more of them after the refinement either, but for those of a turn."""
    waves = excitation.travel / values["period"]
    turns = [np.isclose(values["period"], turn) for turn in TURNS_RAD]
    return bool(np.all(np.any(turns, axis=0) | (waves <= _MOST_WAVES + _ROUNDING)))


def _draw(draws: Draws, scale: Scale) -> dict[str, Array]:
    """5 % to 50 % of the axis's own inertia, as a slope or as one to three waves in the travel."""
    amplitude = draws.log_uniform(0.05, 0.5) * scale.inertia
    straight = draws.uniform(0.0, 1.0)
    cosine, sine = draws.phase()
    return {
        "slope": draws.sign() * straight * amplitude / (0.5 * scale.travel),
        "curvature": 0.0 * amplitude,
        "cosine": (1.0 - straight) * amplitude * cosine,
        "sine": (1.0 - straight) * amplitude * sine,
        "period": scale.travel / draws.uniform(1.0, 3.0),
    }


EFFECT: Final = PositionDependentInertia(
    advice=Advice(
        in_words="how much is moved depends on where the axis stands",
        part="crank, linkage, reel, or what the axis swings out",
        action="No fault where the mechanism is built so: keep it in the model. Otherwise look for "
        "a load that slides or comes loose.",
    ),
    search=SearchSpec(
        forms=(
            Form(("slope",), several_speeds=True),
            Form(("slope", "curvature"), several_speeds=True),
            *(
                Form(
                    ("cosine", "sine"), rotary=True, known=(("period", turn),), several_speeds=True
                )
                for turn in TURNS_RAD
            ),
            Form(("cosine", "sine"), ("period",), several_speeds=True),
        ),
        signature="along the stroke, grows with the acceleration and with the speed squared",
        alternatives=("encoder_eccentricity", "position_dependent_load", "coupling_compliance"),
        experiment="the whole stroke at several accelerations: --motion multisine",
        curve=("inertia", "position"),
        grid=_grid,
        physical=_physical,
        discrepancy=0.05,
        essential=("period",),
    ),
    draw=_draw,
    compensation=Compensation(
        without="it grows with the acceleration, and the board's tables hold a load or friction"
    ),
)
