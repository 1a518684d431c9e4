"""Efforts whose numbers hold their sign in another way than a minus, or have lost it.

A drive sends its effort as a word of some bits, and a recorder may take the word for a number
without a sign. What it writes then jumps by a whole word where the effort changes its sign. So the
encoding is found by trying: the right one turns a course that jumps into one that does not.
"""

from collections.abc import Callable, Mapping
from functools import partial
from typing import Final

import numpy as np

from edge_ident.errors import DataError
from edge_ident.signals.conditioning import Array, condition, unit_length
from edge_ident.signals.contract_columns import EFFORTS, parse_name
from edge_ident.signals.metrics import relative_residual

_BITS: Final = (8, 12, 16, 24, 32)  # of the words that drives send
_SIGN_MAGNITUDE: Final = "sign-magnitude"
OPPOSITE: Final = "opposite"
"""It counts against the position."""
_ROUNDING: Final = 1e-9  # rounding of a number that a file states, as a share of it
_SAME: Final = 1e-12  # the same of a number in memory: a step of a 32-bit word is larger
_DECIMALS: Final = 10  # decimals of a file that are looked at
# What decoding must leave of the mean square of the steps from sample to sample.
_JUMPS: Final = 0.5
# The same over the variance of the decoded effort; that of white noise is 2. An effort that is
# switched between two levels is noise when its levels are put over each other.
_SMOOTH: Final = 1.0
# Different values of either sign: an effort of fewer levels is a command that is switched.
_FEWEST_LEVELS: Final = 8
# Residual that the base model may leave of a magnitude; of the numbers as they stand it leaves more
# than twice as much.
_LEFT: Final = 0.3
# Lowest value over the highest, up to which an effort of one sign reaches zero.
_NEAR_ZERO: Final = 0.1
_ROUNDS: Final = 30
_TINY: Final = float(np.finfo(float).tiny)


def find_encoding(effort: Array) -> str | None:
    """The name of the encoding in which an effort (N,) was written, None where it has a sign.

    Parameters
    ----------
    effort : (N,) array
        In any unit: a word is a power of two of the smallest step between its values.
    """
    if len(effort) < 2 or not np.all(np.isfinite(effort)) or np.min(effort) < 0.0:
        return None
    roughness = {name: _roughness(effort, decode(effort, name)) for name in _possible(effort)}
    best = min(roughness, key=lambda name: roughness[name], default="")
    return best if best and roughness[best] < _JUMPS else None


def decode(effort: Array, encoding: str) -> Array:
    """An effort (N,) with its sign; one that has negative values is returned as it is, but for an
    opposite sign.

    Raises
    ------
    DataError
        There is no such encoding.
    """
    if encoding not in (*ENCODINGS, OPPOSITE):
        raise DataError(
            f"--effort-encoding {encoding}: there is no such encoding",
            f"give one of {', '.join((*ENCODINGS, OPPOSITE))}",
        )
    if encoding == OPPOSITE:
        return -effort
    known = ~np.isnan(effort)
    if not np.any(known) or np.min(effort, where=known, initial=np.inf) < 0.0:
        return effort
    decoded = effort.copy()
    decoded[known] = ENCODINGS[encoding](effort[known])
    return decoded


def encoding_sentence(name: str, effort: Array, encoding: str) -> str:
    """How an effort (N,) of this name in the contract shows its encoding, in words."""
    jump = float(np.max(np.abs(np.diff(effort))))
    what = (
        f"the sign is the bit of {_sign_bit(effort):.6g}"
        if encoding == _SIGN_MAGNITUDE
        else f"negative values were read without their sign, as {encoding}"
    )
    return f"{name} is never negative and jumps by {jump:.6g}: {what}"


def is_effort(target: str | None) -> bool:
    """Whether a name of the contract, or None, is that of an effort."""
    parsed = parse_name(target or "")
    return parsed is not None and parsed[1] in EFFORTS


def check_magnitude(where: str, time_s: Array, position: Array, effort: Array) -> None:
    """Refuse an effort that is the magnitude of one: nothing in it says which way it pushes.

    Raises
    ------
    DataError
    """
    lowest, highest = float(np.min(effort)), float(np.max(effort))
    if lowest < 0.0 or lowest > _NEAR_ZERO * highest:
        return
    signals = condition(time_s, position, effort)
    columns, _ = unit_length(signals.regressor)
    as_given = _left(columns, signals.effort, np.ones(len(columns)))
    magnitude = min(
        _left_by_magnitude(columns, signals.effort, np.sign(start))
        for start in (columns[:, 0], columns[:, 1], columns[:, 0] + columns[:, 1])
    )
    if magnitude < _LEFT and as_given > 2.0 * magnitude:
        raise DataError(
            f"{where}: only the magnitude of the effort was recorded, and its sign is lost: it is "
            f"never negative, and fits the motion as a magnitude ({magnitude:.0%} of it is left; "
            f"as it stands, {as_given:.0%})",
            "record the effort with its sign: most drives have a signed torque or current value "
            "beside the absolute one",
        )


