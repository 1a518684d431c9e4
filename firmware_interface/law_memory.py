"""What the control law remembers of its reference: presliding and backlash."""

import math
from types import ModuleType
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from firmware_interface.gains import AxisGains

Array = NDArray[np.float64]

_REMEMBERING: Final = frozenset({"presliding", "backlash"})
"""Terms of the gains whose effort depends on where the reference has been."""


class Memory(NamedTuple):
    """What the law remembers of the reference.

    Attributes
    ----------
    presliding : float or array
        z, between -1 and 1.
    backlash_rad : float or array
        b.
    """

    presliding: Any = 0.0
    backlash_rad: Any = 0.0

    def after(self, gains: AxisGains, step_rad: Any, functions: ModuleType = math) -> "Memory":
        """The same one sample later, or at several distances into a motion one way.

        Parameters
        ----------
        gains : AxisGains
        step_rad : float or array
            Of the reference, from where this memory is.
        functions : module
            `math`, or numpy for arrays.
        """
        if gains.terms.isdisjoint(_REMEMBERING):
            return self
        sign, way = functions.copysign(1.0, step_rad), abs(step_rad)
        z, b = self
        if "presliding" in gains.terms:
            z = z - (sign - z) * functions.expm1(-way / gains.presliding_distance_rad)
        if "backlash" in gains.terms:
            reached = sign * gains.backlash_offset_rad
            b = b - (reached - b) * functions.expm1(-way / gains.backlash_distance_rad)
        return Memory(z, b)

    def kept(self, gains: AxisGains) -> "Memory":
        """What is left of it for other gains: nothing of a term that they do not have."""
        return Memory(
            self.presliding if "presliding" in gains.terms else 0.0,
            self.backlash_rad if "backlash" in gains.terms else 0.0,
        )

    def along(self, gains: AxisGains, position_rad: Array) -> "Memory":
        """The memory at each sample of a stretch.

        Parameters
        ----------
        gains : AxisGains
        position_rad : (N + 1,) array
            Of the reference: where this memory is, then sample by sample.

        Returns
        -------
        Memory
            Of (N,) arrays, or without arrays where the gains remember nothing.
        """
        if gains.terms.isdisjoint(_REMEMBERING):
            return self
        steps = np.diff(position_rad)
        z, b = np.empty(len(steps)), np.empty(len(steps))
        last, first = self, 0
        for end in [*(np.flatnonzero(np.diff(np.signbit(steps))) + 1).tolist(), len(steps)]:
            way = position_rad[first + 1 : end + 1] - position_rad[first]
            z[first:end], b[first:end] = last.after(gains, way, np)
            last, first = Memory(z[end - 1], b[end - 1]), end
        return Memory(z, b)

    @property
    def last(self) -> "Memory":
        """At the end of a stretch."""
        return Memory(*(float(np.ravel(value)[-1]) for value in self))


NOTHING: Final = Memory()
"""What the law remembers where its controller was just reset."""
