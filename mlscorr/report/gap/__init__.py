"""The pages of a diagnosis and of a plan, and their figures."""

from mlscorr.report.gap.figures import diagnosis_figures, draw, plan_figures
from mlscorr.report.gap.page import diagnosis_page, plan_page
