"""The whole job on a board: capture, run, verification, the life of gains, checks, latency.

The command line imports these names from here. Each loads its module when it is first used.
"""

from typing import TYPE_CHECKING

from edge_ident.support.lazy import lazy_names

if TYPE_CHECKING:
    from edge_ident.commissioning.data_sheet.described_drive import (
        DescribedDrive,
        describe_drive,
        sampling_period_s,
    )
    from edge_ident.commissioning.data_sheet.entries import SHEET_ENTRIES
    from edge_ident.commissioning.data_sheet.sheet import (
        AxisSheet,
        Entry,
        fill_sheet,
        period_doubts,
        sheet_doubts,
        sheet_in_si,
    )
    from edge_ident.commissioning.gains.change import (
        check_change,
        check_owner,
        commit_staged,
        restore_gains,
        roll_back_unconfirmed,
        settled_gains,
        wanted_gains,
    )
    from edge_ident.commissioning.gains.files import back_up, load_gains
    from edge_ident.commissioning.gains.forecast import Forecaster, Forecasts, check_stable
    from edge_ident.commissioning.gains.transfer import stage_gains, staged_whole
    from edge_ident.commissioning.latency.measure import profile_device
    from edge_ident.commissioning.link.connect import VirtualNetwork
    from edge_ident.commissioning.link.doctor import check_host
    from edge_ident.commissioning.link.link_checks import check_link
    from edge_ident.commissioning.link.ports import ask_ports
    from edge_ident.commissioning.link.register_access import (
        check_write,
        parse_values,
        registers_named,
        registers_of,
        write_register,
    )
    from edge_ident.commissioning.motion.homing import hold, move_by, move_to
    from edge_ident.commissioning.motion.record import record_motion
    from edge_ident.commissioning.motion.safety import clear_fault, make_ready
    from edge_ident.commissioning.motion.stopping import stop_machine
    from edge_ident.commissioning.run import Plan, commission
    from edge_ident.commissioning.study.identification_motions import CAPTURE_FILE
    from edge_ident.drive.description import write_drive
    from edge_ident.drive.motions import named_trajectory
    from edge_ident.support.words import plain_number
    from firmware_interface.board import BoardStatus
    from firmware_interface.connection import DEFAULT_BAUD_RATE
    from firmware_interface.gains import Bank
    from firmware_interface.plant.hiding import Fault, Hidden
    from firmware_interface.plant.plant_socket import serve_plant
    from firmware_interface.registers import MAP_VERSION, REGISTERS
    from firmware_interface.virtual.failures import Failure
    from firmware_interface.virtual.server import serve

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
        "CAPTURE_FILE": "edge_ident.commissioning.study.identification_motions",
        "DEFAULT_BAUD_RATE": "firmware_interface.connection",
        "MAP_VERSION": "firmware_interface.registers",
        "REGISTERS": "firmware_interface.registers",
        "SHEET_ENTRIES": "edge_ident.commissioning.data_sheet.entries",
        "AxisSheet": "edge_ident.commissioning.data_sheet.sheet",
        "Bank": "firmware_interface.gains",
        "BoardStatus": "firmware_interface.board",
        "DescribedDrive": "edge_ident.commissioning.data_sheet.described_drive",
        "Entry": "edge_ident.commissioning.data_sheet.sheet",
        "Failure": "firmware_interface.virtual.failures",
        "Fault": "firmware_interface.plant.hiding",
        "Forecaster": "edge_ident.commissioning.gains.forecast",
        "Forecasts": "edge_ident.commissioning.gains.forecast",
        "Hidden": "firmware_interface.plant.hiding",
        "Plan": "edge_ident.commissioning.run",
        "VirtualNetwork": "edge_ident.commissioning.link.connect",
        "ask_ports": "edge_ident.commissioning.link.ports",
        "back_up": "edge_ident.commissioning.gains.files",
        "check_change": "edge_ident.commissioning.gains.change",
        "check_host": "edge_ident.commissioning.link.doctor",
        "check_link": "edge_ident.commissioning.link.link_checks",
        "check_owner": "edge_ident.commissioning.gains.change",
        "check_stable": "edge_ident.commissioning.gains.forecast",
        "clear_fault": "edge_ident.commissioning.motion.safety",
        "check_write": "edge_ident.commissioning.link.register_access",
        "commission": "edge_ident.commissioning.run",
        "commit_staged": "edge_ident.commissioning.gains.change",
        "describe_drive": "edge_ident.commissioning.data_sheet.described_drive",
        "fill_sheet": "edge_ident.commissioning.data_sheet.sheet",
        "hold": "edge_ident.commissioning.motion.homing",
        "load_gains": "edge_ident.commissioning.gains.files",
        "make_ready": "edge_ident.commissioning.motion.safety",
        "move_by": "edge_ident.commissioning.motion.homing",
        "move_to": "edge_ident.commissioning.motion.homing",
        "named_trajectory": "edge_ident.drive.motions",
        "parse_values": "edge_ident.commissioning.link.register_access",
        "plain_number": "edge_ident.support.words",
        "period_doubts": "edge_ident.commissioning.data_sheet.sheet",
        "profile_device": "edge_ident.commissioning.latency.measure",
        "record_motion": "edge_ident.commissioning.motion.record",
        "registers_named": "edge_ident.commissioning.link.register_access",
        "registers_of": "edge_ident.commissioning.link.register_access",
        "restore_gains": "edge_ident.commissioning.gains.change",
        "roll_back_unconfirmed": "edge_ident.commissioning.gains.change",
        "settled_gains": "edge_ident.commissioning.gains.change",
        "sampling_period_s": "edge_ident.commissioning.data_sheet.described_drive",
        "serve": "firmware_interface.virtual.server",
        "serve_plant": "firmware_interface.plant.plant_socket",
        "sheet_doubts": "edge_ident.commissioning.data_sheet.sheet",
        "sheet_in_si": "edge_ident.commissioning.data_sheet.sheet",
        "stage_gains": "edge_ident.commissioning.gains.transfer",
        "staged_whole": "edge_ident.commissioning.gains.transfer",
        "stop_machine": "edge_ident.commissioning.motion.stopping",
        "wanted_gains": "edge_ident.commissioning.gains.change",
        "write_drive": "edge_ident.drive.description",
        "write_register": "edge_ident.commissioning.link.register_access",
    },
)
