"""Sentences of check and correct about one survey."""

import warnings
from typing import NamedTuple

import mlscorr


class Verdicts(NamedTuple):
    "Faults that check finds, whether it found a control point, and what correct refuses by"

    faults: list
    is_searched: bool
    refusal: str

    @property
    def is_passed(self):
        return self.is_searched and not self.faults


def verdicts(path, ties="off"):
    "Both, of a survey.toml or its folder; what a correction refuses is empty where it does not"
    with warnings.catch_warnings(action="ignore"):
        checked = mlscorr.check(path)
        refusal = ""
        try:
            mlscorr.correct(mlscorr.read_survey(path), ties=ties)
        except (ValueError, OSError) as error:
            refusal = str(error)
    return Verdicts([fault.sentence for fault in checked.faults], checked.is_searched, refusal)
