"""One method per file, named as the file; each has `estimate(problem) -> Estimate`.

A method that does not apply raises an `EdgeIdentError` with the reason. To add a method, add a
file.
"""

import importlib
import pkgutil
from collections.abc import Callable

from edge_ident.baselines.problem import Problem
from edge_ident.model.model import Estimate

Method = Callable[[Problem], Estimate]


def all_methods() -> dict[str, Method]:
    """Every method by its name, in alphabetical order."""
    names = sorted(module.name for module in pkgutil.iter_modules(__path__))
    return {name: importlib.import_module(f"{__name__}.{name}").estimate for name in names}
