"""The rule that accepts a cause, and every threshold of the selection.

`decide` is the rule. Forward selection asks it before it adds a term, backward elimination before
it keeps one, and replacement before it exchanges one for an alternative. `structure_left` decides
on the verdict in the same way. No other file of this room holds a threshold; a test checks that.

`thresholds` lists them. docs/diagnosis_reference.md prints the list, and a test compares the two.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final, Generic, TypeVar

import numpy as np

from edge_ident.diagnosis.fit.fitting import FittedTerm

Number = TypeVar("Number", int, float)


@dataclass(frozen=True)
class Threshold(Generic[Number]):
    """A number that decides.

    Attributes
    ----------
    value : int or float
    unit : str
    meaning : str
        What it decides.
    reason : str
        Why it has this value: a source, or the judgement behind it.
    support : str
        The test or the experiment that supports it.
    """

    value: Number
    unit: str
    meaning: str
    reason: str
    support: str


_BENCHMARK: Final = "benchmark, made with this value; no other was compared"
_NONE: Final = "none needed: it decides on no cause"

ADDED_TERM: Final = Threshold(
    25.0,
    "units of the criterion",
    "A model with one more term gains more than this.",
    "2.5 times decisive: most machines have none of the effects, and all of them are tried.",
    "`test_hidden_effects.py`: no cause on sound drives and on the other axis; benchmark",
)
KEPT_TERM: Final = Threshold(
    0.0,
    "units of the criterion",
    "A term that is in the model stays where it gains more than this.",
    "The criterion prefers the model with it. Stepwise selection removes at a lower threshold than "
    "it adds, or it cycles (Efroymson 1960).",
    "`test_real_machines.py`: a ripple of the motor enters, and stays beside others with 7 units",
)
DECISIVE: Final = Threshold(
    10.0,
    "units of the criterion",
    "Two models differ by this, or the motion does not separate them. A replacement that adds a "
    "kind of effect gains more than this.",
    "Kass and Raftery, JASA 90 (1995) 773: a difference of ten is very strong evidence.",
    "`test_alternatives.py`: a separable and an inseparable pair; benchmark",
)
SUPPORTED: Final = Threshold(
    0.95,
    "share of the bootstrap resamples",
    "A cause reduces the held-out residual in more than this share.",
    "The usual level of significance of 5 %, one-sided.",
    "`test_acceptance.py`: regressors of noise are refused, a real one is not",
)
NONZERO: Final = Threshold(
    3.0,
    "standard deviations",
    "An essential parameter of an effect lies farther from zero than this.",
    "The usual three-sigma rule.",
    "`test_search_parts.py`: friction that changes alone is no payload",
)
RELIABILITY: Final = Threshold(
    0.75,
    "reliability ratio",
    "Of a candidate's orthogonal component, more than this share is motion and not encoder noise.",
    "A judgement: a quarter of noise biases an amplitude by a quarter (Fuller 1987).",
    "benchmark: no cause on clean drives with the paper's motion",
)
LARGEST: Final = Threshold(
    2.0,
    "peak of the measured effort",
    "The contribution of a candidate stays below this.",
    "A judgement: a larger one is fitted to its tails, and cancels against other terms.",
    _BENCHMARK,
)
FEWEST_INDEPENDENT: Final = Threshold(
    0.8,
    "share of the valid samples",
    "A residual worth fewer samples than this is coloured: the selection is repeated with as many.",
    "A judgement: a fifth fewer samples change the criterion by a fifth.",
    "`test_criterion.py`: a residual of slow waves counts for fewer samples",
)
ONE_OFF_BLOCKS: Final = Threshold(
    0.15,
    "share of the blocks of time",
    "An effect that acts in fewer blocks happens once, and is judged where it was fitted.",
    "Cross-validation cannot predict from the other blocks what happens once.",
    "`test_search_parts.py`: a single push is found",
)
ONE_OFF_ENERGY: Final = Threshold(
    0.9,
    "share of the energy",
    "An effect acts in those blocks that hold more than this share of its squared effort.",
    "A judgement: the filter spreads an event into its neighbour blocks.",
    "`test_search_parts.py`: a single push is found",
)
NOT_TESTABLE: Final = Threshold(
    0.1,
    "share of the effort's rms",
    "An effect that could be larger than this without being noticed is not testable.",
    "A judgement: a tenth of the effort matters to any controller.",
    "`test_search_parts.py`: one sinusoid does not test friction that follows the load",
)
INDISTINGUISHABLE: Final = Threshold(
    10.0, "times the effort", "Then the page says 'exactly like the base model'.", "Wording.", _NONE
)
STRUCTURE: Final = Threshold(
    1.2,
    "noise floor",
    "A residual above this, widened by twice the floor's uncertainty, has structure.",
    "Encoder rounding is not white: on clean simulated drives the base model leaves 0.90 to 1.16 "
    "times the floor in nine of ten.",
    "`test_hidden_effects.py`: unknown disturbances are unexplained, sound drives adequate",
)

# What follows bounds the effort of the search: what is tried, not what is accepted.
BEAM_WIDTH: Final = Threshold(3, "models", "The beam search follows so many.", "Time.", _BENCHMARK)
FOLLOWED: Final = Threshold(
    2.5, "least error", "Worse models are not followed.", "One term cannot catch up.", _BENCHMARK
)
MOST_TERMS: Final = Threshold(6, "terms", "Forward selection adds no more.", "Time.", _BENCHMARK)
MOST_REFINED: Final = Threshold(4, "candidates", "So many are refined.", "Time.", _BENCHMARK)
PROMISING: Final = Threshold(
    0.4, "best gain", "Lesser candidates are not refined.", "They do not catch up.", _BENCHMARK
)
SLIGHTEST: Final = Threshold(
    3.0,
    "units before penalty",
    "Lesser ones are not refined.",
    "Any parameter gains one by chance.",
    _BENCHMARK,
)
MOST_ALTERNATIVES: Final = Threshold(3, "effects", "So many are fitted.", "Time.", _BENCHMARK)
MOST_ROUNDS: Final = Threshold(
    6,
    "rounds",
    "Backward elimination changes the model no more often; then it has not converged.",
    "Each round drops or replaces one of at most six terms.",
    "`test_backward_elimination.py`: the result says that it did not converge",
)
RESAMPLES: Final = Threshold(
    1000, "resamples", "Of the bootstrap.", "0.95 then has a standard error of 0.007.", _NONE
)
BOOTSTRAP_SEED: Final = Threshold(1, "seed", "Of the bootstrap.", "Reproducible results.", _NONE)
LOST_CORRELATION: Final = Threshold(
    2.0,
    "standard errors",
    "The sum over an autocorrelation ends where it falls below this (Geyer 1992).",
    "The 95 % bound of a white series (Bartlett 1935).",
    "`test_criterion.py`: independent samples of white and of coloured series",
)


def thresholds() -> Mapping[str, Threshold[int] | Threshold[float]]:
    """All thresholds of the selection by name."""
    return {name: value for name, value in globals().items() if isinstance(value, Threshold)}


@dataclass(frozen=True)
class Evidence:
    """What is known about a change from one model to another.

    Attributes
    ----------
    criterion_gain : float
        Difference of the extended BIC, less model discrepancy (`select.criterion`).
    supported : float or None
        Share of the bootstrap resamples in which the held-out residual falls; None where it has
        not been computed.
    one_off : bool
        Whether the change acts once, so that cross-validation does not apply.
    near_zero : tuple of str
        Essential parameters that lie near zero.
    """

    criterion_gain: float
    supported: float | None = None
    one_off: bool = False
    near_zero: tuple[str, ...] = ()


@dataclass(frozen=True)
class Decision:
    """Whether a change of the model is accepted, and why.

    Attributes
    ----------
    accepted : bool
    reason : str
        In words, with the numbers.
    margin : float
        Gain of the criterion beyond what is required.
    """

    accepted: bool
    reason: str
    margin: float


def decide(
    before: Sequence[FittedTerm],
    after: Sequence[FittedTerm],
    evidence: Evidence,
    *,
    staying: bool = False,
) -> Decision:
    """Decide whether a model may take the place of another.

    Parameters
    ----------
    before, after : sequence of FittedTerm
        Terms of the two models.
    evidence : Evidence
        Of the change from the one to the other.
    staying : bool
        Whether the additional term is in the model already, and asks to stay.
    """
    required = _required_gain(before, after, staying)
    margin = evidence.criterion_gain - required
    gained = f"it gains {evidence.criterion_gain:.0f} units of the criterion"
    if not margin > 0.0:
        return Decision(False, f"{gained}; more than {required:.0f} are required", margin)
    if evidence.near_zero:
        names = ", ".join(evidence.near_zero)
        reason = f"{names} lies within {NONZERO.value:.0f} standard deviations of zero"
        return Decision(False, reason, margin)
    reason = f"{gained} (more than {required:.0f} are required)"
    if evidence.one_off:
        return Decision(True, f"{reason} and acts once, so it counts where it was fitted", margin)
    if evidence.supported is None:
        return Decision(True, reason, margin)
    held_out = (
        f"reduces the held-out residual in {evidence.supported:.1%} of the resamples "
        f"(more than {SUPPORTED.value:.0%} are required)"
    )
    if not evidence.supported > SUPPORTED.value:
        return Decision(False, f"it {held_out}", margin)
    return Decision(True, f"{reason} and {held_out}", margin)


def _required_gain(
    before: Sequence[FittedTerm], after: Sequence[FittedTerm], staying: bool
) -> float:
    """Units of the criterion; an added term costs more than one that stays or replaces another."""
    if len(after) > len(before):
        return KEPT_TERM.value if staying else ADDED_TERM.value
    kinds = [len({t.candidate.effect for t in terms}) for terms in (before, after)]
    # a new kind of effect beside one that is there already has to be decisive
    return DECISIVE.value * (kinds[1] - kinds[0])


def separable(criterion_gain: float) -> bool:
    """Whether a motion separates a cause from an alternative that it gains this much over."""
    return criterion_gain >= DECISIVE.value


def structure_left(residual: float, floor: float, uncertainty: float, discrepancy: float) -> bool:
    """Whether a residual has structure that noise and model discrepancy do not explain.

    Parameters
    ----------
    residual, floor, discrepancy : float
        Rms over the valid samples.
    uncertainty : float
        Relative standard deviation of the floor.
    """
    noise = STRUCTURE.value * (1.0 + 2.0 * uncertainty) * floor
    return bool(residual > np.hypot(noise, discrepancy))
