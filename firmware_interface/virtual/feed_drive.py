"""The paper's two-axis feed drive as the virtual board's plant: one documented parameter set.

The paper prints structure and encoder, gearbox and screw data, but no parameter values; those
below are a reconstruction from catalogue-like parts: a 100 W motor of 10,000 rpm, a 131.25:1
planetary gearbox, a 16 mm screw of 4 mm lead, a table of some ten kilograms. Stiffnesses are
such that deformation at the gearbox output stays below one encoder count (7.48e-4 rad), which
is what lets the paper reduce the model to four parameters an axis.
"""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from firmware_interface.virtual.plant import AxisMatrices

Array = NDArray[np.float64]

GEAR_RATIO: Final = 131.25
LEAD_M_PER_RAD: Final = 0.004 / (2.0 * math.pi)
COUNTS_PER_TURN: Final = 8400
GRAVITY_M_S2: Final = 9.81


@dataclass(frozen=True)
class AxisMechanics:
    """Physical parameters of one axis.

    Attributes
    ----------
    motor_inertia, motor_viscous, motor_coulomb : float
        Rotor and bearings, at the motor shaft: kg*m^2, N*m*s/rad, N*m.
    gearbox_inertia, gearbox_viscous, gearbox_coulomb : float
        Output stage, its lubricant and its seals, at the output: kg*m^2, N*m*s/rad, N*m.
    screw_inertia, screw_viscous : float
        Screw with its coupling half; rolling loss in the nut: kg*m^2, N*m*s/rad.
    table_mass, base_mass, support_mass : float
        Table with nut; base support that takes the thrust; support carried by the table (the
        other axis), 0 where there is none: kg.
    guide_coulomb : float
        Between table and base: N.
    gear_stiffness, coupling_stiffness : float
        Torsion, at the output: N*m/rad.
    nut_stiffness, base_stiffness, support_stiffness : float
        N/m.
    loss_factor_s : float
        Every spring has a damper beside it of this share of its stiffness: N*m*s/rad per
        N*m/rad.
    hangs : bool
        The axis is vertical, positive upward, so that the table's weight pulls it down.
    drive_offset : float
        Torque by which the power stage falls short, at the output: N*m.
    """

    motor_inertia: float
    motor_viscous: float
    motor_coulomb: float
    gearbox_inertia: float
    gearbox_viscous: float
    gearbox_coulomb: float
    screw_inertia: float
    screw_viscous: float
    table_mass: float
    base_mass: float
    support_mass: float
    guide_coulomb: float
    gear_stiffness: float
    coupling_stiffness: float
    nut_stiffness: float
    base_stiffness: float
    support_stiffness: float
    loss_factor_s: float
    hangs: bool
    drive_offset: float


FEED_DRIVE: Final = {
    "x": AxisMechanics(
        motor_inertia=2.45e-5,
        motor_viscous=4.1e-5,
        motor_coulomb=7.2e-3,
        gearbox_inertia=2.5e-3,
        gearbox_viscous=0.165,
        gearbox_coulomb=0.43,
        screw_inertia=5.0e-3,
        screw_viscous=0.029,
        table_mass=12.0,
        base_mass=60.0,
        support_mass=28.0,
        guide_coulomb=40.0,
        gear_stiffness=2.0e4,
        coupling_stiffness=6.0e3,
        nut_stiffness=2.0e8,
        base_stiffness=4.0e8,
        support_stiffness=3.0e8,
        loss_factor_s=2.0e-4,
        hangs=False,
        drive_offset=0.03,
    ),
    "z": AxisMechanics(
        motor_inertia=2.16e-5,
        motor_viscous=3.4e-5,
        motor_coulomb=5.6e-3,
        gearbox_inertia=2.5e-3,
        gearbox_viscous=0.135,
        gearbox_coulomb=0.34,
        screw_inertia=4.0e-3,
        screw_viscous=0.029,
        table_mass=16.0,
        base_mass=25.0,
        support_mass=0.0,
        guide_coulomb=40.0,
        gear_stiffness=2.0e4,
        coupling_stiffness=6.0e3,
        nut_stiffness=2.0e8,
        base_stiffness=3.0e8,
        support_stiffness=0.0,
        loss_factor_s=2.0e-4,
        hangs=True,
        drive_offset=0.0,
    ),
}


