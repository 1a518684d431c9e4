"""Backlash: play between the encoder's side and the load.

After a reversal the drive moves only its own inertia and friction for the width of the gap. Then it
takes the load along with an impact, from which the load rebounds. The base parameters include the
load's share of inertia, friction and weight.
Source: Nordin and Gutman, Automatica 38 (2002) 1633 (dead zone with spring and damper).
"""

from collections.abc import Mapping
from typing import Final, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from edge_ident.model import search
from edge_ident.model.effect import Advice, Compensation, Draws, Effect, Parameter, Scale
from edge_ident.model.motion import Array, Motion, Values

_SEGMENTS: Final = 12  # parts of the motion that are integrated side by side
_SHORTEST: Final = 100  # samples of such a segment
_CONTACT_DAMPING: Final = 0.4  # damping ratio of the load on a contact
_LEVELS: Final = 4  # contact rates that the search begins with
# Contact rates over those of the motion and of the filter, between which the levels lie.
_QUICKER: Final = 5.0


class Backlash(Effect):
    """A load that is taken along at the ends of a gap; memory: its position and speed."""

    parameters = (
        Parameter("gap", "{position}", 0.0, 1e9, "free travel between the contacts"),
        Parameter("load_inertia", "{inertia}", 1e-12, 1e9, "part of the inertia beyond the gap"),
        Parameter(
            "deceleration",
            "{position}/s^2",
            0.0,
            1e9,
            "of the free load by its Coulomb friction: that over load_inertia",
        ),
        Parameter(
            "damping_rate", "1/s", 0.0, 1e6, "its viscous friction over load_inertia", default=0.0
        ),
        Parameter(
            "weight", "{position}/s^2", -1e9, 1e9, "its share of the offset over it", default=0.0
        ),
        Parameter(
            "contact_rate", "rad/s", 1.0, 1e6, "the load's resonance on a contact", default=300.0
        ),
    )
    memory_size = 2
    memory_scale = "load_inertia"

    def load(self, at: Motion, values: Values) -> Array:
        """Contact, in place of the viscous friction and the weight of a load that is carried."""
        carried = values["damping_rate"] * at.velocity + values["weight"]
        return _contact(at, values) - values["load_inertia"] * carried

    def friction(self, at: Motion, values: Values) -> Array:
        """What is left of it on the encoder's side."""
        return -values["load_inertia"] * values["deceleration"]

    def inertia(self, at: Motion, values: Values) -> Array:
        """What is left of it on the encoder's side."""
        return -values["load_inertia"]

    def start(self, at: Motion, values: Values) -> Array:
        """States of a load in the middle of the gap, at rest."""
        return np.array([at.position, np.zeros_like(at.position)])

    def rates(self, at: Motion, values: Values) -> Array:
        """Rates of the load; its friction is smoothed where it would stop within a contact."""
        speed = at.memory[1]
        deceleration = values["deceleration"]
        stopping = values["contact_rate"] * speed
        smoothed = np.minimum(np.maximum(stopping, -deceleration), deceleration)
        slowing = smoothed + values["damping_rate"] * speed + values["weight"]
        return np.array([speed, _contact(at, values) / values["load_inertia"] - slowing])

    def fastest_rate(self, values: Values, inertia: Array, speed: float) -> Array:
        """Rate of the contact, with both sides moving."""
        return values["contact_rate"] * (1.0 + values["load_inertia"] / inertia)

    def resistance(self, motion: Motion, values: Values) -> Array:
        """Let the load move on by itself and on the contacts, sample by sample.

        A load forgets what it did before it was last carried, so segments of the motion are
        integrated side by side, each from one segment earlier on, where the axis is quick.
        """
        step_s = float(motion.time_s[1] - motion.time_s[0])
        carried = values["deceleration"] * motion.direction
        carried = carried + values["damping_rate"] * motion.velocity
        carried = motion.acceleration + carried + values["weight"]
        starts = _starts(motion.velocity)
        begins = np.concatenate([[0], starts[:-2]])
        length = int(np.max(starts[1:] - begins)) + 1
        along = np.minimum(begins[:, None] + np.arange(length), len(motion.time_s) - 1)
        pushed = pushed_load(
            motion.position[..., along],
            motion.velocity[..., begins],
            carried[..., begins],
            values,
            step_s,
            _CONTACT_DAMPING,
        )
        contact = np.empty((*pushed.shape[:-2], len(motion.time_s)))
        for row, (begin, start, end) in enumerate(zip(begins, starts, starts[1:], strict=False)):
            contact[..., start:end] = pushed[..., row, start - begin : end - begin]
        return values["load_inertia"] * (contact - carried)


def _physical(values: Values, excitation: search.Excitation) -> bool:
    """A gap that the encoder resolves."""
    return bool(np.all(values["gap"] >= 0.5 * excitation.resolution))


def _degenerate(values: Values, inertia: float) -> str:
    """A gap narrower than what the load's friction winds up the contacts beside it, or too much
    beyond it."""
    wound_up = 2.0 * values["deceleration"] / np.square(values["contact_rate"])
    if np.all(values["gap"] >= wound_up):
        return search.heavier_than(inertia, values)
    return "its gap is narrower than its contacts wind up: that would be a compliance"


