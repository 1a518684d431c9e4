"""Flexible model of a ball-screw feed drive, all axes, with Coulomb friction.

The paper's full model per axis, M q'' + B q' + K q = forces, with q = motor, gearbox output,
screw, table, base support and, on the axis that carries the other, the carried support (its
matrices are not printed in the paper; this arrangement is a reconstruction). Angles count at
the gearbox output: the motor's is divided by the gear ratio, and the linear coordinates by the
screw's lead, so that all are in rad and all forces in N*m.

The linear part is stepped exactly, by the matrix exponential, with forces held over a
sub-step. Coulomb friction acts at the motor, at the gearbox output and between table and base.
In every sub-step the friction forces are those that leave each joint either sliding against
its full friction or, at the sub-step's end, without velocity: a stuck joint stays stuck.
"""

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

JOINTS: Final = 3
"""Friction joints per axis: motor, gearbox output, guide."""
_ONE: Final = np.ones(1)


@dataclass(frozen=True)
class AxisMatrices:
    """Matrices of one axis; n coordinates, in rad at the gearbox output.

    Attributes
    ----------
    inertia, damping, stiffness : (n, n) arrays
        kg*m^2, N*m*s/rad, N*m/rad.
    joints : (n, JOINTS) array
        Direction in which each friction torque acts; its transpose gives the joint velocities.
    coulomb_nm : (JOINTS,) array
        Friction torque of each joint.
    constant_nm : (n,) array
        Gravity and offsets.
    """

    inertia: Array
    damping: Array
    stiffness: Array
    joints: Array
    coulomb_nm: Array
    constant_nm: Array


def matrix_exponential(matrix: Array) -> Array:
    """By scaling and squaring a Taylor series of degree 18."""
    squarings = max(0, math.ceil(math.log2(float(np.linalg.norm(matrix, 1)) + 1e-30)) + 1)
    scaled = matrix / 2.0**squarings
    result = term = np.eye(len(matrix))
    for degree in range(1, 19):
        term = term @ scaled / degree
        result = result + term
    for _ in range(squarings):
        result = result @ result
    return result


