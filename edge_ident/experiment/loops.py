"""Position loops: what an axis makes of its reference, overshoot included.

A loop with known gains has one response. Of an unknown loop, only its kind is known: feedback of
position and speed that keeps the phase margin of `edge_ident.control.gain_design`. Then every
natural frequency of a wide range counts, and the worst decides.
Source: Franklin, Powell and Emami-Naeini, Feedback Control of Dynamic Systems, section 6.4 (the
damping ratio is about the phase margin over 100°).
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.control.gain_design import PHASE_MARGIN_RAD
from firmware_interface.gains import AxisGains

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

_DAMPING_RATIO: Final = math.degrees(PHASE_MARGIN_RAD) / 100.0
_NATURAL_RAD_S: Final = np.geomspace(5.0, 80.0, 6)
"""Natural frequencies of unknown loops: from a heavy axis at start-up to a stiff machine tool."""
_UNKNOWN_RAD_S: Final = 10.0
"""Frequency up to which an unknown loop is taken to follow."""
_FOLLOWED: Final = math.sqrt(0.5)
"""Response at the end of a loop's bandwidth, 3 dB."""
_LOWEST_RAD_S: Final = 1e-6


@dataclass(frozen=True)
class Loops:
    """The loops that an axis may have.

    Attributes
    ----------
    responses : tuple of callable
        Position over reference, at complex frequencies s in rad/s.
    bandwidth_rad_s : float
        Up to which all of them follow.
    stiffness : float
        Effort per distance from the reference; infinite where it is not known.
    words : str
        Which loops these are.
    """

    responses: tuple[Callable[[Complex], Complex], ...]
    bandwidth_rad_s: float
    stiffness: float
    words: str

    @classmethod
    def unknown(cls) -> "Loops":
        """Loops of all natural frequencies, as little damped as the phase margin allows."""
        words = (
            f"the loop is not known: natural frequencies of {_NATURAL_RAD_S[0]:.0f} to "
            f"{_NATURAL_RAD_S[-1]:.0f} rad/s with a damping ratio of {_DAMPING_RATIO:.2g} are "
            "allowed for"
        )
        return cls(
            tuple(map(_second_order, _NATURAL_RAD_S.tolist())), _UNKNOWN_RAD_S, math.inf, words
        )

    @classmethod
    def known(cls, gains: AxisGains, inertia: float, viscous: float, delay_s: float) -> "Loops":
        """The loop of a board's gains around an axis."""
        response = _of_gains(gains, inertia, viscous, delay_s)
        omega = np.geomspace(0.5, 500.0, 400)
        below = np.abs(response(np.asarray(1j * omega, dtype=np.complex128))) < _FOLLOWED
        end = float(omega[np.argmax(below)]) if np.any(below) else float(omega[-1])
        return cls((response,), end, gains.proportional, "the loop is that of the gains in force")

    def followed(self, velocity: Array, acceleration: Array, period_s: float) -> Array:
        """What all L loops make of a reference (N,) that begins and ends at rest.

        Returns
        -------
        (3, L, N) array
            Distance from the reference, velocity, acceleration.
        """
        samples = len(velocity)
        omega = np.maximum(2.0 * np.pi * np.fft.rfftfreq(samples, period_s), _LOWEST_RAD_S)
        s = np.asarray(1j * omega, dtype=np.complex128)
        response = np.stack([of(s) for of in self.responses])
        moving = np.fft.rfft(velocity)
        spectra = [
            (response - 1.0) / s * moving,
            response * moving,
            response * np.fft.rfft(acceleration),
        ]
        return np.asarray(np.fft.irfft(np.stack(spectra), samples))


def _second_order(natural_rad_s: float) -> Callable[[Complex], Complex]:
    damping = 2.0 * _DAMPING_RATIO * natural_rad_s

    def response(s: Complex) -> Complex:
        feedback = damping * s + natural_rad_s**2
        return np.asarray(feedback / (s**2 + feedback))

    return response


def _of_gains(
    gains: AxisGains, inertia: float, viscous: float, delay_s: float
) -> Callable[[Complex], Complex]:
    def response(s: Complex) -> Complex:
        late = np.exp(-s * delay_s)
        steady = gains.proportional + gains.integral / s
        forward = gains.inertia_feedforward * s**2 + gains.viscous_feedforward * s
        filtered = gains.derivative * s / (1.0 + s * gains.velocity_filter_s)
        axis = (inertia * s + viscous) * s
        wanted = (steady + gains.derivative * s + forward) * late
        return np.asarray(wanted / (axis + (steady + filtered) * late))

    return response
