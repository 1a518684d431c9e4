"""Equations of motion of any model, for many drives at once.

The method is the classic fourth-order Runge-Kutta. Dry friction needs no smoothing: in a step every
axis either slides in one direction or sticks. Where a sliding axis comes to rest within a step, the
step is cut there. In the rest of the step the axis slides on, slides back or stays at rest, as the
balance of effort and friction requires. An axis at rest stays there until the effort exceeds the
friction.

The step is at most `STEP` over the fastest rate that any term of any drive brings in. That is a
fifth of the stability limit of the method (2.8).
"""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from itertools import compress
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from edge_ident.errors import ModelError
from edge_ident.model import inverse, model, rigid_body
from edge_ident.model.effect import Effect
from edge_ident.model.effects import named
from edge_ident.model.motion import Array, Motion, Values

STEP: Final = 0.5
"""Longest step times fastest rate."""


# The terms of a model, laid out for simulation: which hooks act, and where their states lie.


class Part(NamedTuple):
    """One effect on one axis, with values (D,), what acts on it and the rows of its states."""

    axis: int
    effect: Effect
    values: Values
    source: tuple[tuple[int, int], ...]
    memory: slice

    def at(self, all_axes: Motion, state: Array) -> Motion:
        """The motion (A, D) and state of all, as this effect sees it."""
        return Motion(
            all_axes.time_s,
            all_axes.position[self.axis],
            all_axes.velocity[self.axis],
            all_axes.acceleration[self.axis],
            all_axes.direction[self.axis],
            memory=state[self.memory],
            driven=all_axes.driven[self.axis],
            source=model.together((_row(all_axes, i), sense) for i, sense in self.source)
            if self.source
            else None,
        )


class Parts:
    """All terms of D drives of one structure.

    Attributes
    ----------
    base : Values
        Of the base terms, (A, D) each.
    all : list of Part
        Axis by axis, in the order of their terms.
    states : int
        Positions and velocities of all axes, and what effects remember.
    """

    def __init__(self, axes: Mapping[str, model.AxisModel], drives: int) -> None:
        self.names = list(axes)
        self._instants = [inverse.everywhere(0.0, axis) for axis in axes.values()]
        terms = [[(term, _values(term, drives)) for term in axis.terms] for axis in axes.values()]
        self.base: Values = {
            name: np.stack([of_axis[0][1][name] for of_axis in terms]) for name in model.PARAMETERS
        }
        self.all: list[Part] = []
        self.states = 2 * len(axes)
        for i, of_axis in enumerate(terms):
            for term, values in of_axis[1:]:
                effect = named(term.effect)
                memory = slice(self.states, self.states + effect.memory_size)
                self.states = memory.stop
                self.all.append(Part(i, effect, values, self._source(i, term), memory))

    def through(self, hook: str) -> list[Part]:
        """Effects that act through a hook."""
        return [part for part in self.all if part.effect.overrides(hook)]

    def fastest_rate(self, top_speed: Array) -> float:
        """Fastest rate (1/s) of all drives in the equations of motion; infinitesimal if none is.

        Raises
        ------
        ModelError
            Effects take more inertia than there is.
        """
        inertia = self._least_inertia()
        for name, least in zip(self.names, inertia.min(axis=1), strict=True):
            if least <= 0.0:
                raise ModelError(
                    f"axis {name}: its terms leave an inertia of {least:.3g}",
                    "raise the inertia of rigid_body, or lower what effects take from it",
                )
        rate = self.base["viscous_friction"] / inertia
        for part in self.all:
            i = part.axis
            rate[i] += part.effect.fastest_rate(part.values, inertia[i], float(top_speed[i]))
        return max(float(np.max(rate)), float(np.finfo(float).tiny))

    def _least_inertia(self) -> Array:
        """What terms leave of the inertia wherever and whenever the axes may be, (A, D)."""
        inertia = np.repeat(self.base["inertia"][:, None], len(self._instants[0].time_s), axis=1)
        for part in self.through("inertia"):
            at = self._instants[part.axis]
            inertia[part.axis] += part.effect.inertia(at, part.values)
        return np.asarray(inertia.min(axis=1))

    def _source(self, axis: int, term: model.Term) -> tuple[tuple[int, int], ...]:
        if not named(term.effect).has_source(term.source_axis):
            return ()
        others = {name: i for i, name in enumerate(self.names) if i != axis}
        acts = model.acting(term.source_axis, others)
        if not acts or not all(one.axis in others for one in acts):
            raise ModelError(
                f"axis {self.names[axis]}, {term.effect}: no other axis is {term.source_axis}",
                f"the axes are {', '.join(self.names)}",
            )
        return tuple((others[one.axis], one.sense) for one in acts)


