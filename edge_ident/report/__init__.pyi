"""Modules that the command line takes from here."""

from edge_ident.report import comparison as comparison
from edge_ident.report import diagnosis as diagnosis
from edge_ident.report import documents as documents
from edge_ident.report import findings as findings
from edge_ident.report import gains as gains
from edge_ident.report import identification as identification
from edge_ident.report import machine as machine
from edge_ident.report import plan as plan
from edge_ident.report import recordings as recordings
from edge_ident.report import render as render
from edge_ident.report import run as run
from edge_ident.report import run_documents as run_documents
from edge_ident.report import survey as survey
from edge_ident.report.page import diagnosis_page as diagnosis_page
from edge_ident.report.page import rendering as rendering
from edge_ident.report.page import run_page as run_page
from edge_ident.report.page import survey_page as survey_page
