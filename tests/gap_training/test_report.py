"""Tables of figures, and what a study is asked."""

from pathlib import Path

import pytest
from gap_training.fit import figures, out_of_fold
from gap_training.report import print_figures, study_arguments

from mlscorr.gap.evidence import OPERATING_POINTS
from tests.beds.joint_scores import records


def test_a_table_has_a_column_each_operating_point(capsys):
    "Calibration errors stand in the row of that name as figures gives them, three digits"
    known = records(48)
    probabilities = out_of_fold(known)
    print_figures(known, probabilities)
    head, *rows = capsys.readouterr().out.splitlines()
    assert head.split() == ["cases", *OPERATING_POINTS]
    numbers = next(row for row in rows if row.startswith("calibration error")).split()[2:]
    assert int(numbers[0]) == 48
    for number, costs in zip(numbers[1:], OPERATING_POINTS.values(), strict=True):
        expected = figures(known, probabilities, costs)["calibration error"][0]
        assert float(number) == pytest.approx(expected, abs=5e-4)


def test_a_study_needs_a_folder_alone():
    "All else has defaults, those of the worlds its own"
    given = study_arguments("", 5000, 10).parse_args(["kept"])
    assert (given.folder, given.first, given.worlds, given.cases) == (Path("kept"), 5000, 10, 24)
