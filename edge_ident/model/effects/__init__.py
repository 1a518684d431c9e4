"""The catalogue of effects: one file each, found by being in this folder.

A file holds one subclass of `edge_ident.model.effect.Effect` and its instance `EFFECT`. The name of
an effect is the name of its file. Nothing else in the project lists effects.
"""

import importlib
import pkgutil
from collections.abc import Mapping
from functools import cache
from types import MappingProxyType
from typing import Final

import numpy as np

from edge_ident.errors import ModelError
from edge_ident.model.effect import Effect
from edge_ident.model.external_vibration import EXTERNAL_VIBRATION
from edge_ident.model.model import Term
from edge_ident.model.rigid_body import RIGID_BODY
from edge_ident.model.strengths import Draws, Scale

_UNCATALOGUED: Final = {effect.name: effect for effect in (RIGID_BODY, EXTERNAL_VIBRATION)}


@cache
def catalogue() -> Mapping[str, Effect]:
    """All effects by name, in alphabetical order.

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
    return MappingProxyType({name: module.EFFECT for name, module in modules.items()})


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
    shape = scale.inertia.shape
    defaults = {name: np.full(shape, value) for name, value in effect.complete({}).items()}
    values = {**defaults, **effect.draw(Draws(rng, shape), scale)}
    return Term(name, values, source_axis=source_axis if effect.needs_source else None)
