"""The report of a correction: figures and one self-contained page."""

from mlscorr.report.cloud import view_cloud
from mlscorr.report.comparison import basis, verdict, write_comparison
from mlscorr.report.figures import write_pictures
from mlscorr.report.html import write_report
from mlscorr.report.target_figures import write_contact_sheet

__all__ = [
    "basis",
    "verdict",
    "view_cloud",
    "write_comparison",
    "write_contact_sheet",
    "write_pictures",
    "write_report",
]
