"""The arithmetic of a network in C: the roundings of IEEE 754, also where the processor lacks them.

Random numbers rarely fall on ties, and images even less: here are the cases that decide.
"""

import subprocess
from fractions import Fraction
from pathlib import Path
from typing import Any, Final

import numpy as np
import pytest
from numpy.typing import NDArray

pytest.importorskip("onnx")

from export.c_source.source import c_source
from tests.export.c_builds import INT8, STRICT, built, needs, write

GIVEN: Final = np.dtype(
    [("sum", "i4"), ("mantissa", "u4"), ("shift", "u4"), ("zero_point", "i4")]
    + [(name, "f4") for name in "abc"]
)
FOUND: Final = np.dtype(
    [("requantized", "i4"), ("quantized", "i4"), ("multiply_add", "f4"), ("sigmoid", "f4")]
)
CASES: Final = 4000

pytestmark = needs("gcc")


@pytest.fixture(scope="module", params=["-mno-fma", "-mfma"])
def results(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Any:
    """What the functions make of the cases, without and with fused multiplication and addition."""
    option, folder = request.param, tmp_path_factory.mktemp("arithmetic")
    flags = Path("/proc/cpuinfo").read_text("utf-8") if Path("/proc/cpuinfo").exists() else ""
    if " fma " not in flags:
        pytest.skip("needs a processor with fused multiplication and addition")
    source = c_source(INT8.read_bytes(), INT8.name)
    write(source, folder)
    program = built(folder, source, "arithmetic.c", "gcc", *STRICT, "-O2", option)
    given = cases()
    done = subprocess.run([program], input=given.tobytes(), stdout=subprocess.PIPE, check=True)
    return given, np.frombuffer(done.stdout, FOUND)


def cases() -> NDArray[Any]:
    """Random numbers; the first half has sums, quotients and products on ties or beside them."""
    rng = np.random.default_rng(5)
    given = np.zeros(CASES, GIVEN)
    ties = np.arange(CASES) < CASES // 2
    given["zero_point"] = rng.integers(-128, 128, CASES)
    given["sum"] = rng.integers(-(2**31), 2**31, CASES) >> rng.integers(0, 24, CASES)
    given["mantissa"] = np.where(ties, 2**23, rng.integers(2**23, 2**24, CASES))
    magnitude = np.ceil(np.log2(np.abs(given["sum"].astype(float)) + 2.0)).astype(int)
    given["shift"] = np.clip(magnitude + 16 + rng.integers(0, 9, CASES), 24, 62)
    near = slice(CASES // 2, 3 * CASES // 4)  # sums whose level is a tie once it is a float
    level = rng.integers(0, 200, CASES // 4) + 0.5
    given["shift"][near] = rng.integers(40, 47, CASES // 4)
    exact_sum = np.ldexp(level, given["shift"][near]) / given["mantissa"][near]
    given["sum"][near] = np.round(np.minimum(exact_sum, 2.0**31 - 1))
    given["b"] = np.where(ties, 0.25, rng.uniform(0.01, 1.0, CASES))
    given["a"] = np.where(
        ties, rng.integers(-2000, 2000, CASES) / 8, rng.normal(scale=60.0, size=CASES)
    )
    given["c"] = rng.normal(scale=8.0, size=CASES)
    beside = given[-CASES // 4 :]  # half a digit of c, and less than a double resolves
    beside["a"] = rng.choice([-1, 1], len(beside)) * 2.0**-12 * (1.0 + 2.0**-23)
    beside["b"] = 2.0**-12 * (1.0 + rng.choice([-1, 1], len(beside)) * 2.0**-23)
    beside["c"] = rng.uniform(1.0, 2.0, len(beside))
    return given


def test_sums_become_levels_as_in_float(results: Any) -> None:
    """To float, times the scale in float, to the nearest integer: three roundings to even."""
    given, found = results
    scales = np.ldexp(given["mantissa"].astype(np.float32), -given["shift"].astype(int))
    levels = np.rint(given["sum"].astype(np.float32) * scales) + given["zero_point"]
    np.testing.assert_array_equal(found["requantized"], np.clip(levels, -128, 127))
    assert np.mean(np.abs(levels) < 127) > 0.3


def test_values_become_levels_as_in_float(results: Any) -> None:
    given, found = results
    levels = np.rint(given["a"] / given["b"]) + given["zero_point"]
    np.testing.assert_array_equal(found["quantized"], np.clip(levels, -128, 127))


def test_the_sigmoid_errs_by_less_than_a_ten_millionth(results: Any) -> None:
    given, found = results
    exact = 1.0 / (1.0 + np.exp(-given["c"].astype(np.float64)))
    assert np.max(np.abs(found["sigmoid"] - exact)) < 1e-7


def test_a_product_is_added_with_one_rounding(results: Any) -> None:
    """No float is nearer to the exact result; of two as near, it is the even one."""
    given, found = results
    for case, result in zip(given, found["multiply_add"], strict=True):
        exact = Fraction(float(case["a"])) * Fraction(float(case["b"])) + Fraction(float(case["c"]))
        distance = abs(Fraction(float(result)) - exact)
        for other in (np.nextafter(result, np.float32(s * np.inf)) for s in (-1, 1)):
            away = abs(Fraction(float(other)) - exact)
            assert distance < away or (distance == away and result.view(np.uint32) % 2 == 0)
