"""Controller gains from identified parameters.

Feedback by pole placement: a proportional-derivative law puts both poles of
inertia·s² + viscous_friction·s at one frequency, the bandwidth. The bandwidth is the highest one at
which the loop, with sampling, hold, velocity filter and the board's measured delay, keeps its
phase and gain margin over the interval of the inertia, and at which encoder quantization stays
a small part of the effort limit. There is no integral action: constant loads are fed forward,
and an integrator hunts around Coulomb friction at rest.
Sources: Åström and Murray, Feedback Systems, ch. 10 (margins); Franklin, Powell and Workman,
Digital Control of Dynamic Systems, ch. 4 (hold and delay); Ellis, Control System Design Guide
(feed-forward and quantization).
"""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.errors import GainError
from firmware_interface.gains import AxisGains

Array = NDArray[np.float64]

PHASE_MARGIN_RAD: Final = math.radians(50.0)
GAIN_MARGIN: Final = 2.5
QUANTIZATION_SHARE: Final = 0.02
"""Rms effort that encoder quantization may cause, as a share of the effort limit."""
_FILTER_RATIO: Final = 5.0
"""The velocity filter's corner, in bandwidths."""
_INTERVAL: Final = 2.0
"""Standard deviations of the inertia over which margins must hold."""
_FREQUENCIES: Final = 400
_ALIASES: Final = np.arange(-2, 3)
_RESOLUTION: Final = 1.02
"""Ratio to which the bandwidth is narrowed down."""
_SMOOTHING_COUNTS_PER_SAMPLE: Final = 0.1
"""Coulomb feed-forward is smoothed below the speed of one count in ten samples."""


