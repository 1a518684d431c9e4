"""An axis, and values of every effect that gains cure."""

import math

from edge_ident.control.position_loop import LoopHardware
from edge_ident.model.effects import named
from edge_ident.model.model import BASE, PARAMETERS, AxisModel, SupportedRange, Term

PERIOD_S, DELAY_S = 0.0025, 0.0005
LATE_S = DELAY_S + 0.5 * PERIOD_S
HARDWARE = LoopHardware(PERIOD_S, DELAY_S, 2 * math.pi / 8400, 12.0)
RANGE = SupportedRange((-1.0, 3.0), (-1.5, 2.0), (-4.0, 4.0), (-8.0, 8.0))
BASE_TERM = Term(BASE, dict(zip(PARAMETERS, (0.43, 0.9, 1.4, 0.3), strict=True)), supported=RANGE)
WAVES = {"stiffness": 0.0, "curvature": 0.0, "cosine": 0.4, "sine": -0.2, "period": 2.5}
BACKLASH = {"gap": 0.02, "load_inertia": 0.2, "deceleration": 2.0}
CURED = {
    "stribeck_friction": ({"level": 0.7, "speed": 0.2}, 1e-6),
    "asymmetric_friction": ({"difference": 0.2}, 1e-6),
    "torque_ripple": ({"cosine": 0.2, "sine": 0.3, "period": 1.5}, 1e-6),
    "nonlinear_viscous": ({"level": 0.3, "exponent": 0.5}, 0.02),
    "position_dependent_load": (WAVES, 0.02),
    "position_dependent_friction": (
        {"gradient": 0.2, "cosine": 0.0, "sine": 0.3, "period": 2.0},
        0.03,
    ),
    "presliding_hysteresis": ({"level": 0.8, "distance": 0.02}, 0.03),
    "load_dependent_friction": ({"share": 0.3, "guided": 0.5, "moved": 0.7}, 1e-6),
    "cross_axis_coupling": (
        {"inertia": 0.1, "viscous_friction": -0.2, "coulomb_friction": 0.3},
        1e-6,
    ),
}
"""Values, and the share of the effect's rms that its feed-forward may miss."""


def term(effect: str, values: dict[str, float], supported: SupportedRange | None = RANGE) -> Term:
    source = "z" if named(effect).needs_source else None
    return Term(effect, values, source_axis=source, supported=supported)


def axis(*terms: Term) -> AxisModel:
    return AxisModel((BASE_TERM, *terms))
