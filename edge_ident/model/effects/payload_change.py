"""Payload change: from one moment on, the axis carries more or less.

From that time, inertia·a + coulomb_friction·sign(v) + offset are added. These are the mass and the
friction of the payload and, on an axis that lifts, its weight. Of several recordings without a
common clock, it changes in one.
Source: rigid-body dynamics.
"""

from typing import Final

import numpy as np

from edge_ident.model.effect import CLOCK, Advice, Compensation, Draws, Effect, Parameter, Scale
from edge_ident.model.motion import Array, Motion, Values
from edge_ident.model.search import Excitation, Form, Largest, SearchSpec, Yardstick


class PayloadChange(Effect):
    """A step of inertia, Coulomb friction and offset."""

    parameters = (
        Parameter("time", "s", -1e9, 1e9, "of the change, from the start of the record"),
        Parameter("inertia", "{inertia}", -1e9, 1e9, "added; negative where something is dropped"),
        Parameter("coulomb_friction", "{effort}", -1e9, 1e9, "added with it"),
        Parameter("offset", "{effort}", -1e9, 1e9, "its weight"),
        CLOCK,
    )
    tied_to_time = True
    changes_base = ("inertia", "coulomb_friction", "offset")

    def load(self, at: Motion, values: Values) -> Array:
        """Weight."""
        return _from_change(at, values, values["offset"])

    def friction(self, at: Motion, values: Values) -> Array:
        """Dry friction of the payload."""
        return _from_change(at, values, values["coulomb_friction"])

    def inertia(self, at: Motion, values: Values) -> Array:
        """Mass of the payload."""
        return _from_change(at, values, values["inertia"])


def _from_change(at: Motion, values: Values, size: Array) -> Array:
    """A size from the change on, zero before and in other recordings. Nothing costs nothing."""
    if not size.any():
        return np.zeros(())
    return np.asarray(size * ((at.time_s >= values["time"]) & (values["clock"] == at.clock)))


def _grid(excitation: Excitation) -> dict[str, Array]:
    """Anywhere but at the ends; of several recordings also all of one."""
    share = np.linspace(0.04, 0.96, 70)
    if len(excitation.spans) > 1:
        share = np.append(0.0, share)
    times = [begin_s + (end_s - begin_s) * share for _, begin_s, end_s in excitation.spans]
    clocks = [np.full(len(share), float(clock)) for clock, _, _ in excitation.spans]
    return {"time": np.concatenate(times), "clock": np.concatenate(clocks)}


def _draw(draws: Draws, scale: Scale) -> dict[str, Array]:
    """5 % to 60 % of inertia, up to that of Coulomb friction, weight a tenth of it."""
    share = draws.sign() * draws.log_uniform(0.05, 0.6)
    return {
        "time": draws.uniform(0.2, 0.8) * scale.duration_s,
        "inertia": share * scale.inertia,
        "coulomb_friction": share * draws.uniform(0.3, 1.0) * scale.coulomb_friction,
        "offset": share * draws.uniform(0.0, 0.1) * scale.coulomb_friction,
    }


EFFECT: Final = PayloadChange(
    advice=Advice(
        in_words="the axis carries more or less from one moment on",
        part="workpiece, tool or gripper",
        action="Look up in the log of the machine what was picked up or put down then. Record "
        "before and after apart.",
    ),
    search=SearchSpec(
        forms=(
            Form(("inertia",), ("time",)),
            Form(("inertia", "coulomb_friction"), ("time",)),
            Form(("inertia", "coulomb_friction", "offset"), ("time",)),
        ),
        signature="coefficients before a moment and after it differ",
        alternatives=("gain_drift", "warm_up", "offset_drift", "disturbance_event"),
        experiment="accelerations throughout the record: --motion multisine",
        grid=_grid,
        largest=(Largest(("inertia",), 1.0, Yardstick.INERTIA),),
        discrepancy=0.05,
        essential=("inertia",),
        between_recordings=("time",),
        repeats=True,
    ),
    draw=_draw,
    compensation=Compensation(at_end=True),
)
