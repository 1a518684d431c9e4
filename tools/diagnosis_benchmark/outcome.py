"""What a diagnosis said of a case, held against what was hidden."""

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from itertools import permutations
from typing import Any, Final, Self

import numpy as np

from edge_ident.diagnosis.measures import Verdict
from edge_ident.diagnosis.result import Cause, Diagnosis
from firmware_interface.plant import SAMPLE_S
from tools.diagnosis_benchmark.bias import mean_parameters, relative_errors
from tools.diagnosis_benchmark.cases import Case
from tools.diagnosis_benchmark.compared import compared_shares
from tools.diagnosis_benchmark.hiding import AXES, load_batch
from tools.diagnosis_benchmark.measuring import ABOVE_BAND

SHOWS: Final = 2.0
"""Variance ratio from which a fault shows outside reversals."""
TOLERANCE: Final = 0.01
"""Share of the rms effort, orthogonal to the base model, from which a fault counts."""
REACH: Final = 6.0
"""Detectability from which a test can tell a fault from noise. The criterion of a test gains its
square on average: 36, where 25 have to be left after a penalty of about 10."""
DIFFERENT_CLOCKS: Final = (("time_delay",), "effort_late")
"""A hidden delay, and the finding that says so where it is longer than any loop bears."""


@dataclass(frozen=True)
class Named:
    """A cause: its effect, and the alternatives that this motion does not separate from it."""

    effect: str
    inseparable: tuple[str, ...]

    def meets(self, hidden: str) -> bool:
        """Whether it is the hidden effect, or has it as its only inseparable alternative."""
        return len(self.inseparable) < 2 and hidden in (self.effect, *self.inseparable)

    @property
    def confident(self) -> bool:
        """Whether this motion separates it from every alternative."""
        return not self.inseparable

    def __str__(self) -> str:
        return "~".join((self.effect, *self.inseparable))


def named_in(causes: Sequence[Cause]) -> tuple[Named, ...]:
    """Causes in their order; several orders of one effect are one cause."""
    named_: dict[str, Named] = {}
    for cause in causes:
        inseparable = tuple(other.effect for other in cause.inseparable)
        named_.setdefault(cause.term.effect, Named(cause.term.effect, inseparable))
    return tuple(named_.values())


def all_named(hidden: tuple[str, ...], causes: tuple[Named, ...]) -> bool:
    """Whether each hidden effect has a cause of its own that meets it."""
    return any(
        all(cause.meets(name) for cause, name in zip(chosen, hidden, strict=True))
        for chosen in permutations(causes, len(hidden))
    )


