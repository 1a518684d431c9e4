"""From what lies above the band to causes, lines and the verdict."""

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from edge_ident.diagnosis.above_band.content import BandContent, above_band
from edge_ident.diagnosis.above_band.sinusoid_search import SAME_RATE, Sinusoid
from edge_ident.diagnosis.above_band.unsteady import Disturbance
from edge_ident.diagnosis.fit.fitting import FittedModel, fit
from edge_ident.diagnosis.fit.summary import nonzero_rms
from edge_ident.diagnosis.judge.causes import strongest_first
from edge_ident.diagnosis.measures import SpectralLine, Verdict
from edge_ident.diagnosis.prepare.axis_data import AxisData
from edge_ident.diagnosis.result import Alternative, AxisDiagnosis, Cause, OutsideVibration
from edge_ident.diagnosis.select.acceptance import larger_than_rest
from edge_ident.diagnosis.select.thresholds import TRADED
from edge_ident.model.effects import named
from edge_ident.model.model import PARAMETERS, AxisModel, Model, Term
from edge_ident.signals.recording import Recording

_RIPPLE: Final = "torque_ripple"
_WORSE: Final = "found above the band; with it the residual inside the band is larger than without"


def with_ripples(axis: AxisModel, content: BandContent, tolerance: float) -> AxisModel:
    """An axis with the orders above the band as terms, if they are worth naming.

    Parameters
    ----------
    tolerance : float
        Smallest rms that is, over that of the effort.
    """
    terms = tuple(_term(s) for s in _new(axis.terms, content.orders) if s.share >= tolerance)
    return replace(axis, terms=(*axis.terms, *terms)) if terms else axis


def orders_in_step(
    data: AxisData, axis: AxisModel, content: BandContent, tolerance: float
) -> tuple[BandContent, tuple[Cause, ...]]:
    """The content without orders that contradict the band of the comparison, and these.

    What an order still does inside the band has to describe the effort there no worse, beside the
    others. Otherwise its phase, or the inertia that it was measured beside, is not right. What it
    explains there counts with what it explains above: a motion of many speeds has it on both sides.

    Parameters
    ----------
    tolerance : float
        Smallest rms that is worth naming, over that of the effort.
    """
    worth = [order for order in content.orders if order.share >= tolerance]
    scale = nonzero_rms(data.effort[data.valid])
    suspected: list[Cause] = []
    inside: dict[Sinusoid, float] = {}
    while worth:
        left = _left_beside(data, axis, worth)
        without = {o: _left_beside(data, axis, [w for w in worth if w is not o]) for o in worth}
        inside = {o: math.sqrt(max(w**2 - left**2, 0.0)) / scale for o, w in without.items()}
        worst = min(worth, key=without.__getitem__)
        if left <= TRADED * without[worst]:
            break
        worth.remove(worst)
        suspected.append(replace(_cause(worst), decision=_WORSE))
    kept = tuple(
        replace(order, recorded=math.hypot(order.recorded, inside.get(order, 0.0)))
        for order in content.orders
        if order in worth or order.share < tolerance
    )
    return replace(content, orders=kept), tuple(suspected)


def _left_beside(data: AxisData, axis: AxisModel, orders: Sequence[Sinusoid]) -> float:
    """Rms of what the base model leaves inside the band beside orders."""
    terms = (*axis.terms, *map(_term, orders))
    left = fit(data, replace(axis, terms=terms), np.zeros(len(PARAMETERS)), ()).error
    return math.sqrt(left / float(np.count_nonzero(data.valid)))


def supported_orders(
    content: BandContent, rest: float, blocked: str | None
) -> tuple[BandContent, tuple[Cause, ...]]:
    """The content without orders that are not supported, and these as suspicions.

    Parameters
    ----------
    rest : float
        Rms of what the extended model leaves beyond noise, over that of the effort. A cause is
        larger.
    blocked : str or None
        Why no cause may be named, if so.
    """
    kept, suspected = [], []
    for order in content.orders:
        decision = larger_than_rest(order.share, rest)
        if decision.accepted and not blocked:
            kept.append(order)
        else:
            suspected.append(replace(_cause(order), decision=blocked or decision.reason))
    return replace(content, orders=tuple(kept)), tuple(suspected)


def beside_causes(
    content: BandContent,
    model: FittedModel,
    recordings: Sequence[Recording],
    name: str,
    data: AxisData,
) -> BandContent:
    """What stays of the content once the effort of the causes is subtracted.

    A jump of friction, for example, has harmonics above the band, and a push is like a wave over
    the way that the axis has gone meanwhile. No formula rings just as the machine does, so beside
    causes the comparison alone judges what lies inside its band.

    Parameters
    ----------
    model : FittedModel
        With the causes, and with the orders that are worth naming.
    """
    if not model.terms or not (content.orders or content.without_cause):
        return content
    causes = replace(model.axis, terms=tuple(_but(model.axis.terms, content.orders)))
    beside = above_band(recordings, name, data, Model({name: causes}))
    cutoff_hz = max(s.cutoff_hz for s in data.segments)
    return replace(
        content,
        orders=tuple(order for order in content.orders if _among(order, beside.orders)),
        unnamed_orders=beside.unnamed_orders,
        lines=beside.lines,
        unsteady=tuple(one for one in beside.unsteady if one.highest_hz > cutoff_hz),
    )