@dataclass(frozen=True)
class ReducedTruth:
    """Rigid-body parameters at the gearbox output: kg*m^2, N*m*s/rad, N*m, N*m."""

    inertia: float
    viscous_friction: float
    coulomb_friction: float
    offset: float


def reduced_truth(mechanics: AxisMechanics) -> ReducedTruth:
    """What the full model becomes when nothing deforms: the paper's four parameters."""
    lead = LEAD_M_PER_RAD
    moved = mechanics.table_mass + mechanics.support_mass
    weight = mechanics.table_mass * GRAVITY_M_S2 if mechanics.hangs else 0.0
    return ReducedTruth(
        inertia=mechanics.motor_inertia * GEAR_RATIO**2
        + mechanics.gearbox_inertia
        + mechanics.screw_inertia
        + moved * lead**2,
        viscous_friction=mechanics.motor_viscous * GEAR_RATIO**2
        + mechanics.gearbox_viscous
        + mechanics.screw_viscous,
        coulomb_friction=mechanics.motor_coulomb * GEAR_RATIO
        + mechanics.gearbox_coulomb
        + mechanics.guide_coulomb * lead,
        offset=mechanics.drive_offset + weight * lead,
    )


_MOTOR, _GEARBOX, _SCREW, _TABLE, _BASE, _SUPPORT = range(6)


def axis_matrices(mechanics: AxisMechanics) -> AxisMatrices:
    """Matrices of the full model: motor, gearbox, screw, table, base and carried support."""
    lead = LEAD_M_PER_RAD
    springs = _stiffness(mechanics)
    bearings = np.zeros(6)
    bearings[_MOTOR] = mechanics.motor_viscous * GEAR_RATIO**2
    bearings[_GEARBOX] = mechanics.gearbox_viscous
    bearings[_SCREW] = mechanics.screw_viscous
    joints = np.zeros((6, 3))
    joints[_MOTOR, 0] = joints[_GEARBOX, 1] = joints[_TABLE, 2] = 1.0
    joints[_BASE, 2] = -1.0
    constant_nm = np.zeros(6)
    constant_nm[_MOTOR] = -mechanics.drive_offset
    constant_nm[_TABLE] = -mechanics.table_mass * GRAVITY_M_S2 * lead if mechanics.hangs else 0.0
    kept = slice(0, 6 if mechanics.support_mass else 5)
    return AxisMatrices(
        inertia=_inertia(mechanics)[kept, kept],
        damping=(np.diag(bearings) + mechanics.loss_factor_s * springs)[kept, kept],
        stiffness=springs[kept, kept],
        joints=joints[kept],
        coulomb_nm=np.array(
            [
                mechanics.motor_coulomb * GEAR_RATIO,
                mechanics.gearbox_coulomb,
                mechanics.guide_coulomb * lead,
            ]
        ),
        constant_nm=constant_nm[kept],
    )


def _inertia(mechanics: AxisMechanics) -> Array:
    """Inertia matrix (6, 6), in the order of the parts."""
    return np.diag(
        [
            mechanics.motor_inertia * GEAR_RATIO**2,
            mechanics.gearbox_inertia,
            mechanics.screw_inertia,
            mechanics.table_mass * LEAD_M_PER_RAD**2,
            mechanics.base_mass * LEAD_M_PER_RAD**2,
            mechanics.support_mass * LEAD_M_PER_RAD**2,
        ]
    )


def _stiffness(mechanics: AxisMechanics) -> Array:
    """Stiffness matrix (6, 6) of the springs between the parts."""
    lead = LEAD_M_PER_RAD
    springs = np.zeros((6, 6))
    for parts, signs, constant in (
        ((_MOTOR, _GEARBOX), (1, -1), mechanics.gear_stiffness),
        ((_GEARBOX, _SCREW), (1, -1), mechanics.coupling_stiffness),
        # the screw pushes the table against the base, which takes the thrust
        ((_SCREW, _TABLE, _BASE), (1, -1, 1), mechanics.nut_stiffness * lead**2),
        ((_BASE,), (1,), mechanics.base_stiffness * lead**2),
        ((_TABLE, _SUPPORT), (1, -1), mechanics.support_stiffness * lead**2),
    ):
        direction = np.zeros(6)
        direction[list(parts)] = signs
        springs += constant * np.outer(direction, direction)
    return springs
