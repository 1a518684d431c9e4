"""Stretches of consecutive registers, and the transfers that carry them."""

from collections.abc import Callable, Iterable, Iterator
from typing import Final

Span = tuple[int, int]
"""Address of the first of consecutive registers, and how many they are."""

READ_WORDS: Final = 124
WRITTEN_WORDS: Final = 122
"""Whole values in one transfer: Modbus reads at most 125 registers and writes at most 123."""


def addresses(spans: Iterable[Span]) -> Iterator[int]:
    """Addresses of all words, in their order."""
    for address, count in spans:
        yield from range(address, address + count)


def transfers(spans: Iterable[Span], longest: int) -> Iterator[Span]:
    """Words in as few transfers as it takes, by address.

    Of the transfers of one stretch, the shorter one comes second: of two reads of one length in a
    row, a late reply to the first could pass for the second, so the link puts another in between.
    """
    ordered = sorted(addresses(spans))
    breaks = [n for n in range(1, len(ordered)) if ordered[n] != ordered[n - 1] + 1]
    for first, last in zip([0, *breaks], [*breaks, len(ordered)], strict=True):
        full, rest = divmod(last - first, longest)
        counts = [longest] * full
        counts[1:1] = [rest] if rest else []
        for count in counts:
            yield ordered[first], count
            first += count


def read_spans(read: Callable[[int, int], list[int]], spans: Iterable[Span]) -> dict[int, int]:
    """Words by their address."""
    return {
        first + n: word
        for first, count in transfers(spans, READ_WORDS)
        for n, word in enumerate(read(first, count))
    }
