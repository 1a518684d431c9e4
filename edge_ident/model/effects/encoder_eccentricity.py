"""Encoder eccentricity: the disc is off centre, and the reading errs once per turn.

reading = x + cosine·cos(2π·x/period) + sine·sin(2π·x/period). Where the reading is even, the true
motion is uneven, which costs effort that grows with the square of the speed. A resolver whose two
windings differ errs twice per turn.
Source: first harmonic of an eccentrically mounted graduation; Hanselman, IEEE Trans. Industrial
Electronics 37 (1990) 556, for the resolver.
"""

from dataclasses import replace
from typing import Final

import numpy as np

from edge_ident.model.effect import Advice, Compensation, Draws, Effect, Parameter, Scale
from edge_ident.model.motion import TURNS_RAD, Array, Motion, Values, cosine_and_sine
from edge_ident.model.search import Excitation, Form, Largest, SearchSpec, Yardstick

# Most steps of Newton's method; errors that keep the reading increasing need fewer.
_ITERATIONS: Final = 5
_CONVERGED: Final = 1e-13
# Largest error, of a turn. A hub that is centred by hand to 0.1 mm at a radius of 20 mm errs by
# 0.0008. A judgement.
_LARGEST: Final = 0.01
_SMALLEST: Final = 0.1  # smallest error of the reading that counts, over the encoder's resolution


class EncoderEccentricity(Effect):
    """A position error that repeats every turn."""

    parameters = (
        Parameter("cosine", "{position}", -1e9, 1e9, "error in phase with position zero"),
        Parameter("sine", "{position}", -1e9, 1e9, "error a quarter turn later"),
        Parameter("period", "{position}", 1e-9, 1e9, "travel of one turn of the encoder"),
    )

    def reading(self, position: Array, values: Values) -> Array:
        """Position and its error."""
        return position + _error(position, values)[0]

    def true_motion(self, motion: Motion, values: Values) -> Motion:
        """Solve the reading for the position; the chain rule gives speed and acceleration."""
        position = motion.position
        for _ in range(_ITERATIONS):
            error, stretch = _error(position, values)
            stretch += 1.0
            step = position + error
            step -= motion.position
            step /= stretch
            position = position - step
            if np.max(np.abs(step, out=step)) < _CONVERGED * np.max(np.abs(motion.position)):
                break
        velocity = motion.velocity / stretch
        bend = -((2.0 * np.pi / values["period"]) ** 2) * error
        acceleration = motion.acceleration - bend * velocity**2
        acceleration /= stretch
        return replace(motion, position=position, velocity=velocity, acceleration=acceleration)


def _physical(values: Values, excitation: Excitation) -> bool:
    """More than a trace of the encoder's own rounding."""
    amplitude = np.hypot(values["cosine"], values["sine"])
    return bool(np.all(amplitude > _SMALLEST * excitation.resolution))


def _grid(excitation: Excitation) -> dict[str, Array]:
    """Turns of an encoder that sees from a quarter of a turn to many."""
    return {"period": excitation.periods(0.25, 40.0, step=0.25)}


def _draw(draws: Draws, scale: Scale) -> dict[str, Array]:
    """One to 20 turns in the travel; the acceleration errs by 3 % to all of it."""
    period = scale.travel / draws.log_uniform(1.0, 20.0)
    rate = 2.0 * np.pi / period
    unevenness = draws.log_uniform(0.03, 1.0) * scale.acceleration
    amplitude = np.minimum(unevenness / (rate * scale.speed) ** 2 * 2.0, _LARGEST * period)
    cosine, sine = draws.phase()
    return {"cosine": amplitude * cosine, "sine": amplitude * sine, "period": period}


def _error(position: Array, values: Values) -> tuple[Array, Array]:
    """The error, and its derivative by position."""
    rate = 2.0 * np.pi / values["period"]
    cosine, sine = cosine_and_sine(rate * position)
    slope = values["sine"] * cosine - values["cosine"] * sine
    slope *= rate
    return values["cosine"] * cosine + values["sine"] * sine, slope


EFFECT: Final = EncoderEccentricity(
    advice=Advice(
        in_words="the position sensor is off its centre or uneven, and errs at every turn",
        part="encoder, its hub and its coupling",
        action="Check the run-out of the encoder's hub with a dial gauge. Centre and clamp the "
        "encoder again.",
    ),
    search=SearchSpec(
        forms=(
            Form(("cosine", "sine"), ("period",)),
            *(
                Form(
                    ("cosine", "sine"),
                    rotary=True,
                    known=(("period", turn),),
                )
                for turn in TURNS_RAD  # a travel of less than a turn does not determine one
            ),
        ),
        signature="repeats every turn and grows with the square of the speed",
        alternatives=("torque_ripple", "position_dependent_load"),
        experiment="several speeds over whole turns: --motion staircase",
        grid=_grid,
        essential=("period",),
        physical=_physical,
        largest=(Largest(("cosine", "sine"), _LARGEST, Yardstick.TURN),),
    ),
    draw=_draw,
    compensation=Compensation(
        without="feedback follows the reading, error included; it goes when the encoder is centred"
    ),
)
