"""Names of a package that load their module when they are first used (PEP 562).

A package that offers names of many modules would otherwise load scipy and onnxruntime for a caller
who wants neither.

So do the views of results: a result is plain data, and does not know what shows it.
"""

from collections.abc import Callable
from importlib import import_module

TYPE_CHECKING = False  # loading typing takes longer than all that a script's start needs
if TYPE_CHECKING:
    from typing import Any


def lazy_names(package: str, folder: str) -> "tuple[Callable[[str], Any], list[str]]":
    """Make the `__getattr__` of a package and list its names, both by its stub `__init__.pyi`.

    Parameters
    ----------
    package : str
        Name of the package.
    folder : str
        Where the stub stands, a line `from MODULE import NAME as NAME` for each name; of a
        package, a name may be one of its modules.

    Returns
    -------
    attribute : callable
        Raises AttributeError for a name that the package does not offer. It keeps nothing: what
        a test puts in the place of a function is found.
    names : list of str
    """
    with open(f"{folder}/__init__.pyi", encoding="utf-8") as stub:
        where = {line.split()[-1]: line.split()[1] for line in stub if line.startswith("from ")}

    def attribute(name: str) -> "Any":
        if name not in where:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        home = vars(import_module(where[name]))
        return home[name] if name in home else import_module(f"{where[name]}.{name}")

    return attribute, list(where)


VIEWS: "dict[str, str]" = {}
"""By the name of a class of results, the module that has its view as `VIEW`."""


_RENDERER = "edge_ident.report.render"


def renderer() -> "Any":
    """The module that shows views; it is loaded when the first one is shown."""
    return import_module(_RENDERER)


def view_of(result: "Any") -> "Any":
    """The view of a kind of result; its module is loaded for the first one.

    Raises
    ------
    LookupError
        No view is known of its class.
    """
    for kind in type(result).__mro__:
        if kind.__name__ in VIEWS:
            return import_module(VIEWS[kind.__name__]).VIEW
    raise LookupError(f"no view of {type(result).__name__}")
