"""Times of another system and coordinates of another zone are called what they are."""

import numpy as np
import pytest

from mlscorr.frames import attitude_from_angles
from mlscorr.io.surveys import check_area, crs_notes
from mlscorr.io.surveys.crs_checks import check_scale
from mlscorr.io.trajectories import check_crs
from mlscorr.io.trajectories.projection import convergence_at
from mlscorr.io.trajectories.sbet import read_sbet
from mlscorr.survey import Trajectory

START = 357_700.0  # s of week


def recorded(folder, late):
    "An SBET of 60 s, late against its smrmsg"
    sbet = np.zeros((6001, 17))
    smrmsg = np.zeros((61, 10))
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
        (400.0, "belongs to another trajectory"),
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
        with pytest.warns(UserWarning, match="114 to 120.*another zone, or easting"):
            check_area(crs, drive(*place))
    check_area(check_crs("EPSG:27572"), drive(600e3, 2428e3))  # counts from Paris, in gon


def test_a_map_that_is_not_true_to_scale_is_told():
    "Mercator's map of the world stretches by 1 / cos(latitude), 1.161 at 30.5 deg; UTM not"
    check_scale(check_crs("EPSG:32650"), drive(200e3, 3374e3))
    with pytest.warns(UserWarning, match=r"The scale of EPSG.* at the trajectory is 1\.161"):
        check_scale(check_crs("EPSG:3857"), drive(12_750e3, 3570e3))


def test_longitudes_from_another_meridian_are_refused():
    "On the meridian of Paris grid north is true north; PROJ's factors would say 1.7 deg"
    with pytest.raises(ValueError, match="counts longitudes from Paris"):
        convergence_at("EPSG:27572", np.array([600e3]), np.array([2428e3]))


def test_eastings_with_the_zone_in_front_are_refused():
    "UTM 50 with 50 000 000 in front lies nowhere on its map, which is no matter of degrees"
    with pytest.raises(ValueError, match=r"outside the map of EPSG:32650.* zone prefix"):
        check_area(check_crs("EPSG:32650"), drive(50_532e3, 3374e3))


def test_latitudes_of_another_datum_are_told_by_how_much():
    "Bessel's and GNSS's latitudes are 190 m apart in Germany; ETRS89 and WGS 84 are one here"
    crs_notes("EPSG:25832", drive(566e3, 5930e3), True)
    with pytest.warns(UserWarning, match=r"in DHDN, .* by [+-]\d\d m E and [+-]1\d\d m N"):
        crs_notes("EPSG:31467", drive(3566e3, 5932e3), True)
    crs_notes("EPSG:31467", drive(3566e3, 5932e3), False)  # of a table of eastings


def test_heights_in_feet_are_named():
    "A compound CRS whose map is in metres and whose heights aren't: the heights are what is wrong"
    with pytest.raises(ValueError, match=r"height in US survey foot, not in meters\. Transform"):
        check_crs("EPSG:32650+6360")
