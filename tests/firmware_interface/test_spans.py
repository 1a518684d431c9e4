"""Stretches of registers, cut into transfers."""

from itertools import pairwise

import pytest

from firmware_interface.codec import READ_WORDS, WRITTEN_WORDS, addresses, transfers
from firmware_interface.gains import bank_spans, span_of


@pytest.mark.parametrize("longest", [READ_WORDS, WRITTEN_WORDS])
@pytest.mark.parametrize("group", ["active", "shadow"])
def test_every_word_of_a_bank_travels_once(group: str, longest: int) -> None:
    spans = [*bank_spans(group), span_of(f"{group}.crc")]
    parts = list(transfers(spans, longest))
    assert list(addresses(parts)) == sorted(addresses(spans))
    assert max(count for _, count in parts) <= longest


@pytest.mark.parametrize("group", ["active", "shadow"])
def test_no_two_reads_of_a_bank_in_a_row_are_of_one_length(group: str) -> None:
    """The link would put another between them."""
    parts = list(transfers([*bank_spans(group), span_of(f"{group}.crc")], READ_WORDS))
    assert len(parts) == 4
    assert all(first[1] != second[1] for first, second in pairwise(parts))
