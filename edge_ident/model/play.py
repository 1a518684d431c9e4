"""A load between two contacts: the equation of motion behind a play, sample by sample."""

from typing import NamedTuple, Self

import numpy as np

from edge_ident.model.effect import Array, Values


class _Steps(NamedTuple):
    """Coefficients (..., K) of a step. Speeds are distances in half a step, and accelerations the
    changes of these in a step.

    Attributes
    ----------
    kept, fallen : arrays
        What viscous friction leaves of a speed until the middle of the step; what a weight adds.
    stiff, damped : arrays
        Acceleration for each depth of a contact, and for each speed of it.
    half : array
        Half of the gap.
    friction : array
        Largest change of the speed by dry friction.
    """

    kept: Array
    fallen: Array
    stiff: Array
    damped: Array
    half: Array
    friction: Array

    @classmethod
    def of(cls, values: Values, damping: float, step_s: float, shape: tuple[int, ...]) -> Self:
        """Coefficients of the implicit midpoint rule."""
        half_s, scale = 0.5 * step_s, 0.5 * step_s**2
        rate = _resolved(values, step_s)
        spring, damper = rate**2, 2.0 * damping * rate
        implicit = 1.0 + half_s * (damper + half_s * spring)
        coefficients = (
            1.0 + 0.5 * np.expm1(-values["damping_rate"] * step_s),
            -0.5 * scale * values["weight"],
            scale * spring / implicit,
            step_s * damper / implicit,
            0.5 * values["gap"],
            scale * values["deceleration"],
        )
        return cls(*(np.broadcast_to(x, shape).copy() for x in coefficients))


def pushed_load(
    drive: Array, speed: Array, carried: Array, values: Values, step_s: float, damping: float
) -> Array:
    """Acceleration (..., K, N) that the contacts give a load, by the implicit midpoint rule. Dry
    friction reduces the speed by at most what it can in a step.

    Parameters
    ----------
    drive : (..., K, N) array
        Positions of the encoder's side along K segments.
    speed, carried : (..., K) arrays
        Where they begin: speed, and the contact's acceleration of a load that is carried.
    values : mapping of str to array
        Parameters of `edge_ident.model.effects.backlash`.
    step_s : float
    damping : float
        Damping ratio of the load on a contact.
    """
    shape = np.broadcast_shapes(drive.shape[:-1], carried.shape)
    steps = _Steps.of(values, damping, step_s, shape)
    wound_up = carried / _resolved(values, step_s) ** 2
    position = drive[..., 0] - np.copysign(steps.half, carried) - wound_up
    speed = np.broadcast_to(0.5 * step_s * speed, shape).copy()
    drive = np.moveaxis(drive, -1, 0)  # time first: a step reads and writes what lies together
    middle, moving = 0.5 * (drive[1:] + drive[:-1]), 0.5 * np.diff(drive, axis=0)
    pushed = np.empty((len(drive), *shape))
    _integrate(pushed, middle, moving, position, speed, steps)
    pushed /= step_s**2
    return np.moveaxis(pushed, 0, -1)


def _integrate(
    pushed: Array, middle: Array, moving: Array, position: Array, speed: Array, steps: _Steps
) -> None:
    """Let the loads move on, and write what pushes them in the steps before and after each sample,
    added up. It is called often, and on few loads: so nothing is allocated in a step."""
    kept, fallen, stiff, damped, half, friction = steps
    least, slowest = -half, -friction
    ahead, depth, part, pulls, push, before = (np.empty_like(speed) for _ in range(6))
    before.fill(0.0)
    for both, between, quick in zip(pushed, middle, moving, strict=False):
        np.multiply(kept, speed, out=ahead)
        ahead += fallen  # in the middle of the step, without a contact
        np.subtract(between, position, out=depth)
        depth -= ahead
        depth -= np.minimum(np.maximum(depth, least, out=part), half, out=part)
        np.subtract(quick, ahead, out=push)
        push *= damped
        push += np.multiply(stiff, depth, out=part)
        np.putmask(push, np.multiply(push, depth, out=pulls) <= 0.0, 0.0)
        np.add(before, push, out=both)
        ahead += ahead
        ahead -= speed
        ahead += push  # at the end of the step, without dry friction
        ahead -= np.minimum(np.maximum(ahead, slowest, out=part), friction, out=part)
        speed += ahead
        position += speed
        speed, ahead = ahead, speed
        push, before = before, push
    pushed[0] += pushed[0]  # at an end, the only step counts twice
    np.add(before, before, out=pushed[-1])


def _resolved(values: Values, step_s: float) -> Array:
    """The load's resonance on a contact, as far as samples resolve it, rad/s."""
    return np.minimum(values["contact_rate"], 2.0 / step_s)
