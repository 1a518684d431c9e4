"""Presliding hysteresis: dry friction that builds up with the distance since a reversal.

Part of the Coulomb friction, the level, acts through bristles: springs that yield at different
reaches. After a long stroke and a reversal, f/level changes sides as 1 - 2·exp(-travel/distance).
Smaller reversals make closed loops inside larger ones.
Source: Iwan, J. Applied Mechanics 33 (1966) 893; Al-Bender and Swevers, IEEE Control Systems 28
(2008) 64 (presliding of machines, Maxwell-slip elements).
"""

from typing import Final

import numpy as np

from edge_ident.model import search
from edge_ident.model.effect import Advice, Compensation, Draws, Effect, Parameter, Scale
from edge_ident.model.motion import Array, Motion, Values

_BRISTLES: Final = 10
_FINE: Final = np.linspace(0.0, 20.0, 20_001)
# Over the distance; gamma distributed: of very many, friction from rest grows exponentially.
_REACHES: Final = 0.5 * np.interp(
    (np.arange(_BRISTLES) + 0.5) / _BRISTLES, 1.0 - (1.0 + _FINE) * np.exp(-_FINE), _FINE
)


class PreslidingHysteresis(Effect):
    """Coulomb friction that needs a distance to change its sign; memory: the bristles' shares."""

    parameters = (
        Parameter("level", "{effort}", 0.0, 1e9, "part of the Coulomb friction that builds up"),
        Parameter("distance", "{position}", 1e-9, 1e9, "in which 63 % of it is built up"),
    )
    memory_size = _BRISTLES
    memory_scale = "level"
    part_of_friction = "level"

    def load(self, at: Motion, values: Values) -> Array:
        """Effort of the bristles."""
        return np.asarray(values["level"] * np.mean(at.memory, axis=0))

    def held_travel(self, values: Values) -> Array:
        """Travel in which the bristles stretch."""
        return values["distance"]

    def friction(self, at: Motion, values: Values) -> Array:
        """What the bristles take over from Coulomb friction."""
        return -values["level"]

    def rates(self, at: Motion, values: Values) -> Array:
        """Rates of the bristles: each stretches or slips; what a step overshoots comes back."""
        stretching = at.memory * np.sign(at.velocity) < 1.0
        beyond = at.memory - np.clip(at.memory, -1.0, 1.0)
        reach = np.multiply.outer(_REACHES, values["distance"])
        return np.asarray((at.velocity * stretching - np.abs(at.velocity) * beyond) / reach)

    def fastest_rate(self, values: Values, inertia: Array, speed: float) -> Array:
        """Bristle resonance, or saturation at top speed."""
        stiffness = values["level"] / values["distance"] * np.mean(1.0 / _REACHES)
        return np.asarray(np.maximum(np.sqrt(stiffness / inertia), speed / values["distance"]))

    def resistance(self, motion: Motion, values: Values) -> Array:
        """Every bristle from each reversal to the next."""
        distance, position, direction = values["distance"], motion.position, motion.direction
        reach = _REACHES.reshape(-1, *(1,) * max(distance.ndim, position.ndim)) * distance
        held = np.empty(np.broadcast_shapes(distance.shape, position.shape))
        turns = np.flatnonzero(np.diff(direction)) + 1
        start = np.full((_BRISTLES, *held[..., :1].shape), direction[0])  # fully stretched
        for first, last in zip([0, *turns], [*turns, len(direction)], strict=True):
            before = max(first - 1, 0)
            moved = position[..., first:last] - position[..., before, None]
            bristles = moved / reach
            bristles += start
            np.minimum(np.maximum(bristles, -1.0, out=bristles), 1.0, out=bristles)
            held[..., first:last] = np.add.reduce(bristles)
            start = bristles[..., -1:]
        return np.asarray(values["level"] * (held / _BRISTLES - direction))


def _sound(values: Values, excitation: search.Excitation) -> bool:
    """As stiff after a reversal, 2·level/distance, as the chain of any drive, which winds up."""
    stiffness = 2.0 * values["level"] / values["distance"]
    resonance = 2.0 * np.pi * search.SOUND_RESONANCE_HZ
    return bool(np.all(stiffness > resonance**2 * excitation.base[0]))


def _grid(excitation: search.Excitation) -> dict[str, Array]:
    """From what the encoder just resolves to a tenth of the travel."""
    return {"distance": np.geomspace(2.0 * excitation.resolution, 0.1 * excitation.travel, 16)}


def _draw(draws: Draws, scale: Scale) -> dict[str, Array]:
    """20 % to all of the Coulomb friction, within 0.02 % to 2 % of the travel."""
    return {
        "level": draws.uniform(0.2, 1.0) * scale.coulomb_friction,
        "distance": draws.log_uniform(2e-4, 2e-2) * scale.travel,
    }


EFFECT: Final = PreslidingHysteresis(
    advice=Advice(
        in_words="friction gives like a spring before the axis slides",
        size="{level} of friction that builds up over {distance}",
        part="guides, bearings and seals, where the axis turns back",
        action="This is usual on a sound machine: keep it in the model. If it has grown, check "
        "preload and lubrication of the guides.",
    ),
    search=search.SearchSpec(
        forms=(search.Form(("level",), ("distance",)),),
        signature="depends on the distance since the reversal, not on speed or time",
        alternatives=("backlash", "stribeck_friction", "coupling_compliance"),
        experiment="small reversals of several sizes: --motion multisine",
        grid=_grid,
        largest=(
            search.Largest(("level",), 1.0, search.Yardstick.EFFORT),
            search.Largest(("distance",), 1.0, search.Yardstick.TRAVEL),
        ),
        discrepancy=0.15,
        needs_reversals=True,
        shares_friction=True,
        sound=_sound,
    ),
    draw=_draw,
    compensation=Compensation(
        feedforward={"level": "presliding_feedforward", "distance": "presliding_distance_rad"},
        takes_over={"level": "coulomb_feedforward"},
        note="its level leaves the Coulomb feed-forward",
    ),
)