@dataclass(frozen=True)
class LoopHardware:
    """What the board and its encoder do to the loop.

    Attributes
    ----------
    sample_period_s, control_delay_s : float
        The delay is measured by the board, encoder latch to effort.
    encoder_resolution_rad : float
    effort_limit_nm : float
    """

    sample_period_s: float
    control_delay_s: float
    encoder_resolution_rad: float
    effort_limit_nm: float


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
    """

    gains: AxisGains
    bandwidth_rad_s: float
    phase_margin_rad: float
    gain_margin: float
    quantization_effort_nm: float

    @property
    def phase_margin_deg(self) -> float:
        """Phase margin in degrees, for people."""
        return math.degrees(self.phase_margin_rad)

    @property
    def sound(self) -> bool:
        """Whether both margins are kept."""
        return self.phase_margin_rad >= PHASE_MARGIN_RAD and self.gain_margin >= GAIN_MARGIN


def design(
    parameters: Array,
    inertia_std: float,
    hardware: LoopHardware,
    bandwidth_rad_s: float | None = None,
) -> GainDesign:
    """Design the gains of one axis.

    Parameters
    ----------
    parameters : (4,) array
        Inertia, viscous friction, Coulomb friction and offset at the gearbox output.
    inertia_std : float
    hardware : LoopHardware
    bandwidth_rad_s : float, optional
        Without it, the highest that keeps the margins.

    Raises
    ------
    GainError
        Unphysical parameters, an inertia known too poorly, or a wanted bandwidth that does not
        keep the margins.
    """
    inertia = float(parameters[0])
    if np.any(parameters[:3] <= 0) or inertia <= _INTERVAL * inertia_std:
        raise GainError(
            f"no gains follow from inertia {inertia:.3g} ± {inertia_std:.2g} "
            f"and friction {parameters[1]:.3g}, {parameters[2]:.3g}",
            "identify again with a motion that excites every parameter",
        )
    if bandwidth_rad_s is not None:
        wanted = _place(parameters, inertia_std, hardware, bandwidth_rad_s)
        if not wanted.sound:
            raise GainError(
                f"a bandwidth of {bandwidth_rad_s:.3g} rad/s leaves a phase margin of "
                f"{wanted.phase_margin_deg:.0f}° and a gain margin of "
                f"{wanted.gain_margin:.2g}",
                f"ask for less: {math.degrees(PHASE_MARGIN_RAD):.0f}° and {GAIN_MARGIN} are needed",
            )
        return wanted
    # below the axis's own corner the derivative gain would turn negative
    lowest = max(1.0, float(parameters[1]) / inertia)
    highest = 0.5 / hardware.sample_period_s
    best = _place(parameters, inertia_std, hardware, lowest)
    if not _acceptable(best, hardware):
        raise GainError(
            f"no bandwidth above {lowest:.3g} rad/s keeps the margins",
            "check the board's control delay and the encoder; or pass --bandwidth",
        )
    while highest / lowest > _RESOLUTION:  # margins shrink and noise grows with bandwidth
        middle = math.sqrt(lowest * highest)
        candidate = _place(parameters, inertia_std, hardware, middle)
        if _acceptable(candidate, hardware):
            lowest, best = middle, candidate
        else:
            highest = middle
    return best


def _acceptable(candidate: GainDesign, hardware: LoopHardware) -> bool:
    loud = candidate.quantization_effort_nm > QUANTIZATION_SHARE * hardware.effort_limit_nm
    return candidate.sound and not loud


def _place(
    parameters: Array, inertia_std: float, hardware: LoopHardware, bandwidth: float
) -> GainDesign:
    inertia, viscous, coulomb, offset = (float(p) for p in parameters)
    gains = AxisGains(
        proportional=inertia * bandwidth**2,
        derivative=max(2.0 * inertia * bandwidth - viscous, 0.0),
        integral=0.0,
        velocity_filter_s=1.0 / (_FILTER_RATIO * bandwidth),
        inertia_feedforward=inertia,
        viscous_feedforward=viscous,
        coulomb_feedforward=coulomb,
        coulomb_smoothing_rad_s=_SMOOTHING_COUNTS_PER_SAMPLE
        * hardware.encoder_resolution_rad
        / hardware.sample_period_s,
        offset_feedforward=offset,
    )
    spread = _INTERVAL * inertia_std
    margins = [
        margins_of(gains, actual, viscous, hardware)
        for actual in (inertia - spread, inertia, inertia + spread)
    ]
    return GainDesign(
        gains=gains,
        bandwidth_rad_s=bandwidth,
        phase_margin_rad=min(phase for phase, _ in margins),
        gain_margin=min(gain for _, gain in margins),
        quantization_effort_nm=_quantization_effort(gains, hardware),
    )


def margins_of(
    gains: AxisGains, inertia: float, viscous_friction: float, hardware: LoopHardware
) -> tuple[float, float]:
    """Phase margin (rad) and gain margin (factor) of a loop.

    Zero phase margin stands for an unstable loop; an infinite gain margin for a phase that
    never reaches -180° below the Nyquist frequency.
    """
    period = hardware.sample_period_s
    omega = np.geomspace(1e-2, 0.999 * np.pi / period, _FREQUENCIES)
    # what the sampler sees is the sum over its aliases
    s = 1j * (omega + 2.0 * np.pi / period * _ALIASES[:, None])
    hold = (1.0 - np.exp(-s * period)) / (s * period)
    delay = np.exp(-s * hardware.control_delay_s)
    axis = np.sum(hold * delay / (s * (inertia * s + viscous_friction)), axis=0)
    loop = _controller(gains, omega, period) * axis
    magnitude, phase = np.abs(loop), np.unwrap(np.angle(loop))
    crossing = np.flatnonzero((magnitude[:-1] >= 1.0) & (magnitude[1:] < 1.0))
    if not len(crossing):
        return 0.0, 0.0
    around = slice(crossing[-1], crossing[-1] + 2)
    at_one = float(np.interp(0.0, -np.log(magnitude[around]), phase[around]))
    past = np.flatnonzero(phase <= -np.pi)
    past = past[past > 0]
    gain_margin = float(1.0 / magnitude[past[0]]) if len(past) else math.inf
    return max(at_one + np.pi, 0.0), gain_margin


def _controller(gains: AxisGains, omega: Array, period: float) -> NDArray[np.complex128]:
    """Frequency response of the board's law from position error to effort."""
    back = np.exp(-1j * omega * period)
    smoothing = period / (gains.velocity_filter_s + period)
    filtered = smoothing / (1.0 - (1.0 - smoothing) * back)
    return np.asarray(
        gains.proportional
        + gains.derivative * (1.0 - back) / period * filtered
        + gains.integral * period / (1.0 - back)
    )


def _quantization_effort(gains: AxisGains, hardware: LoopHardware) -> float:
    """Rms effort from white quantization noise of one twelfth of a count squared."""
    omega = np.linspace(1e-3, np.pi, _FREQUENCIES) / hardware.sample_period_s
    response = np.abs(_controller(gains, omega, hardware.sample_period_s))
    noise = hardware.encoder_resolution_rad / math.sqrt(12.0)
    return float(noise * np.sqrt(np.mean(response**2)))
