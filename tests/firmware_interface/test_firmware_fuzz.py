"""The C firmware under what a fuzzer found, and under every sequence of operations.

`python -m tools.fuzz` searches on; `simulated/fuzz_invariants.c` says what must hold.
"""

import os
import re
import subprocess
from pathlib import Path

import pytest

from tests.repetitions import a_few
from tools.fuzz import CORPUS, SHARES

LARGEST_CORPUS_BYTES = 120_000


def replayed(firmware: Path, target: str) -> list[int]:
    """Run the kept inputs of a target; gives the numbers that the program tells."""
    inputs = sorted((CORPUS / target).iterdir())
    ran = subprocess.run(
        [firmware / "fuzz", *inputs],
        env={**os.environ, "FUZZ_TARGET": target},
        capture_output=True,
        text=True,
        check=False,
    )
    assert ran.returncode == 0, ran.stderr
    count, *numbers = (int(number) for number in re.findall(r"\d+", ran.stdout))
    assert count == len(inputs) > 5
    return numbers


@pytest.mark.parametrize("target", ["frames", "store", "values"])
def test_no_input_that_a_fuzzer_kept_breaks_anything(firmware: Path, target: str) -> None:
    """Sanitizers watch; `store` looks at the gains in force, and `values` at motions any number."""
    _, _, replies, exceptions, *_ = replayed(firmware, target)
    assert replies > exceptions


def test_whatever_a_host_plays_nothing_moves_unasked(firmware: Path) -> None:
    """And the inputs do get there: into motions, faults, and exchanges of gains."""
    numbers = replayed(firmware, "plays")
    _, _, replies, exceptions, enabled, outside, starts, exchanges, *samples = numbers
    assert replies > exceptions > 20
    assert min(enabled, starts) > 30
    assert min(outside, exchanges) > 3
    assert len(samples) == 3
    assert min(samples) > 1_000


def test_the_corpus_is_small() -> None:
    assert {folder.name for folder in CORPUS.iterdir()} == set(SHARES)
    assert sum(file.stat().st_size for file in CORPUS.rglob("*")) < LARGEST_CORPUS_BYTES


@pytest.mark.parametrize("depth", a_few(["4", "7"], ["4"]))
def test_no_sequence_of_operations_breaks_anything(firmware: Path, depth: str) -> None:
    """Every one of so many operations, as `simulated/explore.c` lists them; each state is met."""
    command = [firmware.parent / "explore", depth]
    ran = subprocess.run(command, capture_output=True, text=True, check=False)
    assert ran.returncode == 0, ran.stderr
    *_, found = ran.stdout.split(";")[:2]
    situations = [int(number) for number in re.findall(r"\d+", found)]
    assert len(situations) == 9
    assert min(situations) > 0
