"""Pages of a diagnosis and of a plan, and their figures."""

from mlscorr.report.gap._plan import accuracy_sentence
from mlscorr.report.gap.first_screen import gap_screen
from mlscorr.report.gap.page import diagnosis_figures, diagnosis_page, plan_figures, plan_page
