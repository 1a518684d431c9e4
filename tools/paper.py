"""The paper's tables and figures on our data: writes docs/paper.md and its pictures.

    python tools/paper.py                       everything, under three minutes on two cores
    python tools/paper.py --only images         one section; the others stay as they are
    python tools/paper.py --losses PAPER.csv IMPROVED.csv --network FILE.onnx

All numbers on the page come from the run that wrote it; all that is random is seeded.
"""

import os

# one thread, so that times compare methods and not numbers of threads; before numpy is loaded
os.environ["OMP_NUM_THREADS"] = os.environ["OPENBLAS_NUM_THREADS"] = "1"

import argparse
import sys
import time
from pathlib import Path
from typing import Final

from edge_ident.errors import EdgeIdentError
from edge_ident.estimation.manifest import BUILT_IN
from tools.paper_figures import convolutions, drives, images, kernels, losses, plane
from tools.paper_figures.page import Section, Sources, update

PAGE: Final = Path(__file__).parents[1] / "docs" / "paper.md"
SECTIONS: Final = {
    "drives": drives.section,
    "images": images.section,
    "kernels": kernels.section,
    "losses": losses.section,
    "convolutions": convolutions.section,
    "plane": plane.section,
}


def main() -> int:
    """Make the sections, each with a line of progress; 1 if one of them could not be made."""
    given = _arguments()
    sources = Sources(given.page.with_suffix(""), given.network, tuple(given.losses))
    sources.pictures.mkdir(parents=True, exist_ok=True)
    made: dict[str, Section] = {}
    chosen = given.only or list(SECTIONS)
    for number, name in enumerate(chosen, 1):
        print(f"{number}/{len(chosen)} {name} …", end=" ", file=sys.stderr, flush=True)
        began_s = time.perf_counter()
        try:
            made[name] = SECTIONS[name](sources)
        except EdgeIdentError as error:
            print(f"left as it was\n  {error.cause}\n  {error.next_step}", file=sys.stderr)
            continue
        print(f"{time.perf_counter() - began_s:.0f} s", file=sys.stderr)
    update(given.page, made, list(SECTIONS))
    print(given.page)
    return int(len(made) < len(chosen))


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--only", action="append", choices=list(SECTIONS), metavar="SECTION")
    parser.add_argument(
        "--network",
        type=Path,
        default=BUILT_IN.with_name(f"{BUILT_IN.stem}_fp32.onnx"),
        help="default: the package's",
    )
    pictures = PAGE.with_suffix("")
    parser.add_argument(
        "--losses",
        type=Path,
        nargs=2,
        metavar=("PAPER", "IMPROVED"),
        default=[pictures / "losses_paper.csv", pictures / "losses_improved.csv"],
        help="losses.csv of a training run of each configuration",
    )
    parser.add_argument("--page", type=Path, default=PAGE, help="default: docs/paper.md")
    return parser.parse_args()


if __name__ == "__main__":
    sys.exit(main())
