"""Modules that the command line takes from here."""

from edge_ident.commissioning import capture as capture
from edge_ident.commissioning import data_sheet as data_sheet
from edge_ident.commissioning import described_drive as described_drive
from edge_ident.commissioning import doctor as doctor
from edge_ident.commissioning import gain_change as gain_change
from edge_ident.commissioning import gain_transfer as gain_transfer
from edge_ident.commissioning import homing as homing
from edge_ident.commissioning import identification_motions as identification_motions
from edge_ident.commissioning import latency as latency
from edge_ident.commissioning import ports as ports
from edge_ident.commissioning import promise as promise
from edge_ident.commissioning import register_access as register_access
from edge_ident.commissioning import run as run
from edge_ident.commissioning import safety as safety
from edge_ident.commissioning import verification as verification
from edge_ident.control import position_loop as position_loop
from edge_ident.drive import description as description
from edge_ident.drive import motions as motions
from firmware_interface import board as board
from firmware_interface import connection as connection
from firmware_interface import registers as registers
from firmware_interface.plant import hiding as hiding
from firmware_interface.plant import plant_socket as plant_socket
from firmware_interface.virtual import server as server
