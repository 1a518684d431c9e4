"""How often the 95 % intervals that `identify` reports cover the truth.

Drives with random parameters that obey the base model, on every named motion, with the encoder
of 8400 counts and effort noise of many colours. Each figure comes with its own 95 % interval.
1/f noise is a case apart: it has no mean, so neither has the offset.

    python tools/interval_coverage.py                 the whole table
    python tools/interval_coverage.py --only sinusoid --drives 100
"""

import argparse
import math
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from itertools import repeat

import numpy as np
import scipy.signal
from numpy.typing import NDArray

from edge_ident.drive.description import load_drive
from edge_ident.drive.motions import named_trajectory
from edge_ident.identification.identify import identify
from edge_ident.model.model import NORMAL_95, PARAMETERS
from edge_ident.signals.recording import AxisRecord, Recording
from firmware_interface.motion import reference

Array = NDArray[np.float64]

PERIOD_S = 0.0025
SAMPLES = 8742
JERK_TIME_S = 0.08
"""A drive changes its acceleration over about this time; the staircase's reference jumps."""
LOWEST, HIGHEST = np.array([0.02, 0.1, 0.2, -0.5]), np.array([0.8, 2.0, 3.0, 0.5])
"""Range of the random parameters."""


@dataclass(frozen=True)
class Case:
    """One row of the table.

    Attributes
    ----------
    motion : str
        A named motion, or "quarter" for a quarter of the sinusoid's period.
    colour : str
        "white", "1/f", "resonance" (2 Hz, damping 0.1), or a correlation time such as "0.05 s".
    noise_share : float
        Effort noise over the rms effort.
    """

    motion: str
    colour: str
    noise_share: float = 0.05

    def __str__(self) -> str:
        return f"{self.motion:<10} {self.colour:<10} {self.noise_share:>6.1%}"


CASES = (
    *(Case("sinusoid", colour) for colour in ("white", "0.005 s", "0.02 s", "0.05 s", "0.1 s")),
    *(Case("sinusoid", colour) for colour in ("0.2 s", "0.5 s", "1 s", "resonance", "1/f")),
    *(Case("sinusoid", "0.1 s", share) for share in (0.005, 0.02, 0.1)),
    *(Case("multisine", colour) for colour in ("white", "0.05 s", "0.2 s", "0.5 s", "resonance")),
    *(Case("multisine", "0.1 s", share) for share in (0.005, 0.1)),
    *(Case("staircase", colour) for colour in ("white", "0.05 s", "0.2 s", "0.5 s", "resonance")),
    *(Case("staircase", "0.1 s", share) for share in (0.005, 0.1)),
    *(Case("quarter", colour) for colour in ("white", "0.02 s", "0.1 s")),
)


@dataclass(frozen=True)
class Outcome:
    """One drive: (4,) error and standard deviation of each parameter."""

    error: Array
    std: Array


def main() -> None:
    """Print a row for each case."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--drives", type=int, default=500)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", default="", help="cases whose line contains this")
    parser.add_argument("--processes", type=int, default=2)
    given = parser.parse_args()
    print("covered % (its interval), mean |z|, root of mean square of std over that of error")
    print(f"{'motion':<10} {'colour':<10} {'noise':>6}  " + "".join(f"{n:<29}" for n in PARAMETERS))
    with ProcessPoolExecutor(given.processes) as pool:
        for case in CASES:
            if given.only in str(case):
                seeds = [(given.seed, CASES.index(case), drive) for drive in range(given.drives)]
                found = pool.map(outcome, repeat(case), seeds, chunksize=10)
                print(row(case, [one for one in found if one is not None]), flush=True)


def row(case: Case, outcomes: list[Outcome]) -> str:
    """One line of the table; drives whose parameters the motion cannot tell apart do not count."""
    error, std = (np.array([getattr(o, name) for o in outcomes]) for name in ("error", "std"))
    score = np.abs(error) / std
    cells = []
    for covered, mean, ratio in zip(
        np.mean(score < NORMAL_95, axis=0),
        np.mean(score, axis=0),
        np.sqrt(np.mean(std**2, axis=0) / np.mean(error**2, axis=0)),
        strict=True,
    ):
        low, high = wilson(float(covered), len(outcomes))
        cells.append(f"{covered:5.1%} ({low:.0%}-{high:.0%}) {mean:4.2f} {ratio:5.2f}   ")
    return f"{case}  {''.join(cells)}{len(outcomes)} drives"


def wilson(share: float, count: int) -> tuple[float, float]:
    """Wilson's 95 % interval of a share."""
    z2 = NORMAL_95**2 / count
    middle = (share + 0.5 * z2) / (1.0 + z2)
    half = math.sqrt(share * (1.0 - share) * z2 + 0.25 * z2**2) / (1.0 + z2)
    return middle - half, middle + half