def _possible(effort: Array) -> list[str]:
    """Encodings whose word fits the numbers of an effort (N,)."""
    fits = [f"uint{bits}" for bits in _BITS if _word(effort, bits)]
    return [*fits, *([_SIGN_MAGNITUDE] if _sign_bit(effort) else [])]


def _roughness(effort: Array, decoded: Array) -> float:
    """Steps of a decoded effort over those of the effort as it stands, squared and averaged;
    infinite where the decoded one is no course of an effort, which goes through zero."""
    steps = float(np.mean(np.diff(decoded) ** 2))
    sides = [np.unique(np.abs(decoded[side])) for side in (decoded < 0.0, decoded > 0.0)]
    if min(map(len, sides)) < _FEWEST_LEVELS or steps > _SMOOTH * float(np.var(decoded)):
        return np.inf
    if any(side[0] > _NEAR_ZERO * side[-1] for side in sides):
        return np.inf
    return steps / max(float(np.mean(np.diff(effort) ** 2)), _TINY)


def _from_complement(effort: Array, bits: int) -> Array:
    """Two's complement: the upper half of the word is negative."""
    word = _word(effort, bits) or 2.0**bits * _steps(effort)[-1]
    return np.where(effort >= 0.5 * word, effort - word, effort)


def _word(effort: Array, bits: int) -> float:
    """Value of a whole word of so many bits, 0 where the highest value is not in its upper half."""
    highest = float(np.max(effort))
    words = [2.0**bits * step for step in _steps(effort)]
    return next((word for word in words if 0.5 * word <= highest < word), 0.0)


def _from_sign_magnitude(effort: Array) -> Array:
    """The highest bit that occurs is the sign."""
    bit = _sign_bit(effort)
    return _without_bit(effort, bit) if bit else effort


def _without_bit(effort: Array, bit: float) -> Array:
    return np.where(effort >= (1.0 - _ROUNDING) * bit, bit - effort, effort)


def _sign_bit(effort: Array) -> float:
    """Value of the highest bit that occurs, right above which values lie; 0 where there is none.

    It is a power of two of a step. Of several steps, that counts which leaves the smoothest effort.
    """
    highest, ordered, bits = float(np.max(effort)), np.unique(effort), []
    for step in _steps(effort):
        bit = step * 2.0 ** np.floor(np.log2(max(highest / step, 1.0) * (1.0 + _ROUNDING)))
        above = ordered[np.searchsorted(ordered, (1.0 - _ROUNDING) * bit) :]
        if len(above) and above[0] - bit <= _NEAR_ZERO * (above[-1] - bit):
            bits.append(float(bit))
    rough = [float(np.sum(np.diff(_without_bit(effort, bit)) ** 2)) for bit in bits]
    return bits[int(np.argmin(rough))] if bits else 0.0


def _steps(effort: Array) -> tuple[float, ...]:
    """Steps that all values of an effort (N,) may be whole numbers of: the smallest between two of
    them, as all tell it, and the last decimal; the coarser first."""
    ordered = np.unique(effort)
    apart = np.diff(ordered)
    apart = apart[apart > _SAME * ordered[-1]]
    step = float(np.min(apart, initial=np.inf))
    if not np.isfinite(step):
        return (1.0,)
    reach = 10.0 * step
    while reach < 10.0 * ordered[-1]:  # the more of them, the better they tell one
        near = ordered[(ordered > 0.0) & (ordered <= reach)]
        counts = np.rint(near / step)
        step = float(near @ counts) / float(counts @ counts) if np.any(counts) else step
        reach *= 10.0
    decimals = (10.0**-k for k in range(_DECIMALS))
    decimal = next((d for d in decimals if _are_whole(ordered / d)), step)
    return tuple(sorted({step, decimal}, reverse=True))


def _are_whole(values: Array) -> bool:
    return bool(np.all(np.abs(values - np.rint(values)) <= 1e-6 * np.maximum(values, 1.0)))


def _left_by_magnitude(columns: Array, magnitude: Array, signs: Array) -> float:
    """What the base model leaves of a magnitude (N,) with the signs (N,) that fit it best."""
    for _ in range(_ROUNDS):
        fitted = columns @ np.linalg.lstsq(columns, signs * magnitude, rcond=None)[0]
        changed, signs = signs, np.sign(fitted)
        if np.array_equal(changed, signs):
            break
    return _left(columns, magnitude, signs)


def _left(columns: Array, effort: Array, signs: Array) -> float:
    """Residual of the base model over the rms of an effort (N,) of these signs (N,)."""
    signed = signs * effort
    return relative_residual(signed, columns @ np.linalg.lstsq(columns, signed, rcond=None)[0])


ENCODINGS: Final[Mapping[str, Callable[[Array], Array]]] = {
    **{f"uint{bits}": partial(_from_complement, bits=bits) for bits in _BITS},
    _SIGN_MAGNITUDE: _from_sign_magnitude,
}
"""By its name, what gives the numbers of an encoding their sign."""
