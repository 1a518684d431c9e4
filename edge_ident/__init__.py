"""Identify a feed drive, diagnose what its model gets wrong, and design its gains.

This is the public API. What is not named in `__all__`, which `__init__.pyi` lists, is private and
free to change. Names load their module when they are first used, so that importing the package is
fast.

Results are plain data. How one is shown, as text, table or picture, is its view; which module has
that of which class is said here, so that results know nothing of the package `report`. This module
is imported before any other of the package, so no result is there before it is said.

>>> import edge_ident
>>> recording = edge_ident.simulate()
>>> found = edge_ident.identify(recording)
>>> found.trusted
True
"""

from edge_ident.support.lazy import VIEWS, lazy_names
from edge_ident.support.version import VERSION

__version__ = VERSION

__getattr__, __all__ = lazy_names(__name__, __path__[0])
__all__ += ["__version__"]

VIEWS |= {
    "GainDesigns": "edge_ident.report.gains",
    "Identification": "edge_ident.report.identification",
    "Comparison": "edge_ident.report.comparison",
    "Diagnosis": "edge_ident.report.diagnosis",
    "ErrorBudget": "edge_ident.report.error_budget",
    "MotionPlan": "edge_ident.report.plan",
    "Model": "edge_ident.report.numbers",
    "Recording": "edge_ident.report.recordings",
    "Survey": "edge_ident.report.survey",
}


def __dir__() -> list[str]:
    return sorted(__all__)
