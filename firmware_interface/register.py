"""What one entry of the register map is."""

from dataclasses import dataclass
from typing import Final

WORDS: Final = {"u16": 1, "i16": 1, "u32": 2, "i32": 2, "f32": 2}
"""Modbus registers per value, by type."""


@dataclass(frozen=True)
class Register:
    """A value, or an array of them, in consecutive Modbus registers.

    Attributes
    ----------
    name : str
        Group, instance where there are several, and name, joined by dots.
    address : int
    type : str
        One of `WORDS`; 32 bits with the high word first.
    count : int
        Length of an array, else 1.
    scale : float
        value = raw * scale.
    unit : str
    access : str
        `ro` or `rw`, seen from the host.
    minimum, maximum : float or None
        Allowed values, in the unit.
    enum : str
        Name of the enumeration of its codes, else empty.
    since : int
        Version of the map that brought it.
    description : str
    """

    name: str
    address: int
    type: str
    count: int = 1
    scale: float = 1.0
    unit: str = ""
    access: str = "ro"
    minimum: float | None = None
    maximum: float | None = None
    enum: str = ""
    since: int = 3
    description: str = ""

    @property
    def words(self) -> int:
        """Modbus registers taken."""
        return WORDS[self.type] * self.count
