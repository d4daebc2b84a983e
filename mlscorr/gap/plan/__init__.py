"""Expected results of a survey, and additions that would separate its causes."""

from mlscorr.gap.plan._planned_rows import event_sizes, planned_rows
from mlscorr.gap.plan.additions import NextData, next_data
from mlscorr.gap.plan.draws import ATTEMPTS, Ruler, draw_effects, draw_mechanism, names_to_try
