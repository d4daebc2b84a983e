"""What a survey will be able to show, and what more would tell its causes apart."""

from mlscorr.gap.plan.additions import NextData, next_data
from mlscorr.gap.plan.planned_rows import event_sizes, planned_rows
