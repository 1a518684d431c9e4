"""Recordings of drives that obey the base model exactly, with noise where a test wants it."""

import numpy as np

from edge_ident.signals.recording import AxisRecord, Recording

PERIOD_S = 0.0025
COUNT_RAD = 2 * np.pi / 8400
TRUTH = np.array([0.43, 0.9, 1.4, 0.1])


def record(
    *,
    truth: np.ndarray = TRUTH,
    samples: int = 8742,
    phase: float = 0.5,
    effort_noise: np.ndarray | float = 0.0,
    position_noise: np.ndarray | float = 0.0,
    with_reference: bool = False,
) -> Recording:
    """A motion of two sines, rich in acceleration, through an encoder of 8400 counts."""
    time = PERIOD_S * np.arange(samples)
    position, velocity, acceleration = np.zeros((3, samples))
    for amplitude, rate, start in ((3.0, 0.6, phase), (1.0, 1.8, 2.0 * phase)):
        angle = rate * time + start
        position += amplitude * np.sin(angle)
        velocity += amplitude * rate * np.cos(angle)
        acceleration -= amplitude * rate**2 * np.sin(angle)
    effort = truth @ [acceleration, velocity, np.sign(velocity), np.ones(samples)]
    axis = AxisRecord(
        position=COUNT_RAD * np.round((position + position_noise) / COUNT_RAD),
        effort=effort + effort_noise,
        position_unit="rad",
        effort_unit="N*m",
        reference=position if with_reference else None,
    )
    return Recording(time, {"x": axis}, "test")


def paper_record() -> Recording:
    """The motion of x in the paper, for which the built-in network was trained."""
    time = PERIOD_S * np.arange(8742)
    position = 2 * np.pi * np.sin(0.2875 * time)
    velocity = 2 * np.pi * 0.2875 * np.cos(0.2875 * time)
    effort = TRUTH @ [-(0.2875**2) * position, velocity, np.sign(velocity), np.ones(8742)]
    axis = AxisRecord(COUNT_RAD * np.round(position / COUNT_RAD), effort, "rad", "N*m")
    return Recording(time, {"x": axis}, "test")
