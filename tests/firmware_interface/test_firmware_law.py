"""The firmware's control law, in 32-bit floats, is the virtual board's to their rounding."""

import ctypes
import subprocess
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from conformance_boards import SOURCE
from law_cases import NEUTRAL, PERIOD_S, drawn_gains, drawn_way, of_map_3, old_feedforward, rows

from firmware_interface.gains import AxisGains
from firmware_interface.plant.feed_drive import COUNTS_PER_TURN
from firmware_interface.virtual.controller import AxisController, Setpoint

RAD_PER_COUNT = 2.0 * np.pi / COUNTS_PER_TURN
LIMIT_NM = 1e6
ROUNDING = 1e-5
"""Share of the largest effort: some ten operations of 6e-8, and angles of ten turns."""
Floats3 = ctypes.c_float * 3


class Memory(ctypes.Structure):
    """struct law_memory."""

    _fields_ = (("reference", ctypes.c_float), ("z", ctypes.c_float), ("b", ctypes.c_float))


class Controller(ctypes.Structure):
    """struct controller."""

    _fields_ = (
        ("last_counts", ctypes.c_int32),
        ("velocity", ctypes.c_float),
        ("integral", ctypes.c_float),
        ("carried", ctypes.c_float),
        ("feedforward", ctypes.c_float),
        ("memory", Memory),
    )


@pytest.fixture(scope="module")
def law(tmp_path_factory: pytest.TempPathFactory) -> Any:
    """The firmware's law as a library."""
    library = tmp_path_factory.mktemp("law") / "law.so"
    sources = [str(SOURCE / f"{name}.c") for name in ("control_law", "controller", "numbers")]
    command = ["gcc", "-std=c99", "-O2", "-shared", "-fPIC", "-o", str(library), *sources, "-lm"]
    try:
        subprocess.run(command, check=True)
    except FileNotFoundError:
        pytest.skip("what is built from reference_firmware needs gcc")
    loaded = ctypes.CDLL(str(library))
    loaded.law_feedforward_nm.restype = ctypes.c_float
    loaded.controller_effort_nm.restype = ctypes.c_float
    return loaded


def bank(gains: AxisGains) -> Any:
    """struct fd_gain_bank."""
    numbers = list(gains.numbers().values())
    return (ctypes.c_float * len(numbers))(*numbers)


def efforts(law: Any, gains: AxisGains, own: list[Setpoint], other: list[Setpoint]) -> np.ndarray:
    """Of the firmware's controller, its axis off the reference by a few counts."""
    held, numbers, finite = Controller(), bank(gains), ctypes.c_bool(True)
    law.controller_reset(ctypes.byref(held), counts(own[0]), ctypes.c_float(RAD_PER_COUNT))
    found = []
    for setpoint, by in zip(own, other, strict=True):
        found.append(
            law.controller_effort_nm(
                *(ctypes.byref(held), numbers, Floats3(*setpoint), Floats3(*by)),
                *(counts(setpoint), ctypes.c_float(RAD_PER_COUNT), ctypes.c_float(LIMIT_NM)),
                ctypes.byref(finite),
            )
        )
    assert finite
    return np.array(found)


def counts(setpoint: Setpoint) -> int:
    """Where the axis is: some counts behind."""
    return round(0.995 * setpoint.position_rad / RAD_PER_COUNT)


def virtual_efforts(gains: AxisGains, own: list[Setpoint], other: list[Setpoint]) -> np.ndarray:
    """Of the virtual board's."""
    held = AxisController(gains, PERIOD_S, LIMIT_NM)
    held.reset(counts(own[0]) * RAD_PER_COUNT)
    return np.array(
        [
            held.effort_nm(setpoint, counts(setpoint) * RAD_PER_COUNT, by)
            for setpoint, by in zip(own, other, strict=True)
        ]
    )


FIELDS = {
    "friction curves": ("friction_top_speed_rad_s", "friction_forward", "friction_backward"),
    "load table": ("table_start_rad", "table_step_rad", "load_table", "table_fade_speed_rad_s"),
    "local friction": ("table_start_rad", "table_step_rad", "local_friction_table"),
    "ripples": (
        "ripple_cosine",
        "ripple_sine",
        "ripple_period_rad",
        "ripple_fade_speed_rad_s",
    ),
    "presliding": ("presliding_feedforward", "presliding_distance_rad"),
    "backlash": ("proportional", "backlash_offset_rad", "backlash_distance_rad"),
    "dead band": ("viscous_feedforward", "deadband_inverse", "deadband_smoothing"),
    "cross": (
        "cross_inertia_feedforward",
        "cross_viscous_feedforward",
        "cross_coulomb_feedforward",
    ),
    "transmission": (
        "viscous_feedforward",
        "coulomb_feedforward",
        "offset_feedforward",
        "transmission_loss",
        "transmitted_inertia",
        "transmitted_friction",
    ),
}


@pytest.mark.parametrize("term", FIELDS)
def test_each_term_is_the_same_on_both_boards(law: Any, term: str) -> None:
    rng = np.random.default_rng(len(term))
    drawn = drawn_gains(rng)
    gains = replace(NEUTRAL, **{name: getattr(drawn, name) for name in FIELDS[term]})
    own, other = rows(drawn_way(rng)), rows(drawn_way(rng))
    wanted = virtual_efforts(gains, own, other)
    assert np.ptp(wanted) > 0.01
    found = efforts(law, gains, own, other)
    np.testing.assert_allclose(found, wanted, atol=ROUNDING * np.abs(wanted).max())


@pytest.mark.parametrize("seed", range(10))
def test_the_whole_law_is_the_same_on_both_boards(law: Any, seed: int) -> None:
    """Across reversals, and with all that it remembers; without the derivative and integral parts,
    which sum up the rounding of positions."""
    rng = np.random.default_rng(seed)
    gains = drawn_gains(rng, derivative=0.0, integral=0.0)
    own, other = rows(drawn_way(rng)), rows(drawn_way(rng))
    wanted = virtual_efforts(gains, own, other)
    found = efforts(law, gains, own, other)
    np.testing.assert_allclose(found, wanted, atol=ROUNDING * np.abs(wanted).max())


@pytest.mark.parametrize("seed", range(3))
def test_with_the_new_terms_off_the_firmware_computes_the_law_of_map_3(law: Any, seed: int) -> None:
    rng = np.random.default_rng(seed)
    gains = of_map_3(drawn_gains(rng))
    own, other = rows(drawn_way(rng)), rows(drawn_way(rng))
    memory, numbers = Memory(), bank(gains)
    found = [
        law.law_feedforward_nm(numbers, Floats3(*setpoint), Floats3(*by), ctypes.byref(memory))
        for setpoint, by in zip(own, other, strict=True)
    ]
    wanted = np.array([old_feedforward(gains, setpoint) for setpoint in own])
    np.testing.assert_allclose(found, wanted, atol=ROUNDING * np.abs(wanted).max())
