"""Controller gains from identified parameters.

A proportional-derivative law places both poles of inertia·s² + viscous_friction·s at one frequency,
the bandwidth. The bandwidth is the highest one at which the loop keeps its phase and gain margin
for every inertia and friction inside their intervals, and at which encoder quantization stays a
small part of the effort limit. The loop includes sampling, hold, velocity filter, the board's
measured delay and the latest that the recorded effort may be. Where the intervals are wide, the
filter is faster and the bandwidth lower. Where no bandwidth keeps the margins, or the board takes
none that does, the feedback in force stays, which the axis has shown to bear, and feed-forward
alone is designed. There is no integral action: constant loads are fed forward, and an integrator
hunts around Coulomb friction at rest.

Feed-forward leaves no error at constant acceleration a. The velocity that the law measures is late
by the filter and by half a sample of the difference. So feedback itself contributes
derivative·a·(velocity_filter + period/2), and feed-forward leaves that out. Effort acts late by the
delay and half a sample, so feed-forward of friction adds viscous_friction·a times as much.

The model's effects go into feed-forward and margins as `edge_ident.control.compensation` says.
Sources: Åström and Murray, Feedback Systems, ch. 10 (margins); Ellis, Control System Design Guide
(feed-forward and quantization).
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from os import PathLike
from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.control import position_loop
from edge_ident.control.compensation import (
    Unused,
    Used,
    compensated,
    loop_delay_s,
    over_poses,
    plant_of,
)
from edge_ident.control.law_terms import with_repeating
from edge_ident.control.position_loop import LoopHardware, Plant, check_units
from edge_ident.drive.description import Drive, given_drive
from edge_ident.errors import GainError
from edge_ident.model.inverse import base_at
from edge_ident.model.model import AxisModel
from edge_ident.model.model_files import GivenModel, given_model
from edge_ident.model.repeating import Repeating
from edge_ident.support.given import number
from edge_ident.support.rows import Drawable
from edge_ident.support.words import listed
from firmware_interface.gains import FEEDBACK, AxisGains

PHASE_MARGIN_RAD: Final = math.radians(50.0)
GAIN_MARGIN: Final = 2.5
QUANTIZATION_SHARE: Final = 0.02
"""Rms effort that encoder quantization may cause, as a share of the effort limit."""
# The velocity filter's corner, in bandwidths of an axis with the least inertia: a slow filter lets
# less of the encoder's rounding through, a fast one leaves more margin for delay.
_FILTER_RATIOS: Final = (5.0, 6.0, 7.0, 8.0, 10.0)
_INTERVAL: Final = 2.0  # standard deviations of inertia and friction over which margins must hold
# Least share of an inertia or friction that its interval reaches down to.
_LEAST_SHARE: Final = 0.05
_STEP: Final = 1.5  # ratio of bandwidths that are tried for a first one that is acceptable
_RESOLUTION: Final = 1.02  # ratio to which the bandwidth is narrowed down
# Coulomb feed-forward is smoothed below the speed of one count in ten samples. Where the supported
# acceleration is known, it need not be smoothed beyond the speed that this gives in a sample: a
# reference that turns back passes zero within one.
_SMOOTHING_COUNTS_PER_SAMPLE: Final = 0.1


@dataclass(frozen=True)
class GainDesign:
    """Gains of one axis and what they promise.

    Attributes
    ----------
    gains : AxisGains
    bandwidth_rad_s : float
        Where the closed loop's two poles are placed.
    phase_margin_rad, gain_margin : float
        Smallest over the interval of the inertia.
    quantization_effort_nm : float
        Rms effort caused by encoder quantization.
    used : tuple of Used
        Effects of the model that the gains use, and what became of them.
    unused : tuple of Unused
        Effects of the model that the gains make no use of, and why.
    kept : str
        Why the feedback is that in force, and no bandwidth was chosen; empty where it is designed.

    Examples
    --------
    >>> import edge_ident
    >>> design = edge_ident.design_gains(edge_ident.reduced_model()).axes["x"]
    >>> design.sound
    True
    """

    gains: AxisGains
    bandwidth_rad_s: float
    phase_margin_rad: float
    gain_margin: float
    quantization_effort_nm: float
    used: tuple[Used, ...] = ()
    unused: tuple[Unused, ...] = ()
    kept: str = ""

    @property
    def phase_margin_deg(self) -> float:
        """Phase margin in degrees, for people."""
        return math.degrees(self.phase_margin_rad)

    @property
    def sound(self) -> bool:
        """Whether both margins are kept."""
        return _sound(self.phase_margin_rad, self.gain_margin)


@dataclass(frozen=True)
class Ground:
    """What else a design knows of an axis, beside its model and its board.

    Attributes
    ----------
    at_s : float or None
        Time of the recording that the gains are to fit, from its first sample on; its end, where
        they are for the machine as it is now. Without it, effects that change base parameters in
        time are left out.
    late_s : float
        Longest time by which the effort may act later than the board says.
    repeating : Repeating or None
        Effort beside the model's that comes back over speed and stroke.
    in_force : AxisGains or None
        Gains that the axis has been moved with.
    gain_step : float
        Largest step that the board takes from them, as a share of a number's largest value.
    most_rad_s : float
        Highest bandwidth to choose.
    others : mapping of axis name to AxisModel
        The axes of the model, whose poses may change this one's inertia.
    """

    at_s: float | None = None
    late_s: float = 0.0
    repeating: Repeating | None = None
    in_force: AxisGains | None = None
    gain_step: float = math.inf
    most_rad_s: float = math.inf
    others: Mapping[str, AxisModel] = field(default_factory=dict)


def design(
    axis: AxisModel,
    hardware: LoopHardware,
    bandwidth_rad_s: float | None = None,
    ground: Ground | None = None,
) -> GainDesign:
    """Design the gains of one axis.

    Parameters
    ----------
    axis : AxisModel
        At the gearbox output; a parameter without standard deviation is taken for exact.
    hardware : LoopHardware
    bandwidth_rad_s : float, optional
        Without it, the highest that keeps the margins.
    ground : Ground, optional
        Where it has gains in force, these keep their feedback where no other can be designed.

    Raises
    ------
    GainError
        The model is not in rad and N·m, or a wanted bandwidth does not keep the margins. Without
        gains in force also: parameters are unphysical, the inertia is known too poorly, or no
        bandwidth keeps the margins.
    """
    ground = ground or Ground()
    check_units(axis.units)
    if ground.at_s is not None:
        axis = base_at(axis, ground.at_s)
    axis = over_poses(axis, ground.others, _INTERVAL)
    if ground.in_force is None:
        _check_physical(axis)
    elif doubt := _doubt(axis):
        return _kept(ground.in_force, axis, hardware, ground, doubt)
    known = _Known.of(axis, hardware, ground)
    if bandwidth_rad_s is None:
        found = _highest_acceptable(known)
        if found is None:
            return _kept_or_refused(axis, hardware, ground, known)
        return _with_effects(found, axis, hardware, ground)
    each = (replace(known, filter_ratio=ratio) for ratio in _FILTER_RATIOS)
    tried = [one.design(bandwidth_rad_s) for one in each]
    wanted = next((one for one in tried if one.sound), tried[0])
    if not wanted.sound:
        raise GainError(
            f"a bandwidth of {bandwidth_rad_s:.3g} rad/s leaves a phase margin of "
            f"{wanted.phase_margin_deg:.0f}° and a gain margin of {wanted.gain_margin:.2g}",
            f"choose a lower one: {math.degrees(PHASE_MARGIN_RAD):.0f}° and {GAIN_MARGIN} "
            "are needed",
        )
    return _with_effects(wanted, axis, hardware, ground)


def _check_physical(axis: AxisModel) -> None:
    inertia, viscous, coulomb, _ = (float(value) for value in axis.parameters)
    if min(viscous, coulomb) <= 0 or _doubt(axis):
        raise GainError(
            f"no gains follow from inertia {inertia:.3g} ± {_std(axis, 'inertia'):.2g} "
            f"and friction {viscous:.3g}, {coulomb:.3g}",
            "identify again with a motion that excites every parameter",
        )


def _doubt(axis: AxisModel) -> str:
    """Why no feedback can be designed for an axis; empty where it can."""
    inertia, std = float(axis.parameters[0]), _std(axis, "inertia")
    if inertia > _INTERVAL * std and inertia > 0.0:
        return ""
    return f"its inertia, {inertia:.3g} ± {std:.2g}, is known too poorly"


def _kept_or_refused(
    axis: AxisModel, hardware: LoopHardware, ground: Ground, known: "_Known"
) -> GainDesign:
    """Where no bandwidth is acceptable."""
    why = f"no bandwidth above {known.lowest:.3g} rad/s keeps the margins"
    if ground.in_force is None:
        raise GainError(why, "check the board's control delay and the encoder; or give --bandwidth")
    return _kept(ground.in_force, axis, hardware, ground, why)


def _kept(
    present: AxisGains, axis: AxisModel, hardware: LoopHardware, ground: Ground, why: str
) -> GainDesign:
    """Feed-forward for feedback that stays as it is."""
    known = _Known.of(axis, hardware, ground)
    gains = known.with_feedforward(present)
    margins = position_loop.margins_of(gains, known.plants, known.late)
    return _with_effects(left_alone(gains, axis, hardware, why, margins), axis, hardware, ground)


def left_alone(
    present: AxisGains,
    axis: AxisModel,
    hardware: LoopHardware,
    why: str,
    margins: tuple[float, float] | None = None,
) -> GainDesign:
    """A design that leaves the feedback of an axis as it is, with the margins that its loop has."""
    margins = margins or worst_margins(present, axis, hardware)
    bandwidth_rad_s = math.sqrt(present.proportional / float(axis.parameters[0]))
    noise_nm = position_loop.quantization_effort_nm(present, hardware)
    return GainDesign(present, bandwidth_rad_s, *margins, noise_nm, kept=why)


@dataclass(frozen=True)
class _Known:
    """What the design asks of an axis and its board at every bandwidth.

    Attributes
    ----------
    parameters : (4,) tuple of float
        Those of a machine: none of the first three is negative.
    lightest : float
        Inertia over the least that it may be.
    smoothing_rad_s : float
    plants : tuple of Plant
        At the corners of the intervals of inertia and friction.
    hardware : LoopHardware
    late : LoopHardware
        With the delay that the model adds, and by which the effort may be late.
    ground : Ground
    filter_ratio : float
        The velocity filter's corner, in bandwidths.
    """

    parameters: tuple[float, ...]
    lightest: float
    smoothing_rad_s: float
    plants: tuple[Plant, ...]
    hardware: LoopHardware
    late: LoopHardware
    ground: Ground
    filter_ratio: float = _FILTER_RATIOS[0]

    @classmethod
    def of(cls, axis: AxisModel, hardware: LoopHardware, ground: Ground) -> "_Known":
        plants, late = _loops(axis, hardware, ground.late_s)
        inertia, viscous, coulomb, offset = axis.parameters.tolist()
        inertia = inertia if inertia > 0.0 else plants[0].inertia
        parameters = (inertia, max(viscous, 0.0), max(coulomb, 0.0), offset)
        lightest = inertia / min(plant.inertia for plant in plants)
        smoothing = _coulomb_smoothing(axis, hardware)
        return cls(parameters, lightest, smoothing, plants, hardware, late, ground)

    @property
    def lowest(self) -> float:
        """Bandwidth below which the derivative gain would turn negative: the axis's own corner."""
        inertia, viscous, *_ = self.parameters
        return max(1.0, viscous / inertia)

    def gains(self, bandwidth: float) -> AxisGains:
        inertia, viscous, *_ = self.parameters
        return self.with_feedforward(
            AxisGains(
                proportional=inertia * bandwidth * bandwidth,  # a square may overflow
                derivative=max(2.0 * inertia * bandwidth - viscous, 0.0),
                integral=0.0,
                velocity_filter_s=1.0 / (self.filter_ratio * self.lightest * bandwidth),
                inertia_feedforward=0.0,
                viscous_feedforward=0.0,
                coulomb_feedforward=0.0,
                coulomb_smoothing_rad_s=self.smoothing_rad_s,
                offset_feedforward=0.0,
            )
        )

    def with_feedforward(self, feedback: AxisGains) -> AxisGains:
        """The feedback of these gains, with feed-forward of the base model and nothing else."""
        inertia, viscous, coulomb, offset = self.parameters
        half_s = 0.5 * self.hardware.sample_period_s
        late_s = self.hardware.control_delay_s + half_s
        fed_back = feedback.derivative * (feedback.velocity_filter_s + half_s) - viscous * late_s
        return AxisGains(
            **{name: getattr(feedback, name) for name in FEEDBACK},
            inertia_feedforward=max(inertia - fed_back, 0.0),
            viscous_feedforward=viscous,
            coulomb_feedforward=coulomb,
            coulomb_smoothing_rad_s=self.smoothing_rad_s,
            offset_feedforward=offset,
        )

    def quiet(self, gains: AxisGains) -> bool:
        limit = QUANTIZATION_SHARE * self.hardware.effort_limit_nm
        return position_loop.quantization_effort_nm(gains, self.hardware) <= limit

    def taken(self, gains: AxisGains) -> bool:
        """Whether the board takes the feedback, in one step from that in force."""
        present, largest = self.ground.in_force, self.hardware.gain_maximum
        if present is None or largest is None:
            return True
        numbers = ((getattr(bank, name) for bank in (gains, present, largest)) for name in FEEDBACK)
        return all(
            wanted <= most and abs(wanted - now) <= self.ground.gain_step * most
            for wanted, now, most in numbers
        )

    def acceptable(self, bandwidth: float) -> bool:
        gains = self.gains(bandwidth)
        return self.quiet(gains) and self.sound(gains)  # the quicker question first

    def sound(self, gains: AxisGains) -> bool:
        return _sound(*position_loop.margins_of(gains, self.plants, self.late))

    def design(self, bandwidth: float) -> GainDesign:
        gains = self.gains(bandwidth)
        phase_margin_rad, gain_margin = position_loop.margins_of(gains, self.plants, self.late)
        return GainDesign(
            gains=gains,
            bandwidth_rad_s=bandwidth,
            phase_margin_rad=phase_margin_rad,
            gain_margin=gain_margin,
            quantization_effort_nm=position_loop.quantization_effort_nm(gains, self.hardware),
        )


