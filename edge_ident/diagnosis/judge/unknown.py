"""Something unknown in the place of laws by which other axes act: one path does not tell many.

Several joints offer so many laws that a few of them describe any effort along one path, and along
all its repetitions. So the laws compete with an effort of which nothing is known, but that it is as
smooth as what the base model misses. The criterion counts no more samples than that effort has.
Where it decidedly prefers the base model then, the weakest law of another axis leaves, and the
next.
"""

from collections.abc import Sequence

from edge_ident.diagnosis.judge.assessment import Assessment
from edge_ident.diagnosis.select.acceptance import separable
from edge_ident.diagnosis.select.search import many_other_laws, samples_of_unknown


def unknown_instead(assessed: Assessment, kept: Sequence[int]) -> dict[int, str]:
    """Reasons against terms by which other axes act.

    Parameters
    ----------
    kept : sequence of int
        Places of the terms that nothing else is against.

    Returns
    -------
    mapping of place to str
        Places are those of `assessed.model.terms`.
    """
    doubts: dict[int, str] = {}
    data, terms = assessed.search.data, assessed.model.terms
    coupled = [k for k in kept if terms[k].candidate.source is not None]
    if not coupled or not many_other_laws(data):
        return doubts
    samples = samples_of_unknown(data, assessed.search.start)
    few = assessed.search.with_samples(samples)

    def value(places: Sequence[int]) -> float:
        return few.value(assessed.fitted(places))

    left = list(kept)
    while coupled and separable(few.gain(assessed.fitted(left), assessed.search.start)):
        weakest = min(coupled, key=lambda k: value([j for j in left if j != k]))
        left.remove(weakest)
        coupled.remove(weakest)
        doubts[weakest] = (
            f"what the base model misses has {samples:.0f} independent samples along this motion, "
            "and so few do not tell it from laws of other axes: record other paths"
        )
    return doubts
