"""Reports: a command's results, in one HTML file with all that is needed to trust it and to do it again."""

from harvester.report.answers import of_comparison, of_run
from harvester.report.measurements import of_identification, of_record
from harvester.report.page import Page, html, titled, write
from harvester.report.printed import (
    of_charge,
    of_motion,
    of_response,
    of_search,
    of_stability,
    of_tolerance,
)
from harvester.report.studies import of_cost, of_paper, of_sweep

__all__ = [
    "Page",
    "html",
    "of_charge",
    "of_comparison",
    "of_cost",
    "of_identification",
    "of_motion",
    "of_paper",
    "of_record",
    "of_response",
    "of_run",
    "of_search",
    "of_stability",
    "of_sweep",
    "of_tolerance",
    "titled",
    "write",
]
