"""The pages of a diagnosis and of a plan."""

from mlscorr.report.gap.page import diagnosis_page, plan_page