def _highest_acceptable(known: _Known) -> GainDesign | None:
    """The design of the highest bandwidth that is acceptable; None where none is, or where the
    board takes no such step."""
    best: GainDesign | None = None
    for ratio in _FILTER_RATIOS:
        found = _highest_with(replace(known, filter_ratio=ratio))
        if found is None:
            continue
        if best is not None and found.bandwidth_rad_s <= best.bandwidth_rad_s * _RESOLUTION:
            break  # faster filters let more noise through, and nothing else asks for them
        best = found
    return best if best is not None and known.taken(best.gains) else None


def _highest_with(known: _Known) -> GainDesign | None:
    """The same with one filter, by bisection."""
    lowest = known.lowest
    highest = min(0.5 / known.hardware.sample_period_s, known.ground.most_rad_s)
    while not known.acceptable(lowest):  # friction that is hardly known damps a slow loop, or not
        lowest *= _STEP
        if lowest >= highest:
            return None
    while highest / lowest > _RESOLUTION:  # margins shrink and noise grows with bandwidth
        middle = math.sqrt(lowest * highest)
        if known.acceptable(middle):
            lowest = middle
        else:
            highest = middle
    return known.design(lowest)


def _coulomb_smoothing(axis: AxisModel, hardware: LoopHardware) -> float:
    """Speed below which the feed-forward of dry friction changes its sign."""
    period_s, supported = hardware.sample_period_s, axis.terms[0].supported
    seen = _SMOOTHING_COUNTS_PER_SAMPLE * hardware.encoder_resolution_rad / period_s
    if supported is None or not any(supported.acceleration):
        return seen
    return min(seen, period_s * max(abs(a) for a in supported.acceleration))


