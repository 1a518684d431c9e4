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


ADDED_TERM: Final = Threshold(
    25.0,
    "units of the criterion",
    "A model with one more term gains more than this.",
    "2.5 times decisive: most machines have none of the effects, and all of them are tried.",
    "`test_hidden_effects.py`: no cause on sound drives, and none on the other axis; sensitivity",
)
DECISIVE: Final = Threshold(
    10.0,
    "units of the criterion",
    "Two models differ by at least this, or this motion does not separate them. A replacement "
    "that adds a kind of effect gains more than this.",
    "Kass and Raftery, JASA 90 (1995) 773: a difference of ten is very strong evidence.",
    "`test_alternatives.py`: separable and inseparable pairs; sensitivity",
)
SUPPORTED: Final = Threshold(
    0.95,
    "share of the bootstrap resamples",
    "A cause reduces the held-out residual in more than this share.",
    "The usual level of significance of 5 %, one-sided.",
    "`test_acceptance.py`: a regressor of noise is refused; sensitivity",
)
NONZERO: Final = Threshold(
    3.0,
    "standard deviations",
    "An essential parameter of an effect lies farther from zero than this.",
    "The usual three-sigma rule.",
    "`test_search_parts.py`: friction that changes alone is no payload; sensitivity",
)
RELIABILITY: Final = Threshold(
    0.75,
    "reliability ratio",
    "Of a candidate's orthogonal component, more than this share is motion and not encoder noise.",
    "A judgement: a quarter of noise biases an amplitude by a quarter (Fuller 1987).",
    "benchmark, clean drives on the paper's motion: no cause; sensitivity",
)
LARGEST: Final = Threshold(
    2.0,
    "peak of the measured effort",
    "The contribution of a candidate stays below this.",
    "A larger one was fitted to its tails alone, and cancels against other terms.",
    "sensitivity",
)
FEWEST_INDEPENDENT: Final = Threshold(
    0.8,
    "share of the valid samples",
    "A residual that is worth fewer independent samples than this is coloured: the selection is "
    "repeated with their number.",
    "A judgement: a fifth fewer samples change the criterion by a fifth.",
    "sensitivity",
)
ONE_OFF_BLOCKS: Final = Threshold(
    0.15,
    "share of the blocks of time",
    "An effect that acts in fewer blocks than this happens once and is judged where it was fitted.",
    "Cross-validation cannot predict from the other blocks what happens once.",
    "`test_search_parts.py`: a push while quantization aliases is found; sensitivity",
)
ONE_OFF_ENERGY: Final = Threshold(
    0.9,
    "share of the energy",
    "An effect acts in those blocks that hold more than this share of its squared effort.",
    "A judgement: the filter spreads an event into its neighbour blocks.",
    "as for one-off blocks",
)
NOT_TESTABLE: Final = Threshold(
    0.1,
    "share of the effort's rms",
    "An effect that could be larger than this without being noticed is not testable.",
    "A judgement: a tenth of the effort matters to any controller.",
    "`test_search_parts.py`: a spring along one sinusoid is not testable",
)
INDISTINGUISHABLE: Final = Threshold(
    10.0,
    "times the effort's rms",
    "An effect that could be this large is said to look exactly like the base model.",
    "It changes a sentence, and no decision.",
    "none needed",
)
STRUCTURE: Final = Threshold(
    1.2,
    "noise floor",
    "A residual above this, widened by twice the floor's uncertainty, has structure: the verdict "
    "is then unexplained.",
    "Encoder rounding is not white: on clean simulated drives the base model leaves 0.90 to 1.16 "
    "times the floor in nine of ten.",
    "benchmark, clean drives; `test_hidden_effects.py`: unknown disturbances are unexplained",
)

# What follows bounds the effort of the search. It decides what is tried, not what is accepted.
BEAM_WIDTH: Final = Threshold(
    3, "models", "Forward selection follows so many.", "Time.", "sensitivity"
)
FOLLOWED: Final = Threshold(
    2.5,
    "least error",
    "Models and candidates above this are not followed.",
    "Time: they cannot catch up by one term.",
    "sensitivity",
)
MOST_TERMS: Final = Threshold(
    6, "terms", "Forward selection adds no more.", "No benchmark drive has more.", "benchmark"
)
MOST_REFINED: Final = Threshold(
    4, "candidates", "So many are refined before one is chosen.", "Time.", "sensitivity"
)
PROMISING: Final = Threshold(
    0.4,
    "gain of the best candidate",
    "A candidate that gains less is not refined.",
    "Time: refinement does not bring it to the front.",
    "sensitivity",
)
SLIGHTEST: Final = Threshold(
    3.0,
    "units of the criterion",
    "A candidate that gains less, before its penalty, is not refined.",
    "Any parameter gains about one by chance.",
    "sensitivity",
)
MOST_ALTERNATIVES: Final = Threshold(
    3, "effects", "So many are fitted in the place of a cause.", "Time.", "sensitivity"
)
MOST_ROUNDS: Final = Threshold(
    6,
    "rounds",
    "Backward elimination changes the model no more often; then it has not converged.",
    "Each round drops or replaces one of at most six terms.",
    "`test_backward_elimination.py`: the result says that it did not converge",
)
RESAMPLES: Final = Threshold(
    1000,
    "resamples",
    "Of the block bootstrap (Künsch, Annals of Statistics 17 (1989) 1217).",
    "A share of 0.95 then has a standard error of 0.007.",
    "none needed",
)
BOOTSTRAP_SEED: Final = Threshold(
    1, "seed", "Makes the bootstrap reproducible.", "Any.", "`test_real_machines.py`: same bytes"
)
LOST_CORRELATION: Final = Threshold(
    2.0,
    "standard errors",
    "An autocorrelation below this is zero: the sum over lags ends (Geyer 1992).",
    "The 95 % bound of a white series (Bartlett 1935).",
    "`test_criterion.py`: samples of white and of coloured noise",
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
    before: Sequence[FittedTerm], after: Sequence[FittedTerm], evidence: Evidence
) -> Decision:
    """Decide whether a model may take the place of another.

    Parameters
    ----------
    before, after : sequence of FittedTerm
        Terms of the two models.
    evidence : Evidence
        Of the change from the one to the other.
    """
    required = _required_gain(before, after)
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


def _required_gain(before: Sequence[FittedTerm], after: Sequence[FittedTerm]) -> float:
    """Units of the criterion; an added term costs more than one in the place of another."""
    if len(after) > len(before):
        return ADDED_TERM.value
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
