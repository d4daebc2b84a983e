"""The pages of a diagnosis and of a plan, and their figures."""

from mlscorr.report.gap.accuracy import accuracy_sentence
from mlscorr.report.gap.figures import diagnosis_figures, plan_figures
from mlscorr.report.gap.first_screen import gap_screen
from mlscorr.report.gap.page import diagnosis_page, plan_page
