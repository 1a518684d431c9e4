"""Offset drift: the constant effort changes with time.

f = rate·t + curvature·t² from the start of the record. With a time constant τ in place of the
curvature, τ·(1 - exp(-t/τ)) takes the place of t. An example is an amplifier or a force sensor that
warms.
Source: Taylor expansion, first-order warming.
"""

from typing import Final

import numpy as np

from edge_ident.model.effect import Advice, Compensation, Draws, Effect, Parameter, Scale
from edge_ident.model.motion import Array, Motion, Values
from edge_ident.model.search import Excitation, Form, SearchSpec

TIME_CONSTANT: Final = Parameter(
    "time_constant", "s", 1e-3, 1e9, "in which 63 % of the drift is done", default=1e9
)


class OffsetDrift(Effect):
    """A slow effort of its own, independent of the motion."""

    parameters = (
        Parameter("rate", "{effort}/s", -1e9, 1e9, "growth at the start"),
        Parameter("curvature", "{effort}/s^2", -1e9, 1e9, "half the growth of the rate"),
        TIME_CONSTANT,
    )
    tied_to_time = True
    changes_base = ("offset",)

    def load(self, at: Motion, values: Values) -> Array:
        """A parabola of time, or an approach to a constant."""
        since = effective_time_s(at.time_s, values)
        return (values["rate"] + values["curvature"] * since) * since


def _grid(excitation: Excitation) -> dict[str, Array]:
    """From a straight line to what is over in a twentieth of the record."""
    return time_constants(excitation)


def _draw(draws: Draws, scale: Scale) -> dict[str, Array]:
    """2 % to 30 % of the effort about its mean, straight or bent."""
    drift = draws.sign() * draws.strength() * scale.effort / scale.duration_s
    bend = draws.uniform(-1.0, 1.0)
    return {
        "rate": 3.5 * drift * (1.0 - np.abs(bend)),
        "curvature": 3.4 * drift * bend / scale.duration_s,
        "time_constant": np.full(draws.shape, 1e9),
    }


def effective_time_s(time_s: Array, values: Values) -> Array:
    """Time since the start of the record; with a time constant, it levels off at that."""
    constant = values["time_constant"]
    return np.asarray(-constant * np.expm1(-np.maximum(time_s, 0.0) / constant))


def time_constants(excitation: Excitation) -> dict[str, Array]:
    """Time constants to search, the first a straight line."""
    share = np.concatenate([[1e3], np.geomspace(3.0, 0.05, 10)])
    return {"time_constant": excitation.duration_s * share}


FORMS: Final = (
    Form(("rate",)),
    Form(("rate", "curvature")),
    Form(("rate",), ("time_constant",)),
)
"""Forms of a drift: even, bent, and towards an end."""

EFFECT: Final = OffsetDrift(
    advice=Advice(
        in_words="the constant force changes slowly with time",
        part="amplifier or force sensor as it warms, or a weight balance that loses pressure",
        action="Let the electronics warm up, set their zero, and record again. Check the pressure "
        "of the weight balance.",
    ),
    search=SearchSpec(
        forms=FORMS,
        signature="the mean effort moves with time, whatever the motion",
        alternatives=("position_dependent_load", "gain_drift", "payload_change"),
        experiment="the same motion several times over",
        curve=("load", "time"),
        grid=_grid,
        discrepancy=0.1,
        open_ended=("time_constant",),
    ),
    draw=_draw,
    compensation=Compensation(at_end=True),
)