def _row(motion: Motion, axis: int) -> Motion:
    return Motion(
        motion.time_s,
        motion.position[axis],
        motion.velocity[axis],
        motion.acceleration[axis],
        motion.direction[axis],
    )


def _values(term: model.Term, drives: int) -> dict[str, Array]:
    return {
        name: np.broadcast_to(np.asarray(value, dtype=np.float64), (drives,))
        for name, value in named(term.effect).complete(term.values).items()
    }


class _Balance(NamedTuple):
    """What acts on the axes at an instant, (A, D) each; the push is all but dry friction.

    What every effect sees is kept beside it.
    """

    seen: list[Motion]
    push: Array
    friction: Array
    inertia: Array


class Machine:
    """All axes of D drives of one structure.

    Parameters
    ----------
    axes : mapping of axis name to AxisModel
        Values are floats, or arrays (D,).
    position : (A, D) array
        Where the axes stand.
    top_speed : (A,) array
        To be expected; the step follows from it.
    period_s, delay_s : float
        Between control samples, and from a sample to its new effort, at most a period.
    longest_step_s : float, optional
        Beyond the rule of the module.
    velocity : (A, D) array or float, optional
        How fast they move; they stand unless told otherwise.

    Raises
    ------
    ModelError
        Effects take more inertia than there is, or need an axis that there is not.
    """

    def __init__(
        self,
        axes: Mapping[str, model.AxisModel],
        position: Array,
        top_speed: Array,
        period_s: float,
        delay_s: float,
        longest_step_s: float = np.inf,
        velocity: Array | float = 0.0,
    ) -> None:
        self._count = len(position)
        self._parts = parts = Parts(axes, position.shape[1])
        self.longest_step_s = min(longest_step_s, STEP / parts.fastest_rate(top_speed))
        self._holds_s = (delay_s, period_s - delay_s)
        self._springs, self._loads, self._frictions, self._inertias, self._memories = (
            [part.effect.overrides(hook) for part in parts.all]
            for hook in ("transmitted", "load", "friction", "inertia", "rates")
        )
        losing = any(part.effect.follows_base for part in parts.all)
        self._carried = [losing and part.effect.carried for part in parts.all]
        self._crossings = [part.effect.overrides("cross_inertia") for part in parts.all]
        self._crossed = any(self._crossings)
        self._base_friction = np.maximum(parts.base["coulomb_friction"], 0.0)
        self._time_s: float | Array = 0.0
        self._zero = np.zeros(position.shape)
        self._state = np.zeros((parts.states, position.shape[1]))
        self._state[: self._count] = position
        self._state[self._count : 2 * self._count] = velocity
        self._direction = np.sign(self.velocity)
        at = self._instant(self._state, self._direction, parts.base["offset"])
        for part in parts.through("start"):
            self._state[part.memory] = part.effect.start(part.at(at, self._state), part.values)

    # ---- seen from outside

    @property
    def position(self) -> Array:
        """Position of the encoder's side, (A, D)."""
        return self._state[: self._count]

    @property
    def velocity(self) -> Array:
        """Velocity of the encoder's side, (A, D)."""
        return self._state[self._count : 2 * self._count]

    @property
    def reading(self) -> Array:
        """What the encoders read, (A, D), before they count."""
        read = self.position.copy()
        for part in self._parts.through("reading"):
            read[part.axis] = part.effect.reading(read[part.axis], part.values)
        return read

    def set_time(self, time_s: float | Array) -> None:
        """Set the clock of all drives, or those (D,) of each; zero is the start of the record."""
        self._time_s = time_s

    def advance(self, before: Array, command: Array) -> None:
        """Let a sample pass: the delay under the command (A, D) before, the rest under the new."""
        for held, duration_s in zip((before, command), self._holds_s, strict=True):
            torque = self._torque(held)
            # 1e-9: a whole number of steps is not one more for the rounding of the quotient
            needed = int(np.ceil(duration_s / self.longest_step_s - 1e-9))
            steps = max(1, needed) if duration_s > 0.0 else 0
            for _ in range(steps):
                self._step(torque, duration_s / steps)

    def recorded(self, command: Array, time_s: Array) -> Array:
        """Effort columns (A, D, N) of the commands at their time stamps (N,)."""
        effort = command.copy()
        for part in self._parts.through("recorded"):
            values = {name: value[:, None] for name, value in part.values.items()}
            effort[part.axis] = part.effect.recorded(effort[part.axis], time_s, values)
        return effort

    def _torque(self, command: Array) -> Array:
        """What the actuators make of a command, (A, D)."""
        torque = command.copy()
        # the inverse model goes from torque to command through the terms in their order
        for part in reversed(self._parts.through("torque")):
            torque[part.axis] = part.effect.torque(
                torque[part.axis], np.asarray(self._time_s), part.values
            )
        return torque

    # ---- a step

    def _step(self, torque: Array, step_s: float) -> None:
        if not self._direction.all():
            self._direction, _ = self._leave_rest(self._state, self._direction, torque)
        state, count = self._state, self._count
        # the classic tableau; directions hold over the step, so the rates are smooth in it
        k1 = self._rates(state, torque, 0.0)
        k2 = self._rates(state + 0.5 * step_s * k1, torque, 0.5 * step_s)
        k3 = self._rates(state + 0.5 * step_s * k2, torque, 0.5 * step_s)
        k4 = self._rates(state + step_s * k3, torque, step_s)
        new = state + step_s / 6.0 * (k1 + 2.0 * (k2 + k3) + k4)
        self._time_s = self._time_s + step_s
        turned = self._direction * new[count : 2 * count] < 0.0
        if turned.any():
            self._turn(new, turned, torque, step_s)
        self._state = new

    def _turn(self, new: Array, turned: NDArray[np.bool_], torque: Array, step_s: float) -> None:
        """Bring axes to rest where they came to it, and let the rest of the step pass."""
        position, velocity = new[: self._count], new[self._count : 2 * self._count]
        before = self.velocity[turned]
        # over so short a time speed falls in a straight line: it is zero after this share of the
        # step, and the way until then is that of the mean speed
        share = before / (before - velocity[turned])
        position[turned] = self.position[turned] + 0.5 * share * step_s * before
        velocity[turned] = 0.0
        direction = np.where(turned, 0.0, self._direction)
        self._direction, acceleration = self._leave_rest(new, direction, torque)
        left_s = (1.0 - share) * step_s
        velocity[turned] = acceleration[turned] * left_s
        position[turned] += 0.5 * left_s * velocity[turned]

    def _leave_rest(self, state: Array, direction: Array, torque: Array) -> tuple[Array, Array]:
        """Directions and accelerations, axes at rest having given way to a push above friction."""
        balance = self._balance(state, direction, torque)
        acceleration = self._accelerate(balance, direction)
        # an axis at rest also feels the others accelerate
        push = balance.push - self._cross_effort(balance, acceleration)
        leaves = (direction == 0.0) & (np.abs(push) > balance.friction)
        if not leaves.any():
            return direction, acceleration
        moving = np.where(leaves, np.sign(push), direction)
        return moving, self._accelerate(self._balance(state, moving, torque), moving)

    def _rates(self, state: Array, torque: Array, since_s: float) -> Array:
        balance = self._balance(state, self._direction, torque, since_s)
        acceleration = self._accelerate(balance, self._direction)
        rates = np.empty_like(state)
        rates[: self._count] = state[self._count : 2 * self._count]
        rates[self._count : 2 * self._count] = acceleration
        for part, at in compress(zip(self._parts.all, balance.seen, strict=True), self._memories):
            at = replace(at, acceleration=acceleration[part.axis])
            rates[part.memory] = part.effect.rates(at, part.values)
        return rates

    # ---- forces

    def _balance(
        self, state: Array, direction: Array, torque: Array, since_s: float = 0.0
    ) -> _Balance:
        base, velocity = self._parts.base, state[self._count : 2 * self._count]
        # dry friction is no part of the push: it opposes the direction, or at rest the push itself
        push = torque - rigid_body.RIGID_BODY.load_at(velocity, base)
        inertia, friction = base["inertia"], base["coulomb_friction"]
        if not self._parts.all:
            return _Balance([], push, self._base_friction, inertia)
        at = self._instant(state, direction, torque, since_s)
        seen = [part.at(at, state) for part in self._parts.all]
        of_parts = list(zip(self._parts.all, seen, strict=True))
        for part, one in compress(of_parts, self._springs):
            # a spring passes on another effort than the motor's: it takes the place of that
            push[part.axis] += part.effect.transmitted(one, part.values) - one.driven
        for part, one in compress(of_parts, self._loads):
            push[part.axis] -= part.effect.load(one, part.values)
        if any(self._inertias):
            inertia = inertia.copy()
        for part, one in compress(of_parts, self._inertias):
            inertia[part.axis] += part.effect.inertia(one, part.values)
        if any(self._frictions):
            inertia_effort = push - direction * friction
            friction_effort = base["viscous_friction"] * velocity + direction * friction
            # the offset is a weight: the transmission passes it on too, and the push is without it
            transmitted = inertia_effort + base["offset"]
            for part, one in compress(of_parts, self._carried):
                transmitted[part.axis] += part.effect.load(one, part.values)
            friction = friction.copy()
        for part, one in compress(of_parts, self._frictions):
            one = replace(
                one,
                transmitted=transmitted[part.axis],
                inertia_effort=inertia_effort[part.axis],
                friction_effort=friction_effort[part.axis],
            )
            friction[part.axis] += part.effect.friction(one, part.values)
        # effects may take more friction than there is, and friction never drives
        return _Balance(seen, push, np.maximum(friction, 0.0), inertia)

    def _accelerate(self, balance: _Balance, direction: Array) -> Array:
        slides = direction != 0.0
        free = balance.push - direction * balance.friction
        if not self._crossed:
            return np.where(slides, free / balance.inertia, 0.0)
        matrix = np.zeros((free.shape[1], self._count, self._count))
        for i in range(self._count):
            # one row an axis: M·a = free effort; the row of an axis at rest says a = 0
            matrix[:, i, i] = np.where(slides[i], balance.inertia[i], 1.0)
        for part, one in self._crossing(balance):
            coupling = part.effect.cross_inertia(one, part.values)
            felt = np.where(slides[part.axis], coupling, 0.0)
            for source, sense in part.source:
                matrix[:, part.axis, source] += sense * felt
        free = np.where(slides, free, 0.0)
        return np.asarray(np.linalg.solve(matrix, free.T[..., None])[..., 0].T)

    def _cross_effort(self, balance: _Balance, acceleration: Array) -> Array:
        """Effort on each axis that the accelerations of others cost."""
        effort = self._zero
        for part, one in self._crossing(balance):
            effort = effort.copy()
            coupling = part.effect.cross_inertia(one, part.values)
            effort[part.axis] += coupling * sum(sense * acceleration[i] for i, sense in part.source)
        return effort

    def _crossing(self, balance: _Balance) -> Iterator[tuple[Part, Motion]]:
        """Effects by which axes accelerate each other, with what they see."""
        return compress(zip(self._parts.all, balance.seen, strict=True), self._crossings)

    def _instant(
        self, state: Array, direction: Array, driven: Array, since_s: float = 0.0
    ) -> Motion:
        """Motion of all axes, (A, D)."""
        position, velocity = state[: self._count], state[self._count : 2 * self._count]
        now = np.asarray(self._time_s + since_s)
        return Motion(now, position, velocity, self._zero, direction, driven=driven)
