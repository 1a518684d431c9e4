"""The plant's laws are not the catalogue's formulas: fitted to them, those leave some of them.

Play, presliding and compliance act through masses that move by themselves, and have no law along a
given motion: docs/virtual_board.md says in words how they differ.
"""

from collections.abc import Iterator
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.optimize import least_squares

from edge_ident.model.effects import named
from edge_ident.model.motion import Motion
from edge_ident.model.search import Excitation, Form, Span
from firmware_interface.plant import EFFECTS, SAMPLE_S, Effect, draw, draw_drives, multisine
from firmware_interface.plant.drives import Array
from firmware_interface.plant.effect import Scales
from firmware_interface.plant.plant import overriding

OF_MASSES = ("backlash", "presliding_hysteresis", "coupling_compliance")
LEFT = 0.003
SEEDS = (82, 83)
DRIVES, MOTION = draw_drives(1, 71), multisine(4000, 71)
SCALES = Scales.of(DRIVES, MOTION)
INERTIA, VISCOUS, COULOMB, OFFSET = SCALES.rigid[0, 0].tolist()


def along(axis: int) -> Motion:
    """What is recorded of an axis, and what its rigid body needs for it."""
    ways = (MOTION.position, MOTION.velocity, MOTION.acceleration)
    parts = [part[MOTION.recorded, 0, axis] for part in ways]
    moved, rubbed = INERTIA * parts[2], VISCOUS * parts[1] + COULOMB * np.sign(parts[1])
    time_s = MOTION.clock_s[MOTION.recorded]
    known = Motion.known(time_s, *parts)
    source = along(1) if axis == 0 else None
    return replace(
        known, transmitted=moved + OFFSET, inertia_effort=moved, friction_effort=rubbed,
        source=source,
    )  # fmt: skip


X = along(0)
EFFORT = X.transmitted + X.friction_effort
BASE = np.stack([X.acceleration, X.velocity, X.direction, np.ones(len(EFFORT))], axis=1)
EXCITATION = Excitation(
    lowest=float(X.position.min()), travel=float(np.ptp(X.position)),
    speed=float(abs(X.velocity).max()), typical_speed=float(np.std(X.velocity)),
    acceleration=float(np.std(X.acceleration)), effort=float(abs(EFFORT).max()),
    resolution=1e-4, duration_s=float(X.time_s[-1]), cutoff_hz=15.0, sampling_s=SAMPLE_S,
    base=SCALES.rigid[0, 0], spans=(Span(0, 0.0, float(X.time_s[-1])),),
)  # fmt: skip


def of_plant(effect: Effect) -> Array:
    """What the effect adds along the motion of x: to torque, angle or record."""
    own = effect.of_axis(0, 0)
    if overriding([effect], "recorded"):
        return np.asarray(effect.recorded(EFFORT[:, None, None], X.time_s)[:, 0, 0] - EFFORT)
    if overriding([own], "encoder"):
        return np.array([own.encoder(x) - x for x in X.position.tolist()])
    if overriding([own], "applied"):
        pairs = zip(EFFORT.tolist(), X.time_s.tolist(), strict=True)
        return np.array([own.applied(*pair) for pair in pairs]) - EFFORT
    return np.array([_torque(own, row) for row in range(len(EFFORT))])


def _torque(own: Effect, row: int) -> float:
    """What acts against motor and table at one sample."""
    x, v, a, sign = (float(q[row]) for q in (X.position, X.velocity, X.acceleration, X.direction))
    state = SimpleNamespace(
        time_s=float(X.time_s[row]), angle=(x, x, x), velocity=(v, v, v), load=float(EFFORT[row]),
        other_velocity=float(X.partner.velocity[row]),
        other_acceleration=float(X.partner.acceleration[row]),
    )  # fmt: skip
    torque = sum(e.motor_torque(state) for e in overriding([own], "motor_torque"))
    torque += sum(e.table_torque(state) for e in overriding([own], "table_torque"))
    torque += sum(sign * e.table_friction(state, sign) for e in overriding([own], "table_friction"))
    return torque + sum(
        a * e.table_inertia(state.time_s) for e in overriding([own], "table_inertia")
    )


def of_catalogue(name: str, values: dict[str, Array]) -> Array:
    """The same by the catalogue's formula."""
    effect = named(name)
    nothing = {p.name: max(p.low, 0.0) for p in effect.parameters}
    complete = {k: np.asarray(v) for k, v in (nothing | effect.complete(values)).items()}
    if effect.overrides("recorded"):
        return effect.recorded(EFFORT, X.time_s, complete) - EFFORT
    if effect.overrides("reading"):
        return effect.reading(X.position, complete) - X.position
    if effect.overrides("torque"):
        return effect.torque(EFFORT, X.time_s, complete) - EFFORT
    motion = X if effect.needs_source else replace(X, source=None)
    return np.broadcast_to(effect.resistance(motion, complete), EFFORT.shape)


def beside_base(rows: Array) -> Array:
    """What the rigid body's parameters cannot take in."""
    return np.asarray(rows - BASE @ np.linalg.lstsq(BASE, rows, rcond=None)[0])


def starts(name: str, form: Form, target: Array) -> Iterator[tuple[float, dict[str, float]]]:
    """At every point of the form's grid: what is left, and the best values."""
    search = named(name).search
    grid = (form.grid or search.grid)(EXCITATION) if form.nonlinear or form.grid else {}
    for point in zip(*grid.values(), strict=True) if grid else [()]:
        values = dict.fromkeys(form.linear, 0.0) | dict(form.known)
        values |= {key: float(value) for key, value in zip(grid, point, strict=True)}
        nothing = of_catalogue(name, values)
        columns = [beside_base(1e6 * (of_catalogue(name, values | {k: 1e-6}) - nothing))
                   for k in form.linear]  # fmt: skip
        rest = target - beside_base(nothing)
        if columns:
            size = np.linalg.lstsq(np.array(columns).T, rest, rcond=None)[0]
            rest = rest - np.array(columns).T @ size
            values |= dict(zip(form.linear, size.tolist(), strict=True))
        yield float(np.std(rest)), values


def left(name: str, law: Array) -> float:
    """What the formula at its best leaves of a law, beside what the rigid body takes in."""
    target = beside_base(law)
    found = [
        (rest, values, (*form.linear, *form.nonlinear))
        for form in named(name).search.forms
        if form.link is None and not form.sums
        for rest, values in starts(name, form, target)
    ]
    best = np.inf
    for _, values, free in sorted(found, key=lambda one: one[0])[:3]:

        def rest(sizes: Array, values: dict = values, free: tuple = free) -> Array:
            return target - beside_base(
                of_catalogue(name, values | dict(zip(free, sizes, strict=True)))
            )

        start = np.array([values[key] for key in free])
        fitted = least_squares(rest, start, x_scale=np.maximum(abs(start), 1e-9), diff_step=1e-4)
        best = min(best, float(np.std(fitted.fun)))
    return best / float(np.std(target))


@pytest.mark.parametrize("name", [name for name in EFFECTS if name not in OF_MASSES])
def test_the_formula_leaves_some_of_the_law(name: str) -> None:
    """Of an effect of two kinds, each is drawn once."""
    hits = [draw([name], DRIVES, MOTION, seed, strength=0.75)[0] for seed in SEEDS]
    for effect in (e for e in hits if e.hit[0, 0]):
        assert left(name, of_plant(effect)) > LEFT
    assert any(e.hit[0, 0] for e in hits)