@dataclass(frozen=True)
class Outcome:
    """One case.

    Attributes
    ----------
    case, kind, motion : str
    scale : float
    hidden : tuple of str
    shows, shows_full : tuple of float
        Variance ratio of each hidden effect alone, at this scale and at full size.
    share : tuple of float
        Of the rms effort, by each hidden effect, orthogonal to the base model, at full size.
    share_compared : tuple of float
        The same of what the diagnosis compares (`compared.py`).
    detectability : tuple of float
        Of each hidden effect alone by the ideal test, at full size.
    shift_periods, found_shift_periods : float
        By which the effort is recorded late, and as diagnosed.
    verdict : str
    causes, suspected, minor : tuple of Named
        On the axis with the fault; on x where there is none.
    findings : tuple of str
        Codes of what the diagnosis finds against any cause.
    sound_verdict, sound_causes
        Of the other axis.
    error_before, error_after : tuple of float
        Relative, of `JUDGED`, with the base model and with the extended one.
    held_out_before, held_out_after, noise_floor : float
        Relative residuals.
    cutoff_hz : float
    wall_s : float
        For both axes.
    failure : str
        Of a diagnosis that ended with an error; all else is empty then.
    """

    case: str
    kind: str
    motion: str
    scale: float
    hidden: tuple[str, ...]
    shows: tuple[float, ...]
    shows_full: tuple[float, ...]
    share: tuple[float, ...] = ()
    share_compared: tuple[float, ...] = ()
    detectability: tuple[float, ...] = ()
    shift_periods: float = 0.0
    found_shift_periods: float = 0.0
    verdict: str = ""
    causes: tuple[Named, ...] = ()
    suspected: tuple[Named, ...] = ()
    minor: tuple[Named, ...] = ()
    findings: tuple[str, ...] = ()
    sound_verdict: str = ""
    sound_causes: tuple[Named, ...] = ()
    error_before: tuple[float, ...] = ()
    error_after: tuple[float, ...] = ()
    held_out_before: float = 0.0
    held_out_after: float = 0.0
    noise_floor: float = 0.0
    cutoff_hz: float = 0.0
    wall_s: float = 0.0
    failure: str = ""

    @property
    def counts(self) -> bool:
        """Whether every hidden effect is above the tolerance at full size."""
        return all(share >= TOLERANCE for share in self.share)

    @property
    def seen(self) -> bool:
        """Whether every hidden effect counts, and shows outside reversals; above the band: counts.

        A line above the band cannot show in it.
        """
        above = set(self.hidden) <= set(ABOVE_BAND)
        return self.counts and (above or all(ratio >= SHOWS for ratio in self.shows_full))

    @property
    def within_reach(self) -> bool:
        """Whether every hidden effect counts, and the ideal test can tell it from noise."""
        return self.counts and all(index >= REACH for index in self.detectability)

    @property
    def compared(self) -> bool:
        """Whether every hidden effect is above the tolerance where the diagnosis compares."""
        shares = self.share_compared
        return bool(shares) and min(shares) >= TOLERANCE

    @property
    def said(self) -> bool:
        """Whether a finding says what is hidden: effort and position have different clocks."""
        return self.hidden == DIFFERENT_CLOCKS[0] and DIFFERENT_CLOCKS[1] in self.findings

    @property
    def right(self) -> bool:
        """Whether the first cause, or a finding, is a hidden effect."""
        return self.said or (bool(self.causes) and self.causes[0].effect in self.hidden)

    @property
    def met(self) -> bool:
        """Whether that, or the first cause's only inseparable alternative, is a hidden effect."""
        if self.said:
            return True
        return bool(self.causes) and any(self.causes[0].meets(name) for name in self.hidden)

    @property
    def found_all(self) -> bool:
        """Whether each hidden effect has a cause of its own that meets it."""
        return all_named(self.hidden, self.causes)

    @property
    def alone(self) -> bool:
        """Whether the causes are what is hidden and nothing else, or its one alternative.

        What is suspected or minor is not named.
        """
        if self.said:
            return not self.causes
        return len(self.causes) == len(self.hidden) and self.found_all

    @property
    def suspects(self) -> bool:
        """Whether a hidden effect, that is no cause, is suspected or minor."""
        listed = [named.effect for named in (*self.suspected, *self.minor)]
        return not self.right and any(name in listed for name in self.hidden)

    @property
    def exact(self) -> bool:
        """Whether it found all that was hidden, named nothing else, and says it is explained."""
        return self.alone and self.verdict == (
            Verdict.EXPLAINED if self.hidden else Verdict.ADEQUATE
        )

    @property
    def open(self) -> bool:
        """Whether it says that structure is left."""
        return self.verdict in (Verdict.UNEXPLAINED, Verdict.PARTLY_EXPLAINED)

    @property
    def undecided(self) -> bool:
        """Whether this motion does not separate the first cause from an alternative."""
        return bool(self.causes) and bool(self.causes[0].inseparable)

    @property
    def confident(self) -> bool:
        """Whether it has a cause without such an alternative."""
        return any(cause.confident for cause in self.causes)

    def line(self) -> str:
        """As one line of JSON."""
        return json.dumps(asdict(self))

    @classmethod
    def read(cls, line: str) -> Self:
        """From one line of JSON."""
        values: dict[str, Any] = json.loads(line)
        for key in ("causes", "suspected", "minor", "sound_causes"):
            values[key] = tuple(Named(c["effect"], tuple(c["inseparable"])) for c in values[key])
        for key, value in values.items():
            values[key] = tuple(value) if isinstance(value, list) else value
        return cls(**values)


def unjudged(case: Case, failure: str = "") -> Outcome:
    """An outcome that holds nothing but what was hidden."""
    shows, shows_full = (load_batch(b).shows[case.row] for b in (case.batch, case.batch.full_size))
    full = load_batch(case.batch.full_size)
    return Outcome(
        case=str(case),
        kind=case.batch.kind,
        motion=case.batch.motion,
        scale=case.batch.scale,
        hidden=case.hidden,
        shows=tuple(shows.tolist()),
        shows_full=tuple(shows_full.tolist()),
        share=tuple(full.share[case.row].tolist()),
        detectability=tuple(full.detectability[case.row].tolist()),
        shift_periods=-float(full.effort_shift_s[case.row]) / SAMPLE_S,
        failure=failure,
    )


def judge(case: Case, diagnosis: Diagnosis, wall_s: float) -> Outcome:
    """Hold a diagnosis against the truth."""
    hidden = load_batch(case.batch)
    hit = int(hidden.axis[case.row])
    axis, sound = diagnosis.axes[AXES[hit]], diagnosis.axes[AXES[1 - hit]]
    truth = hidden.truth[case.row, hit]
    before = axis.base.estimate.parameters
    after = mean_parameters(axis.model, float(hidden.time_s[-1]))
    added = load_batch(case.batch.full_size).added[case.row].astype(np.float64)
    compared = compared_shares(hidden.recording(case.row), AXES[hit], added)
    return replace(
        unjudged(case),
        share_compared=tuple(compared),
        verdict=str(axis.verdict),
        causes=named_in(axis.causes),
        suspected=named_in(axis.suspected),
        minor=named_in(axis.minor),
        findings=tuple(finding.code for finding in axis.findings),
        found_shift_periods=float(axis.timing.shift_samples),
        sound_verdict=str(sound.verdict),
        sound_causes=named_in(sound.causes),
        error_before=relative_errors(before, truth),
        error_after=relative_errors(after, truth),
        held_out_before=float(axis.base.held_out),
        held_out_after=float(axis.extended.held_out),
        noise_floor=float(axis.noise_floor),
        cutoff_hz=float(axis.cutoff_hz),
        wall_s=wall_s,
    )
