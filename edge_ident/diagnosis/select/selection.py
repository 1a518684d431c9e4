"""The search for causes, from the base model to the model that it ends with."""

from dataclasses import dataclass

import numpy as np

from edge_ident.diagnosis.fit.fitting import FittedModel, delayed, fit
from edge_ident.diagnosis.measures import worth_naming
from edge_ident.diagnosis.prepare.axis_data import AxisData
from edge_ident.diagnosis.select.backward_elimination import SupportedModel, eliminate_backward
from edge_ident.diagnosis.select.forward_selection import (
    Selection,
    first_causes,
    grown_on,
    select_forward,
)
from edge_ident.diagnosis.select.search import Search
from edge_ident.model.inverse import remembers
from edge_ident.model.model import PARAMETERS, AxisModel


@dataclass(frozen=True)
class Selected:
    """The base model of an axis, and the model that the selection ends with.

    Attributes
    ----------
    search : Search
    start : FittedModel
        The base model.
    supported : SupportedModel
        That backward elimination left of what forward selection found.
    """

    search: Search
    start: FittedModel
    supported: SupportedModel

    @property
    def late(self) -> bool:
        """Whether a delay is among what was selected."""
        return delayed(self.supported.model.axis)

    def better_than(self, other: "Selected") -> bool:
        """Whether the criterion prefers this model to that of another selection.

        Of an effort that is late, fewer samples are compared: the mean of the squares counts.
        """
        samples, values = other.search.criterion.samples, []
        for one in (self, other):
            value = one.search.with_samples(samples).criterion.value(one.supported.model)
            compared = np.count_nonzero(one.search.data.valid)
            values.append(value - samples * np.log(compared))
        return bool(values[0] < values[1])


def fitted_base(data: AxisData, template: AxisModel) -> FittedModel:
    """The base model beside what the axis is known to have; the fit starts from an inertia."""
    return fit(data, template, np.eye(len(PARAMETERS))[0], ())


def selected_model(data: AxisData, template: AxisModel, before: Search | None = None) -> Selected:
    """Select a model of an axis.

    Parameters
    ----------
    data : AxisData
    template : AxisModel
        The axis with what it is known to have.
    before : Search, optional
        On the same motion, with an effort that may have been moved since then.
    """
    start = fitted_base(data, template)
    search = before
    if search is None or search.data is not data:
        search = Search.of(data, template, start, before)
    return _with_hidden_events(_selected(search, start))


def first_selected(data: AxisData, template: AxisModel) -> Selected:
    """What a selection begins with; see `first_causes`."""
    start = fitted_base(data, template)
    first = first_causes(Search.of(data, template, start), start)
    unsupported = SupportedModel(first.model, (), (), converged=False)
    return Selected(first.search, start, unsupported)


def _selected(search: Search, start: FittedModel) -> Selected:
    return _eliminated(select_forward(search, start), start)


def _eliminated(selection: Selection, start: FittedModel) -> Selected:
    """Eliminate, and select on from there where what took a term's place has left as well."""
    search, model = selection.search, selection.model
    supported = eliminate_backward(search, model)
    left = {r.instead for r in supported.refused} - supported.model.effects - {""}
    if left:
        without = frozenset(r.effect for r in supported.refused if not r.instead)
        again = eliminate_backward(search, grown_on(search, supported.model, without))
        supported = again if search.gain(supported.model, again.model) > 0.0 else supported
    return Selected(search, start, supported)


def _with_hidden_events(selected: Selected) -> Selected:
    """Repeat a selection where left-out samples hide an event, with those samples valid."""
    inertia, template = float(selected.start.base[0]), selected.start.template
    data = with_hidden_events(selected.search.data, selected.supported.model, inertia)
    if data is selected.search.data:
        return selected
    start = fitted_base(data, template)
    return _selected(Search.of(data, template, start), start)


# Events in samples that the comparison leaves out.
#
# Aliased encoder rounding explains so much and no more. At the start of a recording, only friction
# and play remember what was before it: beside a model in which nothing remembers, an effort that is
# far off there is an event as well.


def with_hidden_events(data: AxisData, model: FittedModel, inertia: float) -> AxisData:
    """The data with samples valid at which something happened; the data itself where nothing did.

    Parameters
    ----------
    data : AxisData
    model : FittedModel
        That was selected on these data.
    inertia : float
        That turns aliased rounding into effort.
    """
    whole = data if remembers(model.axis.terms) else data.from_start()
    residual = whole.effort - fit(whole, model.template, model.base, model.terms).predicted
    hidden = whole.exceeds_aliasing(residual, inertia)
    if whole.late:
        hidden &= ~whole.near_ends(whole.late_s)
    added = [
        np.arange(len(s.sample_index)) < len(s.sample_index) - len(before.sample_index)
        for s, before in zip(whole.segments, data.segments, strict=True)
    ]
    start = np.concatenate(added)
    if not worth_naming(residual[hidden & start], data.effort[data.valid]):
        hidden &= ~start
    return whole.with_valid(hidden) if np.any(hidden) else data
