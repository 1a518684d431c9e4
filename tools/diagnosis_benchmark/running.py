"""Diagnoses cases in several processes."""

import multiprocessing
import signal
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import Self, TypeVar

from rich.console import Console
from rich.progress import track

from edge_ident.diagnosis import diagnose as engine
from tools.diagnosis_benchmark.cases import CLEAN, SINGLE, Batch, Case
from tools.diagnosis_benchmark.hiding import load_batch, simulate_batch
from tools.diagnosis_benchmark.outcome import TOLERANCE, Outcome, judge, unjudged

Given = TypeVar("Given")
Made = TypeVar("Made")


class Workers:
    """Processes that simulate and diagnose; an interrupt ends them at once."""

    def __init__(self, jobs: int) -> None:
        self._pool = multiprocessing.get_context("fork").Pool(jobs, _leave_interrupts_alone)
        self._progress = Console(stderr=True)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        self._pool.terminate()

    def simulate(self, batches: Sequence[Batch]) -> None:
        """Make what is not in the folder yet."""
        for _ in self.each(simulate_batch, batches, "simulate"):
            pass

    def diagnose(self, cases: Sequence[Case]) -> Iterator[Outcome]:
        """Outcomes in the order of the cases."""
        return self.each(diagnose_case, cases, "diagnose")

    def each(
        self, function: Callable[[Given], Made], items: Sequence[Given], title: str
    ) -> Iterator[Made]:
        """Results in the order of the items, with progress."""
        done = self._pool.imap(function, items)
        return iter(track(done, title, len(items), console=self._progress))


def select(cases: Sequence[Case], scale: float, workers: Workers) -> list[Case]:
    """Cases that are worth a diagnosis, simulated.

    At full size: all single effects and clean drives, and of the others those in which every
    fault is above the tolerance. At another scale: what is above it at full size.
    """
    workers.simulate(_batches(cases))
    always = {CLEAN, SINGLE} if scale == 1.0 else set()
    cases = [case for case in cases if case.batch.kind in always or counts(case)]
    scaled = [replace(case, batch=replace(case.batch, scale=scale)) for case in cases]
    workers.simulate(_batches(scaled))
    return scaled


def diagnose_case(case: Case) -> Outcome:
    """Diagnose one case; an error of the engine is an outcome, too."""
    recording = load_batch(case.batch).recording(case.row)
    began_s = time.perf_counter()
    try:
        diagnosis = engine.diagnose([recording])
    except Exception as error:
        return unjudged(case, f"{type(error).__name__}: {error}")
    return judge(case, diagnosis, time.perf_counter() - began_s)


def counts(case: Case) -> bool:
    """Whether every fault of a case is above the tolerance; not so where there is none."""
    shares = load_batch(case.batch).share[case.row]
    return len(shares) > 0 and bool((shares >= TOLERANCE).all())


def _batches(cases: Sequence[Case]) -> list[Batch]:
    return list(dict.fromkeys(case.batch for case in cases))


def _leave_interrupts_alone() -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)