def with_band_content(
    found: AxisDiagnosis, content: BandContent, axis: AxisModel, tolerance: float
) -> AxisDiagnosis:
    """A diagnosis with what lies above the band.

    Orders are causes. No effect names lines, nor what keeps no frequency, nor orders that may be an
    error of the encoder: the verdict on an axis that has one above the tolerance is
    'unexplained'.

    Parameters
    ----------
    found : AxisDiagnosis
        Of a search beside `with_ripples`.
    """
    inside = [cause.term for cause in found.causes]
    # beside an order in the model, the search may find what its rate is off by: no other ripple
    new = [
        order
        for order in _new(axis.terms, content.orders)
        if order.share >= tolerance or _new(inside, [order])
    ]
    unnamed = _new((*axis.terms, *inside), content.unnamed_orders)
    worth = [_cause(s) for s in new if s.recorded >= tolerance]
    minor = [_cause(s) for s in new if s.recorded < tolerance]
    lasting = [s for s in content.lines if not _told(s, found.external_vibrations)]
    unsteady = [s for s in content.unsteady if s.share >= tolerance]
    per_unit = 1.0 if found.model.position_unit == "rad" else math.tau
    lines = (
        *(_line(s, s.rate / per_unit, None) for s in unnamed),
        *(_line(s, None, s.rate / math.tau) for s in lasting),
        *(_unsteady(s) for s in unsteady),
    )
    verdict = found.verdict
    if worth and verdict is Verdict.ADEQUATE:
        verdict = Verdict.EXPLAINED
    if unsteady or any(s.recorded >= tolerance for s in (*unnamed, *lasting)):
        verdict = Verdict.UNEXPLAINED
    return replace(
        found,
        verdict=verdict,
        causes=strongest_first((*found.causes, *worth)),
        minor=strongest_first((*found.minor, *minor)),
        share_in_band=content.share_in_band,
        lines=lines,
    )


def without_names(content: BandContent) -> BandContent:
    """The content of a recording that contradicts itself: no order has a cause."""
    return replace(content, orders=(), unnamed_orders=(*content.orders, *content.unnamed_orders))


def _new(terms: Sequence[Term], orders: Sequence[Sinusoid]) -> list[Sinusoid]:
    """Orders that are not among the terms."""
    known = [math.tau / float(np.asarray(t.values["period"])) for t in terms if t.effect == _RIPPLE]
    return [s for s in orders if all(abs(s.rate - k) > SAME_RATE * k for k in known)]


def _told(line: Sinusoid, vibrations: Sequence[OutsideVibration]) -> bool:
    """Whether a line is what is left of a vibration that the diagnosis tells of."""
    return any(
        abs(line.rate - math.tau * v.frequency_hz) <= SAME_RATE * line.rate
        and line.amplitude < v.amplitude
        for v in vibrations
    )


def _but(terms: Sequence[Term], orders: Sequence[Sinusoid]) -> list[Term]:
    """Terms without these orders."""
    return [t for t in terms if t.effect != _RIPPLE or len(_new([t], orders)) == len(orders)]


def _among(order: Sinusoid, others: Sequence[Sinusoid]) -> bool:
    return not _new([_term(other) for other in others], [order])


def _term(order: Sinusoid) -> Term:
    period = math.tau / order.rate
    return Term(
        _RIPPLE,
        {"cosine": order.cosine, "sine": order.sine, "period": period},
        {"cosine": order.std, "sine": order.std, "period": period * order.rate_std / order.rate},
    )


def _cause(order: Sinusoid) -> Cause:
    search = named(_RIPPLE).search
    speeds = "has too few speeds to tell" if order.at_one_speed else "has the speeds that tell"
    encoder = Alternative(
        effect="encoder_eccentricity",
        separable=not order.at_one_speed,
        evidence=f"its effort grows with the square of the speed, and the motion {speeds}",
        experiment=search.experiment,
    )
    return Cause(
        term=_term(order),
        held_out_gain=float(np.mean(order.gain)),
        held_out_gain_interval=order.gain,
        share=order.share,
        alternatives=(encoder,),
        evidence=(
            f"{search.signature}; found above the band, at full bandwidth: it makes up "
            f"{order.share:.1%} of the effort, and the amplitude of either half of the recording "
            f"reduces what is left of the other by {order.gain[0]:.0%} to {order.gain[1]:.0%}"
        ),
        decision="stands out of the noise beside it in both halves of the recording",
    )


def _line(sinusoid: Sinusoid, order: float | None, frequency_hz: float | None) -> SpectralLine:
    return SpectralLine(order, frequency_hz, sinusoid.amplitude, sinusoid.std)


def _unsteady(found: Disturbance) -> SpectralLine:
    limits_hz = (found.lowest_hz, found.highest_hz)
    return SpectralLine(None, None, found.amplitude, found.std, frequency_range_hz=limits_hz)
