"""What is wired to the board: emergency stop, limit switches, reference marks."""

from collections.abc import Sequence

from firmware_interface.virtual.controller import Setpoint


class Inputs:
    """The port layer's inputs; tests press and release them.

    Attributes
    ----------
    sto_active : bool
        The wired emergency stop cuts the effort.
    sto_latched : bool
        It did so since the latch was re-armed, were it for less than a sample.
    limit_switches : int
        Bits 2n and 2n + 1: the switch at the negative and at the positive end of axis n.
    homed : int
        Bit n: axis n counts from the machine's reference mark.

    Parameters
    ----------
    homed : int
    """

    def __init__(self, homed: int = 0) -> None:
        self.sto_active = self.sto_latched = False
        self.limit_switches = 0
        self.homed = homed

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
        return any(
            self.limit_switches >> 2 * axis & (1 if setpoint.velocity_rad_s < 0.0 else 2)
            for axis, setpoint in enumerate(setpoints)
            if setpoint.velocity_rad_s != 0.0
        )
