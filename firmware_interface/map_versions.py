"""The register maps whose boards a host drives: its own, and the older ones that it still knows."""

from collections.abc import Mapping
from typing import Final

from firmware_interface.registers import MAP_CRC, MAP_VERSION

MAP_CRCS: Final[Mapping[int, int]] = {
    3: 0x58329FE3,
    4: 0x0A052151,
    5: 0x70F6F3EB,
    MAP_VERSION: MAP_CRC,
}
"""CRC-32 of each map, by its version."""
