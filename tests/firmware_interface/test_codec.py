"""What goes over the line comes back as it was, or is refused."""

import math
from dataclasses import astuple

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from firmware_interface.codec import (
    RawPage,
    addresses,
    crc32,
    decode,
    decode_array,
    decode_page,
    decode_trajectory,
    encode,
    encode_page,
    encode_trajectory,
)
from firmware_interface.gains import (
    OFF,
    POSITIVE,
    SIGNED,
    AxisGains,
    bank_spans,
    decode_gains,
    encode_gains,
    span_of,
)
from firmware_interface.motion import Multisine, SineComponent, Staircase, Trajectory
from firmware_interface.registers import PAGE_ADDRESS, PAGE_WORDS, REGISTERS

LIMITS = {
    "u16": (0, 2**16 - 1),
    "i16": (-(2**15), 2**15 - 1),
    "u32": (0, 2**32 - 1),
    "i32": (-(2**31), 2**31 - 1),
}
f32 = st.floats(width=32, allow_nan=False, allow_infinity=False)


@given(st.data(), st.sampled_from(sorted(REGISTERS)))
def test_every_register_round_trips(data: st.DataObject, name: str) -> None:
    register = REGISTERS[name]
    number = f32 if register.type == "f32" else st.integers(*LIMITS[register.type])
    raw = data.draw(st.lists(number, min_size=register.count, max_size=register.count))
    values = [value * register.scale for value in raw]
    words = encode(name, *values)
    assert len(words) == register.words
    assert all(0 <= word <= 0xFFFF for word in words)
    assert decode_array(name, words) == pytest.approx(values, rel=1e-12)


def test_high_word_comes_first() -> None:
    assert encode("identity.serial_number", 0x12345678) == [0x1234, 0x5678]


def test_scale_is_applied_once() -> None:
    assert encode("identity.sample_period", 0.0025) == [0x0026, 0x25A0]  # 2 500 000 ns
    assert decode("identity.sample_period", [0x0026, 0x25A0]) == pytest.approx(0.0025)


@pytest.mark.parametrize("value", [-1.0, 2.0**16, math.inf])
def test_a_value_that_does_not_fit_is_refused(value: float) -> None:
    with pytest.raises(ValueError, match="does not fit"):
        encode("status.last_token", value)


def test_crc_is_the_one_everybody_has() -> None:
    # check value of CRC-32/ISO-HDLC for the ASCII digits 1 to 8 ("12345678")
    assert crc32([0x3132, 0x3334, 0x3536, 0x3738]) == 0x9AE0DAAF


counts = st.tuples(
    st.integers(-(2**31), 2**31 - 1),
    st.integers(-(2**15), 2**15 - 1),
    st.integers(-(2**20), 2**20),
)


@given(
    st.integers(0, 2**32 - 1),
    st.integers(0, 2**32 - 1),
    st.lists(st.tuples(counts, counts), min_size=1, max_size=14),
)
def test_pages_round_trip_and_following_errors_saturate(
    index: int, first: int, rows: list[tuple[tuple[int, int, int], tuple[int, int, int]]]
) -> None:
    samples = np.array(rows)
    page = RawPage(index, first, samples[..., 0], samples[..., 1], samples[..., 2])
    words = encode_page(page)
    assert len(words) == PAGE_WORDS
    back = decode_page(words)
    assert (back.index, back.first_sample) == (index, first)
    np.testing.assert_array_equal(back.position, page.position)
    np.testing.assert_array_equal(back.effort, page.effort)
    saturated = np.clip(page.following_error, -(2**15), 2**15 - 1)
    np.testing.assert_array_equal(back.following_error, saturated)


def some_page() -> list[int]:
    samples = np.arange(28).reshape(14, 2)
    return encode_page(RawPage(3, 42, samples * 1000, samples, -samples))