def outcome(case: Case, seed: tuple[int, ...]) -> Outcome | None:
    """Simulate and identify one drive; None if the motion cannot tell its parameters apart."""
    rng = np.random.default_rng(seed)
    truth = rng.uniform(LOWEST, HIGHEST)
    time_s, position, columns = move(case.motion, rng)
    effort = columns @ truth
    effort = effort + case.noise_share * np.sqrt(np.mean(effort**2)) * noise(
        case.colour, len(effort), rng
    )
    count = load_drive().axes["x"].encoder_resolution_rad
    counted = count * np.round(position / count + rng.uniform())
    recording = Recording(time_s, {"x": AxisRecord(counted, effort, "rad", "N*m")}, "simulated")
    found = identify(recording, None, diagnose=False).axes["x"]
    if any(finding.code == "inseparable" for finding in found.findings):
        return None
    return Outcome(found.estimate.parameters - truth, found.estimate.std)


def move(name: str, rng: np.random.Generator) -> tuple[Array, Array, Array]:
    """Time, position and regressor of a motion from a random phase on, unfiltered."""
    drive = load_drive()
    trajectory = named_trajectory(drive, "sinusoid" if name == "quarter" else name)  # type: ignore[arg-type]
    motion = trajectory.axes[str(rng.choice(sorted(trajectory.axes)))]
    samples = round(trajectory.duration_s / PERIOD_S) if name == "staircase" else SAMPLES
    samples = samples // 4 if name == "quarter" else samples
    time_s = np.asarray(PERIOD_S * np.arange(samples), dtype=np.float64)
    longest = PERIOD_S if name == "staircase" else 2.0 * math.pi / drive.angular_frequency_rad_s
    start_s = rng.uniform(0.0, longest)
    offsets = JERK_TIME_S * np.linspace(-0.5, 0.5, 21) if name == "staircase" else np.zeros(1)
    moves = [reference(motion, time_s + start_s + off, 1.0, 0.0) for off in offsets]
    position, velocity, acceleration = (
        np.asarray(np.mean([getattr(step, part) for step in moves], axis=0))
        for part in ("position_rad", "velocity_rad_s", "acceleration_rad_s2")
    )
    ones = np.ones_like(velocity)
    columns: Array = np.column_stack([acceleration, velocity, np.sign(velocity), ones])
    return time_s, position, columns


def noise(colour: str, samples: int, rng: np.random.Generator) -> Array:
    """Stationary noise of unit variance."""
    if colour == "white":
        return rng.normal(size=samples)
    if colour == "1/f":
        # a record many times as long, so that there is power below the record's own frequency
        frequency = np.fft.rfftfreq(8 * samples)
        frequency[0] = np.inf
        spectrum = rng.normal(size=(2, len(frequency)))
        made = np.fft.irfft((spectrum[0] + 1j * spectrum[1]) / np.sqrt(frequency), 8 * samples)
        return np.asarray(made[:samples] / np.std(made))
    if colour == "resonance":
        turn = 2.0 * math.pi * 2.0 * PERIOD_S
        poles = math.exp(-0.1 * turn) * np.exp(1j * turn * np.array([1.0, -1.0]))
        denominator = np.real(np.poly(poles))
    else:
        denominator = np.array([1.0, -math.exp(-PERIOD_S / float(colour.removesuffix(" s")))])
    response = np.abs(scipy.signal.freqz([1.0], denominator, 2**15)[1]) ** 2
    transient = 6000
    white = rng.normal(size=samples + transient) / math.sqrt(float(np.mean(response)))
    return np.asarray(scipy.signal.lfilter([1.0], denominator, white)[transient:])


if __name__ == "__main__":
    main()
