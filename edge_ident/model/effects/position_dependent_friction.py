"""Friction that depends on position: a guide that tightens, a bent screw, a worn part of it.

f = sign(v)·(gradient·y + curvature·y² + cosine·cos(2π·x/period) + sine·sin(2π·x/period)
+ bump·exp(-((x - place)/width)²)) with y = x - centre, beside the Coulomb friction in the middle of
the travel. A bump is one worn or tight place.
Source: Popović and Goldenberg, IEEE Trans. Robotics and Automation 14 (1998) 114 (spectral
friction model).
"""

from typing import Final

import numpy as np

from edge_ident.model.effect import Advice, Compensation, Draws, Effect, Parameter, Scale
from edge_ident.model.motion import Array, Motion, Values, added, bump, polynomial, wave
from edge_ident.model.search import Excitation, Form, SearchSpec


class PositionDependentFriction(Effect):
    """Dry friction with a parabola, one wave and one bump over the stroke."""

    parameters = (
        Parameter("gradient", "{effort}/{position}", -1e9, 1e9, "rise of friction along the axis"),
        Parameter("cosine", "{effort}", -1e9, 1e9, "amplitude in phase with position zero"),
        Parameter("sine", "{effort}", -1e9, 1e9, "amplitude a quarter period later"),
        Parameter("period", "{position}", 1e-9, 1e9, "travel after which the wave repeats"),
        Parameter(
            "curvature", "{effort}/{position}^2", -1e9, 1e9, "rise towards the ends", default=0.0
        ),
        Parameter("centre", "{position}", -1e9, 1e9, "middle of the travel", default=0.0),
        Parameter("bump", "{effort}", -1e9, 1e9, "largest friction at one place", default=0.0),
        Parameter("place", "{position}", -1e9, 1e9, "of the bump", default=0.0),
        Parameter("width", "{position}", 1e-9, 1e9, "within which it falls to 37 %", default=1.0),
    )

    def friction(self, at: Motion, values: Values) -> Array:
        """Level above Coulomb friction, or below."""
        x = at.position
        angle = 2.0 * np.pi / values["period"] * x
        return added(
            polynomial(x - values["centre"], values["gradient"], values["curvature"]),
            wave(angle, values["cosine"], values["sine"]),
            bump(x, values["bump"], values["place"], values["width"]),
        )

    def fastest_rate(self, values: Values, inertia: Array, speed: float) -> Array:
        """Passing the waves or the bump at top speed."""
        passing = np.where(values["bump"], 1.0 / values["width"], 0.0)
        return np.maximum(2.0 * np.pi / values["period"], passing) * speed


def _grid(excitation: Excitation) -> dict[str, Array]:
    """Up to twenty waves over the travel."""
    return excitation.waves(20.0)


def _draw(draws: Draws, scale: Scale) -> dict[str, Array]:
    """Slope and wave 4 % to 80 % of Coulomb friction; one to 20 waves in the travel."""
    amplitude = draws.log_uniform(0.04, 0.8) * scale.coulomb_friction
    slope = draws.uniform(0.0, 1.0)
    cosine, sine = draws.phase()
    return {
        "gradient": draws.sign() * slope * amplitude / (0.5 * scale.travel),
        "cosine": (1.0 - slope) * amplitude * cosine,
        "sine": (1.0 - slope) * amplitude * sine,
        "period": scale.travel / draws.log_uniform(1.0, 20.0),
    }


EFFECT: Final = PositionDependentFriction(
    advice=Advice(
        in_words="friction changes along the stroke",
        part="guides, screw and covers at the place where friction is highest",
        action="Look there for dirt, wear or a bent screw. Clean, lubricate and check the "
        "alignment.",
    ),
    search=SearchSpec(
        forms=(
            Form(("gradient",)),
            Form(("gradient", "curvature"), several_speeds=True),
            Form(("cosine", "sine"), ("period",)),
            Form(
                ("bump",),
                ("place", "width"),
                several_speeds=True,
                grid=Excitation.places,
            ),
        ),
        signature="differs along the stroke and changes its sign with the direction",
        alternatives=("torque_ripple", "position_dependent_load", "asymmetric_friction"),
        experiment="the whole stroke both ways at several speeds: --motion staircase",
        curve=("friction", "position"),
        grid=_grid,
        discrepancy=0.05,
        repeats=True,
        shares_friction=True,
        essential=("period",),
    ),
    draw=_draw,
    compensation=Compensation(over="position"),
)
