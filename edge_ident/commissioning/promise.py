"""What new gains promise on the motions that will judge them, and whether they keep it.

Of every axis and motion: the tracking error now, as measured and as forecast, and the error that
the new gains will have, with its 90 % interval. The draws come from
`edge_ident.commissioning.tracking_forecast`. What the forecast of 'now' misses is known, for
'now' has been measured. The forecast of 'after' is corrected by the same factor as far as both
errors have the same course over time, and its interval is as much wider: gains much like those in
force err alike, quite different ones do not.

A promise is worth a write if on some axis and motion the rms error falls by `WORTH` and by more
than the forecast of 'now' was off, and on none it would certainly grow. It is kept if no measured
error is above its limit. All errors of a right forecast together stay below their limits in 95 of
100 cases, so a limit lies above the end of its interval. A promise that is not kept takes no gains
back: it makes the intervals of later forecasts for the same machine as much wider.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from statistics import NormalDist, median
from typing import Final

import numpy as np

from edge_ident.commissioning.drawn_loads import Grounds, RecordedMotion
from edge_ident.commissioning.tracking_forecast import Drawn, drawn_errors
from edge_ident.control.gain_design import worst_margins
from edge_ident.control.position_loop import LoopHardware
from edge_ident.errors import DataError, GainError, ModelError
from edge_ident.identification.identify import identify
from edge_ident.identification.result import Identification
from edge_ident.model.model import BOARD_UNITS, Array, Model
from edge_ident.signals.metrics import rms
from edge_ident.signals.recording import Recording
from firmware_interface.board import AxisLimits, BoardIdentity
from firmware_interface.gains import Bank

WORTH: Final = 0.05
"""Share by which the tracking error must fall to be worth a write."""
SHARE: Final = 0.02
"""Relative difference of tracking errors that means anything."""
COUNTS: Final = 0.1
"""Difference of rms errors in encoder counts that means anything."""
# Share of right forecasts above the 90 % interval; and of right promises that count as broken.
_TAIL: Final = 0.05
_TINY: Final = 1e-12


@dataclass(frozen=True)
class Errors:
    """Tracking error of one axis on one motion, rad."""

    rms_rad: float
    peak_rad: float

    @classmethod
    def of(cls, error: Array) -> "Errors":
        """Rms and peak of an error over time, (N,)."""
        return cls(rms(error), float(np.max(np.abs(error))))


@dataclass(frozen=True)
class Expected:
    """A tracking error that is forecast, rad.

    Attributes
    ----------
    middle_rad : float
    low_rad, high_rad : float
        Ends of the 90 % interval.
    """

    middle_rad: float
    low_rad: float
    high_rad: float

    @classmethod
    def of(
        cls, drawn: Array, factor: float = 1.0, read_rad: float = 0.0, disbelief: float = 0.0
    ) -> "Expected":
        """From draws, corrected by a factor of which the interval is as much wider.

        Parameters
        ----------
        drawn : (DRAWS,) array
        factor : float
        read_rad : float
            To how much it is read; half of that is added at both ends.
        disbelief : float
            Logarithm by which such forecasts were off before.
        """
        middle = float(median(drawn))
        if not (math.isfinite(middle) and middle > 0.0):
            return cls(middle, 0.0, math.inf)
        # in logarithms: errors are positive, and what is not known of them multiplies
        ends = np.log([max(float(np.min(drawn)), _TINY) / middle, float(np.max(drawn)) / middle])
        # the correction is as doubtful as it is large, and independent of the draws
        low, high = np.hypot(ends, math.hypot(math.log(factor), disbelief))
        corrected = factor * middle
        below, above = corrected * math.exp(-low), corrected * math.exp(high)
        return cls(corrected, max(below - 0.5 * read_rad, 0.0), above + 0.5 * read_rad)

    def limit_rad(self, judged: int) -> float:
        """What a right forecast exceeds in one of 20 cases where so many errors are judged."""
        normal = NormalDist()
        # Bonferroni: the chance that one of all exceeds its limit stays that of a single one
        wider = normal.inv_cdf(1.0 - _TAIL / judged) / normal.inv_cdf(1.0 - _TAIL)
        grown = self.high_rad / max(self.middle_rad, _TINY)
        return float(self.middle_rad * grown**wider)

    def holds(self, measured_rad: float) -> bool:
        """Whether a measured error lies inside the interval."""
        return self.low_rad <= measured_rad <= self.high_rad


@dataclass(frozen=True)
class ExpectedErrors:
    """Both errors of one axis on one motion, as forecast."""

    rms: Expected
    peak: Expected


@dataclass(frozen=True)
class Promised:
    """One axis on one motion.

    Attributes
    ----------
    now : Errors
        Measured with the gains in force.
    now_forecast, after : ExpectedErrors
        `after` is corrected by what `now_forecast` missed.
    count_rad : float
        Of the encoder.
    measured : Errors or None
        With the new gains, where the motion was done with them.
    """

    now: Errors
    now_forecast: ExpectedErrors
    after: ExpectedErrors
    count_rad: float
    measured: Errors | None = None

    @classmethod
    def of(
        cls, error: Array, now: Drawn, after: Drawn, count_rad: float, disbelief: float = 0.0
    ) -> "Promised":
        """From the error measured now (N,), and the draws of now and after."""
        measured, alike = Errors.of(error), now.alike(after)
        expected = [
            (
                Expected.of(of_now, 1.0, read_rad),
                Expected.of(of_after, _missed(found, of_now) ** alike, read_rad, disbelief),
            )
            for found, of_now, of_after, read_rad in (
                (measured.rms_rad, now.rms_rad, after.rms_rad, COUNTS * count_rad),
                (measured.peak_rad, now.peak_rad, after.peak_rad, count_rad),  # in whole counts
            )
        ]
        now_forecast, then = (ExpectedErrors(*both) for both in zip(*expected, strict=True))
        return cls(measured, now_forecast, then, count_rad)

    @property
    def bias(self) -> float:
        """Measured over forecast rms error of now."""
        return _ratio(self.now.rms_rad, self.now_forecast.rms.middle_rad)

    @property
    def improvement(self) -> float:
        """Share by which the rms error will fall; negative where it will grow."""
        return 1.0 - _ratio(self.after.rms.middle_rad, self.now.rms_rad)

    @property
    def worth_a_write(self) -> bool:
        """Whether the fall of the rms error is large enough, and more than the forecast is off."""
        fall_rad = self.now.rms_rad - self.after.rms.middle_rad
        # a forecast that was off by a factor, up or down, may be off by it again
        off = math.exp(abs(math.log(max(self.bias, _TINY))))
        return (
            fall_rad > max(WORTH * self.now.rms_rad, COUNTS * self.count_rad)
            and self.now.rms_rad > off * self.after.rms.middle_rad
        )

    @property
    def worse(self) -> bool:
        """Whether the rms error would grow, with all of its interval."""
        least_rad = max(SHARE * self.now.rms_rad, COUNTS * self.count_rad)
        return self.after.rms.low_rad > self.now.rms_rad + least_rad

    def kept(self, judged: int) -> bool | None:
        """Whether the measured errors are below their limits; None where none was measured.

        Parameters
        ----------
        judged : int
            Errors that are judged together.
        """
        if self.measured is None:
            return None
        peak_kept = self.measured.peak_rad <= self.peak_limit_rad(judged)
        return peak_kept and self.rms_kept(judged) is True

    def rms_kept(self, judged: int) -> bool | None:
        """The same of the rms error alone."""
        return (
            None if self.measured is None else self.measured.rms_rad <= self.rms_limit_rad(judged)
        )

    def rms_limit_rad(self, judged: int) -> float:
        """Largest rms error that keeps the promise; `judged` as in `kept`."""
        return self.after.rms.limit_rad(judged) + COUNTS * self.count_rad

    def peak_limit_rad(self, judged: int) -> float:
        """Largest peak error that keeps the promise; `judged` as in `kept`."""
        return self.after.peak.limit_rad(judged) + self.count_rad


@dataclass(frozen=True)
class Promise:
    """What new gains promise, by motion and axis.

    Attributes
    ----------
    motions : mapping of motion to mapping of axis name to Promised
        The motion of the identification first.
    """

    motions: Mapping[str, Mapping[str, Promised]]

    @property
    def every(self) -> tuple[tuple[str, str, Promised], ...]:
        """Motion, axis and what is promised there."""
        return tuple(
            (motion, axis, of_axis)
            for motion, axes in self.motions.items()
            for axis, of_axis in axes.items()
        )

    @property
    def worth_a_write(self) -> bool:
        """Whether an axis gains enough, and none would certainly follow worse."""
        promised = [of_axis for *_, of_axis in self.every]
        return any(p.worth_a_write for p in promised) and not any(p.worse for p in promised)

    def useful(self, axis: str) -> bool:
        """Whether an axis gains enough on a motion, and would certainly follow worse on none."""
        promised = [of_axis for _, name, of_axis in self.every if name == axis]
        return any(p.worth_a_write for p in promised) and not any(p.worse for p in promised)

    @property
    def best(self) -> float:
        """Largest improvement of an rms error."""
        return max(of_axis.improvement for *_, of_axis in self.every)

    @property
    def worse(self) -> tuple[str, ...]:
        """Where an error would certainly grow, in words."""
        return tuple(f"axis {a} on the {m}" for m, a, of_axis in self.every if of_axis.worse)

    @property
    def broken(self) -> tuple[str, ...]:
        """Where a measured error is above its limit, in words."""
        return tuple(
            f"axis {axis} on the {motion}"
            for motion, axis, of_axis in self.every
            if of_axis.kept(self.judged) is False
        )

    @property
    def judged(self) -> int:
        """Errors that are judged together: rms and peak of every axis on every motion."""
        return 2 * len(self.every)

    @property
    def missed(self) -> float:
        """Logarithm of the largest measured error over what was forecast; zero where none is
        larger. Half a count more or less is the encoder's."""
        ratios = [
            found / max(expected.high_rad, of.count_rad)
            for *_, of in self.every
            if of.measured is not None
            for found, expected in (
                (of.measured.rms_rad, of.after.rms),
                (of.measured.peak_rad - of.count_rad, of.after.peak),
            )
        ]
        return math.log(max([1.0, *ratios]))

    def with_motion(self, name: str, axes: Mapping[str, Promised]) -> "Promise":
        """The promise with one motion more."""
        return Promise({**self.motions, name: axes})

    def measured(self, found: Mapping[str, Mapping[str, Errors]]) -> "Promise":
        """The promise with what was measured with the new gains, by motion and axis."""
        return Promise(
            {
                motion: {
                    axis: replace(of_axis, measured=found.get(motion, {}).get(axis))
                    for axis, of_axis in axes.items()
                }
                for motion, axes in self.motions.items()
            }
        )