def _with_effects(
    found: GainDesign, axis: AxisModel, hardware: LoopHardware, ground: Ground
) -> GainDesign:
    """The design with what the effects of the model, and what repeats beside it, add to it."""
    better = compensated(found.gains, axis, hardware, GAIN_MARGIN, ground.at_s)
    gains, used = better.gains, better.used
    if ground.repeating is not None:
        late_s = hardware.control_delay_s + 0.5 * hardware.sample_period_s + loop_delay_s(axis)
        gains, said = with_repeating(gains, ground.repeating, hardware, late_s)
        used = (*used, *(Used("repeating", sentence) for sentence in said))
    return replace(found, gains=gains, used=used, unused=better.unused)


def worst_margins(
    gains: AxisGains,
    axis: AxisModel,
    hardware: LoopHardware,
    others: Mapping[str, AxisModel] | None = None,
) -> tuple[float, float]:
    """Smallest phase margin (rad) and gain margin over the intervals of inertia and friction, and
    over the poses of other axes where these are given. The model's own delay comes on top of the
    hardware's; see `position_loop.margins_of`.
    """
    if others is not None:
        axis = over_poses(axis, others, _INTERVAL)
    return position_loop.margins_of(gains, *_loops(axis, hardware, 0.0))


def _loops(
    axis: AxisModel, hardware: LoopHardware, late_s: float
) -> tuple[tuple[Plant, ...], LoopHardware]:
    """The axis at the corners of its intervals, itself among them, and the board with all delay."""
    plant = plant_of(axis)
    inertias = _interval(plant.inertia, _std(axis, "inertia"))
    frictions = _interval(plant.viscous_friction, _std(axis, "viscous_friction"))
    corners = [
        replace(plant.with_inertia(inertia), viscous_friction=friction)
        for inertia in inertias
        for friction in frictions
    ]
    middle = replace(plant, viscous_friction=max(plant.viscous_friction, 0.0))
    plants = (middle, *corners) if plant.inertia > 0.0 else tuple(corners)
    delay_s = hardware.control_delay_s + loop_delay_s(axis) + late_s
    return tuple(dict.fromkeys(plants)), replace(hardware, control_delay_s=delay_s)


