"""The section of report.json on ties."""

from dataclasses import replace

import numpy as np
import pytest

from mlscorr.estimate import TieResiduals, estimate_correction, with_ties
from mlscorr.evaluate import tie_section
from tests.beds.tied_passes import tied_passes


@pytest.mark.long
def test_the_section_counts_and_measures_what_was_given():
    """300 planes of one pair of passes: decimetres apart before, their noise of 4 mm after; none
    that was refused counts, and where there are none there is a reason
    """
    survey = tied_passes(2)
    alone = estimate_correction(survey.trajectory, survey.matched)
    assert tie_section(alone) is None
    refused = TieResiduals(survey.ties, np.zeros(300, bool), survey.ties.misclosure)
    section = tie_section(replace(alone, ties=refused))
    assert (section["n"], section["used"], section["share"]) == (300, 0, {"control": 1.0})
    assert section["pairs"][0]["after"] == {"median": None, "rms": None}
    reason = tie_section(replace(alone, untied="Nothing was scanned twice."))
    assert reason == {"n": 0, "used": 0, "reason": "Nothing was scanned twice."}
    section = tie_section(with_ties(alone, survey.ties))
    assert section["n"] == 300
    assert section["kinds"] == {"plane": 300, "pole": 0, "line": 0, "dash": 0}
    (row,) = section["pairs"]
    assert row["passes"] == [1, 2]
    assert row["used"] == section["used"] <= row["n"] == 300
    assert row["before"]["median"] == pytest.approx(np.median(np.abs(survey.ties.misclosure)), 0.1)
    assert row["after"]["rms"] == pytest.approx(0.004, rel=0.25)  # m