def test_any_flipped_bit_of_a_page_is_noticed() -> None:
    words = some_page()
    for position in range(PAGE_WORDS * 16):
        broken = list(words)
        broken[position // 16] ^= 1 << position % 16
        with pytest.raises(ValueError, match="CRC"):
            decode_page(broken)


def test_a_short_read_of_a_page_is_noticed() -> None:
    with pytest.raises(ValueError, match="CRC"):
        decode_page(some_page()[:-2])


gains = st.lists(f32, min_size=len(OFF), max_size=len(OFF)).map(AxisGains.of_numbers)


@given(gains, gains)
def test_gain_banks_round_trip(x: AxisGains, z: AxisGains) -> None:
    back = decode_gains(encode_gains({"z": z, "x": x}))
    assert [astuple(back[axis]) for axis in ("x", "z")] == [astuple(x), astuple(z)]


@pytest.mark.parametrize("group", ["active", "shadow", "gain_maximum"])
def test_banks_hold_the_gains_in_the_order_of_the_map(group: str) -> None:
    names = list(OFF)
    bank = {"z": AxisGains.of_numbers(range(len(names)))}
    words = dict(zip(addresses(bank_spans(group, axes="z")), encode_gains(bank), strict=True))
    for register in REGISTERS.values():
        if register.name.startswith(f"{group}.z."):
            field = register.name.rpartition(".")[2]
            own = [words[address] for address in addresses([span_of(register.name)])]
            for k, value in enumerate(decode_array(register.name, own, register.address)):
                entry = f"[{k}]" if register.count > 1 else ""
                stem, unit = names[int(value)].removesuffix(entry), ("", "_s", "_rad", "_rad_s")
                assert stem in [field + u for u in unit]


def test_signs_are_said_of_numbers_that_exist() -> None:
    assert OFF.keys() >= SIGNED | POSITIVE


def roundtrip(trajectory: Trajectory) -> Trajectory:
    base = REGISTERS["trajectory.kind"].address
    words = [0] * (PAGE_ADDRESS - base)
    for address, part in encode_trajectory(trajectory, 0.0025):
        words[address - base : address - base + len(part)] = part
    return decode_trajectory(words, base, 0.0025)


sines = st.builds(SineComponent, f32, f32, f32)
multisines = st.lists(sines, max_size=8).map(lambda parts: Multisine(tuple(parts)))
stairs = st.builds(Staircase, st.lists(f32, max_size=12).map(tuple), f32, f32)
samples = st.integers(1, 10**6)


@given(
    st.one_of(
        st.fixed_dictionaries({"x": multisines, "z": multisines}),
        st.fixed_dictionaries({"x": stairs, "z": stairs}),
    ),
    samples,
    samples,
)
def test_trajectories_round_trip(axes: dict[str, Multisine], capture: int, lead_in: int) -> None:
    sent = Trajectory(axes, capture * 0.0025, lead_in * 0.0025)
    back = roundtrip(sent)
    assert back.axes == sent.axes
    assert (back.duration_s, back.lead_in_s) == pytest.approx((sent.duration_s, sent.lead_in_s))


def test_the_papers_period_is_8742_samples() -> None:
    sine = Multisine((SineComponent(2 * math.pi, 0.2875, 0.0),))
    trajectory = Trajectory({"x": sine, "z": sine}, duration_s=2 * math.pi / 0.2875)
    _, header = encode_trajectory(trajectory, 0.0025)[0]
    base = REGISTERS["trajectory.kind"].address
    assert decode("trajectory.capture_samples", header, base) == 8742
    assert decode("trajectory.lead_in_samples", header, base) == 2000


def test_impossible_trajectories_are_refused() -> None:
    sine, stair = Multisine((SineComponent(1, 1, 0),)), Staircase((1.0,), 1.0, 1.0)
    with pytest.raises(ValueError, match="same kind"):
        encode_trajectory(Trajectory({"x": sine, "z": stair}, 1.0), 0.0025)  # type: ignore[dict-item]
    with pytest.raises(ValueError, match="axes x, z"):
        encode_trajectory(Trajectory({"x": sine}, 1.0), 0.0025)
    many = Multisine(sine.components * 9)
    with pytest.raises(ValueError, match="at most 8"):
        encode_trajectory(Trajectory({"x": many, "z": many}, 1.0), 0.0025)
