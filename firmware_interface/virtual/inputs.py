"""What is wired to the board: emergency stop, limit switches, reference marks."""

import math
from collections.abc import Sequence

from firmware_interface.virtual.controller import Setpoint


class Inputs:
    """The port layer's inputs; tests press and release them.

    Parameters
    ----------
    homed : int
        Bit n: axis n counts from the machine's reference mark.
    switches_rad : float
        Distance from the machine's zero at which an axis presses its limit switches.

    Attributes
    ----------
    sto_active : bool
        The wired emergency stop cuts the effort.
    sto_latched : bool
        It did so since the latch was re-armed, were it for less than a sample.
    pressed_by_hand : int
        Limit switches that are pressed wherever the axes stand, as `limit_switches`.
    """

    def __init__(self, homed: int = 0, switches_rad: float = math.inf) -> None:
        self.homed = homed
        self.sto_active = self.sto_latched = False
        self.pressed_by_hand = 0
        self._switches_rad = switches_rad
        self._reached = 0

    @property
    def limit_switches(self) -> int:
        """Bits 2n and 2n + 1: the switch at the negative and at the positive end of axis n."""
        return self.pressed_by_hand | self._reached

    def feel(self, output_rad: Sequence[float]) -> None:
        """The axes stand here."""
        self._reached = 0
        for axis, position in enumerate(output_rad):
            self._reached |= (position <= -self._switches_rad) << 2 * axis
            self._reached |= (position >= self._switches_rad) << 2 * axis + 1

    def press_stop(self) -> None:
        """Pull the wired emergency stop."""
        self.sto_active = self.sto_latched = True

    def release_stop(self) -> None:
        """Let go of it; the latch stays."""
        self.sto_active = False

    def rearm_stop(self) -> None:
        """Forget the pulses of before."""
        self.sto_latched = self.sto_active

    def bar(self, setpoints: Sequence[Setpoint]) -> bool:
        """Whether a setpoint moves onto a switch that is pressed; away from it is allowed."""
        pressed = self.limit_switches
        return pressed != 0 and any(
            pressed >> 2 * axis & (1 if setpoint.velocity_rad_s < 0.0 else 2)
            for axis, setpoint in enumerate(setpoints)
            if setpoint.velocity_rad_s != 0.0
        )
