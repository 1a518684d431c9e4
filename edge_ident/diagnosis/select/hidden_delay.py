"""A delay that larger causes hide.

An effort is late where the delay is most of what the base model leaves (`prepare.timing`). Beside a
ripple, say, it is little of that, and only timing up to its limit is in the model. What timing
lacks then looks like a dead band or like friction that follows the load, and a delay of many
samples like a compliance. So a delay is fitted beside the causes that were found.
"""

from collections.abc import Iterator
from dataclasses import replace

from edge_ident.diagnosis.fit.candidates import Candidate
from edge_ident.diagnosis.fit.external_vibrations import VIBRATION
from edge_ident.diagnosis.fit.fitting import FittedTerm, delayed, fit
from edge_ident.diagnosis.fit.own_effort import base_space, own_shares
from edge_ident.diagnosis.prepare.axis_data import AxisData
from edge_ident.diagnosis.prepare.timing import SHARE_OF_DELAY, out_of_step
from edge_ident.diagnosis.select.selection import Selected
from edge_ident.model.effect import Effect
from edge_ident.model.effects import catalogue
from edge_ident.model.timing import LARGEST_SHIFT
from edge_ident.signals.timing import within_limits


def delayed_data(selected: Selected) -> AxisData | None:
    """The data of an axis as it was recorded, where its causes hid that the effort is late.

    A few causes are asked first: the others may be what the delay was taken for.

    Parameters
    ----------
    selected : Selected

    Returns
    -------
    AxisData or None
        None where the effort is in time, or was late before.
    """
    search, start, data = selected.search, selected.start, selected.search.data
    if data.late or delayed(start.template):
        return None
    no_delay = _no_delay()
    recorded = _out_of_step(data, 0.0)
    for beside in causes_in_turn(selected):
        without = search.fit(start.base, beside)
        model = fit(recorded, start.template, without.base, (*beside, no_delay))
        late_s = next(iter(model.terms[-1].linear.values()))
        beyond = all(abs(late_s) > LARGEST_SHIFT * s.raw_period_s for s in data.segments)
        if beyond and model.error < (1.0 - SHARE_OF_DELAY) * without.error:
            return _out_of_step(data, late_s)
    return None


def causes_in_turn(selected: Selected, *, none: bool = False) -> Iterator[tuple[FittedTerm, ...]]:
    """External vibrations alone; then with one cause after the other, the strongest first, last
    those that are like a delay.

    Parameters
    ----------
    selected : Selected
    none : bool
        Whether nothing comes first where there are no vibrations.
    """
    data, model = selected.search.data, selected.supported.model
    like_delays = _delay().search.alternatives
    shares = own_shares(data, model, base_space(data, selected.start))
    pairs = list(zip(shares, model.terms, strict=True))
    ranked = sorted(pairs, key=lambda pair: (pair[1].candidate.effect in like_delays, -pair[0]))
    terms = [term for _, term in ranked]
    vibrations = [term for term in terms if term.candidate == VIBRATION]
    causes = [term for term in terms if term.candidate != VIBRATION]
    for count in range(0 if vibrations or none else 1, len(causes) + 1):
        yield (*vibrations, *causes[:count])


def _delay() -> Effect:
    """The effect that shifts the effort."""
    return next(effect for effect in catalogue().values() if effect.effort_delay)


def _no_delay() -> FittedTerm:
    """The same, by nothing."""
    effect = _delay()
    (form,) = effect.search.forms
    return FittedTerm(Candidate(effect.name, form), {}, {effect.effort_delay: 0.0})


def _out_of_step(data: AxisData, late_s: float) -> AxisData:
    """The same data, with every effort where it was recorded."""
    shifts = [within_limits(late_s, 0.0, s.raw_period_s) for s in data.segments]
    segments = tuple(map(out_of_step, data.segments, shifts))
    return replace(data.with_efforts_of(segments), late=True)
