"""How well the boards' watch tells loops that shake from those that do not.

Random legal feedback on random rigid drives with dry friction, in the boards' own control law and
watch: each loop is knocked, pushed by hand, or follows a lively motion. Prints how many ended as an
oscillation, by what the poles say of the loop.

    python -m tools.oscillation_watch --loops 300
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Annotated, Final

import numpy as np
import typer

from firmware_interface.control_law import feedback_poles
from firmware_interface.gains import CONSERVATIVE_GAINS, AxisGains
from firmware_interface.virtual import drive, settings
from firmware_interface.virtual.controller import AxisController, Setpoint

LONGEST_S: Final = 8.0
LEFT_RAD: Final = 0.02
"""An axis that is so far from its reference has begun to swing."""
SHAKES_RAD: Final = 0.02
"""From peak to peak in the last second: still swinging."""


@dataclass(frozen=True)
class Loop:
    """A rigid drive, N·m and rad at the gearbox output, and its feedback."""

    inertia: float
    viscous_friction: float
    coulomb_friction: float
    gains: AxisGains

    @classmethod
    def drawn(cls, rng: np.random.Generator) -> "Loop":
        """Anything that a board takes, small gains oftener than large ones."""
        inertia, viscous, coulomb = np.exp(rng.uniform(*np.log([[0.015, 0.02, 0.02], [1.5, 2, 2]])))
        largest = settings.DEFAULT_LIMITS.gain_maximum
        proportional, derivative, integral = rng.uniform(size=3) ** [3, 2, 3]
        gains = replace(
            CONSERVATIVE_GAINS,
            proportional=largest.proportional * proportional,
            derivative=largest.derivative * derivative,
            integral=largest.integral * integral * (rng.uniform() < 0.5),
            velocity_filter_s=rng.uniform(0.0, 0.05) * (rng.uniform() > 0.3),
        )
        return cls(float(inertia), float(viscous), float(coulomb), gains)

    @property
    def damping_ratio(self) -> float:
        """The smallest of its poles; negative where it is unstable."""
        poles = feedback_poles(
            self.gains,
            self.inertia,
            self.viscous_friction,
            period_s=drive.SAMPLE_PERIOD_S,
            control_delay_s=drive.CONTROL_DELAY_S,
        ).astype(complex)
        rates = np.log(poles[np.abs(poles) > 1e-9])
        return float(np.min(-rates.real / np.abs(rates), initial=1.0))

    @property
    def effort_of_a_count_nm(self) -> float:
        """What one encoder count adds to the effort at once."""
        filtered_s = self.gains.velocity_filter_s + drive.SAMPLE_PERIOD_S
        return drive.RAD_PER_COUNT * (self.gains.proportional + self.gains.derivative / filtered_s)


@dataclass(frozen=True)
class Outcome:
    """What became of a loop.

    Attributes
    ----------
    end : str
        `oscillation`, `limit` (following error or speed), `swings` at the end, or `rests`.
    late_s : float
        From `LEFT_RAD` to the end by the watch.
    """

    end: str
    late_s: float = 0.0


def played(
    loop: Loop,
    speed_rad_s: float = 0.0,
    push_nm: Callable[[float], float] = lambda time_s: 0.0,
    reference: Callable[[float], Setpoint] = lambda time_s: Setpoint(0.0, 0.0, 0.0),
) -> Outcome:
    """Run a loop from rest, or from a knock, until something ends it."""
    limits = settings.DEFAULT_LIMITS
    law = AxisController(loop.gains, drive.SAMPLE_PERIOD_S, limits.effort_nm)
    watch = drive.OscillationWatch(
        limits.effort_nm / drive.EFFORT_PER_COUNT_NM,
        2,
        period_s=drive.SAMPLE_PERIOD_S,
        control_delay_s=drive.CONTROL_DELAY_S,
    )
    position, speed, before, left_s, last = 0.0, speed_rad_s, 0.0, math.inf, []
    for sample in range(round(LONGEST_S / drive.SAMPLE_PERIOD_S)):
        time_s = sample * drive.SAMPLE_PERIOD_S
        setpoint, count = reference(time_s), round(position / drive.RAD_PER_COUNT)
        error = round(setpoint.position_rad / drive.RAD_PER_COUNT) - count
        effort = round(
            law.effort_nm(setpoint, count * drive.RAD_PER_COUNT) / drive.EFFORT_PER_COUNT_NM
        )
        if abs(position - setpoint.position_rad) > LEFT_RAD:
            left_s = min(left_s, time_s)
        if watch.seen(count, error, effort):
            return Outcome("oscillation", time_s - min(left_s, time_s))
        too_far = abs(error) * drive.RAD_PER_COUNT > limits.following_error_rad
        if too_far or abs(speed) > limits.speed_rad_s:
            return Outcome("limit")
        for acting, seconds in (
            (before, drive.CONTROL_DELAY_S),
            (effort * drive.EFFORT_PER_COUNT_NM, drive.SAMPLE_PERIOD_S - drive.CONTROL_DELAY_S),
        ):
            position, speed = _moved(loop, position, speed, acting + push_nm(time_s), seconds)
        before = effort * drive.EFFORT_PER_COUNT_NM
        if time_s > LONGEST_S - 1.0:
            last.append(position - setpoint.position_rad)
    return Outcome("swings" if np.ptp(last) > SHAKES_RAD else "rests")


def _moved(
    loop: Loop, position: float, speed: float, force_nm: float, seconds: float
) -> tuple[float, float]:
    """Semi-implicit steps of 0.25 ms with friction that holds."""
    steps = math.ceil(seconds / 2.5e-4)
    step = seconds / steps
    for _ in range(steps):
        free = speed + step / loop.inertia * (force_nm - loop.viscous_friction * speed)
        held = step / loop.inertia * loop.coulomb_friction
        speed = math.copysign(max(abs(free) - held, 0.0), free)
        position += step * speed
    return position, speed


def _lively(rng: np.random.Generator) -> Callable[[float], Setpoint]:
    """Three sines of up to 25 rad/s, led in over one second."""
    rates = np.exp(rng.uniform(math.log(0.5), math.log(25.0), 3))
    sizes, phases = rng.uniform(0.1, 1.0, 3) / rates, rng.uniform(0.0, 6.0, 3)

    def at(time_s: float) -> Setpoint:
        share = min(time_s, 1.0) ** 2 * (3.0 - 2.0 * min(time_s, 1.0))
        angle = rates * time_s + phases
        return Setpoint(
            float(share * (sizes * np.sin(angle)).sum()),
            float(share * (sizes * rates * np.cos(angle)).sum()),
            0.0,
        )

    return at


def _of_kind(kind: str, loop: Loop, rng: np.random.Generator) -> Outcome:
    if kind == "knocked":
        return played(loop, speed_rad_s=0.3)
    if kind == "pushed by hand":
        size, rate = rng.uniform(1.0, 10.0), 2.0 * math.pi * rng.uniform(0.3, 6.0)
        return played(loop, push_nm=lambda time_s: size * math.sin(rate * time_s))
    return played(loop, reference=_lively(rng))


def main(
    loops: Annotated[int, typer.Option(help="Loops of each kind.")] = 300, seed: int = 1
) -> None:
    """Print the table."""
    for kind in ("knocked", "pushed by hand", "lively motion"):
        rng = np.random.default_rng([seed, len(kind)])
        found: dict[str, list[Outcome]] = {}
        for _ in range(loops):
            loop = Loop.drawn(rng)
            ratio = loop.damping_ratio
            group = "unstable" if ratio < 0.0 else "damping below 0.2"
            if ratio >= 0.2:
                coarse = loop.effort_of_a_count_nm > 1.5
                group = "well damped, coarse" if coarse else "well damped"
            found.setdefault(group, []).append(_of_kind(kind, loop, rng))
        for group, outcomes in sorted(found.items()):
            ends = [outcome.end for outcome in outcomes]
            counts = ", ".join(f"{end} {ends.count(end)}" for end in sorted(set(ends)))
            late = [outcome.late_s for outcome in outcomes if outcome.end == "oscillation"]
            median = f"; seen after {np.median(late):.2f} s (median)" if late else ""
            print(f"{kind}, {group}: {len(outcomes)} loops: {counts}{median}", flush=True)


if __name__ == "__main__":
    typer.run(main)
