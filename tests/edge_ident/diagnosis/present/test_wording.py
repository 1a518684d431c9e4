"""What a diagnosis says of the shift between effort and motion."""

import pytest

from edge_ident.diagnosis.present.wording import timing_sentence
from edge_ident.model.timing import EVEN_SHIFT, NO_SHIFT, Timing


@pytest.mark.parametrize(
    ("timing", "said"),
    [
        (Timing(0.00125, 0.5, 0.02), "late by 0.50 ± 0.02 samples (1.25 ms)"),
        (Timing(-0.00125, -0.5, 0.02), "early by 0.50"),
        (Timing(-1e-6, -4e-4, 0.006), "in step with the motion, ± 0.006 samples"),
        (Timing(0.0, 0.0, EVEN_SHIFT), "does not show"),
        (NO_SHIFT, "the delay in the model"),
    ],
)
def test_the_shift_is_said_in_words(timing: Timing, said: str) -> None:
    assert said in timing_sentence(timing)
