"""The catalogue of effects: one file each, found by being in this folder.

A file holds one subclass of `edge_ident.model.effect.Effect` and its instance `EFFECT`. The name of
an effect is the name of its file. Nothing else in the project lists effects. Effects of a user's
own, from any file, join them by `register_effect` for as long as the program runs.
"""

import importlib
import pkgutil
import sys
from collections.abc import Mapping
from copy import copy
from dataclasses import replace
from functools import cache
from types import MappingProxyType
from typing import Final

import numpy as np

from edge_ident.errors import ModelError
from edge_ident.model.effect import Advice, Compensation, Draws, Effect, Scale, no_draw
from edge_ident.model.measured_curves import MEASURED
from edge_ident.model.model import Term
from edge_ident.model.rigid_body import EXTERNAL_VIBRATION, RIGID_BODY

_UNCATALOGUED: Final[Mapping[str, Effect]] = {
    RIGID_BODY.name: RIGID_BODY,
    EXTERNAL_VIBRATION.name: EXTERNAL_VIBRATION,
    **MEASURED,
}


_registered: dict[str, Effect] = {}
_file_of: dict[str, str] = {}
"""Where each was registered."""


@cache
def catalogue() -> Mapping[str, Effect]:
    """All effects by name, in alphabetical order, those of a user's own among them.

    Raises
    ------
    ModelError
        An effect's file does not hold what the project relies on.
    """
    from edge_ident.model.registration import check_effect

    names = sorted(module.name for module in pkgutil.iter_modules(__path__))
    modules = {name: importlib.import_module(f"{__name__}.{name}") for name in names}
    for name, module in modules.items():
        check_effect(name, getattr(module, "EFFECT", None), names)
    every = {name: module.EFFECT for name, module in modules.items()} | _registered
    return MappingProxyType({name: every[name] for name in sorted(every)})


def register_effect(effect: Effect) -> str:
    """Let the diagnosis, the simulation and model files know an effect of your own.

    It needs its physics and how it is searched for. What it means to a person, what gains do about
    it and values for training can be left out; whoever needs them is told that they are not there.
    An effect of the same name that was registered before is replaced. Only this program knows it,
    and not the commands. The processes of `survey` learn it from the file that calls this: they
    carry out that file as far as the call.

    Parameters
    ----------
    effect : Effect
        An instance of your subclass.

    Returns
    -------
    str
        Its name, for a `Term`: that of the class, in words joined by underscores.

    Raises
    ------
    ModelError
        It is no effect, its name is that of another one, or it lacks something; the message names
        all that it lacks.

    Examples
    --------
    >>> import edge_ident
    >>> class SquareDrag(edge_ident.Effect):
    ...     "Drag that grows with the square of the speed."
    ...     parameters = (edge_ident.Parameter("level", "{effort}", 0.0, 1e9, "at unit speed"),)
    ...     def load(self, at, values):
    ...         return values["level"] * at.velocity * abs(at.velocity)
    >>> search = edge_ident.SearchSpec(forms=(edge_ident.Form(("level",)),))
    >>> edge_ident.register_effect(SquareDrag(search=search))
    'square_drag'
    """
    from edge_ident.model.registration import check_own_effect

    known = {*catalogue(), *_UNCATALOGUED} - set(_registered)
    found = check_own_effect(effect, known)
    if found.name in known:
        raise ModelError(
            f"there is an effect {found.name} already", "give the class of yours another name"
        )
    _registered[found.name] = _completed(found)
    _file_of[found.name] = sys._getframe(1).f_code.co_filename
    catalogue.cache_clear()
    return found.name


def registered() -> Mapping[str, tuple[Effect, str]]:
    """Effects that were registered by name, each with the file that did it."""
    return {name: (effect, _file_of[name]) for name, effect in _registered.items()}


def _completed(effect: Effect) -> Effect:
    """The effect with words in the place of those that it leaves out."""
    full, title = copy(effect), effect.title.rstrip(".")
    search, advice = effect.search, effect.advice
    full.search = replace(
        search,
        signature=search.signature or title,
        experiment=search.experiment or "a motion on which it is strong, at several speeds",
    )
    full.advice = Advice(
        advice.in_words or title,
        advice.part or f"what causes it ({effect.name.replace('_', ' ')})",
        advice.action or "Look at that part of the machine.",
        advice.size,
    )
    if not effect.compensation.used and not effect.compensation.without:
        full.compensation = Compensation(
            without="its class says nothing of gains; give it a Compensation to have it used"
        )
    return full


def named(name: str) -> Effect:
    """The effect of this name, the base term, or an external vibration.

    Raises
    ------
    ModelError
        There is none.
    """
    found = _UNCATALOGUED.get(name) or catalogue().get(name)
    if found is None:
        raise ModelError(f"there is no effect {name!r}", f"known: {', '.join(catalogue())}")
    return found


def random_term(
    name: str, rng: "np.random.Generator", scale: Scale, source_axis: str | None = None
) -> Term:
    """An effect at random strength for every drive of a scale, faint to strong.

    Parameters
    ----------
    name : str
    rng : numpy Generator
    scale : Scale
        Of the drives; its arrays' shape is that of the values.
    source_axis : str, optional
        Kept only by effects that need one.
    """
    effect = named(name)
    if effect.draw is no_draw:
        raise ModelError(
            f"effect {name} draws no random values for training",
            f"give {type(effect).__name__}(draw=...), from Draws and Scale to values",
        )
    shape = scale.inertia.shape
    defaults = {name: np.full(shape, value) for name, value in effect.complete({}).items()}
    values = {**defaults, **effect.draw(Draws(rng, shape), scale)}
    return Term(name, values, source_axis=source_axis if effect.needs_source else None)
