"""Identify a feed drive, diagnose what its model gets wrong, and design its gains.

This is the public API. What is not named in `__all__`, which `__init__.pyi` lists, is private and
free to change. Names load their module when they are first used, so that importing the package is
fast.

Results are plain data. How one is shown, as text, table or picture, is its view; which function
makes that of which class is said here, so that results know nothing of the package `report`. This
module is imported before any other of the package, so no result is there before it is said.

>>> import edge_ident
>>> recording = edge_ident.simulate()
>>> found = edge_ident.identify(recording)
>>> found.trusted
True
"""

from edge_ident.support.lazy import lazy_names, shown_by
from edge_ident.support.version import VERSION

__version__ = VERSION

__getattr__, __all__ = lazy_names(__name__, __path__[0])
__all__ += ["__version__"]

shown_by(
    {
        "edge_ident.report.gains": "GainDesigns=designs_view",
        "edge_ident.report.identification": "Identification=identification_view",
        "edge_ident.report.comparison": "Comparison=comparison_view",
        "edge_ident.report.diagnosis": "Diagnosis=diagnosis_view",
        "edge_ident.report.error_budget": "ErrorBudget=budget_view",
        "edge_ident.report.plan": "MotionPlan=plan_view",
        "edge_ident.report.numbers": "Model=model_view",
        "edge_ident.report.recordings": "Recording=recording_view",
        "edge_ident.report.survey": "Survey=survey_view",
    }
)


def __dir__() -> list[str]:
    return sorted(__all__)
