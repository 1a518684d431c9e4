"""Other gains go on from where the law is: no jump in their first sample, alike on both boards."""

import copy
import ctypes
import subprocess
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from board_bench import NEW, OLD
from conformance_boards import SOURCE
from hypothesis import given
from hypothesis import strategies as st
from law_cases import drawn_gains

from firmware_interface.control_law import CARRY_TIME_S, Memory
from firmware_interface.gains import AxisGains
from firmware_interface.motion import stop_acceleration_rad_s2, stop_duration_s, stopping_reference
from firmware_interface.registers import AXES
from firmware_interface.virtual.controller import AxisController, Setpoint, Transfer, transfer
from firmware_interface.virtual.drive import RAD_PER_COUNT, SAMPLE_PERIOD_S

SEEDS = st.integers(0, 2**32 - 1)
ROUNDING = 1e-5
"""Share of the largest effort, as of the law."""


class State:
    """Both axes somewhere in a motion, with gains in force and others to come, from a seed."""

    def __init__(self, seed: int) -> None:
        rng = np.random.default_rng(seed)
        self.controllers = [AxisController(drawn_gains(rng), SAMPLE_PERIOD_S, 1e6) for _ in AXES]
        self.gains = [drawn_gains(rng) for _ in AXES]
        self.setpoints = [Setpoint(*map(single, rng.uniform(-1.0, 1.0, 3))) for _ in AXES]
        self.counts = [
            round((s.position_rad + rng.normal(0.0, 0.05)) / RAD_PER_COUNT) for s in self.setpoints
        ]
        for held, setpoint, count in zip(
            self.controllers, self.setpoints, self.counts, strict=True
        ):
            held.reset((count - int(rng.integers(-4, 5))) * RAD_PER_COUNT)
            held.memory = Memory(single(rng.uniform(-1.0, 1.0)), single(rng.normal(0.0, 0.003)))
            held._reference_rad = single(setpoint.position_rad - rng.normal(0.0, 0.003))
            held._integral_nm, held.carried_nm = map(single, rng.normal(0.0, 1.0, 2))
            held._velocity_rad_s = single(setpoint.velocity_rad_s + rng.normal(0.0, 0.3))
        self.positions = [count * RAD_PER_COUNT for count in self.counts]

    def efforts_nm(self) -> list[float]:
        """Of the gains in force."""
        return [
            copy.copy(self.controllers[n]).effort_nm(
                self.setpoints[n], self.positions[n], self.setpoints[1 - n]
            )
            for n in (0, 1)
        ]

    def transferred(self, *, moving: bool) -> Transfer:
        """To the others, by the virtual board."""
        return transfer(self.controllers, self.gains, self.setpoints, self.positions, moving=moving)


def single(number: float) -> float:
    """As a 32-bit float holds it."""
    return float(np.float32(number))


@given(SEEDS, st.booleans())
def test_the_effort_goes_on_in_the_sample_of_the_exchange(seed: int, moving: bool) -> None:
    """Of any gains in any state: to the last digits what the gains that go would have given."""
    state = State(seed)
    now = state.efforts_nm()
    found = state.transferred(moving=moving)
    for n in (0, 1):
        new, begun = found.controllers[n], found.setpoints[n]
        assert new.carried_nm == -found.jumps_nm[n]
        after = new.effort_nm(begun, state.positions[n], found.setpoints[1 - n])
        digits = 1e-9 * (1.0 + abs(found.jumps_nm[n]) + abs(now[n]))
        assert after == pytest.approx(now[n], abs=digits)
        ends = sorted([state.positions[n], state.setpoints[n].position_rad])
        assert ends[0] - 0.02 <= begun.position_rad <= ends[1] + 0.02  # b is below that


def test_what_is_left_of_a_jump_decays_within_the_shortest_stop() -> None:
    still = replace(OLD["x"], proportional=0.0, derivative=0.0)
    held = AxisController(still, SAMPLE_PERIOD_S, 12.0)
    held.carried_nm = 2.0
    efforts = [held.effort_nm(Setpoint(0.0, 0.0, 0.0), 0.0) for _ in range(400)]
    at = np.arange(400) * SAMPLE_PERIOD_S
    np.testing.assert_allclose(efforts, 2.0 * np.exp(-at / CARRY_TIME_S), atol=2e-6)
    assert efforts[round(0.25 / SAMPLE_PERIOD_S)] < 0.01 * 2.0
    assert efforts[-1] == 0.0


def test_what_a_term_remembered_that_the_new_gains_have_not_is_forgotten() -> None:
    memory = Memory(0.5, 0.001)
    assert memory.kept(OLD["x"]) == Memory()
    assert memory.kept(NEW["x"]) == memory
    assert memory.kept(replace(NEW["x"], backlash_offset_rad=0.0)) == Memory(0.5, 0.0)


