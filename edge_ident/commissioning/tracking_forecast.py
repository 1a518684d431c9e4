"""The tracking error that gains will have on a motion that was recorded, with its interval.

The record tells the effort that the motion needed, whatever the model says: what the model leaves
unexplained is replayed as a disturbance. So the model answers one question only, what other gains
make of the same need (`edge_ident.simulation.loop_response`). `DRAWS` drives do it side by side.
They differ in all that is not known:

- the base parameters and those of the effects, within their deviations, which hold the fit's noise
  and the spread between the regimes of the motion;
- the time by which effort and position are apart in the record, within its deviation;
- how friction turns round, which no encoder resolves: at once, or within a whole count;
- how much of what is unexplained is the encoder's noise, which no drive has to bring up
  (`edge_ident.commissioning.drawn_loads`);
- whether the rest belongs to the place in the motion and comes back, or is new each time: each
  drive has a mixture of what was seen and of other noise with the same spectrum;
- where the encoder's counts lie.

The errors are read as a board reports them, in whole counts, from the way that the motor is to take
(`edge_ident.commissioning.tracking_forecast`). The 90 % interval goes from the
smallest of `DRAWS` to the largest.

Terms that are tied to time (`Effect.tied_to_time`) act in the recording that they were found in.
Nobody knows whether a push or a warm-up comes again in the next motion. So every second draw has
them once more. In the others they are over, and base parameters that they changed stay as they were
at the end of the recording. Effort ends at the board's limit, or at one of the actuator that the
model knows.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.commissioning import drawn_loads
from edge_ident.commissioning.drawn_loads import Grounds, RecordedMotion
from edge_ident.control.compensation import effort_limit_nm
from edge_ident.control.gain_design import GainDesign, worst_margins
from edge_ident.control.position_loop import LoopHardware, law_response
from edge_ident.model.model import Array, AxisModel
from edge_ident.signals.recording import AxisRecord, Recording
from edge_ident.simulation.loop_response import Loads, Path, tracking_errors
from firmware_interface.control_law import NOTHING, Memory
from firmware_interface.gains import AxisGains, Bank
from firmware_interface.motion import Reference, Trajectory

_LOOKS: Final = 10.0  # samples in the time in which the stiffest loop turns by one radian
_TINY: Final = 1e-12


@dataclass(frozen=True)
class Drawn:
    """Tracking errors of one axis and bank, by drawn drive.

    Attributes
    ----------
    rms_rad, peak_rad : (DRAWS,) arrays
        Infinite for a loop that would be unstable.
    errors_rad : (DRAWS, N) array
        Over time, at the samples that the forecast looked at.
    """

    rms_rad: Array
    peak_rad: Array
    errors_rad: Array

    @cached_property
    def course_rad(self) -> Array:
        """Mean error over time, (N,)."""
        return np.asarray(np.mean(self.errors_rad, axis=0))

    def alike(self, other: "Drawn") -> float:
        """How far both errors have the same course: their correlation, 0 to 1."""
        product = float(np.mean(self.course_rad * other.course_rad))
        size = math.sqrt(np.mean(self.course_rad**2) * np.mean(other.course_rad**2))
        return max(product / max(size, _TINY), 0.0)


def drawn_errors(
    moved: RecordedMotion,
    grounds: Grounds,
    hardware: Mapping[str, LoopHardware],
    recorded: Sequence[Bank],
    then: Sequence[Bank],
) -> tuple[Mapping[str, Drawn], ...]:
    """Tracking errors for every bank, those of `recorded` first, by axis, for the same drives.

    Parameters
    ----------
    moved : RecordedMotion
    grounds : Grounds
    hardware : mapping of axis name to LoopHardware
    recorded : sequence of mapping of axis name to AxisGains
        Gains for the drive in the course of the recording.
    then : sequence of mapping of axis name to AxisGains
        Gains for the drive as it goes on after the recording.

    Raises
    ------
    ModelError
        The model does not fit the recording.
    """
    by_axis = {
        name: _of_axis(name, moved, grounds, of, recorded, then) for name, of in hardware.items()
    }
    return tuple(
        {name: of_axis[number] for name, of_axis in by_axis.items()}
        for number in range(len(recorded) + len(then))
    )


def _of_axis(
    name: str,
    moved: RecordedMotion,
    grounds: Grounds,
    hardware: LoopHardware,
    recorded: Sequence[Bank],
    then: Sequence[Bank],
) -> list[Drawn]:
    """Tracking errors of one axis: what its drives need is large, and freed before the next."""
    axis, gains = grounds.model.axes[name], [bank[name] for bank in (*recorded, *then)]
    every = _every(gains, axis, hardware)
    thinned = {of: _thinned(each, moved.begin, every) for of, each in moved.references.items()}
    others = [each for of, each in thinned.items() if of != name]
    beside = others[0] if len(others) == 1 else None
    path = Path(thinned[name], every * hardware.sample_period_s, moved.begin // every, beside)
    during, later = drawn_loads.drawn_loads(name, moved, grounds, hardware, every)
    limited = replace(hardware, effort_limit_nm=effort_limit_nm(axis, hardware))
    found: list[Drawn] = []
    missed: _Missed | None = None
    for number, of_bank in enumerate(gains):
        loads = during if number < len(recorded) else later
        beyond = None if missed is None else missed.with_gains(of_bank)
        drawn = _drawn(path, loads, of_bank, limited, axis, beyond)
        if number == 0 and recorded and np.all(np.isfinite(drawn.rms_rad)):
            measured = moved.errors(name)[::every]
            missed = _Missed.of(measured, drawn, path.period_s, of_bank, limited, axis)
        found.append(drawn)
    return found


@dataclass(frozen=True)
class _Missed:
    """What forecasts with the recorded gains miss of the error that was measured with them.

    It is what no draw knows of: how friction turns round at reversals, an encoder that is uneven.
    Other gains make of it what they make of any effort that the model lacks.

    Attributes
    ----------
    spectra : (DRAWS, K) array
        Of errors with the recorded gains, as they may come back.
    omega : (K,) array
    samples : int
    gains : AxisGains
        Recorded.
    """

    spectra: NDArray[np.complex128]
    omega: Array
    samples: int
    gains: AxisGains
    hardware: LoopHardware
    axis: AxisModel

    @classmethod
    def of(
        cls,
        measured: Array,
        drawn: "Drawn",
        period_s: float,
        gains: AxisGains,
        hardware: LoopHardware,
        axis: AxisModel,
    ) -> "_Missed":
        scatter = drawn.errors_rad - drawn.course_rad
        left = np.broadcast_to(measured - drawn.course_rad, scatter.shape)
        known = np.ones(len(measured), dtype=np.bool_)
        extra = drawn_loads.drawn_unexplained(left, known, scatter, np.random.default_rng(1))
        frequency = np.fft.rfftfreq(len(measured), period_s).astype(np.float64)
        omega = 2.0 * np.pi * frequency
        omega[0] = omega[1]  # an axis that is not held drifts away
        spectra = np.fft.rfft(extra)
        return cls(spectra, omega, len(measured), gains, hardware, axis)

    def with_gains(self, gains: AxisGains) -> Array:
        """What it is with other gains, (DRAWS, N)."""
        share = self._opened(self.gains) / self._opened(gains)
        return np.asarray(np.fft.irfft(share * self.spectra, self.samples))

    def _opened(self, gains: AxisGains) -> NDArray[np.complex128]:
        """One and the opened loop, (K,): an effort becomes an error over it."""
        s = 1j * self.omega
        inertia, viscous, *_ = self.axis.parameters
        late_s = self.hardware.control_delay_s + 0.5 * self.hardware.sample_period_s
        law = law_response(gains, self.omega, self.hardware.sample_period_s)
        return np.asarray(1.0 + law * np.exp(-s * late_s) / (s * (inertia * s + viscous)))


def _every(gains: Sequence[AxisGains], axis: AxisModel, hardware: LoopHardware) -> int:
    """Samples from one to the next that the forecast looks at."""
    stiffest = max(of_bank.proportional for of_bank in gains)
    fastest = math.sqrt(max(stiffest / float(axis.parameters[0]), _TINY))
    return max(1, int(1.0 / (_LOOKS * fastest * hardware.sample_period_s)))


def _thinned(whole: Reference, begin: int, every: int) -> Reference:
    """Every so many samples, the first of the recording among them."""
    rows = (whole.position_rad, whole.velocity_rad_s, whole.acceleration_rad_s2)
    return Reference(*(row[begin % every :: every] for row in rows))


def _drawn(
    path: Path,
    loads: Loads,
    gains: AxisGains,
    hardware: LoopHardware,
    axis: AxisModel,
    beyond: Array | None = None,
) -> Drawn:
    """Errors of the drawn drives; `beyond` what forecasts are known to miss, (DRAWS, N)."""
    phase_margin, gain_margin = worst_margins(gains, axis, hardware)
    if phase_margin <= 0.0 or gain_margin <= 1.0:
        runs_away = np.full(drawn_loads.DRAWS, np.inf)
        still = np.zeros((drawn_loads.DRAWS, len(path.reference.position_rad) - path.begin))
        return Drawn(runs_away, runs_away, still)
    lead = lead_rad(gains, path.reference.position_rad)[path.begin :]
    reference_rad = path.reference.position_rad[path.begin :]
    position = reference_rad - tracking_errors(path, loads, gains, hardware)
    if beyond is not None:
        position -= beyond
    if count := hardware.encoder_resolution_rad:
        reference_rad, position = (count * np.round(of / count) for of in (reference_rad, position))
    errors = reference_rad + lead - position
    rms, peak = np.sqrt(np.mean(errors**2, axis=-1)), np.max(np.abs(errors), axis=-1)
    return Drawn(rms, peak, errors)


# Where gains with a term for play want the motor, which an encoder on it can judge.
#
# Such gains let the motor lead its reference by half the gap, so that the load follows. The encoder
# sits on the motor. So two motions are compared by how well the motor kept to the way that it was
# to take. Whether the load follows better only a scale or a dial gauge at the load can show.


def of_motor(recording: Recording, gains: Bank, trajectory: Trajectory) -> Recording:
    """The recording with the way of the motor for its reference.

    Parameters
    ----------
    recording : Recording
        Of a motion with these gains.
    gains : mapping of axis name to AxisGains
    trajectory : Trajectory
        Of the motion: its way in decides on which side of the play the recording begins.
    """
    if not any("backlash" in of_axis.terms for of_axis in gains.values()):
        return recording
    moved = RecordedMotion.along(recording, trajectory)
    ways_in = {axis: way.position_rad[: moved.begin + 1] for axis, way in moved.references.items()}
    axes = {
        axis: _led(record, gains[axis], ways_in[axis]) for axis, record in recording.axes.items()
    }
    return replace(recording, axes=axes)


def _led(record: AxisRecord, gains: AxisGains, way_in_rad: Array) -> AxisRecord:
    if record.reference is None or "backlash" not in gains.terms:
        return record
    start = NOTHING.along(gains, way_in_rad).last
    return replace(record, reference=record.reference + lead_rad(gains, record.reference, start))


def lead_rad(gains: AxisGains, reference_rad: Array, start: Memory = NOTHING) -> Array:
    """How far the motor is to lead a reference (N,), whose first sample is where the law begins.

    Parameters
    ----------
    gains : AxisGains
    reference_rad : (N,) array
    start : Memory
        Of the law, before it.
    """
    way = np.concatenate([reference_rad[:1], reference_rad])
    return np.broadcast_to(start.along(gains, way).backlash_rad, reference_rad.shape)


def unseen_load(designs: Mapping[str, GainDesign]) -> str:
    """What an outcome must add where gains make up for play; empty where none do."""
    axes = [name for name, found in designs.items() if "backlash" in found.gains.terms]
    if not axes:
        return ""
    return (
        f"; axis {', '.join(axes)}: the error is that of the motor, which leads by half the play; "
        "its encoder cannot show whether the load follows better"
    )
