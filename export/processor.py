"""Where a training run computes: the torch device, and the number of threads on a processor."""

import logging
import os
import time
from typing import Final

import torch

from edge_ident.errors import ModelError
from edge_ident.signals.metrics import POINTS
from export.network import ResidualNetwork

log = logging.getLogger(__name__)

# Where it is set, torch uses that many threads, and nothing is measured.
_VARIABLE: Final = "OMP_NUM_THREADS"
_EXAMPLES: Final = 64
# Steps of each measurement; the fastest counts: other programs only slow a step down.
_STEPS: Final = 3
_GAIN: Final = 0.8  # a larger number of threads has to take at most this part of the time


def checked_device(accelerator: str | None) -> str:
    """The torch device to train on; None is a GPU if there is one, else the processor.

    Raises
    ------
    ModelError
        If torch cannot compute there.
    """
    if accelerator is None:
        return "cuda" if torch.cuda.is_available() else "cpu"
    try:
        float(torch.ones(1, device=accelerator).sum())
    except (RuntimeError, AssertionError, NotImplementedError) as error:
        first_line = str(error).splitlines()[0]
        raise ModelError(
            f"--accelerator {accelerator}: torch cannot use this device ({first_line})",
            "use --accelerator cpu, or install a torch build for your GPU",
        ) from error
    return accelerator


def set_fastest_threads() -> int:
    """Measure how many threads train fastest, and set torch to that number.

    On a shared machine torch's default, a thread for every core, can be many times slower than
    one thread: the threads of a step wait for the slowest of them.

    Returns
    -------
    int
        Number of threads.
    """
    if os.environ.get(_VARIABLE):
        return torch.get_num_threads()
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    chosen, best_s, count = 1, _step_s(1), 2
    while count <= (cores or 1):
        taken_s = _step_s(count)
        if taken_s < _GAIN * best_s:
            chosen, best_s = count, taken_s
        count *= 2
    torch.set_num_threads(chosen)
    log.info("training with %d threads, the fastest of those measured", chosen)
    return chosen


def _step_s(threads: int) -> float:
    """Shortest time of a forward and backward pass with this number of threads."""
    torch.set_num_threads(threads)
    with torch.random.fork_rng(devices=[]):
        network = ResidualNetwork(POINTS)
        efforts = torch.rand(2, _EXAMPLES, POINTS)
        factors = (efforts[0], efforts[1], torch.zeros(_EXAMPLES))
    times_s = []
    for _ in range(_STEPS):
        began_s = time.perf_counter()
        total = network.residuals(*factors).sum()
        total.backward()  # type: ignore[no-untyped-call]
        times_s.append(time.perf_counter() - began_s)
    return min(times_s)
