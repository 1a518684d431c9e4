"""Cross-axis coupling: the motion of another axis costs effort on this one.

f = (inertia + inertia_cosine·cos x)·a₂ + viscous_friction·v₂ + coulomb_friction·sign(v₂) +
centrifugal_sine·sin(x)·v₂², where 2 is the source axis. Examples are a carried axis that
accelerates, guides out of square and a shared cable chain.

Two joints that turn in one plane share an inertia h(q) = cosine·cos q + sine·sin q over the angle q
of the outer one, which is measured from the inner one. The outer joint feels h·a₂ - h'·v₂² with
q = x, the inner one h·(2·a + a₂) + h'·(2·v·v₂ + v₂²) with q = x₂. The joint that a recording lists
first is taken for the inner one.

A link that turns freely on an axis, such as a pendulum on a carriage, shares h with it by its own
angle x₂ alone: the axis feels h·a₂ + h'·v₂² (`carried_cosine`, `carried_sine`).
Source: off-diagonal elements of a multi-body inertia matrix; skewed guides. Two links: Siciliano et
al., Robotics, sec. 7.3.2.
"""

from collections.abc import Mapping
from typing import Final

import numpy as np

from edge_ident.model.effect import Advice, Compensation, Draws, Effect, Parameter, Scale
from edge_ident.model.motion import Array, Motion, Values, wave
from edge_ident.model.search import Form, Link, SearchSpec

_BY_ANGLE: Final = (
    "inertia_cosine", "centrifugal_sine", "outer_cosine", "outer_sine", "inner_cosine",
    "inner_sine", "carried_cosine", "carried_sine",
)  # fmt: skip


class CrossAxisCoupling(Effect):
    """Effort in proportion to another axis's acceleration, velocity and friction."""

    parameters = (
        Parameter("inertia", "{inertia}", -1e9, 1e9, "per acceleration of the source"),
        Parameter("viscous_friction", "{effort}*s/{position}", -1e9, 1e9, "per its velocity"),
        Parameter("coulomb_friction", "{effort}", -1e9, 1e9, "with the sign of its velocity"),
        Parameter(
            "inertia_cosine", "{inertia}", -1e9, 1e9, "by the cosine of the own angle", default=0.0
        ),
        Parameter(
            "centrifugal_sine",
            "{inertia}",
            -1e9,
            1e9,
            "per its velocity squared, by the sine of it",
            default=0.0,
        ),
        *(
            Parameter(
                f"{joint}_{part}",
                "{inertia}",
                -1e9,
                1e9,
                f"of two links, where this is the {joint} one, by the {part} of the {angle} angle",
                default=0.0,
            )
            for joint, angle in (("outer", "own"), ("inner", "other"))
            for part in ("cosine", "sine")
        ),
        *(
            Parameter(
                f"carried_{part}",
                "{inertia}",
                -1e9,
                1e9,
                f"of a link that this axis carries, by the {part} of the link's angle",
                default=0.0,
            )
            for part in ("cosine", "sine")
        ),
    )
    needs_source = True

    def load(self, at: Motion, values: Values) -> Array:
        """Effort by velocities and their signs."""
        source = at.partner
        viscous = values["viscous_friction"] * source.velocity
        centrifugal = values["centrifugal_sine"] * np.sin(at.position) * source.velocity**2
        # centrifugal and Coriolis efforts, from the derivative h' of the shared inertia
        outer = _slope(at.position, values, "outer") * source.velocity**2
        inner = _slope(source.position, values, "inner") * (
            (2.0 * at.velocity + source.velocity) * source.velocity
        )
        carried = _slope(source.position, values, "carried") * source.velocity**2
        friction = viscous + values["coulomb_friction"] * source.direction
        # the outer joint feels -h'·v₂², see the equations above; all other signs are plus
        return np.asarray(friction + centrifugal - outer + inner + carried)

    def inertia(self, at: Motion, values: Values) -> Array:
        """What the outer link adds to that of the inner one."""
        # h·2·a: the inner joint swings the outer link about itself as well
        return 2.0 * _shared(at.partner.position, values, "inner")

    def cross_inertia(self, at: Motion, values: Values) -> Array:
        """An element of the inertia matrix, which may depend on the angle between the axes."""
        alone = values["inertia"] + values["inertia_cosine"] * np.cos(at.position)
        outer = _shared(at.position, values, "outer")
        by_other = (_shared(at.partner.position, values, name) for name in ("inner", "carried"))
        return np.asarray(alone + outer + sum(by_other))


def _shared(angle: Array, values: Values, joint: str) -> Array:
    """Inertia that two links share at an angle of the outer one."""
    return wave(angle, values[f"{joint}_cosine"], values[f"{joint}_sine"])


def _slope(angle: Array, values: Values, joint: str) -> Array:
    """Its derivative by that angle."""
    return wave(angle, values[f"{joint}_sine"], -values[f"{joint}_cosine"])


def _draw(draws: Draws, scale: Scale) -> dict[str, Array]:
    """5 % to 50 % of the axis's own coefficients, any mixture, either sign."""
    share = draws.log_uniform(0.05, 0.5)
    return {
        "inertia": draws.uniform(-1.0, 1.0) * share * scale.inertia,
        "viscous_friction": draws.uniform(-1.0, 1.0) * share * scale.viscous_friction,
        "coulomb_friction": draws.uniform(-1.0, 1.0) * share * scale.coulomb_friction,
    }


def _by_angle(values: Mapping[str, float], top_speed: float) -> str:
    """What depends on the angle between the axes may turn the sign of the rest."""
    if any(values[name] for name in _BY_ANGLE):
        return "it depends on the angle between the axes, which the board's law does not know"
    return ""


EFFECT: Final = CrossAxisCoupling(
    advice=Advice(
        in_words="another axis pushes on this one",
        part="the structure that both axes share, and the cables between them",
        action="Move the other axis alone and see whether this one feels it. Check mounts and "
        "balance.",
    ),
    search=SearchSpec(
        forms=(
            Form(("inertia",), coupled=True),
            Form(("viscous_friction",), coupled=True),
            Form(("coulomb_friction",), coupled=True),
            Form(("inertia", "viscous_friction", "coulomb_friction"), coupled=True),
            Form(("inertia", "inertia_cosine", "centrifugal_sine"), coupled=True, rotary=True),
            Form(("carried_cosine", "carried_sine"), coupled=True, turning=True),
            Form(
                ("inertia", "outer_cosine", "outer_sine"),
                coupled=True,
                link=Link.OUTER,
                rotary=True,
                senses=True,
            ),
            Form(
                ("inertia", "inner_cosine", "inner_sine"),
                coupled=True,
                link=Link.INNER,
                rotary=True,
                senses=True,
            ),
        ),
        signature="follows the other axis, and is gone when that one rests",
        alternatives=("position_dependent_load", "offset_drift"),
        experiment="both axes at different frequencies, then one at rest: --motion multisine",
        discrepancy=0.1,
    ),
    draw=_draw,
    compensation=Compensation(
        feedforward={
            "inertia": "cross_inertia_feedforward",
            "viscous_friction": "cross_viscous_feedforward",
            "coulomb_friction": "cross_coulomb_feedforward",
        },
        objection=_by_angle,
    ),
)
