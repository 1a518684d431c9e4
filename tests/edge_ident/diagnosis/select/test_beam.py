"""What the beam of the forward selection follows."""

from edge_ident.diagnosis.fit.candidates import Candidate
from edge_ident.diagnosis.fit.fitting import FittedTerm
from edge_ident.diagnosis.fit.library import ScoredCandidate
from edge_ident.diagnosis.select.forward_selection import different_first
from edge_ident.model.effects import named


def scored(effect: str, form: int, error: float, source: str | None = None) -> ScoredCandidate:
    candidate = Candidate(effect, named(effect).search.forms[form], source)
    return ScoredCandidate(FittedTerm(candidate, {}, {}), error)


def test_the_best_of_each_kind_comes_before_other_forms_of_the_same() -> None:
    """The weight of a joint that follows the own angle in three forms leaves room for the one that
    follows the sum of two angles."""
    spring, parabola = (scored("position_dependent_load", k, 1.0 + k) for k in (0, 2))
    both = scored("position_dependent_load", 5, 4.0, source="y")
    coupling = scored("cross_axis_coupling", 0, 5.0, source="y")
    ranked = [spring, parabola, both, coupling]
    assert different_first(ranked) == [spring, both, coupling, parabola]