def _sound(values: Values, excitation: search.Excitation) -> bool:
    """No more lost motion at a reversal than on the chain of any drive.

    The load's friction winds up both contacts beside the gap. A spring on which it would lose as
    much is a stiff one.
    """
    friction = 2.0 * values["deceleration"]
    lost = values["gap"] + friction / np.square(values["contact_rate"])
    resonance = 2.0 * np.pi * search.SOUND_RESONANCE_HZ
    return bool(np.all(friction > resonance**2 * lost))


def _grid(excitation: search.Excitation) -> dict[str, Array]:
    """Gaps from what the encoder just resolves; loads with more or less friction than their share
    of the inertia; contacts from soft to stiff.

    On stiff contacts a load that flies free rebounds many times, and each rebound depends on all
    those before: the error has many minima. On soft ones it has few, and the search from them finds
    the gap.
    """
    inertia, viscous, coulomb, offset = excitation.base
    inertia, viscous, coulomb = (max(x, 1e-9) for x in (inertia, viscous, coulomb))
    fastest = 2.0 * np.pi * excitation.cutoff_hz
    ends = _QUICKER * excitation.turning_rate, _QUICKER * fastest
    gaps, shares, rates = np.meshgrid(
        np.geomspace(0.5 * excitation.resolution, 0.1 * excitation.travel, 30),
        np.array([0.1, 0.4, 1.0, 2.5]),
        np.geomspace(min(ends), max(ends), _LEVELS),
    )
    return {
        "gap": gaps.ravel(),
        "deceleration": shares.ravel() * coulomb / inertia,
        "damping_rate": np.full(gaps.size, 1.5 * viscous / inertia),
        "weight": np.full(gaps.size, 2.0 * offset / inertia),
        "contact_rate": rates.ravel(),
    }


def _draw(draws: Draws, scale: Scale) -> dict[str, Array]:
    """0.02 % to 1 % of the travel; the load has 20 % to 80 % of inertia and friction."""
    gap = draws.log_uniform(2e-4, 1e-2) * scale.travel
    load_inertia = draws.uniform(0.2, 0.8) * scale.inertia
    friction = draws.uniform(0.2, 0.8) * scale.coulomb_friction
    return {
        "gap": gap,
        "load_inertia": load_inertia,
        "deceleration": friction / load_inertia,
        "damping_rate": scale.viscous_friction / scale.inertia,
        "weight": np.zeros(draws.shape),
        "contact_rate": 2.0 * np.pi * draws.log_uniform(20.0, 100.0),
    }


def _starts(velocity: Array) -> NDArray[np.intp]:
    """Where segments start (K + 1), the end included: where the axis is quick, evenly spread."""
    speed = np.abs(velocity).reshape(-1, velocity.shape[-1])[0]
    count = max(1, min(_SEGMENTS, len(speed) // _SHORTEST))
    near = len(speed) // (4 * count)
    even = len(speed) * np.arange(1, count) // count
    quick = [k - near + int(np.argmax(speed[k - near : k + near])) for k in even]
    return np.array([0, *quick, len(speed)])


def _contact(at: Motion, values: Values) -> Array:
    """Effort of the contact, which pushes and never pulls."""
    behind = at.position - at.memory[0]
    half, rate = 0.5 * values["gap"], values["contact_rate"]
    depth = behind - np.minimum(np.maximum(behind, -half), half)
    pull = rate * (depth * rate + 2.0 * _CONTACT_DAMPING * (at.velocity - at.memory[1]))
    return np.where(pull * depth > 0.0, values["load_inertia"] * pull, 0.0)


def _one_sided(values: Mapping[str, float], top_speed: float) -> str:
    """A load that rests on one contact whichever way it moves has no play to make up for. Half the
    top speed counts: most of a motion is faster."""
    friction = values["deceleration"] + 0.5 * values["damping_rate"] * top_speed
    if abs(values["weight"]) >= friction:
        return "its weight keeps the load on one side of the gap"
    return ""


EFFECT: Final = Backlash(
    advice=Advice(
        in_words="there is free play: the motor turns a little before the load follows",
        size="play of {gap} at the encoder",
        part="coupling, ball nut and its bearings, gear or belt",
        action="Hold the motor still, push the load both ways, and read the free travel on a dial "
        "gauge. Tighten or preload the part that gives.",
    ),
    search=search.SearchSpec(
        forms=(
            search.Form(
                ("load_inertia",), ("gap", "deceleration", "damping_rate", "weight", "contact_rate")
            ),
        ),
        signature="little effort over a fixed length after each reversal, then an impact",
        alternatives=("presliding_hysteresis", "coupling_compliance"),
        experiment="reversals at several accelerations, some smaller than the play: --motion "
        "multisine",
        grid=_grid,
        physical=_physical,
        largest=(
            search.Largest(("gap",), 1.0, search.Yardstick.TRAVEL),
            search.Largest(("load_inertia",), 1.0, search.Yardstick.INERTIA),
        ),
        discrepancy=0.4,
        open_ended=("deceleration", "contact_rate"),
        needs_reversals=True,
        sound=_sound,
        degenerate=_degenerate,
    ),
    draw=_draw,
    compensation=Compensation(
        feedforward={"gap": "backlash_offset_rad"},
        times={"gap": 0.5},
        objection=_one_sided,
        note="so that the load follows, the motor leads by half the gap; an encoder on the motor "
        "cannot show whether the load does",
    ),
)


# A load between two contacts: the equation of motion behind a play, sample by sample.


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
