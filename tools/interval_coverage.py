"""How often nominal 95 % intervals of least squares cover the truth, under coloured noise.

Ideal drives on the paper's motion at random phases, encoder of 8400 counts, effort noise of
0.1 N*m with different correlation times.

    python tools/interval_coverage.py --drives 200
"""

import argparse

import numpy as np
import scipy.signal
from numpy.typing import NDArray

from edge_ident import least_squares
from edge_ident.model import PARAMETERS
from edge_ident.signals import condition

PERIOD_S = 0.0025
SAMPLES = 8742
RATE_RAD_S = 0.2875
COUNT_RAD = 2 * np.pi / 8400
TRUTH = np.array([0.43, 0.9, 1.4, 0.05])
NOISE_NM = 0.1
SETTLING = 4000


def coverage(correlation_s: float, drives: int, seed: int) -> NDArray[np.float64]:
    """Share of drives whose interval covers the truth, by parameter."""
    rng = np.random.default_rng(seed)
    pole = max(0.0, 1.0 - PERIOD_S / correlation_s) if correlation_s else 0.0
    time = PERIOD_S * np.arange(SAMPLES)
    covered = np.zeros(len(TRUTH))
    for _ in range(drives):
        angle = RATE_RAD_S * time + rng.uniform(0.0, 2 * np.pi)
        position = 2 * np.pi * np.sin(angle)
        velocity = 2 * np.pi * RATE_RAD_S * np.cos(angle)
        white = rng.normal(size=SAMPLES + SETTLING)
        noise = scipy.signal.lfilter([np.sqrt(1.0 - pole**2)], [1.0, -pole], white)[SETTLING:]
        effort = TRUTH[0] * -(RATE_RAD_S**2) * position + TRUTH[1] * velocity
        effort += TRUTH[2] * np.sign(velocity) + TRUTH[3] + NOISE_NM * noise
        counted = COUNT_RAD * np.round(position / COUNT_RAD)
        found = least_squares.fit(condition(time, counted, effort))
        covered += np.abs(found.parameters - TRUTH) < 1.96 * found.std
    return covered / drives


def main() -> None:
    """Print a row for each correlation time."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--drives", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    print("correlation s  " + "  ".join(f"{name:>16}" for name in PARAMETERS))
    for correlation_s in (0.0, 0.05, 0.5):
        shares = coverage(correlation_s, given.drives, given.seed)
        print(f"{correlation_s:13}  " + "  ".join(f"{share:16.1%}" for share in shares))


if __name__ == "__main__":
    main()
