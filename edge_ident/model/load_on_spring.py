"""The lag of a load on a spring, with dry friction of its own, along a given motion.

Between samples the drive of the lag is straight and its dry friction constant, so each step is
exact. All sets of values are computed side by side, time first.
"""

from itertools import pairwise
from typing import Final

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

_LEAST_MOBILITY: Final = 1e-9
"""Over the whole response. A load that rings or settles within a sample is stopped by friction of
the motion's direction; the response at the end of the sample alone would say the opposite."""
_BLOCK: Final = 64
"""Samples that are computed at once."""
_CACHED: Final = 8192
"""Numbers that are multiplied at once, in a processor's cache."""
_STEPS: Final = 8
"""Samples that are computed one by one where friction changes."""


def lag_states(
    pole: Complex, load: Array, velocity: Array, most: Array, period_s: float
) -> tuple[Complex, Complex]:
    """States of a lag d that obeys u' = pole·u + load + friction, for u = d' - conj(pole)·d.

    Dry friction is constant over a sample: what stops the load at its end, or all there is.
    Friction reaches the motion through a linear filter. So the sequence of friction is found first,
    beside the motion that there would be without it.

    Parameters
    ----------
    pole : (D, 1) array of complex
        Of the load with the encoder's side held, in 1/s.
    load : (D, N) array
        Acceleration that drives the lag, but for dry friction.
    velocity : (N,) array
        Of the encoder's side.
    most : (D, 1) array
        Largest deceleration of the load by dry friction.
    period_s : float

    Returns
    -------
    states : (N, D) array of complex
        From the steady lag on, in units of the response.
    response : (D, 1) array of complex
        u at the end of a sample, from rest, to an acceleration of one.
    """
    step = pole * period_s
    decay = np.exp(step)
    # response to a load that rises to one, and one that falls from it, over a sample
    rising = (decay - 1.0 - step) / (pole * step)
    falling = (decay - 1.0) / pole - rising
    response = rising + falling  # to friction
    lean = pole.real / pole.imag
    mobility = response.real + lean * response.imag
    mobility = np.maximum(mobility, _LEAST_MOBILITY * np.abs(response))
    # the real part of a product with it: what stops the load
    stopped = (1.0 - 1j * lean) / mobility * response
    start = -(load[..., :1] + most * np.sign(velocity[..., :1])) / (pole * response)
    decays, gain, limit, stops, free, before, now, first = (
        np.broadcast_to(x, load[..., :1].shape).ravel()
        for x in (
            decay, stopped * decay, most, stopped, mobility, falling / response, rising / response,
            start,
        )
    )  # fmt: skip
    # time first: a step reads and writes what lies together
    load = np.ascontiguousarray(load.reshape(-1, load.shape[-1]).T)
    added = np.empty(load.shape, dtype=np.complex128)
    added[0] = first
    parts = (added.real, before.real, now.real), (added.imag, before.imag, now.imag)
    for part, earlier, later in parts:
        np.multiply(load[1:], later, out=part[1:])
        part[1:] += load[:-1] * earlier
    wanted = velocity[..., 1:].reshape(-1, len(load) - 1).T / free - real_product(added[1:], stops)
    wanted -= real_product(_filtered(added, decays)[:-1], gain)
    added.real[1:] += _friction(wanted, decays, gain, limit)
    return _filtered(added, decays), response


def real_product(states: Complex, factor: Complex) -> Array:
    """Real part of products of states (N, D) with a factor (D,) each, a few samples at once."""
    product, count = np.empty(states.shape), max(1, _CACHED // len(factor))
    for first in range(0, len(states), count):
        part, found = states[first : first + count], product[first : first + count]
        np.multiply(part.real, factor.real, out=found)
        found -= part.imag * factor.imag
    return product


def _filtered(added: Complex, decay: Complex) -> Complex:
    """States (N, D) that decay from one sample to the next, where (N, D) is added.

    Blocks of samples are filtered side by side, and then what each begins with is added.
    """
    count = -(-len(added) // _BLOCK)
    states = np.zeros((count, _BLOCK, len(decay)), dtype=np.complex128)
    states.reshape(-1, len(decay))[: len(added)] = added
    left = np.empty((count, len(decay)), dtype=np.complex128)
    for k in range(1, _BLOCK):
        states[:, k] += np.multiply(decay, states[:, k - 1], out=left)
    powers = decay ** np.arange(1, _BLOCK + 1)[:, None]
    for before, block in pairwise(states):
        block += powers * before[-1]
    return states.reshape(-1, len(decay))[: len(added)]


def _friction(wanted: Array, decay: Complex, gain: Complex, most: Array) -> Array:
    """Dry friction (N, D) on loads, sample by sample.

    While friction keeps its sign and size on all of them, its effect is known in closed form.

    Parameters
    ----------
    wanted : (N, D) array
        Friction that would stop the load if there had been none before.
    decay, gain : (D,) arrays
        What friction of one leaves at the next sample, and the friction that this asks for there.
    most : (D,) array
    """
    friction, state = np.empty_like(wanted), np.zeros_like(decay)
    powers = decay ** np.arange(_BLOCK + 1)[:, None]
    shares = gain * powers[:-1]
    cosine, sine = shares.real.copy(), shares.imag.copy()
    least, left, k = -most, 1.0 / (1.0 - decay), 0
    while k < len(wanted):
        for target, now in zip(wanted[k : k + _STEPS], friction[k : k + _STEPS], strict=True):
            stopping = target - (gain * state).real
            np.minimum(np.maximum(stopping, least), most, out=now)
            state = decay * state + now
        k += _STEPS
        if (np.abs(stopping) >= most).all():
            steady = left * now
            off = state - steady
            ahead = wanted[k : k + _BLOCK]
            stopping = ahead - (gain * steady).real - cosine[: len(ahead)] * off.real
            stopping += sine[: len(ahead)] * off.imag
            kept = np.minimum(np.maximum(stopping, least), most) == now
            same = np.append(kept.all(axis=1), False)
            count = int(same.argmin())
            friction[k : k + count] = now
            state = steady + powers[count] * off
            k += count
    return friction
