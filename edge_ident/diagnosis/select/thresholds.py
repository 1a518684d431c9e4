"""Every threshold of the selection, which docs/diagnosis_reference.md prints, with its reason."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final, Generic, TypeVar

# A number that decides, with its reason.

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
    "`test_hidden_effects.py`: no cause on sound drives; `test_floors.py`: none on the other axis",
)
KEPT_TERM: Final = Threshold(
    0.0,
    "units of the criterion",
    "A term in the model stays where it gains more than this.",
    "The criterion prefers the model with it. Stepwise selection removes at a lower threshold than "
    "it adds, or it cycles (Efroymson 1960).",
    "`test_real_machines.py`: a ripple of the motor enters, and stays beside others with 7 units",
)
DECISIVE: Final = Threshold(
    10.0,
    "units of the criterion",
    "Two models differ by this, or the motion does not separate them. What replaces a cause gains "
    "more: another kind of effect, an unnamed law, an event in the place of what lasts. The law in "
    "a payload's place, and what lasts in an event's, lose no more.",
    "Kass and Raftery, JASA 90 (1995) 773: a difference of ten is very strong evidence.",
    "`test_alternatives.py`: a separable and an inseparable pair",
)
SUPPORTED: Final = Threshold(
    0.95,
    "probability",
    "A cause reduces the held-out residual with more than this probability, over blocks of time.",
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
SIZED: Final = Threshold(
    1.0,
    "standard deviations",
    "One of a cause's linear parameters is larger than this, or the cause is suspected.",
    "What is known to no more than its own size may as well be nothing.",
    "`test_judgement.py`: a cause that is as uncertain as it is large",
)
STIFF_CHAIN: Final = Threshold(
    2.0,
    "tolerances",
    "The stiff chain of a sound drive is minor where its own effort is below this.",
    "A judgement: no chain is rigid, but what is twice worth naming is no small matter.",
    "`test_recorded_effort.py`: chains of 20 and 30 Hz, which take 2.9 and 1.0 %",
)
SAME_SIZE: Final = Threshold(
    0.4,
    "size of the cause",
    "Two halves of the data that show a cause with sizes farther apart show no law of the machine.",
    "The largest discrepancy that an effect's file states: no formula is farther off.",
    "`test_both_halves.py`: a ripple that comes or goes is no law",
)
LARGER_IN_TIME: Final = Threshold(
    2.0,
    "rms of what is left",
    "A cause that is tied to time is larger than this; any other is larger than what is left.",
    "A judgement: the larger part of an unknown disturbance in time may look like such a cause.",
    "`test_acceptance.py`: a drift beside as large a rest is only suspected",
)
HELD: Final = Threshold(
    0.5,
    "of the energy of a cause's effort",
    "So much of a cause in time acts at a stop or at an extreme of the motion: it is suspected.",
    "A judgement: most of it is then what friction may do, or a law that shows there alone.",
    "`test_causes_in_time.py`: what lasts beyond the stop is no friction",
)
TAKEN_BACK: Final = Threshold(
    2.0,
    "residuals of the base model",
    "A cause whose own effort is larger is suspected.",
    "All causes together explain no more than that residual, so others take back over half of it.",
    "`test_judgement.py`: two efforts that cancel each other",
)
MOST_EVENTS: Final = Threshold(
    2,
    "events",
    "More of them in one recording are suspected.",
    "A judgement: an event happens once. What happens three times has a cause that recurs.",
    "`test_causes_in_time.py`: bumps that recur",
)
NEGATIVE: Final = Threshold(
    2.0,
    "standard deviations",
    "Inertia or friction below zero by more than this is unphysical: no cause is named beside it.",
    "The usual level of significance of 2.5 %, one-sided: doubt is enough to name nothing.",
    "`test_judgement.py`: the law of a speed loop is no machine",
)
TRADED: Final = Threshold(
    1.02,
    "residual with the best base parameters",
    "An order from above the band leaves no more than this inside it, or it is suspected.",
    "What an order still does inside the band describes the effort there no worse than nothing.",
    "`test_above_band_causes.py`: an order is a cause with its amplitude",
)
INFORMATION_KEPT: Final = Threshold(
    0.5,
    "of the information on a base parameter",
    "Beside external vibrations, the motion still says more than this, or they are refused.",
    "A judgement: standard deviations grow by 1.4 at most.",
    "`test_search_parts.py`: an axis that a vibration moves; one that moves at one frequency alone",
)
RELIABILITY: Final = Threshold(
    0.5,
    "reliability ratio",
    "Of a candidate's orthogonal component, more than this share is motion and not encoder noise.",
    "A judgement: more of it says something than not. The criterion counts no noise as evidence.",
    "`test_screening.py`: mostly motion; it keeps small delays and springs out of clean drives",
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
    10.0,
    "times the effort",
    "Then the page says 'exactly like the base model'.",
    "Wording.",
    "none needed: it decides on no cause",
)
STRUCTURE: Final = Threshold(
    1.2,
    "noise floor",
    "A residual above this, widened by twice the floor's uncertainty, has structure.",
    "Encoder rounding is not white: on clean simulated drives the base model leaves 0.90 to 1.16 "
    "times the floor in nine of ten.",
    "`test_hidden_effects.py`: unknown disturbances are unexplained, sound drives adequate",
)
LARGEST_DISCREPANCY: Final = Threshold(
    0.05,
    "share of the effort's rms",
    "What the formulas of a model may be off explains no more of its residual than this.",
    "A twentieth of the effort moves gains (`estimation.trust`): to leave more is to explain less.",
    "`test_judgement.py`: a rest of a fifth of the effort is unexplained",
)

# What follows bounds the effort of the search: what is tried, not what is accepted.
BEAM_WIDTH: Final = Threshold(
    3,
    "models",
    "The beam search follows so many.",
    "Time.",
    "none needed: it bounds the effort of the search",
)
MOST_TERMS: Final = Threshold(
    6,
    "terms",
    "The search adds no more.",
    "Time.",
    "none needed: it bounds the effort of the search",
)
MOST_REFINED: Final = Threshold(
    4,
    "candidates",
    "So many are refined.",
    "Time.",
    "none needed: it bounds the effort of the search",
)
PROMISING: Final = Threshold(
    0.4,
    "best gain",
    "Lesser candidates are not refined.",
    "They do not catch up.",
    "none needed: it bounds the effort of the search",
)
SLIGHTEST: Final = Threshold(
    3.0,
    "units before penalty",
    "Lesser ones are not refined.",
    "Any parameter gains one by chance.",
    "none needed: it bounds the effort of the search",
)
MOST_FITTED: Final = Threshold(
    3,
    "candidates",
    "So many are fitted to be added, or in the place of a term.",
    "Time.",
    "none needed: it bounds the effort of the search",
)
MOST_ROUNDS: Final = Threshold(
    24,
    "rounds",
    "The search changes the model no more often; then it has not converged.",
    "Each of at most six terms may enter, be exchanged, and leave, and return in another form.",
    "`test_selection.py`: the result says that it did not converge",
)
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
