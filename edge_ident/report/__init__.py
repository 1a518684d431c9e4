"""Results become something to read: documents, tables, figures, pages.

The command line imports these names from here. Each loads its module when it is first used.
"""

from typing import TYPE_CHECKING

from edge_ident.support.lazy import lazy_names

if TYPE_CHECKING:
    from edge_ident.report.comparison import comparison_document
    from edge_ident.report.diagnosis import diagnosis_answer, diagnosis_document
    from edge_ident.report.documents import (
        gains_document,
        identification_document,
        simulation_document,
    )
    from edge_ident.report.findings import with_next_steps
    from edge_ident.report.gains import GainReport, gain_report_document, gain_report_view
    from edge_ident.report.identification import identification_answer
    from edge_ident.report.machine import (
        drive_document,
        fault_documents,
        fault_lines,
        profile_view,
        register_lines,
        registers_document,
        save_waterfall,
        values_text,
    )
    from edge_ident.report.page.diagnosis_page import write_markdown, write_page
    from edge_ident.report.page.rendering import Provenance
    from edge_ident.report.page.run_page import write_run_page
    from edge_ident.report.page.survey_page import write_survey_page
    from edge_ident.report.plan import plan_document, plan_next_step
    from edge_ident.report.recordings import (
        import_document,
        inspection_lines,
        recording_lines,
        resting_lines,
        scale_lines,
    )
    from edge_ident.report.render import drawn, save_figure, show
    from edge_ident.report.run import outcome_view, run_charts
    from edge_ident.report.run_documents import (
        capture_document,
        hold_document,
        home_document,
        home_lines,
        profile_document,
        run_document,
    )
    from edge_ident.report.survey import survey_document, survey_lines, write_survey_tables
    from edge_ident.support.documents import to_json, write_json
    from edge_ident.support.next_step import Done

__all__ = [
    "Done",
    "GainReport",
    "Provenance",
    "capture_document",
    "comparison_document",
    "diagnosis_answer",
    "diagnosis_document",
    "drawn",
    "drive_document",
    "fault_documents",
    "fault_lines",
    "gain_report_document",
    "gain_report_view",
    "gains_document",
    "hold_document",
    "home_document",
    "home_lines",
    "identification_answer",
    "identification_document",
    "import_document",
    "inspection_lines",
    "outcome_view",
    "plan_document",
    "plan_next_step",
    "profile_document",
    "profile_view",
    "recording_lines",
    "register_lines",
    "registers_document",
    "resting_lines",
    "run_charts",
    "run_document",
    "save_figure",
    "save_waterfall",
    "scale_lines",
    "show",
    "simulation_document",
    "survey_document",
    "survey_lines",
    "to_json",
    "values_text",
    "with_next_steps",
    "write_json",
    "write_markdown",
    "write_page",
    "write_run_page",
    "write_survey_page",
    "write_survey_tables",
]

__getattr__ = lazy_names(
    __name__,
    {
        "edge_ident.report.diagnosis": "diagnosis_answer diagnosis_document",
        "edge_ident.report.identification": "identification_answer",
        "edge_ident.report.comparison": "comparison_document",
        "edge_ident.report.documents": "gains_document identification_document simulation_document",
        "edge_ident.report.gains": "GainReport gain_report_document gain_report_view",
        "edge_ident.report.recordings": (
            "import_document inspection_lines recording_lines resting_lines scale_lines"
        ),
        "edge_ident.report.machine": (
            "drive_document fault_documents fault_lines "
            "profile_view register_lines registers_document save_waterfall values_text"
        ),
        "edge_ident.report.findings": "with_next_steps",
        "edge_ident.report.render": "drawn save_figure show",
        "edge_ident.report.page.diagnosis_page": "write_markdown write_page",
        "edge_ident.report.page.rendering": "Provenance",
        "edge_ident.report.page.run_page": "write_run_page",
        "edge_ident.report.page.survey_page": "write_survey_page",
        "edge_ident.report.plan": "plan_document plan_next_step",
        "edge_ident.report.run_documents": (
            "capture_document hold_document home_document home_lines profile_document run_document"
        ),
        "edge_ident.report.run": "outcome_view run_charts",
        "edge_ident.report.survey": "survey_document survey_lines write_survey_tables",
        "edge_ident.support.documents": "to_json write_json",
        "edge_ident.support.next_step": "Done",
    },
)
