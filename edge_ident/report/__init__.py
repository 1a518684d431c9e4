"""Results become something to read: documents, tables, figures, pages.

The command line takes the modules from here. Each loads when it is first named.
"""

from typing import TYPE_CHECKING

from edge_ident.support.lazy import lazy_modules

if TYPE_CHECKING:
    from edge_ident.report import (  # noqa: F401
        comparison,
        diagnosis,
        documents,
        findings,
        gains,
        identification,
        machine,
        plan,
        recordings,
        render,
        run,
        run_documents,
        survey,
    )  # fmt: skip
    from edge_ident.report.page import diagnosis_page as diagnosis_page
    from edge_ident.report.page import rendering as rendering
    from edge_ident.report.page import run_page as run_page
    from edge_ident.report.page import survey_page as survey_page

__getattr__ = lazy_modules(
    __name__,
    "edge_ident.report.page.diagnosis_page",
    "edge_ident.report.page.rendering",
    "edge_ident.report.page.run_page",
    "edge_ident.report.page.survey_page",
)