def promised(
    moved: RecordedMotion,
    grounds: Grounds,
    hardware: Mapping[str, LoopHardware],
    active: Bank,
    wanted: Bank,
    disbelief: float = 0.0,
) -> dict[str, Promised]:
    """What new gains promise on a motion that was recorded with those in force, by axis.

    Parameters
    ----------
    moved : RecordedMotion
    grounds : Grounds
    hardware : mapping of axis name to LoopHardware
    active, wanted : mapping of axis name to AxisGains
    disbelief : float
        Logarithm by which forecasts for this machine were off before.
    """
    now, after = drawn_errors(moved, grounds, hardware, (active,), (wanted,))
    return {
        name: Promised.of(
            moved.errors(name), now[name], after[name], of.encoder_resolution_rad, disbelief
        )
        for name, of in hardware.items()
    }


def _ratio(one: float, other: float) -> float:
    return one / max(other, _TINY)


def _missed(measured: float, drawn: Array) -> float:
    """Measured over forecast; one where there is no forecast."""
    middle = float(median(drawn))
    return measured / middle if math.isfinite(middle) and min(measured, middle) > 0.0 else 1.0


# What gains promise before they are in force: margins, and tracking on a recorded motion.


@dataclass(frozen=True)
class Forecast:
    """Margins and tracking error of one axis under one set of gains.

    Attributes
    ----------
    phase_margin_rad, gain_margin : float
        Smallest over the interval of the inertia; no phase margin stands for an unstable loop.
    tracking_rms, tracking_peak : Expected or None
        On the recorded motion; infinite for an unstable loop, None where no motion is known.
    """

    phase_margin_rad: float
    gain_margin: float
    tracking_rms: Expected | None = None
    tracking_peak: Expected | None = None

    @property
    def stable(self) -> bool:
        """Whether the loop settles at all."""
        return self.phase_margin_rad > 0.0 and self.gain_margin > 1.0

    @property
    def phase_margin_deg(self) -> float:
        """Phase margin in degrees, for people."""
        return math.degrees(self.phase_margin_rad)


