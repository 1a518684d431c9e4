"""The whole job on a board: capture, run, verification, the life of gains, checks, latency.

The command line takes the modules from here. Each loads when it is first named.
"""

from typing import TYPE_CHECKING

from edge_ident.support.lazy import lazy_modules

if TYPE_CHECKING:
    from edge_ident.commissioning import (  # noqa: F401
        capture,
        data_sheet,
        described_drive,
        doctor,
        gain_change,
        gain_transfer,
        homing,
        identification_motions,
        latency,
        ports,
        promise,
        register_access,
        run,
        safety,
        verification,
    )  # fmt: skip
    from edge_ident.drive import description as description
    from edge_ident.drive import motions as motions
    from firmware_interface import connection as connection
    from firmware_interface import registers as registers
    from firmware_interface.plant import hiding as hiding
    from firmware_interface.plant import plant_socket as plant_socket
    from firmware_interface.virtual import server as server

__getattr__ = lazy_modules(
    __name__,
    "edge_ident.drive.description",
    "edge_ident.drive.motions",
    "firmware_interface.connection",
    "firmware_interface.plant.hiding",
    "firmware_interface.plant.plant_socket",
    "firmware_interface.registers",
    "firmware_interface.virtual.server",
)
