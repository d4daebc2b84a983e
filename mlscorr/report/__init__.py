"""The report of a correction: figures and one self-contained page."""

from mlscorr.report.calibration_page import calibration_page, calibration_screen
from mlscorr.report.cloud import view_cloud
from mlscorr.report.comparison_page import comparison_figure, write_comparison
from mlscorr.report.comparison_screen import comparison_screen
from mlscorr.report.correction_page import write_report
from mlscorr.report.figures import draw_figure, write_pictures
from mlscorr.report.headline import first_screen
from mlscorr.report.target_figures import write_contact_sheet
