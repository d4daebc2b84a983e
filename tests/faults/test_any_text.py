"""Tables and survey files of any content: what was written is read, all else refused in words."""

import warnings

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from mlscorr.frames import angles_from_attitude, attitude_from_angles
from mlscorr.io.store import read_toml
from mlscorr.io.surveys import SurveyFile
from mlscorr.io.tables import ControlSection, read_control
from mlscorr.io.trajectories import read_trajectory, write_trajectory_csv
from mlscorr.survey import Trajectory
from tests.faults.sizes import tries

EXAMPLES = settings(
    max_examples=tries(25, 1000),
    deadline=None,
    derandomize=True,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)
CONTROL = "name,easting,northing,height,sigma_horizontal,sigma_vertical,kind,size,role\n"
TRAJECTORY = "gps_time,easting,northing,height,roll,pitch,heading\n"
SURVEY = '[cloud]\nfiles = ["a.las"]\n[trajectory]\nfile = "a.csv"\n[control]\nfile = "b.csv"\n'
LIST = "Punkt;Ostwert;Nordwert;Höhe\n"
OF_ALL = ControlSection(file="", kind="circle", size=0.6, sigma=[0.003, 0.004])
READERS = {
    "list.txt": (LIST, lambda path: read_control(path, OF_ALL)),
    "drive.txt": (TRAJECTORY.replace(",", "\t"), read_trajectory),
    "control.csv": (CONTROL, read_control),
    "trajectory.csv": (TRAJECTORY, read_trajectory),
    "survey.toml": (SURVEY, lambda path: read_toml(path, SurveyFile, "it")),
}
names = st.text(st.characters(codec="utf-8", categories=("L", "N")), min_size=1, max_size=12)
coordinates = st.decimals(-1e7, 1e7, places=4)
millimetres = st.decimals("0.0001", 1, places=4)
points = st.tuples(names, *[coordinates] * 3, *[millimetres] * 2)


@pytest.mark.parametrize("name", READERS)
@EXAMPLES
@given(
    st.text(alphabet=st.characters(codec="utf-8"), max_size=200) | st.text('0123456789.,-e"\n=[]#')
)
def test_any_text_is_read_or_refused(name, tmp_path, text):
    "Behind its header a file may hold anything: a ValueError that names it, or a result"
    head, read = READERS[name]
    path = tmp_path / name
    for content in (text, head + text):
        path.write_text(content, encoding="utf-8", newline="")
        with warnings.catch_warnings(action="ignore"):
            try:
                read(path)
            except ValueError as error:
                assert name in str(error) and str(error)[-1] in ".?", error


@EXAMPLES
@given(st.lists(points, min_size=1, max_size=8, unique_by=lambda point: point[0]))
def test_control_is_read_as_it_was_written(tmp_path, rows):
    "Names, coordinates and sigmas of up to eight points come back to the last digit"
    path = tmp_path / "control.csv"
    lines = [f"{','.join(map(str, row))},circle,0.6,control\n" for row in rows]
    path.write_text(CONTROL + "".join(lines), encoding="utf-8")
    with warnings.catch_warnings(action="ignore"):
        control, check, _ = read_control(path)
    assert len(check) == 0
    assert list(control.name) == [row[0] for row in rows]
    assert np.array_equal(control.position, np.array([row[1:4] for row in rows], float))
    assert np.array_equal(control.sigma[:, [0, 2]], np.array([row[4:] for row in rows], float))


@EXAMPLES
@given(st.integers(2, 40), st.integers(0, 2**32 - 1), st.booleans())
def test_a_trajectory_is_read_as_it_was_written(tmp_path, epochs, seed, states):
    "Times to the microsecond, positions to a tenth of a millimetre, attitudes to its arc, sigmas"
    rng = np.random.default_rng(seed)
    times = rng.uniform(0, 6e5) + np.cumsum(rng.uniform(0.005, 0.02, epochs))
    place = rng.uniform([2e5, 1e5, -100], [8e5, 9e6, 4000])
    position = place + np.cumsum(rng.normal(0, 0.05, (epochs, 3)), axis=0)
    angles = rng.uniform([-0.5, -0.5, 0.0], [0.5, 0.5, 6.28], (epochs, 3))
    if states:
        sigmas = rng.uniform(0.001, 1.0, (2, epochs, 3))
    else:
        sigmas = (None, None)
    written = Trajectory(times, position, attitude_from_angles(*angles.T), *sigmas)
    path = tmp_path / "trajectory.csv"
    write_trajectory_csv(path, written)
    with warnings.catch_warnings(action="ignore"):
        read = read_trajectory(path)
    assert np.abs(read.gps_time - times).max() < 2e-6
    assert np.abs(read.position - position).max() < 1e-4
    assert np.abs(np.subtract(angles_from_attitude(read.attitude), angles.T)).max() < 1e-6
    assert (read.position_sigma is None) == (not states)
    if states:
        assert np.abs(read.position_sigma - sigmas[0]).max() < 1e-3
