"""What an actuator does not obey, however much of the effort that is."""

from collections.abc import Callable

import numpy as np
import pytest

from edge_ident.diagnosis.diagnose import diagnose
from edge_ident.diagnosis.measures import Verdict
from edge_ident.diagnosis.result import AxisDiagnosis
from edge_ident.signals.recording import AxisRecord, Recording

PERIOD_S, STEPS, SECONDS = 0.004, 5, 20.0
INERTIA, VISCOUS, COULOMB = 0.4, 0.6, 0.8
RATES, PHASES = 2.0 * np.pi * np.array([0.13, 0.29, 0.47]), np.array([0.4, 1.9, 4.0])
STIFFNESS, DAMPING = 90.0, 9.0


def controlled(arrives: Callable[[float], float]) -> AxisDiagnosis:
    """An axis whose loop follows sines; of its commands, which are recorded, so much arrives."""
    step = PERIOD_S / STEPS
    time_s = PERIOD_S * np.arange(round(SECONDS / PERIOD_S))
    place, pace = float(np.sum(np.sin(PHASES))), float(np.sum(RATES * np.cos(PHASES)))
    places, commands = [], []
    for moment in time_s:
        angle = RATES * moment + PHASES
        wanted, speed = float(np.sum(np.sin(angle))), float(np.sum(RATES * np.cos(angle)))
        command = STIFFNESS * (wanted - place) + DAMPING * (speed - pace)
        places.append(place)
        commands.append(command)
        for _ in range(STEPS):
            free = pace + step * (arrives(command) - VISCOUS * pace) / INERTIA
            pace = float(np.sign(free)) * max(abs(free) - step * COULOMB / INERTIA, 0.0)
            place += step * pace
    effort = np.array(commands) + 0.02 * np.random.default_rng(4).standard_normal(len(commands))
    read = 1e-4 * np.round(np.array(places) / 1e-4)
    recording = Recording(time_s, {"x": AxisRecord(read, effort, "rad", "N*m")}, "a test")
    return diagnose([recording]).axes["x"]


def test_a_saturation_that_ignores_a_third_of_the_commands_is_named() -> None:
    axis = controlled(lambda command: float(np.clip(command, -5.1, 5.1)))
    assert axis.verdict is Verdict.EXPLAINED
    (cause,) = axis.causes
    assert cause.term.effect == "actuator_saturation"
    assert cause.term.values["limit"] == pytest.approx(5.1, rel=0.02)


def test_a_dead_band_half_as_wide_as_the_effort_is_named() -> None:
    axis = controlled(lambda command: command - float(np.clip(command, -2.0, 2.0)))
    assert axis.verdict is Verdict.EXPLAINED
    (cause,) = axis.causes
    assert cause.term.effect == "actuator_deadband"
    assert cause.term.values["width"] == pytest.approx(2.0, rel=0.02)
