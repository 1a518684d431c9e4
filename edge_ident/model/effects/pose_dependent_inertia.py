"""Pose-dependent inertia: a joint turns another one about an axis across its own, as in a turret.

An upright joint turns the links that the next joint lifts. Its inertia depends on how far they
reach out: J(q) = cosine·cos q + sine·sin q + cosine_2·cos 2q + sine_2·sin 2q beside a constant,
where q is the angle of the lifted joint. The turning joint feels J·a + J'·v·v₂ with q = x₂, the
lifted one -J'/2·v₂² with q = x; 2 is the other joint. The joint that a recording lists first is
taken for the turning one.
Source: Lagrange's equations of the kinetic energy J(q)·v²/2; Siciliano et al., Robotics, sec. 7.3.
"""

from typing import Final

import numpy as np

from edge_ident.model.effect import Advice, Compensation, Draws, Effect, Parameter, Scale
from edge_ident.model.motion import Array, Motion, Values, wave
from edge_ident.model.search import Form, Link, SearchSpec

_PARTS: Final = ("cosine", "sine", "cosine_2", "sine_2")
# What this joint does: whose angle changes the inertia, and which of the two it is.
_PLACES: Final = {"turning": ("other", Link.INNER), "lifted": ("own", Link.OUTER)}


class PoseDependentInertia(Effect):
    """Inertia about an upright axis by the angle of a joint that lifts."""

    parameters = tuple(
        Parameter(
            f"{place}_{part}",
            "{inertia}",
            -1e9,
            1e9,
            f"where this is the {place} joint, by the {part.partition('_')[0]} of "
            f"{'twice ' if part.endswith('2') else ''}the {angle} angle",
            default=0.0,
        )
        for place, (angle, _) in _PLACES.items()
        for part in _PARTS
    )
    needs_source = True

    def load(self, at: Motion, values: Values) -> Array:
        """What speeds cost: of both joints on the turning one, of that on the lifted one."""
        turned = at.partner.velocity
        turning = _slope(at.partner.position, values, "turning") * at.velocity * turned
        return np.asarray(turning - 0.5 * _slope(at.position, values, "lifted") * turned**2)

    def inertia(self, at: Motion, values: Values) -> Array:
        """What is turned, beside what is turned at any angle."""
        angle = at.partner.position
        once = wave(angle, values["turning_cosine"], values["turning_sine"])
        return once + wave(2.0 * angle, values["turning_cosine_2"], values["turning_sine_2"])


def _slope(angle: Array, values: Values, place: str) -> Array:
    """Derivative of the inertia by its angle."""
    cosine, sine, cosine_2, sine_2 = (values[f"{place}_{part}"] for part in _PARTS)
    return wave(angle, sine, -cosine) + 2.0 * wave(2.0 * angle, sine_2, -cosine_2)


def _draw(draws: Draws, scale: Scale) -> dict[str, Array]:
    """5 % to 50 % of the axis's own inertia at full reach, in any phase."""
    amplitude = 0.5 * draws.log_uniform(0.05, 0.5) * scale.inertia
    parts = [amplitude * part for _ in range(2) for part in draws.phase()]
    turned = dict(zip((f"turning_{part}" for part in _PARTS), parts, strict=True))
    return {p.name: turned.get(p.name, 0.0 * amplitude) for p in PoseDependentInertia.parameters}


EFFECT: Final = PoseDependentInertia(
    advice=Advice(
        in_words="how far the machine reaches out changes how hard it is to turn",
        part="the links that an upright joint carries",
        action="Turn the first joint with the arm stretched out and with the arm folded, and "
        "compare the efforts.",
    ),
    search=SearchSpec(
        forms=tuple(
            Form(
                tuple(f"{place}_{part}" for part in parts),
                coupled=True,
                link=link,
                rotary=True,
                across=True,
            )
            for place, (_, link) in _PLACES.items()
            for parts in (_PARTS[:2], _PARTS[2:], _PARTS)
        ),
        signature="the inertia follows the angle of another axis, or grows with its speed squared",
        alternatives=("cross_axis_coupling", "position_dependent_load"),
        experiment="both axes at different frequencies, then one at rest: --motion multisine",
        discrepancy=0.1,
    ),
    draw=_draw,
    compensation=Compensation(
        without="it depends on the angle of another axis, which the board's law does not know"
    ),
)
