"""Ends the identification motion as soon as its parameters are known well enough.

Every twentieth of a period, what is captured so far is identified as it will be in the end. The
motion ends where, twice in a row, the base model is adequate, every axis is trusted, and every
interval is narrow enough. Each is a 95 % interval that holds model error. Half of its width is
compared with the value of the parameter; that of the offset with the Coulomb friction, for the
offset of a level axis is nothing.

No look comes before half a period, nor before every axis has gone both ways at half of the highest
speed that the motion asks for in that direction: friction at speeds that were not seen would be
extrapolated.
"""

import logging
import math
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np

from edge_ident.commissioning.motion.capture import Capture
from edge_ident.commissioning.study.identification_motions import Study, identified
from edge_ident.errors import DataError
from edge_ident.identification.identify import identify
from edge_ident.identification.result import Identification
from edge_ident.model.model import NORMAL_95, PARAMETERS
from edge_ident.signals.data_checks import check_recording
from edge_ident.signals.recording import Recording
from firmware_interface.motion import Multisine, Trajectory, reference

log = logging.getLogger(__name__)

_LOOKS_PER_PERIOD: Final = 20
_IN_A_ROW: Final = 2
_LEAST_PERIODS: Final = 0.5
_SPEED_SHARE: Final = 0.5
"""Share of the highest speed in each direction that must have been seen."""
_TIME_SHARE: Final = 0.25
"""Share of the motion's time that looks may take: the link must keep up with the pages."""
_COULOMB, _OFFSET = PARAMETERS.index("coulomb_friction"), PARAMETERS.index("offset")


@dataclass(frozen=True)
class Widest:
    """The widest interval of all axes.

    Attributes
    ----------
    axis, parameter : str
    half_width : float
        Of the 95 % interval, over the parameter's value; of the offset, over the Coulomb friction.
    """

    axis: str
    parameter: str
    half_width: float

    @classmethod
    def of(cls, found: Identification) -> "Widest":
        """The widest of what was identified."""
        widths = []
        for name, axis in found.axes.items():
            values = np.abs(axis.estimate.parameters)
            values[_OFFSET] = values[_COULOMB]
            with np.errstate(divide="ignore"):
                halves = NORMAL_95 * axis.estimate.std / values
            widths += [
                cls(name, *pair) for pair in zip(PARAMETERS, map(float, halves), strict=True)
            ]
        return max(widths, key=lambda one: one.half_width)

    def __str__(self) -> str:
        return f"{self.parameter.replace('_', ' ')} of axis {self.axis}, ±{self.half_width:.1%}"


@dataclass(frozen=True)
class EarlyAnswer:
    """Whether the parameters were known well enough before the motion was over.

    Attributes
    ----------
    asked : float
        Largest half-width of an interval, as in `Widest`.
    reached : bool
        The motion ended early.
    share : float
        Of the motion that was captured.
    widest : Widest
        Of what was identified from that part.
    sentence : str
    """

    asked: float
    reached: bool
    share: float
    widest: Widest
    sentence: str


class Looks:
    """Looks at a motion while it lasts.

    Parameters
    ----------
    study : Study
    trajectory : Trajectory
    asked : float
        Largest half-width of an interval, as in `Widest`.
    """

    def __init__(self, study: Study, trajectory: Trajectory, asked: float) -> None:
        self._study, self._asked = study, asked
        sampling_s = study.board.identity.sample_period_s
        self._whole = round(trajectory.duration_s / sampling_s)
        self._every = max(round(period_s(trajectory) / sampling_s / _LOOKS_PER_PERIOD), 1)
        self._next = earliest_s(trajectory, sampling_s) / sampling_s
        self._good = 0
        self._found: Identification | None = None

    def enough(self, samples: int, in_hand: Callable[[], Recording]) -> bool:
        """Look, where it is time; see `edge_ident.commissioning.motion.capture.Enough`.

        There is no look where the motion is over before the next: nothing would be gained.
        """
        if samples < self._next or samples + self._every > self._whole:
            return False
        began_s = time.thread_time()
        self._good = self._good + 1 if self._ok(in_hand()) else 0
        took_s = time.thread_time() - began_s
        pause = took_s / _TIME_SHARE / self._study.board.identity.sample_period_s
        self._next = samples + max(self._every, pause)
        return self._good >= _IN_A_ROW

    def identified(self, capture: Capture) -> Identification:
        """What the last look found, where the motion ended with it; else what the capture shows."""
        if capture.ended_early and self._found is not None:
            return self._found
        return identified(self._study, capture.recording)

    def answer(self, capture: Capture, found: Identification) -> EarlyAnswer:
        """What became of it; the person at the machine is told.

        Parameters
        ----------
        capture : Capture
            Of the motion.
        found : Identification
            From it.
        """
        share, widest = len(capture.recording.time_s) / self._whole, Widest.of(found)
        reached = capture.ended_early
        if reached:
            sentence = (
                f"{share:.0%} of the motion was enough to know every parameter to {self._bound}"
            )
        else:
            sentence = f"the whole motion was needed: {self._why_not(found, widest)}"
        sentence = f"{sentence}; widest interval: {widest}"
        self._study.tell(sentence)
        return EarlyAnswer(self._asked, reached, share, widest, sentence)

    @property
    def _bound(self) -> str:
        return f"{100.0 * self._asked:g}%"

    def _why_not(self, found: Identification, widest: Widest) -> str:
        inadequate = [name for name, axis in found.axes.items() if not axis.adequacy.adequate]
        if inadequate:
            return f"the base model is not enough for axis {', '.join(inadequate)}"
        if not found.trusted:
            return "not every axis is trusted"
        if widest.half_width > self._asked:
            return f"not every parameter is known to {self._bound}"
        return f"every parameter is known to {self._bound}, but not until its end"

    def _ok(self, recording: Recording) -> bool:
        study = self._study
        try:
            check_recording(recording)
            found = identify(
                recording, study.network, model=study.model, seed=study.seed, diagnose=False
            )
        except DataError as error:
            log.info("look at %d samples: %s", len(recording.time_s), error.cause)
            return False
        self._found, widest = found, Widest.of(found)
        log.info("look at %d samples: %s", len(recording.time_s), widest)
        adequate = all(axis.adequacy.adequate for axis in found.axes.values())
        return adequate and found.trusted and widest.half_width <= self._asked


def period_s(trajectory: Trajectory) -> float:
    """Period of the slowest sine; the duration of a motion that does not repeat."""
    rates = [
        sine.angular_frequency_rad_s
        for motion in trajectory.axes.values()
        if isinstance(motion, Multisine)
        for sine in motion.components
    ]
    return 2.0 * math.pi / min(rates) if rates else trajectory.duration_s


def earliest_s(trajectory: Trajectory, sampling_s: float) -> float:
    """When the captured part has seen enough speeds for a first look; inf where it never does."""
    times_s = np.arange(0.0, min(period_s(trajectory), trajectory.duration_s), sampling_s)
    earliest = _LEAST_PERIODS * period_s(trajectory)
    for motion in trajectory.axes.values():
        velocity = reference(motion, times_s, trajectory.lead_in_s, 0.0).velocity_rad_s
        for way in (velocity, -velocity):
            if np.max(way) <= 0.0:
                return math.inf
            earliest = max(earliest, float(times_s[np.argmax(way >= _SPEED_SHARE * np.max(way))]))
    return earliest
