"""Controller gains from identified parameters.

A proportional-derivative law places both poles of inertia·s² + viscous_friction·s at one frequency,
the bandwidth. The bandwidth is the highest one at which the loop keeps its phase and gain margin
over the interval of the inertia, and at which encoder quantization stays a small part of the
effort limit. The loop includes sampling, hold, velocity filter and the board's measured delay.
There is no integral action: constant loads are fed forward, and an integrator hunts around Coulomb
friction at rest.

Feed-forward leaves no error at constant acceleration a. The velocity that the law measures is late
by the filter and by half a sample of the difference. So feedback itself contributes
derivative·a·(velocity_filter + period/2), and feed-forward leaves that out. Effort acts late by the
delay and half a sample, so feed-forward of friction adds viscous_friction·a times as much.

The model's effects go into feed-forward and margins as `edge_ident.control.compensation` says.
Sources: Åström and Murray, Feedback Systems, ch. 10 (margins); Ellis, Control System Design Guide
(feed-forward and quantization).
"""

import math
from dataclasses import dataclass, replace
from typing import Final

from edge_ident.control.compensation import (
    Unused,
    Used,
    compensated,
    loop_delay_s,
    plant_of,
)
from edge_ident.control.loop_plant import Plant
from edge_ident.control.position_loop import (
    LoopHardware,
    margins_of,
    quantization_effort_nm,
)
from edge_ident.errors import GainError
from edge_ident.model.base_in_time import base_at
from edge_ident.model.model import BOARD_UNITS, AxisModel
from edge_ident.support.words import listed
from firmware_interface.gains import AxisGains

PHASE_MARGIN_RAD: Final = math.radians(50.0)
GAIN_MARGIN: Final = 2.5
QUANTIZATION_SHARE: Final = 0.02
"""Rms effort that encoder quantization may cause, as a share of the effort limit."""
_FILTER_RATIO: Final = 5.0
"""The velocity filter's corner, in bandwidths."""
_INTERVAL: Final = 2.0
"""Standard deviations of the inertia over which margins must hold."""
_RESOLUTION: Final = 1.02
"""Ratio to which the bandwidth is narrowed down."""
_SMOOTHING_COUNTS_PER_SAMPLE: Final = 0.1
"""Coulomb feed-forward is smoothed below the speed of one count in ten samples. Where the supported
acceleration is known, it need not be smoothed beyond the speed that this gives in a sample: a
reference that turns back passes zero within one."""


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

    @property
    def phase_margin_deg(self) -> float:
        """Phase margin in degrees, for people."""
        return math.degrees(self.phase_margin_rad)

    @property
    def sound(self) -> bool:
        """Whether both margins are kept."""
        return _sound(self.phase_margin_rad, self.gain_margin)


def design(
    axis: AxisModel,
    hardware: LoopHardware,
    bandwidth_rad_s: float | None = None,
    at_s: float | None = None,
) -> GainDesign:
    """Design the gains of one axis.

    Parameters
    ----------
    axis : AxisModel
        At the gearbox output; an inertia without standard deviation is taken for exact.
    hardware : LoopHardware
    bandwidth_rad_s : float, optional
        Without it, the highest that keeps the margins.
    at_s : float, optional
        Time of the recording that the gains are to fit, from its first sample on; its end, where
        they are for the machine as it is now. Without it, effects that change base parameters in
        time are left out.

    Raises
    ------
    GainError
        The model is not in rad and N·m, parameters are unphysical, the inertia is known too
        poorly, or a wanted bandwidth does not keep the margins.
    """
    _check_units(axis)
    if at_s is not None:
        axis = base_at(axis, at_s)
    _check_physical(axis)
    known = _Known.of(axis, hardware)
    if bandwidth_rad_s is None:
        return _with_effects(_highest_acceptable(known), axis, hardware, at_s)
    wanted = known.design(bandwidth_rad_s)
    if not wanted.sound:
        raise GainError(
            f"a bandwidth of {bandwidth_rad_s:.3g} rad/s leaves a phase margin of "
            f"{wanted.phase_margin_deg:.0f}° and a gain margin of {wanted.gain_margin:.2g}",
            f"choose a lower one: {math.degrees(PHASE_MARGIN_RAD):.0f}° and {GAIN_MARGIN} "
            "are needed",
        )
    return _with_effects(wanted, axis, hardware, at_s)


def _check_units(axis: AxisModel) -> None:
    if axis.units != BOARD_UNITS:
        raise GainError(
            f"the model is in {listed(axis.units)}, and gains of a board are in rad and N*m",
            "convert the recording with --unit, --resolution or --torque-constant, and identify "
            "again",
        )


def _check_physical(axis: AxisModel) -> None:
    inertia, viscous, coulomb, _ = (float(value) for value in axis.parameters)
    inertia_std = _inertia_std(axis)
    if min(inertia, viscous, coulomb) <= 0 or inertia <= _INTERVAL * inertia_std:
        raise GainError(
            f"no gains follow from inertia {inertia:.3g} ± {inertia_std:.2g} "
            f"and friction {viscous:.3g}, {coulomb:.3g}",
            "identify again with a motion that excites every parameter",
        )


