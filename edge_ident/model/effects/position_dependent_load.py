"""A load that depends on position: a spring, a cable chain, the weight of an arm over its angle.

f = stiffness·x + curvature·x² + cubic·x³ + cosine·cos(φ) + sine·sin(φ) + twice_cosine·cos(2φ)
+ twice_sine·sin(2φ) + bump·exp(-((x - place)/width)²), where φ = 2π·x/period. A cable, a hose or a
flexure hardens to both ends (cubic); a hanging arm has a period of 2π rad; a crank has a part of
twice the angle, at most half as large; a bump is what a cable or a seal does at one place. The
weight of a joint that another joint carries in the same plane follows the sum of both angles:
sum_cosine·cos(x + x₂) + sum_sine·sin(x + x₂), where x₂ may be the sum of two other angles, or have
a minus. On one sinusoid the stiffness looks like inertia, because a is proportional to x there.
Source: statics.
"""

from typing import Final

import numpy as np

from edge_ident.model.effect import Advice, Compensation, Draws, Effect, Parameter, Scale
from edge_ident.model.motion import Array, Motion, Values, added, bump, polynomial, wave
from edge_ident.model.search import Excitation, Form, Largest, Link, SearchSpec, Yardstick

_TURN_RAD: Final = 2.0 * np.pi
_MOST_WAVES: Final = 2.0  # most waves over the travel; what repeats more often is called ripple
_ROUNDING: Final = 1e-9
_CRANK: Final = 0.5
"""Largest part of twice the angle, of that of the angle: half of crank over rod, the longer one."""


class PositionDependentLoad(Effect):
    """A conservative load along the stroke."""

    parameters = (
        Parameter("stiffness", "{effort}/{position}", -1e9, 1e9, "of a spring about zero"),
        Parameter("curvature", "{effort}/{position}^2", -1e9, 1e9, "rise of the stiffness, half"),
        Parameter("cosine", "{effort}", -1e9, 1e9, "of the position's angle"),
        Parameter("sine", "{effort}", -1e9, 1e9, "of the position's angle"),
        Parameter("period", "{position}", 1e-9, 1e9, "travel of one turn of that angle"),
        Parameter(
            "sum_cosine", "{effort}", -1e9, 1e9, "of the sum of two joints' angles", default=0.0
        ),
        Parameter(
            "sum_sine", "{effort}", -1e9, 1e9, "of the sum of two joints' angles", default=0.0
        ),
        Parameter("bump", "{effort}", -1e9, 1e9, "largest load at one place", default=0.0),
        Parameter("place", "{position}", -1e9, 1e9, "of the bump", default=0.0),
        Parameter("width", "{position}", 1e-9, 1e9, "within which it falls to 37 %", default=1.0),
        Parameter("twice_cosine", "{effort}", -1e9, 1e9, "of twice that angle", default=0.0),
        Parameter("twice_sine", "{effort}", -1e9, 1e9, "of twice that angle", default=0.0),
        Parameter(
            "cubic", "{effort}/{position}^3", -1e9, 1e9, "of a spring that hardens", default=0.0
        ),
    )
    carried = True
    takes_source = True

    def load(self, at: Motion, values: Values) -> Array:
        """Powers, sinusoid and bump."""
        x = at.position
        angle = 2.0 * np.pi / values["period"] * x
        parts = [
            polynomial(x, values["stiffness"], values["curvature"], values["cubic"]),
            wave(angle, values["cosine"], values["sine"]),
            wave(2.0 * angle, values["twice_cosine"], values["twice_sine"]),
            bump(x, values["bump"], values["place"], values["width"]),
        ]
        if at.source is not None:
            both = x + at.source.position
            parts.append(wave(both, values["sum_cosine"], values["sum_sine"]))
        return added(*parts)

    def fastest_rate(self, values: Values, inertia: Array, speed: float) -> Array:
        """Resonance on the steepest slope, at most ten seconds of travel away."""
        rate = 2.0 * np.pi / values["period"]
        twice = 2.0 * np.hypot(values["twice_cosine"], values["twice_sine"])
        waves = (np.hypot(values["cosine"], values["sine"]) + twice) * rate
        away = 10.0 * speed
        bend = (2.0 * np.abs(values["curvature"]) + 3.0 * np.abs(values["cubic"]) * away) * away
        slope = np.abs(values["bump"]) / values["width"]  # at its steepest 0.86 of that
        return np.sqrt((np.abs(values["stiffness"]) + bend + waves + slope) / inertia)


def _grid(excitation: Excitation) -> dict[str, Array]:
    """A tenth of a wave over the travel, and more."""
    return {"period": excitation.periods(0.1, _MOST_WAVES, step=0.1)}


def _physical(values: Values, excitation: Excitation) -> bool:
    """Not so many turns that the weight of an arm would be a ripple."""
    waves = excitation.travel / values["period"]
    return bool(np.all(waves <= _MOST_WAVES + _ROUNDING))


def _draw(draws: Draws, scale: Scale) -> dict[str, Array]:
    """2 % to 30 % of the effort: of spring, bend and one to three slow waves, any mixture."""
    effort = draws.strength() * scale.effort
    spring, bend, wave = draws.rng.dirichlet(np.ones(3), draws.shape).transpose(
        -1, *range(len(draws.shape))
    )
    half = 0.5 * scale.travel
    cosine, sine = draws.phase()
    return {
        "stiffness": draws.sign() * 1.4 * spring * effort / half,
        "curvature": draws.sign() * 2.2 * bend * effort / half**2,
        "cosine": 1.4 * wave * effort * cosine,
        "sine": 1.4 * wave * effort * sine,
        "period": scale.travel / draws.uniform(1.0, 3.0),
    }


EFFECT: Final = PositionDependentLoad(
    advice=Advice(
        in_words="a force depends on where the axis stands, like a weight, a spring or a cable",
        part="cable chain, hoses, springs, weight balance or a hanging arm",
        action="Detach hoses or chain if you can, and record again. A weight that hangs on a joint "
        "is no fault: keep it in the model.",
    ),
    search=SearchSpec(
        forms=(
            Form(("stiffness",)),
            Form(("cosine", "sine"), rotary=True, known=(("period", _TURN_RAD),)),
            Form(("stiffness", "curvature")),
            Form(("stiffness", "curvature", "cubic")),
            Form(("cosine", "sine"), ("period",)),
            Form(("cosine", "sine", "twice_cosine", "twice_sine"), ("period",)),
            Form(("sum_cosine", "sum_sine"), coupled=True, rotary=True, senses=True, sums=True),
            Form(
                ("cosine", "sine", "sum_cosine", "sum_sine"),
                coupled=True,
                link=Link.INNER,
                rotary=True,
                senses=True,
                sums=True,
                known=(("period", _TURN_RAD),),
            ),
            Form(("bump",), ("place", "width"), grid=Excitation.places),
        ),
        signature="differs along the stroke and is the same both ways",
        alternatives=(
            "torque_ripple",
            "position_dependent_friction",
            "offset_drift",
            "cross_axis_coupling",
        ),
        experiment="the whole stroke at several accelerations: --motion multisine",
        curve=("load", "position"),
        grid=_grid,
        physical=_physical,
        largest=(Largest(("twice_cosine", "twice_sine"), _CRANK, Yardstick.WAVE),),
        essential=("period",),
    ),
    draw=_draw,
    compensation=Compensation(over="position"),
)
