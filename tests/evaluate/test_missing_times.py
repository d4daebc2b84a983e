"""Points without a time are not called points outside the trajectory."""

import laspy
import numpy as np
import pytest

import mlscorr
from mlscorr.evaluate import BeamCheck
from mlscorr.io.clouds import read_chunks
from tests.beds.missing_times import write_survey


@pytest.mark.parametrize("late", [0, 200])
def test_points_without_a_time_are_not_outside_the_trajectory(late, tmp_path):
    "1 % of points with time -1 are reported, and so are points after the trajectory's end"
    times = write_survey(tmp_path, -1.0, step=31)
    las = laspy.read(tmp_path / "pass.las")
    las.gps_time = np.where(
        (np.arange(len(times)) >= len(times) - late) & (times > 0), times + 20.0, times
    )
    las.write(tmp_path / "pass.las")
    with pytest.warns(UserWarning, match="gps_time -1"):
        survey = mlscorr.read_survey(tmp_path)
    beams = BeamCheck(survey)
    list(beams.watched(read_chunks)(survey.clouds[0]))
    lost = list(beams.uncovered())
    assert [each.key for each in lost] == ["no time", "outside"][: 1 + (late > 0)]
    assert lost[0].values["values"] == "-1"
