"""Time delay: the effort column is recorded late (or early) against the position column.

recorded(t) = effort(t - delay), the same at all amplitudes and frequencies. A shift of up to 1.5
sampling periods is in every recording of a digital controller, and belongs to the base model
(`timing`). A longer one is a cause; its size is what exceeds that share.
Source: linear phase of a pure delay.
"""

from typing import Final

import numpy as np

from edge_ident.model.effect import Advice, Compensation, Draws, Effect, Parameter, Scale
from edge_ident.model.motion import LARGEST_SHIFT, Array, Values
from edge_ident.model.search import Excitation, Form, SearchSpec


class TimeDelay(Effect):
    """Shift of the whole effort in time."""

    parameters = (Parameter("delay", "s", -1.0, 1.0, "by which the effort is recorded late"),)
    effort_delay = "delay"

    def recorded(self, effort: Array, time_s: Array, values: Values) -> Array:
        """Linear between samples; the ends stay as they are."""
        shape = np.broadcast_shapes(values["delay"].shape, effort.shape)
        rows = np.broadcast_to(effort, shape).reshape(-1, shape[-1])
        delays = np.broadcast_to(values["delay"], (*shape[:-1], 1)).reshape(-1)
        shifted = [
            np.interp(time_s - delay, time_s, row) for delay, row in zip(delays, rows, strict=True)
        ]
        return np.reshape(shifted, shape)


def _physical(values: Values, excitation: Excitation) -> bool:
    """Beyond a controller's timing, and up to half a turn of the motion: more could be anything
    with a phase."""
    late_s = np.abs(values["delay"])
    beyond = late_s > LARGEST_SHIFT * excitation.sampling_s
    half_turn = late_s * excitation.turning_rate < np.pi
    return bool(np.all(beyond & half_turn))


def _draw(draws: Draws, scale: Scale) -> dict[str, Array]:
    """A fifth of a sample to 20 samples, three times out of four late."""
    sign = np.where(draws.uniform(0.0, 1.0) < 0.25, -1.0, 1.0)
    return {"delay": sign * draws.log_uniform(0.2, 20.0) * scale.period_s}


EFFECT: Final = TimeDelay(
    advice=Advice(
        in_words="force and position are not recorded at the same time",
        size="the effort is recorded {delay} late",
        part="the recorder, not the mechanics: controller, bus or data logger; of a voltage, "
        "also the winding",
        action="Check time stamps, filters and bus cycle. Record both signals with one clock.",
    ),
    search=SearchSpec(
        forms=(Form(("delay",)),),
        signature="the whole effort is shifted, the same at all amplitudes",
        alternatives=("coupling_compliance", "presliding_hysteresis"),
        experiment="quick changes of acceleration: --motion multisine",
        physical=_physical,
    ),
    draw=_draw,
    compensation=Compensation(loop_delay="delay"),
)
