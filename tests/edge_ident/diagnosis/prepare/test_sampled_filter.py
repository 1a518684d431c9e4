"""The filter at a few samples is the filter of the whole record, looked at there."""

import numpy as np
import pytest

from edge_ident.diagnosis.prepare.sampled import SampledFilter

SAMPLES = 400


@pytest.mark.parametrize("reach", [3, 40, SAMPLES - 1])
@pytest.mark.parametrize("shape", [(), (1,), (3,), (2, 4)])
def test_it_is_a_convolution_of_the_weighted_and_reflected_record(
    reach: int, shape: tuple[int, ...]
) -> None:
    rng = np.random.default_rng(5)
    half = rng.normal(size=reach + 1)
    response = np.concatenate([half[:0:-1], half])
    weight = rng.uniform(0.0, 1.0, SAMPLES)
    # neighbours, a long gap, and both ends
    at = np.concatenate([np.arange(0, 90, 3), [200], np.arange(330, SAMPLES)])
    signals = rng.normal(size=(*shape, SAMPLES))
    sides = [(0, 0)] * len(shape) + [(reach, reach)]
    reflected = np.pad(weight * signals, sides, mode="reflect")
    windows = np.lib.stride_tricks.sliding_window_view(reflected, len(response), axis=-1)
    found = SampledFilter.of(response, at, weight)(signals)
    assert found.shape == (*shape, len(at))
    np.testing.assert_allclose(found, (windows @ response)[..., at], rtol=0, atol=1e-9)


def test_where_no_sample_is_wanted_there_is_none() -> None:
    """Of a part of a recording whose motion reverses all the time."""
    none = np.empty(0, dtype=np.intp)
    found = SampledFilter.of(np.ones(7), none, np.ones(SAMPLES))(np.ones((2, SAMPLES)))
    assert found.shape == (2, 0)