def _interval(value: float, std: float) -> tuple[float, float]:
    """Ends of the interval of a positive number."""
    high = max(value + _INTERVAL * std, 0.0)
    least = max(_LEAST_SHARE * max(value, high), 0.0)
    return max(value - _INTERVAL * std, least), high


def _sound(phase_margin_rad: float, gain_margin: float) -> bool:
    return phase_margin_rad >= PHASE_MARGIN_RAD and gain_margin >= GAIN_MARGIN


def _std(axis: AxisModel, name: str) -> float:
    return axis.terms[0].std.get(name, 0.0)


# Entry point: from a model of a drive to the gains of all its axes.

CONTROL_DELAY_S: Final = 0.0005
"""Time from the encoder latch to the new effort, where no board is there to say it."""


@dataclass(frozen=True)
class OpenLoop:
    """Frequency response of a designed loop, opened at the effort, with the nominal inertia.

    Attributes
    ----------
    omega_rad_s : (N,) array
        Frequencies, increasing, up to nearly the Nyquist frequency.
    response : (N,) complex array
    """

    omega_rad_s: NDArray[np.float64]
    response: NDArray[np.complex128]

    @property
    def crossover_hz(self) -> float:
        """The highest frequency at which the loop gain is one or more; 0 where there is none."""
        acts = self.omega_rad_s[np.abs(self.response) >= 1.0]
        return float(acts[-1]) / math.tau if acts.size else 0.0


