"""Times of another system and coordinates of another zone are called what they are."""

import numpy as np
import pytest

from mlscorr.frames import attitude_from_angles
from mlscorr.io.projection import check_area, check_crs
from mlscorr.io.sbet import read_sbet
from mlscorr.survey import Trajectory

START = 357_700.0  # s of week


def recorded(folder, late):
    "An SBET of 60 s, late against its smrmsg"
    sbet, smrmsg = np.zeros((6001, 17)), np.zeros((61, 10))
    sbet[:, 0] = START + late + 0.01 * np.arange(6001)
    sbet[:, 1:4] = np.radians(30.4926), np.radians(117.3333), 40.0
    smrmsg[:, 0] = START + np.arange(61)
    smrmsg[:, 1:] = 0.02
    sbet.tofile(folder / "a.sbet")
    smrmsg.tofile(folder / "a.out")
    return folder / "a.sbet", "EPSG:32650", folder / "a.out"


@pytest.mark.parametrize(
    ("late", "cause"),
    [
        (604_800.0, r"\+1 weeks apart, so one of the two has the wrong GPS week"),
        (-18.0, r"-18\.0 s apart, so one may be in UTC"),
        (400.0, "belongs to another one"),
    ],
)
def test_an_accuracy_of_another_time_system_is_named(late, cause, tmp_path):
    "A week late, in UTC, or of another drive: not all of these are a wrong file"
    assert len(read_sbet(*recorded(tmp_path, 0.0))) == 6001
    with pytest.raises(ValueError, match=cause):
        read_sbet(*recorded(tmp_path, late))


def drive(east, north):
    level = attitude_from_angles(np.zeros(2), 0.0, 0.0)
    return Trajectory(START + np.arange(2.0), np.array([[east, north, 40.0]] * 2), level)


def test_places_outside_the_area_of_a_crs_are_told():
    "Within a zone and a little beyond nothing is said; two zones away, or swapped, it is"
    crs = check_crs("EPSG:32650")
    check_area(crs, drive(532e3, 3374e3))
    check_area(crs, drive(200e3, 3374e3))
    for place in ((-700e3, 3374e3), (3374e3, 532e3)):
        with pytest.warns(UserWarning, match="made for 114 to 120 .* another zone, or easting"):
            check_area(crs, drive(*place))
