"""Warm-up: friction that falls as the lubricant warms.

f = exp(-t/time_constant)·(excess·v + dry_excess·sign(v)) from the start of the record. Before the
start, the axis is as cold as at the start.
Source: Simoni, Beschi, Legnani and Visioli, IEEE/RSJ IROS 2015 (friction with temperature effects),
with first-order heating.
"""

from typing import Final

import numpy as np

from edge_ident.model.effect import Advice, Compensation, Draws, Effect, Parameter, Scale
from edge_ident.model.motion import Array, Motion, Values
from edge_ident.model.search import Excitation, Form, SearchSpec


class WarmUp(Effect):
    """Viscous and dry friction of the cold machine that fades."""

    parameters = (
        Parameter("excess", "{effort}*s/{position}", -1e9, 1e9, "viscous friction at the start"),
        Parameter("time_constant", "s", 1e-3, 1e9, "in which 63 % of it is gone"),
        Parameter("dry_excess", "{effort}", -1e9, 1e9, "dry friction at the start", default=0.0),
    )
    tied_to_time = True
    changes_base = ("viscous_friction", "coulomb_friction")

    def load(self, at: Motion, values: Values) -> Array:
        """Viscous, fading."""
        return np.asarray(values["excess"] * _left(at, values) * at.velocity)

    def friction(self, at: Motion, values: Values) -> Array:
        """Dry, fading."""
        if not values["dry_excess"].any():
            return np.zeros(())
        return np.asarray(values["dry_excess"] * _left(at, values))

    def fastest_rate(self, values: Values, inertia: Array, speed: float) -> Array:
        """Rate of viscous friction when cold."""
        return np.abs(values["excess"]) / inertia


def _left(at: Motion, values: Values) -> Array:
    """Share of the excess that is left."""
    return np.asarray(np.exp(-np.maximum(at.time_s, 0.0) / values["time_constant"]))


def _physical(values: Values, excitation: Excitation) -> bool:
    """Friction that falls, at the typical speed."""
    cold = values["excess"] * excitation.typical_speed + values["dry_excess"]
    return bool(np.all(cold > 0.0))


def _grid(excitation: Excitation) -> dict[str, Array]:
    """From an instant to where it looks like a straight line."""
    return {"time_constant": excitation.duration_s * np.geomspace(0.03, 3.0, 12)}


def _draw(draws: Draws, scale: Scale) -> dict[str, Array]:
    """5 % to 100 % more viscous friction, gone in a tenth to twice the record."""
    return {
        "excess": draws.log_uniform(0.05, 1.0) * scale.viscous_friction,
        "time_constant": draws.log_uniform(0.1, 2.0) * scale.duration_s,
    }


EFFECT: Final = WarmUp(
    advice=Advice(
        in_words="friction falls while the machine warms",
        part="the lubricant in guides, nut and bearings",
        action="Warm the machine up before you measure or work. Record again when it is warm.",
    ),
    search=SearchSpec(
        forms=(
            Form(("excess",), ("time_constant",)),
            Form(("excess", "dry_excess"), ("time_constant",)),
        ),
        signature="friction falls from repeat to repeat, and inertia does not",
        alternatives=("gain_drift", "nonlinear_viscous", "payload_change"),
        experiment="the same motion for longer than the machine takes to warm",
        grid=_grid,
        physical=_physical,
        discrepancy=0.1,
        open_ended=("time_constant",),
        shares_friction=True,
    ),
    draw=_draw,
    compensation=Compensation(at_end=True),
)
