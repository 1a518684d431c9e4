"""Every number that decides in selection and judgement, with its reason.

docs/diagnosis_reference.md has the table of them.
"""

from typing import Final

ADDED_TERM: Final = 25.0
"""Units of the criterion. A model with one more term gains more than this. 2.5 times decisive: most
machines have none of the effects, and all of them are tried."""
KEPT_TERM: Final = 0.0
"""Units of the criterion. A term in the model stays where it gains more than this. The criterion
prefers the model with it. Stepwise selection removes at a lower threshold than it adds, or it
cycles (Efroymson 1960)."""
DECISIVE: Final = 10.0
"""Units of the criterion. Two models differ by this, or the motion does not separate them. What
replaces a cause gains more: another kind of effect, a curve, an event in the place of what lasts.
What lasts in an event's place loses no more. Kass and Raftery,
JASA 90 (1995) 773: a difference of ten is very strong evidence."""
SUPPORTED: Final = 0.95
"""Probability. A cause reduces the held-out residual with more than this probability, over blocks
of time. The usual level of significance of 5 %, one-sided."""
NONZERO: Final = 3.0
"""Standard deviations. An essential parameter of an effect lies farther from zero than this. The
usual three-sigma rule."""
SIZED: Final = 1.0
"""Standard deviations. One of a cause's linear parameters is larger than this, or the cause is
suspected. What is known to no more than its own size may as well be nothing."""
STIFF_CHAIN: Final = 2.0
"""Tolerances. The stiff chain of a sound drive is minor where its own effort is below this. A
judgement: no chain is rigid, but what is twice worth naming is no small matter."""
SAME_SIZE: Final = 0.4
"""Size of the cause. Two halves of the data that show a cause with sizes farther apart show no law
of the machine. The largest discrepancy that an effect's file states: no formula is farther off."""
LARGER_IN_TIME: Final = 2.0
"""Rms of what is left. A cause that is tied to time is larger than this; any other is larger than
what is left. A judgement: the larger part of an unknown disturbance in time may look like such a
cause."""
HELD: Final = 0.5
"""Share of the energy of a cause's effort. So much of a cause in time acts at a stop or at an
extreme of the motion: it is suspected. A judgement: most of it is then what friction may do, or a
law that shows there alone."""
TAKEN_BACK: Final = 2.0
"""Residuals of the base model. A cause whose own effort is larger is suspected. All causes together
explain no more than that residual, so others take back over half of it."""
MOST_EVENTS: Final = 2
"""Events. More of them in one recording are suspected. A judgement: an event happens once. What
happens three times has a cause that recurs."""
NEGATIVE: Final = 2.0
"""Standard deviations. Inertia or friction below zero by more than this is unphysical: no cause is
named beside it. The usual level of significance of 2.5 %, one-sided: doubt is enough to name
nothing."""
TRADED: Final = 1.02
"""Residual with the best base parameters. An order from above the band leaves no more than this
inside it, or it is suspected. What an order still does inside the band describes the effort there
no worse than nothing."""
INFORMATION_KEPT: Final = 0.5
"""Share of the information on a base parameter. Beside external vibrations, the motion still says
more than this, or they are refused. A judgement: standard deviations grow by 1.4 at most."""
RELIABILITY: Final = 0.5
"""Reliability ratio. Of a candidate's orthogonal component, more than this share is motion and not
encoder noise. A judgement: more of it says something than not. The criterion counts no noise as
evidence."""
FEWEST_INDEPENDENT: Final = 0.8
"""Share of the valid samples. A residual worth fewer samples than this is coloured: the selection
is repeated with as many. A judgement: a fifth fewer samples change the criterion by a fifth."""
ONE_OFF_BLOCKS: Final = 0.15
"""Share of the blocks of time. An effect that acts in fewer blocks happens once, and is judged
where it was fitted. Cross-validation cannot predict from the other blocks what happens once."""
ONE_OFF_ENERGY: Final = 0.9
"""Share of the energy. An effect acts in those blocks that hold more than this share of its squared
effort. A judgement: the filter spreads an event into its neighbour blocks."""
NOT_TESTABLE: Final = 0.1
"""Share of the effort's rms. An effect that could be larger than this without being noticed is not
testable. A judgement: a tenth of the effort matters to any controller."""
INDISTINGUISHABLE: Final = 10.0
"""Times the effort. Then the page says 'exactly like the base model'. Wording."""
STRUCTURE: Final = 1.2
"""Noise floor. A residual above this, widened by twice the floor's uncertainty, has structure.
Encoder rounding is not white: on clean simulated drives the base model leaves 0.90 to 1.16 times
the floor in nine of ten."""
LARGEST_DISCREPANCY: Final = 0.05
"""Share of the effort's rms. What the formulas of a model may be off explains no more of its
residual than this. A twentieth of the effort moves gains (`estimation.trust`): to leave more is to
explain less."""
LOST_CORRELATION: Final = 2.0
"""Standard errors. The sum over an autocorrelation ends where it falls below this (Geyer 1992). The
95 % bound of a white series (Bartlett 1935)."""
MOST_ROUNDS: Final = 24
"""Rounds. The search changes the model no more often; then it has not converged. Each of at most
six terms may enter, be exchanged, and leave, and return in another form."""

# What follows bounds the effort of the search: what is tried, not what is accepted.

BEAM_WIDTH: Final = 3
"""Models. The beam search follows so many."""
MOST_TERMS: Final = 6
"""Terms. The search adds no more."""
MOST_REFINED: Final = 4
"""Candidates. So many are refined."""
PROMISING: Final = 0.4
"""Best gain. Lesser candidates are not refined. They do not catch up."""
SLIGHTEST: Final = 3.0
"""Units before penalty. Lesser ones are not refined. Any parameter gains one by chance."""
MOST_FITTED: Final = 3
"""Candidates. So many are fitted to be added, or in the place of a term."""