class Plant:
    """Steps all axes by whole control samples.

    Parameters
    ----------
    axes : sequence of AxisMatrices
    substep_s : float
        Also the time by which a new effort comes late.
    substeps : int
        Sub-steps per control sample.
    """

    def __init__(self, axes: Sequence[AxisMatrices], substep_s: float, substeps: int) -> None:
        self._substeps = substeps
        n = sum(len(axis.inertia) for axis in axes)
        joints, inputs, constant = _joined(axes)
        self._transition, response = _discretise(axes, n, substep_s)
        self._friction_in = response @ joints
        self._effort_in = response @ inputs
        self._constant_in = response @ constant
        self._joint_velocity = np.hstack([np.zeros((JOINTS * len(axes), n)), joints.T])
        self._law = _FrictionLaw(
            self._joint_velocity @ self._friction_in,
            np.concatenate([axis.coulomb_nm for axis in axes]),
        )
        self._maps: dict[tuple[int, ...], tuple[Array, Array, Array]] = {}
        self._state = np.zeros(2 * n)
        first = np.cumsum([0, *(len(axis.inertia) for axis in axes[:-1])])
        self._output_index = first + 1

    @property
    def output_rad(self) -> Array:
        """Gearbox output angle of each axis."""
        return np.take(self._state, self._output_index)

    @property
    def output_rad_s(self) -> Array:
        """Gearbox output speed of each axis."""
        return np.take(self._state, self._output_index + len(self._state) // 2)

    @property
    def state(self) -> Array:
        """Coordinates of all axes, then their velocities."""
        return self._state.copy()

    def advance(self, effort_before_nm: Array, effort_nm: Array) -> None:
        """One control sample: a sub-step of the old effort, the rest of the new one.

        As long as no joint changes between sliding and sticking, the whole sample is one linear
        map, made once for each combination.
        """
        combination = self._law.combination
        if combination not in self._maps:
            self._maps[combination] = self._compose(combination)
        sample_map, lowest, highest = self._maps[combination]
        stacked = sample_map @ np.concatenate([self._state, effort_before_nm, effort_nm, _ONE])
        states = len(self._state)
        checked = stacked[states:]
        if ((checked >= lowest) & (checked <= highest)).all():
            self._state = stacked[:states]
            return
        self._substep(effort_before_nm)
        for _ in range(self._substeps - 1):
            self._substep(effort_nm)

    def _substep(self, effort_nm: Array) -> None:
        free = self._transition @ self._state + self._effort_in @ effort_nm + self._constant_in
        self._state = free + self._friction_in @ self._law.solve(self._joint_velocity @ free)

    def _compose(self, combination: tuple[int, ...]) -> tuple[Array, Array, Array]:
        """Map of a whole sample for one combination, and bounds of what it must be checked for.

        From state, old effort, new effort and one, to the state at the end and, after every
        sub-step, the torque of each stuck joint and the speed of each sliding one.
        """
        gain, bias, signs = self._law.affine(combination)
        states, efforts = len(self._state), self._effort_in.shape[1]
        current = np.eye(states, states + 2 * efforts + 1)
        rows = []
        for step in range(self._substeps):
            free = self._transition @ current
            effort = states + (efforts if step else 0)
            free[:, effort : effort + efforts] += self._effort_in
            free[:, -1] += self._constant_in
            friction = gain @ (self._joint_velocity @ free)
            friction[:, -1] += bias
            current = free + self._friction_in @ friction
            speed = signs[:, None] * (self._joint_velocity @ current)
            rows.append(np.where(signs[:, None] == 0.0, friction, speed))
        stuck = signs == 0.0
        lowest = np.where(stuck, -self._law.coulomb_nm, 0.0)
        highest = np.where(stuck, self._law.coulomb_nm, np.inf)
        return (
            np.vstack([current, *rows]),
            np.tile(lowest, self._substeps),
            np.tile(highest, self._substeps),
        )


class _FrictionLaw:
    """Friction torques f with |f| <= coulomb such that v = v_free + G f obeys Coulomb's law.

    Three joints an axis have 27 combinations of stuck, sliding forward and sliding back. G is
    symmetric and positive definite, so exactly one combination is consistent. For each of them
    f is an affine function of v_free.

    Attributes
    ----------
    combination : tuple of int
        Which one held last, by axis.
    """

    def __init__(self, compliance: Array, coulomb_nm: Array) -> None:
        self.coulomb_nm = coulomb_nm
        axes = len(coulomb_nm) // JOINTS
        self._axes = np.arange(axes)
        self._signs = np.array(list(itertools.product((-1.0, 0.0, 1.0), repeat=JOINTS)))
        self.combination: tuple[int, ...] = (len(self._signs) // 2,) * axes
        shape = (axes, len(self._signs), JOINTS)
        self._gain = np.zeros((*shape, JOINTS))
        self._bias = np.zeros(shape)
        self._coulomb = coulomb_nm.reshape(axes, 1, JOINTS)
        self._compliance = np.zeros((axes, 1, JOINTS, JOINTS))
        for axis in range(axes):
            part = slice(axis * JOINTS, (axis + 1) * JOINTS)
            self._compliance[axis, 0] = compliance[part, part]
            for n in range(len(self._signs)):
                self._prepare(axis, n)
        self._per_velocity = 1.0 / np.diagonal(self._compliance, axis1=2, axis2=3)

    def solve(self, free_velocity: Array) -> Array:
        """Friction torques of all joints: of all combinations, the one that breaks no law."""
        free = free_velocity.reshape(len(self._axes), 1, JOINTS, 1)
        friction = (self._gain @ free)[..., 0] + self._bias
        velocity = (free + self._compliance @ friction[..., None])[..., 0]
        backwards = -velocity * self._signs * self._per_velocity
        too_large = np.abs(friction) - self._coulomb
        violation = np.where(self._signs == 0.0, too_large, backwards).max(axis=2)
        best = violation.argmin(axis=1)
        self.combination = tuple(best.tolist())
        return np.ravel(friction[self._axes, best])

    def affine(self, combination: tuple[int, ...]) -> tuple[Array, Array, Array]:
        """Gain and bias of all joints' torques over v_free, and the directions of sliding."""
        which = (self._axes, np.array(combination))
        return (
            block_diagonal(list(self._gain[which])),
            np.ravel(self._bias[which]),
            np.ravel(self._signs[which[1]]),
        )

    def _prepare(self, axis: int, n: int) -> None:
        """Sliding joints have their full friction, stuck ones the torque that stops them."""
        signs, block = self._signs[n], self._compliance[axis, 0]
        bias = -signs * self._coulomb[axis, 0]
        stuck = np.flatnonzero(signs == 0.0)
        inverse = np.linalg.inv(block[np.ix_(stuck, stuck)])
        self._gain[axis, n, stuck] = -inverse @ np.eye(JOINTS)[stuck]
        bias[stuck] = -inverse @ (block @ bias)[stuck]
        self._bias[axis, n] = bias


def _joined(axes: Sequence[AxisMatrices]) -> tuple[Array, Array, Array]:
    """Joint directions, motor inputs and constant forces of all axes in one vector."""
    inputs = []
    for number, axis in enumerate(axes):
        column = np.zeros((len(axis.inertia), len(axes)))
        column[0, number] = 1.0
        inputs.append(column)
    return (
        block_diagonal([axis.joints for axis in axes]),
        np.vstack(inputs),
        np.concatenate([axis.constant_nm for axis in axes]),
    )


def block_diagonal(blocks: Sequence[Array]) -> Array:
    """Matrix of the blocks along its diagonal."""
    result = np.zeros(np.sum([block.shape for block in blocks], axis=0))
    row = column = 0
    for block in blocks:
        result[row : row + block.shape[0], column : column + block.shape[1]] = block
        row, column = row + block.shape[0], column + block.shape[1]
    return result


def _discretise(axes: Sequence[AxisMatrices], n: int, step_s: float) -> tuple[Array, Array]:
    """Transition of the state over a step, and its response to forces held over it."""
    inverse = np.linalg.inv(block_diagonal([axis.inertia for axis in axes]))
    augmented = np.zeros((3 * n, 3 * n))
    augmented[:n, n : 2 * n] = np.eye(n)
    augmented[n : 2 * n, :n] = -inverse @ block_diagonal([axis.stiffness for axis in axes])
    augmented[n : 2 * n, n : 2 * n] = -inverse @ block_diagonal([axis.damping for axis in axes])
    augmented[n : 2 * n, 2 * n :] = inverse
    exponential = matrix_exponential(augmented * step_s)
    return exponential[: 2 * n, : 2 * n], exponential[: 2 * n, 2 * n :]