Forecasts = tuple[Mapping[str, Forecast], ...]
"""Forecasts of several banks, by axis; none where nothing is known of the drive."""


class Forecaster:
    """Knows the drive behind a board from a model, a recording, or both.

    Parameters
    ----------
    identity, limits
        Of the board.
    model : Model or None
        Effects that are known; without a recording, inertia and friction too.
    recording : Recording or None
        What inertia and friction are identified from, and the motion to be followed.

    Raises
    ------
    ModelError
        The model lacks an axis of the board, or is in other units.
    GainError
        The recording does not identify the drive, or the inertia is known too poorly.
    """

    def __init__(
        self,
        identity: BoardIdentity,
        limits: Mapping[str, AxisLimits],
        model: Model | None,
        recording: Recording | None,
    ) -> None:
        grounds = None if model is None else Grounds(model, {}, {})
        if recording is not None:
            grounds = Grounds.of(_identified(recording, model))
        if grounds is None:
            raise ValueError("a model or a recording is needed")
        self._grounds = replace(grounds, model=_checked(grounds.model, tuple(limits)))
        self._moved = None if recording is None else _moved(recording, tuple(limits), identity)
        self._hardware = LoopHardware.of_axes(identity, limits)

    def forecast(self, banks: Sequence[Bank]) -> Forecasts:
        """Forecast margins and tracking errors for every bank, by axis."""
        axes = self._grounds.model.axes
        margins = [
            {
                axis: Forecast(*worst_margins(bank[axis], axes[axis], hardware, axes))
                for axis, hardware in self._hardware.items()
            }
            for bank in banks
        ]
        if self._moved is None:
            return tuple(margins)
        errors = drawn_errors(self._moved, self._grounds, self._hardware, (), banks)
        return tuple(
            {
                axis: replace(
                    of_axis,
                    tracking_rms=Expected.of(drawn[axis].rms_rad),
                    tracking_peak=Expected.of(drawn[axis].peak_rad),
                )
                for axis, of_axis in of_bank.items()
            }
            for of_bank, drawn in zip(margins, errors, strict=True)
        )


