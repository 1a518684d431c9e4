"""How long one long recording takes."""

import time
from typing import Final

import numpy as np
from rich.console import Console

from edge_ident.diagnosis import diagnose as engine
from edge_ident.support.stopwatch import keep
from firmware_interface.plant import Noise, draw, draw_drives, multisine, simulate
from tools.diagnosis_benchmark.hiding import AXES, recording_of

SAMPLES: Final = 17_600
HIDDEN: Final = ("stribeck_friction", "torque_ripple")
SEED: Final = 500
REPEATS: Final = 5


def print_speed(console: Console) -> None:
    """Diagnose 44 s of two axes, both with the same two effects, as the command line does: in one
    thread that keeps its memory."""
    keep()
    motion = multisine(SAMPLES, seed=SEED)
    drives = draw_drives(1, SEED)
    effects = draw(HIDDEN, drives, motion, SEED, strength=0.8)
    made = simulate(drives, motion, effects=effects, noise=Noise(), seed=SEED)
    recording = recording_of(made, 0)
    times = []
    for _ in range(REPEATS):
        began_s = time.perf_counter()
        diagnosis = engine.diagnose([recording])
        times.append(time.perf_counter() - began_s)
    for name, axis in diagnosis.axes.items():
        named = ", ".join(cause.term.effect for cause in axis.causes)
        console.print(f"axis {name}: {axis.verdict}: {named or 'no cause'}")
    console.print(
        f"{SAMPLES} samples, {len(AXES)} axes: {np.median(times):.2f} s, the median of {REPEATS} "
        f"({', '.join(f'{t:.2f}' for t in times)})"
    )