@given(st.floats(-4.0, 4.0), st.floats(-30.0, 30.0), st.floats(0.0, 1.0))
def test_a_stop_that_goes_on_brakes_and_does_not_turn_round(
    velocity: float, acceleration: float, share: float
) -> None:
    duration = stop_duration_s(velocity)
    begun = stop_acceleration_rad_s2(velocity, acceleration, duration)
    assert abs(begun) <= abs(acceleration)
    path = stopping_reference(0.5, velocity, [0.0, share * duration, duration], duration, begun)
    assert path.acceleration_rad_s2[0] == pytest.approx(begun)
    assert path.velocity_rad_s[1] * velocity >= -1e-9
    assert abs(path.velocity_rad_s[1]) <= abs(velocity) + 1e-9
    assert path.velocity_rad_s[2] == pytest.approx(0.0, abs=1e-9)
    assert abs(path.acceleration_rad_s2[2]) < 1e-9
    assert np.abs(path.acceleration_rad_s2).max() <= 24.0 + 1e-9  # twice a stop's largest


# ---- the firmware


class FirmwareMemory(ctypes.Structure):
    """struct law_memory."""

    _fields_ = (("reference", ctypes.c_float), ("z", ctypes.c_float), ("b", ctypes.c_float))


class FirmwareController(ctypes.Structure):
    """struct controller."""

    _fields_ = (
        ("last_counts", ctypes.c_int32),
        ("velocity", ctypes.c_float),
        ("integral", ctypes.c_float),
        ("carried", ctypes.c_float),
        ("feedforward", ctypes.c_float),
        ("memory", FirmwareMemory),
    )


class From(ctypes.Structure):
    """struct transfer_from."""

    _fields_ = (
        ("controllers", ctypes.c_void_p),
        ("gains", ctypes.c_void_p),
        ("setpoints", ctypes.c_void_p),
        ("counts", ctypes.c_void_p),
        ("limit", ctypes.c_void_p),
        ("rad_per_count", ctypes.c_float),
        ("moving", ctypes.c_bool),
    )


class FirmwareTransfer(ctypes.Structure):
    """struct transfer."""

    _fields_ = (
        ("controllers", FirmwareController * 2),
        ("setpoints", (ctypes.c_float * 3) * 2),
        ("jump", ctypes.c_float * 2),
    )


@pytest.fixture(scope="module")
def firmware_transfer(tmp_path_factory: pytest.TempPathFactory) -> Any:
    """The firmware's transfer as a library."""
    library = tmp_path_factory.mktemp("transfer") / "transfer.so"
    names = ("transfer", "stop", "controller", "control_law", "numbers")
    sources = [str(SOURCE / f"{name}.c") for name in names]
    command = ["gcc", "-std=c99", "-O2", "-shared", "-fPIC", "-o", str(library), *sources, "-lm"]
    try:
        subprocess.run(command, check=True)
    except FileNotFoundError:
        pytest.skip("what is built from reference_firmware needs gcc")
    return ctypes.CDLL(str(library))


def banks(gains: list[AxisGains]) -> Any:
    """Two of struct fd_gain_bank."""
    numbers = [number for bank in gains for number in bank.numbers().values()]
    return (ctypes.c_float * len(numbers))(*numbers)


def of_firmware(library: Any, state: State, *, moving: bool) -> FirmwareTransfer:
    """The same transfer by the firmware."""
    held = (FirmwareController * 2)()
    for n, of in enumerate(state.controllers):
        memory = FirmwareMemory(of._reference_rad, *of.memory)
        last = round(of._last_rad / RAD_PER_COUNT)
        held[n] = FirmwareController(
            last, of._velocity_rad_s, of._integral_nm, of.carried_nm, of.feedforward_nm, memory
        )
    parts = (
        held,
        banks([of.gains for of in state.controllers]),
        (ctypes.c_float * 6)(*(number for setpoint in state.setpoints for number in setpoint)),
        (ctypes.c_int32 * 2)(*state.counts),
        (ctypes.c_float * 2)(1e6, 1e6),
    )
    given_by = From(*map(ctypes.addressof, parts), RAD_PER_COUNT, moving)
    found = FirmwareTransfer()
    library.transfer_consider(ctypes.byref(found), banks(state.gains), ctypes.byref(given_by))
    return found


@pytest.mark.parametrize("moving", [False, True])
@pytest.mark.parametrize("seed", range(40))
def test_both_boards_go_on_alike(firmware_transfer: Any, seed: int, moving: bool) -> None:
    state = State(seed)
    wanted, found = (
        state.transferred(moving=moving),
        of_firmware(firmware_transfer, state, moving=moving),
    )
    largest = max(map(abs, [*state.efforts_nm(), *wanted.jumps_nm, 600.0 * 0.15]))
    np.testing.assert_allclose(found.jump, wanted.jumps_nm, atol=10.0 * ROUNDING * largest)
    for n in (0, 1):
        np.testing.assert_allclose(found.setpoints[n], wanted.setpoints[n], atol=1e-4)
        assert found.controllers[n].carried == -found.jump[n]
