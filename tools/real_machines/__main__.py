"""What a diagnosis of one recording is worth on another recording of the same machine.

Every model is fitted to one recording of a pair and scored on the other, both ways round. The
score is the relative residual of base and extended model under the same physical bounds, on the
same samples, with the offset refitted and without what is tied to the clock of one recording. The
extension harms where it leaves more than 1.02 times what the base model leaves. Nothing that
`diagnose` itself says about a second recording enters.

    python -m tools.real_machines                     the folder in EDGE_IDENT_DATA
    python -m tools.real_machines FOLDER --only emps,lift
    python -m tools.real_machines --pair FIRST SECOND
    python -m tools.real_machines --read SCORES       the tables of a former run
    python -m tools.real_machines --compare OLD NEW   two of these, case by case; 1 for a loss

A file `NAME_second` belongs to `NAME` or to `NAME_first`. A file without such a partner is cut in
half. Halves of a motion that repeats are the same data: only another motion is a test.
"""

import os

# one thread for each process; before numpy is loaded
os.environ["OMP_NUM_THREADS"] = os.environ["OPENBLAS_NUM_THREADS"] = "1"

import argparse
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Final

from rich.console import Console

from tools.real_machines.pairs import Pair, pair_of, pairs_in
from tools.real_machines.scores import Score, kept_scores
from tools.real_machines.tables import compare_scores, print_scores

# Scores of the last run; git ignores it.
_OUTPUT: Final = Path(__file__).parents[2] / "runs" / "real_machines" / "scores.jsonl"


def main() -> int:
    """Score the pairs and print the tables; 1 for a loss."""
    given = _arguments()
    console = Console(width=180, highlight=False)
    if given.read:
        print_scores(_read(given.read), console)
        return 0
    if given.compare:
        old, new = map(_read, given.compare)
        return compare_scores(old, new, console)
    pairs = _pairs(given.folder, given.pair)
    wanted = [p for p in pairs if not given.only or any(n in p.name for n in given.only)]
    runs = (direction for pair in wanted for direction in pair.directions)
    print_scores(kept_scores(runs, given.output), console)
    console.print(f"every score: {given.output}")
    return 0


def _read(path: Path) -> list[Score]:
    return [Score.read(line) for line in path.read_text("utf-8").splitlines()]


def _pairs(folder: Path, pair: Sequence[Path] | None) -> Iterator[Pair]:
    if pair is None:
        yield from pairs_in(folder)
        return
    made = pair_of(*pair)
    if made is None:
        raise SystemExit("the two recordings have other axes or other units")
    yield made


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "folder", nargs="?", type=Path, default=os.environ.get("EDGE_IDENT_DATA"), help="recordings"
    )
    parser.add_argument("--only", type=lambda text: text.split(","), metavar="A,B")
    parser.add_argument("--pair", type=Path, nargs=2, metavar=("FIRST", "SECOND"))
    parser.add_argument("--read", type=Path, metavar="SCORES", help="print its tables again")
    parser.add_argument("--compare", type=Path, nargs=2, metavar=("OLD", "NEW"))
    parser.add_argument("--output", type=Path, default=_OUTPUT)
    given = parser.parse_args()
    if not any((given.folder, given.pair, given.read, given.compare)):
        parser.error("name a folder of recordings, or set EDGE_IDENT_DATA")
    return given


if __name__ == "__main__":
    sys.exit(main())
