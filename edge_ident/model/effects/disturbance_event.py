"""Disturbance event: a push or a collision, an effort of short duration.

f = level·sin²(π·(t - time)/duration) from `time` on, for its duration. Of several recordings it
happens in one.
Source: none needed; this is the shortest smooth pulse.
"""

from typing import Final

import numpy as np

from edge_ident.model.effect import CLOCK, Advice, Compensation, Draws, Effect, Parameter, Scale
from edge_ident.model.motion import Array, Motion, Values, cosine_and_sine
from edge_ident.model.search import Excitation, Form, SearchSpec


class DisturbanceEvent(Effect):
    """One pulse that does not repeat."""

    parameters = (
        Parameter("time", "s", -1e9, 1e9, "of its beginning, from the start of the record"),
        Parameter("duration", "s", 1e-6, 1e9, "from beginning to end"),
        Parameter("level", "{effort}", -1e9, 1e9, "peak of the resisting effort"),
        CLOCK,
    )
    tied_to_time = True

    def load(self, at: Motion, values: Values) -> Array:
        """A pulse in time."""
        share = np.asarray((at.time_s - values["time"]) / values["duration"])
        during = (share > 0.0) & (share < 1.0)
        pulse = np.zeros(share.shape)
        pulse[during] = cosine_and_sine(np.pi * share[during])[1] ** 2
        return np.asarray(values["level"] * (values["clock"] == at.clock) * pulse)

    def fastest_rate(self, values: Values, inertia: Array, speed: float) -> Array:
        """Rate of the pulse itself."""
        return 2.0 * np.pi / values["duration"]


def _physical(values: Values, excitation: Excitation) -> bool:
    """A pulse that begins and ends within the record: what happened before is not recorded."""
    begins, ends = values["time"], values["time"] + values["duration"]
    inside = np.zeros(np.shape(begins), dtype=np.bool_)
    for clock, begin_s, end_s in excitation.spans:
        inside |= (values["clock"] == clock) & (begins > begin_s) & (ends < end_s)
    return bool(np.all(inside))


def _grid(excitation: Excitation) -> dict[str, Array]:
    """From 1/250 of the record to a tenth of it, and no shorter than the filter passes.

    One pulse is as short as that: a finer grid would be too large, but the best duration between
    its points may be shorter than them.
    """
    points = []
    for clock, begin_s, end_s in excitation.spans:
        lasts_s = end_s - begin_s
        longest = 0.1 * lasts_s
        shortest = min(0.35 / excitation.cutoff_hz, longest)
        points.append([np.full(1, v) for v in (begin_s + 0.5 * lasts_s, shortest, float(clock))])
        duration = max(shortest, lasts_s / 250.0)
        while duration <= longest:
            step = max(duration / 2.0, 0.2 / excitation.cutoff_hz)
            starts = begin_s + np.arange(0.5 * step, lasts_s - duration, step)
            points.append(
                [starts, np.full(len(starts), duration), np.full(len(starts), float(clock))]
            )
            duration *= 2.0
    time, duration_s, clocks = np.concatenate(points, axis=1)
    return {"time": time, "duration": duration_s, "clock": clocks}


def _draw(draws: Draws, scale: Scale) -> dict[str, Array]:
    """Half to five times the effort's rms, for 0.5 % to 5 % of the record."""
    duration = draws.log_uniform(0.005, 0.05) * scale.duration_s
    return {
        "time": draws.uniform(0.05, 0.9) * scale.duration_s,
        "duration": duration,
        "level": draws.sign() * draws.log_uniform(0.25, 2.5) * scale.effort,
    }


EFFECT: Final = DisturbanceEvent(
    advice=Advice(
        in_words="something pushed the axis once",
        part="whatever touched the machine at that time: a person, a chip, a cable, a collision",
        action="Look up that time in the log of the machine. Record the same motion again and see "
        "whether it comes back.",
    ),
    search=SearchSpec(
        forms=(Form(("level",), ("time", "duration")),),
        signature="one short time, and not again where the motion repeats",
        alternatives=("payload_change", "actuator_saturation", "backlash"),
        experiment="the same motion again",
        grid=_grid,
        physical=_physical,
        discrepancy=0.1,
        open_ended=("duration",),
        repeats=True,
    ),
    draw=_draw,
    compensation=Compensation(
        without="it happened once, and no controller knows when it happens again"
    ),
)