@dataclass(frozen=True)
class _Known:
    """What the design asks of an axis and its board at every bandwidth.

    Attributes
    ----------
    parameters : (4,) tuple of float
    smoothing_rad_s : float
    plants : tuple of Plant
        Over the interval of the inertia.
    hardware : LoopHardware
    late : LoopHardware
        With the delay that the model adds.
    """

    parameters: tuple[float, ...]
    smoothing_rad_s: float
    plants: tuple[Plant, ...]
    hardware: LoopHardware
    late: LoopHardware

    @classmethod
    def of(cls, axis: AxisModel, hardware: LoopHardware) -> "_Known":
        plants, late = _loops(axis, hardware)
        parameters = tuple(axis.parameters.tolist())
        return cls(parameters, _coulomb_smoothing(axis, hardware), plants, hardware, late)

    def gains(self, bandwidth: float) -> AxisGains:
        inertia, viscous, coulomb, offset = self.parameters
        derivative = max(2.0 * inertia * bandwidth - viscous, 0.0)
        filter_s = 1.0 / (_FILTER_RATIO * bandwidth)
        half_s = 0.5 * self.hardware.sample_period_s
        late_s = self.hardware.control_delay_s + half_s
        fed_back = derivative * (filter_s + half_s) - viscous * late_s
        return AxisGains(
            proportional=inertia * bandwidth * bandwidth,  # a square may overflow
            derivative=derivative,
            integral=0.0,
            velocity_filter_s=filter_s,
            inertia_feedforward=max(inertia - fed_back, 0.0),
            viscous_feedforward=viscous,
            coulomb_feedforward=coulomb,
            coulomb_smoothing_rad_s=self.smoothing_rad_s,
            offset_feedforward=offset,
        )

    def quiet(self, gains: AxisGains) -> bool:
        limit = QUANTIZATION_SHARE * self.hardware.effort_limit_nm
        return quantization_effort_nm(gains, self.hardware) <= limit

    def sound(self, gains: AxisGains) -> bool:
        return _sound(*margins_of(gains, self.plants, self.late))

    def design(self, bandwidth: float) -> GainDesign:
        gains = self.gains(bandwidth)
        phase_margin_rad, gain_margin = margins_of(gains, self.plants, self.late)
        return GainDesign(
            gains=gains,
            bandwidth_rad_s=bandwidth,
            phase_margin_rad=phase_margin_rad,
            gain_margin=gain_margin,
            quantization_effort_nm=quantization_effort_nm(gains, self.hardware),
        )


def _highest_acceptable(known: _Known) -> GainDesign:
    """The design of the highest bandwidth that is acceptable, by bisection."""
    inertia, viscous, *_ = known.parameters

    def acceptable(bandwidth: float) -> bool:
        gains = known.gains(bandwidth)
        return known.quiet(gains) and known.sound(gains)  # the quicker question first

    # below the axis's own corner the derivative gain would turn negative
    lowest = max(1.0, viscous / inertia)
    highest = 0.5 / known.hardware.sample_period_s
    if not acceptable(lowest):
        raise GainError(
            f"no bandwidth above {lowest:.3g} rad/s keeps the margins",
            "check the board's control delay and the encoder; or give --bandwidth",
        )
    while highest / lowest > _RESOLUTION:  # margins shrink and noise grows with bandwidth
        middle = math.sqrt(lowest * highest)
        if acceptable(middle):
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
    found: GainDesign, axis: AxisModel, hardware: LoopHardware, at_s: float | None
) -> GainDesign:
    """The design with what the effects of the model add to its gains."""
    better = compensated(found.gains, axis, hardware, GAIN_MARGIN, at_s)
    return replace(found, gains=better.gains, used=better.used, unused=better.unused)


def worst_margins(gains: AxisGains, axis: AxisModel, hardware: LoopHardware) -> tuple[float, float]:
    """Smallest phase margin (rad) and gain margin over the interval of the inertia.

    The model's own delay comes on top of the hardware's; see `position_loop.margins_of`.
    """
    return margins_of(gains, *_loops(axis, hardware))


def _loops(axis: AxisModel, hardware: LoopHardware) -> tuple[tuple[Plant, ...], LoopHardware]:
    """The axis over the interval of its inertia, and the board with the model's own delay."""
    plant, spread = plant_of(axis), _INTERVAL * _inertia_std(axis)
    plants = tuple(plant.with_inertia(plant.inertia + change) for change in (-spread, 0.0, spread))
    delay_s = hardware.control_delay_s + loop_delay_s(axis)
    return plants, replace(hardware, control_delay_s=delay_s)


def _sound(phase_margin_rad: float, gain_margin: float) -> bool:
    return phase_margin_rad >= PHASE_MARGIN_RAD and gain_margin >= GAIN_MARGIN


def _inertia_std(axis: AxisModel) -> float:
    return axis.terms[0].std.get("inertia", 0.0)