def check_stable(forecast: Mapping[str, Forecast]) -> None:
    """Refuse gains that cannot work.

    Raises
    ------
    GainError
    """
    for axis, of_axis in forecast.items():
        if not of_axis.stable:
            raise GainError(
                f"axis {axis}: the loop would be unstable (phase margin "
                f"{of_axis.phase_margin_deg:.0f}°, gain margin {of_axis.gain_margin:.2g})",
                "design gains from a recording of this drive: edge-ident gains FILE",
            )


def _identified(recording: Recording, known: Model | None) -> Identification:
    found = identify(recording, None, model=known)
    if not found.trusted:
        raise GainError(
            f"{recording.source}: the drive cannot be identified from it",
            "run edge-ident identify on it to see why, or give a --model instead",
        )
    return found


def _checked(model: Model, axes: tuple[str, ...]) -> Model:
    for name in axes:
        axis = model.axes.get(name)
        if axis is None or axis.units != BOARD_UNITS:
            raise ModelError(
                f"the board has axis {name} in rad and N*m; the model or recording has "
                + ", ".join(f"{n} ({' and '.join(of.units)})" for n, of in model.axes.items()),
                "give a model or recording of the drive of this board, with the board's names",
            )
        inertia, std = float(axis.parameters[0]), axis.terms[0].std.get("inertia", 0.0)
        if inertia <= 2.0 * std:
            raise GainError(
                f"axis {name}: the inertia {inertia:.3g} ± {std:.2g} is too uncertain",
                "record a motion that excites it: edge-ident capture --motion multisine",
            )
    return Model({name: model.axes[name] for name in axes})


def _moved(recording: Recording, axes: tuple[str, ...], identity: BoardIdentity) -> RecordedMotion:
    moved = RecordedMotion.of(recording, axes)
    if not math.isclose(moved.period_s, identity.sample_period_s, rel_tol=1e-3):
        raise DataError(
            f"{recording.source}: sampled every {moved.period_s:g} s, the board's loop runs "
            f"every {identity.sample_period_s:g} s",
            "give a recording made on this board with edge-ident capture",
        )
    return moved