@dataclass(frozen=True, repr=False)
class GainDesigns(Drawable):
    """The gains of a drive.

    `table` has a row for each number of each axis: bandwidth, margins, gains. `plot` draws the open
    loop of every axis, with its margins.

    Attributes
    ----------
    axes : mapping of axis name to GainDesign
    loops : mapping of axis name to OpenLoop

    Examples
    --------
    >>> import edge_ident
    >>> designs = edge_ident.design_gains(edge_ident.reduced_model())
    >>> print(designs)  # doctest: +ELLIPSIS
    gains, in N·m, rad and s
    ...
    """

    axes: Mapping[str, GainDesign]
    loops: Mapping[str, OpenLoop]


def design_gains(
    model: GivenModel,
    drive: Drive | str | PathLike[str] | None = None,
    *,
    bandwidth_rad_s: float | None = None,
    control_delay_s: float = CONTROL_DELAY_S,
    at_s: float | None = None,
) -> GainDesigns:
    """Design the controller gains of every axis of a model; nothing is written to a board.

    Parameters
    ----------
    model : Model, result with a model, str or Path
    drive : Drive, str or Path, optional
        Tells sampling, encoders and effort limits; without one, the built-in drive's.
    bandwidth_rad_s : float, optional
        Of the closed loop; without it, the highest that keeps the margins.
    control_delay_s : float
        Time from the encoder latch to the new effort.
    at_s : float, optional
        Time of the model's recording that the gains are to fit: its end, for the machine as it is
        now. Without it, effects that change base parameters in time are left out.

    Returns
    -------
    GainDesigns

    Raises
    ------
    DataError
        The drive description lacks an axis.
    GainError
        An axis that no drive moves acts on one; the parameters are not physical or not known well
        enough, or the margins are not kept.

    Examples
    --------
    >>> import edge_ident
    >>> designs = edge_ident.design_gains(edge_ident.reduced_model(), bandwidth_rad_s=12.0)
    >>> designs.axes["x"].phase_margin_deg > 50.0
    True
    """
    model = given_model(model)
    if bandwidth_rad_s is not None:
        number("bandwidth_rad_s", bandwidth_rad_s, 1e-3, 1e5, "give rad/s, or leave it out")
    number("control_delay_s", control_delay_s, 0.0, 1.0, "give seconds, such as 0.0005")
    if model.passive:
        raise GainError(
            f"the axes carry {listed(model.passive)}, which no drive moves: how that swings in the "
            "loop is not known",
            "hold it fast, record that, and design gains from the new recording",
        )
    described = given_drive(drive)
    designs, loops = {}, {}
    for name, axis in model.axes.items():
        hardware = _hardware(described, name, control_delay_s)
        ground = Ground(at_s, others=model.axes)
        designs[name] = design(axis, hardware, bandwidth_rad_s, ground)
        posed = over_poses(axis, model.axes, _INTERVAL)
        loops[name] = _open_loop(designs[name], posed, hardware)
    return GainDesigns(designs, loops)


def _hardware(drive: Drive, axis: str, control_delay_s: float) -> LoopHardware:
    drive.check_axes([axis])
    described = drive.axes[axis]
    return LoopHardware(
        drive.sampling_period_s,
        control_delay_s,
        described.encoder_resolution_rad,
        described.effort_limit_nm,
    )


def _open_loop(found: GainDesign, axis: AxisModel, hardware: LoopHardware) -> OpenLoop:
    delayed = replace(hardware, control_delay_s=hardware.control_delay_s + loop_delay_s(axis))
    return OpenLoop(*position_loop.open_loop(found.gains, plant_of(axis), delayed))
