"""The feed drive behind the virtual board: one documented set of parameters.

The paper prints structure, encoder, gearbox and screw, but no parameter values. The sums are a
reconstruction from catalogue-like parts: a 100 W motor of 10,000 rpm with a gearbox of 131.25:1, a
screw of 4 mm lead, a table of some ten kilograms. How they are shared among three masses is a
choice: enough of them lies behind the motor for a fault there to show at the encoder.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np

from firmware_interface.gains import CONSERVATIVE_GAINS
from firmware_interface.plant.drives import COUNT_RAD, Array, Chain, Control, Drives

COUNTS_PER_TURN: Final = round(2 * np.pi / COUNT_RAD)
# Shares of the motor with its gearbox, the screw, and the table.
_SHARES: Final = {
    "inertia": (0.60, 0.10, 0.30),
    "viscous_friction": (0.40, 0.08, 0.52),
    "coulomb_friction": (0.30, 0.0, 0.70),
}
# Of each joint, N·m/rad: at full speed the chain winds up by a fifth of an encoder count.
_STIFFNESS: Final = 3.0e4
_DAMPING_RATIO: Final = 0.09


@dataclass(frozen=True)
class RigidBody:
    """Parameters at the gearbox output of a chain that does not deform.

    kg·m², N·m·s/rad, N·m, N·m.
    """

    inertia: float
    viscous_friction: float
    coulomb_friction: float
    offset: float


FEED_DRIVE: Final = {
    "x": RigidBody(0.42957, 0.90029, 1.40046, 0.03000),
    "z": RigidBody(0.37860, 0.74970, 1.10046, 0.09992),
}
"""By axis; the offset of z is its table's weight."""


def feed_drive() -> Drives:
    """The flexible drive, in a loop with the feedback of the gains that a board starts with."""
    bodies, gains = FEED_DRIVE.values(), CONSERVATIVE_GAINS
    whole = np.ones((1, len(bodies)))
    chain = Chain(
        inertia=_shared("inertia"),
        viscous=_shared("viscous_friction"),
        coulomb=_shared("coulomb_friction"),
        stiffness=_STIFFNESS * np.stack([whole, whole]),
        damping_ratio=_DAMPING_RATIO * np.stack([whole, whole]),
        offset=np.array([[body.offset for body in bodies]]),
        play_rad=0.0 * whole,
        bristle_reach_rad=0.0 * whole,
        loss_s_per_rad=0.0 * whole,
    )
    control = Control(
        position_gain=gains.proportional * whole,
        velocity_gain=gains.derivative * whole,
        filter_s=gains.velocity_filter_s * whole,
        feedforward=np.zeros((*whole.shape, 4)),
    )
    return Drives(chain, control)


def _shared(quantity: str) -> Array:
    """A sum of every axis, shared among its masses, (3, 1, A)."""
    sums = np.array([[getattr(body, quantity) for body in FEED_DRIVE.values()]])
    return np.asarray(np.array(_SHARES[quantity])[:, None, None] * sums)
