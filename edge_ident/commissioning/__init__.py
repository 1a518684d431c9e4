"""The whole job on a board: capture, run, verification, gains, safety, doctor, ports, profiling.

This is the door of the room; its names load their modules when they are first used.
"""

from typing import TYPE_CHECKING

from edge_ident.support.lazy import lazy_names

if TYPE_CHECKING:
    from firmware_interface.virtual.server import serve

__all__ = ["serve"]

__getattr__ = lazy_names(__name__, {"serve": "firmware_interface.virtual.server"})
