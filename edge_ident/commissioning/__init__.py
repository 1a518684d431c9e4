"""The whole job on a board: capture, run, verification, the life of gains, checks, latency.

The command line imports these names from here. Each loads its module when it is first used.
"""

from typing import TYPE_CHECKING

from edge_ident.support.lazy import lazy_names

if TYPE_CHECKING:
    from edge_ident.commissioning.capture import record_motion
    from edge_ident.commissioning.data_sheet import (
        SHEET_ENTRIES,
        AxisSheet,
        Entry,
        fill_sheet,
        period_doubts,
        sheet_doubts,
        sheet_in_si,
    )
    from edge_ident.commissioning.described_drive import (
        DescribedDrive,
        describe_drive,
        sampling_period_s,
    )
    from edge_ident.commissioning.doctor import check_host, check_link
    from edge_ident.commissioning.gain_change import (
        check_change,
        check_owner,
        commit_staged,
        restore_gains,
        roll_back_unconfirmed,
        settled_gains,
        wanted_gains,
    )
    from edge_ident.commissioning.gain_transfer import (
        back_up,
        load_gains,
        stage_gains,
        staged_whole,
    )
    from edge_ident.commissioning.homing import hold, move_by, move_to
    from edge_ident.commissioning.identification_motions import CAPTURE_FILE
    from edge_ident.commissioning.latency import profile_device
    from edge_ident.commissioning.ports import VirtualNetwork, ask_ports
    from edge_ident.commissioning.promise import Forecaster, Forecasts, check_stable
    from edge_ident.commissioning.register_access import (
        check_write,
        parse_values,
        registers_named,
        registers_of,
        write_register,
    )
    from edge_ident.commissioning.run import Plan, commission
    from edge_ident.commissioning.safety import clear_fault, make_ready, stop_machine
    from edge_ident.drive.description import write_drive
    from edge_ident.drive.motions import named_trajectory
    from edge_ident.support.words import plain_number
    from firmware_interface.board import BoardStatus
    from firmware_interface.connection import DEFAULT_BAUD_RATE
    from firmware_interface.gains import Bank
    from firmware_interface.plant.hiding import Fault, Hidden
    from firmware_interface.plant.plant_socket import serve_plant
    from firmware_interface.registers import MAP_VERSION, REGISTERS
    from firmware_interface.virtual.server import Failure, serve

__all__ = [
    "CAPTURE_FILE",
    "DEFAULT_BAUD_RATE",
    "MAP_VERSION",
    "REGISTERS",
    "SHEET_ENTRIES",
    "AxisSheet",
    "Bank",
    "BoardStatus",
    "DescribedDrive",
    "Entry",
    "Failure",
    "Fault",
    "Forecaster",
    "Forecasts",
    "Hidden",
    "Plan",
    "VirtualNetwork",
    "ask_ports",
    "back_up",
    "check_change",
    "check_host",
    "check_link",
    "check_owner",
    "check_stable",
    "check_write",
    "clear_fault",
    "commission",
    "commit_staged",
    "describe_drive",
    "fill_sheet",
    "hold",
    "load_gains",
    "make_ready",
    "move_by",
    "move_to",
    "named_trajectory",
    "parse_values",
    "period_doubts",
    "plain_number",
    "profile_device",
    "record_motion",
    "registers_named",
    "registers_of",
    "restore_gains",
    "roll_back_unconfirmed",
    "sampling_period_s",
    "serve",
    "serve_plant",
    "settled_gains",
    "sheet_doubts",
    "sheet_in_si",
    "stage_gains",
    "staged_whole",
    "stop_machine",
    "wanted_gains",
    "write_drive",
    "write_register",
]

__getattr__ = lazy_names(
    __name__,
    {
        "edge_ident.commissioning.capture": "record_motion",
        "edge_ident.commissioning.data_sheet": (
            "AxisSheet Entry SHEET_ENTRIES fill_sheet period_doubts sheet_doubts sheet_in_si"
        ),
        "edge_ident.commissioning.described_drive": (
            "DescribedDrive describe_drive sampling_period_s"
        ),
        "edge_ident.commissioning.doctor": "check_host check_link",
        "edge_ident.commissioning.gain_change": (
            "check_change check_owner commit_staged restore_gains roll_back_unconfirmed "
            "settled_gains wanted_gains"
        ),
        "edge_ident.commissioning.gain_transfer": "back_up load_gains stage_gains staged_whole",
        "edge_ident.commissioning.homing": "hold move_by move_to",
        "edge_ident.commissioning.identification_motions": "CAPTURE_FILE",
        "edge_ident.commissioning.latency": "profile_device",
        "edge_ident.commissioning.ports": "VirtualNetwork ask_ports",
        "edge_ident.commissioning.promise": "Forecaster Forecasts check_stable",
        "edge_ident.commissioning.register_access": (
            "check_write parse_values registers_named registers_of write_register"
        ),
        "edge_ident.commissioning.run": "Plan commission",
        "edge_ident.commissioning.safety": "clear_fault make_ready stop_machine",
        "edge_ident.drive.description": "write_drive",
        "edge_ident.drive.motions": "named_trajectory",
        "edge_ident.support.words": "plain_number",
        "firmware_interface.board": "BoardStatus",
        "firmware_interface.connection": "DEFAULT_BAUD_RATE",
        "firmware_interface.gains": "Bank",
        "firmware_interface.plant.hiding": "Fault Hidden",
        "firmware_interface.plant.plant_socket": "serve_plant",
        "firmware_interface.registers": "MAP_VERSION REGISTERS",
        "firmware_interface.virtual.server": "Failure serve",
    },
)
