"""Trajectories in: CSV and SBET, synthetic and real; and out: CSV."""

import laspy
import numpy as np
import pytest
from pyproj import Geod
from scipy.spatial.transform import Rotation

from mlscorr.frames import angles_from_attitude, attitude_from_angles, georeference, to_scanner
from mlscorr.io.surveys.crs_checks import describe_projection
from mlscorr.io.trajectories import (
    SBET_FIELDS,
    SMRMSG_FIELDS,
    read_trajectory,
    write_trajectory_csv,
)
from mlscorr.io.trajectories.sbet import read_sbet
from mlscorr.pos import find_steps
from mlscorr.survey import Mounting, Trajectory
from tests.beds.shared import shared

SCANNER_IS_BODY = Mounting(np.zeros(3), Rotation.identity())
HEADER = "gps_time,easting,northing,height,roll,pitch,heading"


def drive(n=400, sigmas=True):
    "An arc at UTM coordinates and GPS seconds of week, heading along the course"
    gps_time = 413200.0 + 0.05 * np.arange(n)
    heading = np.radians(300.0) + 0.01 * (gps_time - gps_time[0])  # rad
    steps = 0.05 * 9.0 * np.column_stack([np.sin(heading), np.cos(heading), 0 * heading])
    rng = np.random.default_rng(5)
    return Trajectory(
        gps_time,
        np.cumsum(steps, axis=0) + np.array([532_000.0, 3_374_000.0, 42.0]),
        attitude_from_angles(*rng.normal(0, 0.01, (2, n)), heading),
        rng.uniform(0.01, 0.5, (n, 3)) if sigmas else None,
        rng.uniform(1e-4, 1e-3, (n, 3)) if sigmas else None,
    )


def csv_of(path, table, header=HEADER):
    np.savetxt(path, table, delimiter=",", header=header, comments="", fmt="%.8f")
    return path


def table_of(trajectory, degrees=True):
    angles = np.column_stack(angles_from_attitude(trajectory.attitude))
    angles = np.degrees(angles) if degrees else angles
    return np.column_stack([trajectory.gps_time, trajectory.position, angles])


# ---- CSV


def test_epochs_within_a_microsecond_are_one(tmp_path):
    "An epoch 2 ns after another is left out with a sentence; it made a step of 22 cm"
    written = table_of(drive())
    table = np.insert(written, 200, written[200], axis=0)
    table[201, 0] += 2e-9
    path = tmp_path / "trajectory.csv"
    np.savetxt(path, table, delimiter=",", header=HEADER, comments="", fmt="%.10f")
    with pytest.warns(UserWarning, match=r"1 of 401 epochs .* within a microsecond"):
        read = read_trajectory(path)
    np.testing.assert_allclose(read.gps_time, written[:, 0], atol=1e-9)
    assert len(find_steps(read)) == 0


@pytest.mark.parametrize("sigmas", [True, False])
def test_csv_returns_what_was_written(tmp_path, sigmas):
    "Written and read again: time to 1 us, position to 10 um, angles to 1e-7 deg, sigmas too"
    written = drive(sigmas=sigmas)
    write_trajectory_csv(tmp_path / "trajectory.csv", written)
    read = read_trajectory(tmp_path / "trajectory.csv")
    assert np.abs(read.gps_time - written.gps_time).max() < 6e-7
    assert np.abs(read.position - written.position).max() < 6e-6
    turn = (read.attitude * written.attitude.inv()).magnitude()
    assert np.degrees(turn.max()) < 2e-7
    assert (read.position_sigma is None) == (not sigmas)
    if sigmas:
        assert np.abs(read.position_sigma - written.position_sigma).max() < 6e-6
        assert np.degrees(np.abs(read.attitude_sigma - written.attitude_sigma).max()) < 6e-8
    assert [file.name for file in tmp_path.iterdir()] == ["trajectory.csv"]


def test_csv_is_written_the_same_once_read(tmp_path):
    "Reading and writing again changes no byte"
    write_trajectory_csv(tmp_path / "a.csv", drive())
    write_trajectory_csv(tmp_path / "b.csv", read_trajectory(tmp_path / "a.csv"))
    assert (tmp_path / "a.csv").read_bytes() == (tmp_path / "b.csv").read_bytes()


def test_csv_columns_are_found_by_name(tmp_path):
    "Order, further columns of text, a byte order mark, spaces, capitals and blank lines are free"
    table = table_of(drive(50, sigmas=False))
    lines = ["\ufeffquality, Heading ,pitch,roll,height,northing,easting,GPS_time"]
    lines += ["Q1," + ", ".join(f"{x:.8f}" for x in row[::-1]) + "\n" for row in table]
    (tmp_path / "t.csv").write_text("\n".join(lines), encoding="utf-8")
    read = read_trajectory(tmp_path / "t.csv")
    assert np.abs(read.position - table[:, 1:4]).max() < 1e-7


def test_csv_may_have_only_position_sigmas(tmp_path):
    "Three sigmas of position and none of attitude: one is there, the other is not"
    table = np.column_stack([table_of(drive(50)), np.full((50, 3), 0.02)])
    header = HEADER + ",sigma_easting,sigma_northing,sigma_height"
    read = read_trajectory(csv_of(tmp_path / "t.csv", table, header))
    assert np.allclose(read.position_sigma, 0.02)
    assert read.attitude_sigma is None


def test_a_group_of_sigmas_in_part_is_refused(tmp_path):
    "Two of three sigmas: the missing column is named"
    table = np.column_stack([table_of(drive(50)), np.full((50, 2), 0.02)])
    path = csv_of(tmp_path / "t.csv", table, HEADER + ",sigma_easting,sigma_height")
    with pytest.raises(ValueError, match="but not sigma_northing: give all"):
        read_trajectory(path)


def spoil(row, column, value):
    def change(table):
        table[row, column] = value
        return table

    return change


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (spoil(7, 2, np.nan), r"1 of 400 epochs .* northing that is not a number.*epoch 8"),
        (spoil(9, 6, np.inf), r"1 of 400 epochs .* heading"),
        (lambda table: table[[0, 2, 1, *range(3, 400)]], "1 go back in time .first after 413200.1"),
        (spoil(slice(200, None), 0, np.arange(200)), "1 go back in time .first after 413209.9"),
        (lambda table: np.repeat(table, 2, axis=0), "400 epochs are duplicates"),
        (lambda table: table[:1], "needs at least 2 epochs"),
        (lambda table: table[:0], "header but no epochs"),
    ],
)
def test_bad_epochs_are_refused(tmp_path, change, message):
    "NaN, unsorted, doubled, too few: each is counted and located in one sentence"
    path = csv_of(tmp_path / "t.csv", change(table_of(drive())))
    with pytest.raises(ValueError, match=message):
        read_trajectory(path)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", r"is empty \(0 bytes\): .* interrupted. Copy it again"),
        ("\n\n", "is empty"),
        (HEADER + "\n", "header but no epochs"),
        (HEADER.replace("heading", "yaw") + "\n1,2,3,4,5,6,7\n", "no column heading; it has"),
        (HEADER.replace(",", ";") + "\n1;2;3\n", "Line 2.*3 columns where 7"),
        (HEADER + ",height\n1,2,3,4,5,6,7,8\n", "column height 2 times"),
        (HEADER + "\n1,2,3,4,5,6,7\n2,2,3,4\n", "Line 3.*4 columns"),
        (HEADER + "\n1,2,3,4,5,6,7\n2,2,x,4,5,6,7\n", "Line 3 .*'x' where a number is expected"),
        (HEADER + "\n1,2,3,4,5,6,7\n2,2,,4,5,6,7\n", "Line 3 .*'' where a number is expected"),
        (
            HEADER + "\n1,2,3,4,5,6,7\n2,2,1_0,4,5,6,7\n",
            "Line 3 .*'1_0' where a number is expected",
        ),
    ],
)
def test_bad_csv_text_is_refused(tmp_path, text, message):
    "Empty, cut off, other separators, missing or doubled columns: the line or column is named"
    (tmp_path / "t.csv").write_text(text)
    with pytest.raises(ValueError, match=message):
        read_trajectory(tmp_path / "t.csv")


def test_binary_under_a_csv_name_is_refused(tmp_path):
    "An SBET renamed to .csv is not text"
    np.full(170, -1.5e300).tofile(tmp_path / "t.csv")
    with pytest.raises(ValueError, match="not a text file"):
        read_trajectory(tmp_path / "t.csv")


def test_radians_where_degrees_belong_are_refused(tmp_path):
    "A heading that fits the course as radians, and not as degrees, is in radians"
    path = csv_of(tmp_path / "t.csv", table_of(drive(), degrees=False))
    with pytest.raises(ValueError, match=r"seem to be in radians"):
        read_trajectory(path)


def test_a_drive_due_north_in_degrees_is_no_drive_in_radians(tmp_path):
    "Small angles alone are no evidence: heading 0.3 deg on a course of 0.3 deg is read"
    table = np.tile([413200.0, 532_000.0, 3_374_000.0, 42.0, 0.1, -0.2, 0.3], (400, 1))
    table[:, :3] += np.arange(400)[:, None] * [0.05, 0.0024, 0.45]
    heading = angles_from_attitude(read_trajectory(csv_of(tmp_path / "t.csv", table)).attitude)[2]
    assert np.degrees(heading[0]) == pytest.approx(0.3, abs=1e-7)


def test_a_heading_against_the_course_is_warned_of(tmp_path):
    "A vehicle that reverses all the way may be right: it is read, with a warning"
    table = table_of(drive())
    table[:, 6] += 180.0
    with pytest.warns(UserWarning, match="differs from the course over ground by 180 deg"):
        read_trajectory(csv_of(tmp_path / "t.csv", table))


def test_milliseconds_are_no_seconds(tmp_path):
    "Weeks at less than a metre a second: any cloud of the week would lie within them"
    table = table_of(drive(1000, sigmas=False))
    table[:, 0] *= 1e3
    table[500:, 0] += 1e6  # as of a drive of 18 minutes
    with pytest.raises(ValueError, match=r"lasts 12\.2 days.*0\.009 m/s:.*Give seconds"):
        read_trajectory(csv_of(tmp_path / "t.csv", table))


def test_a_vehicle_at_rest_has_no_course(tmp_path):
    "Centimetres of position noise at rest say nothing of the heading"
    table = table_of(drive())
    table[:, 1:4] = [532_000.0, 3_374_000.0, 42.0]
    table[:, 1:3] += np.random.default_rng(1).normal(0, 0.02, (400, 2))
    assert len(read_trajectory(csv_of(tmp_path / "t.csv", table))) == 400


def test_unknown_kinds_and_needless_accuracy_are_refused(tmp_path):
    "Unusable input is reported, not ignored"
    (tmp_path / "t.nav").write_bytes(bytes(1000))
    with pytest.raises(ValueError, match=r"t\.nav has an unknown format: .* as text or SBET"):
        read_trajectory(tmp_path / "t.nav")
    csv_of(tmp_path / "t.csv", table_of(drive(50)))
    with pytest.raises(ValueError, match="its own sigma columns"):
        read_trajectory(tmp_path / "t.csv", accuracy=tmp_path / "smrmsg.out")
    with pytest.raises(FileNotFoundError):
        read_trajectory(tmp_path / "u.csv")


def test_sigmas_of_zero_throughout_are_refused(tmp_path):
    "A column that a program filled with zeros states nothing, and no drift could follow it"
    write_trajectory_csv(tmp_path / "t.csv", drive(50))
    table = np.loadtxt(tmp_path / "t.csv", delimiter=",", skiprows=1)
    table[:, 7] = 0.0
    header = (tmp_path / "t.csv").read_text().splitlines()[0]
    with pytest.raises(ValueError, match=r"50 of 50 .* sigma_easting of 0 or less .*\[pos\]"):
        read_trajectory(csv_of(tmp_path / "t.csv", table, header))


# ---- SBET


def sbet_records(n=200, azimuth=40.0, wander=1.3):
    "A straight flight over the ellipsoid, level, nose along its true azimuth (deg)"
    longitude, latitude, _ = Geod(ellps="WGS84").fwd(
        np.full(n, -119.1), np.full(n, 37.7), np.full(n, azimuth), 0.2 * np.arange(n)
    )
    records = np.zeros((n, len(SBET_FIELDS)))
    records[:, 0] = 400_825.0 + 0.005 * np.arange(n)
    records[:, 1:4] = np.column_stack([np.radians(latitude), np.radians(longitude), 0 * latitude])
    records[:, 3] = 1800.0
    records[:, 7:11] = np.radians([2.0, -3.0, azimuth + wander, wander])
    return records


def written(path, records):
    records.astype("<f8").tofile(path)
    return path


@pytest.mark.parametrize("crs", ["EPSG:32611", "EPSG:32610", "EPSG:26943"])
@pytest.mark.parametrize("azimuth", [40.0, 170.0, 265.0])
def test_sbet_heading_is_the_course_on_the_map(tmp_path, crs, azimuth):
    "A nose along the track must point along the projected track, whatever the convergence"
    path = written(tmp_path / "sbet.out", sbet_records(azimuth=azimuth))
    trajectory = read_sbet(path, crs)
    roll, pitch, heading = angles_from_attitude(trajectory.attitude[0])
    east, north, _ = trajectory.position[-1] - trajectory.position[0]
    course = np.degrees(np.arctan2(east, north)) % 360
    assert np.degrees(heading) == pytest.approx(course, abs=2e-3)
    assert abs(np.degrees(heading) - azimuth) > 0.4  # grid north is not true north
    assert np.degrees([roll, pitch]) == pytest.approx([2.0, -3.0])
    assert trajectory.position[:, 2] == pytest.approx(1800.0)


def test_sbet_accuracy_is_interpolated(tmp_path):
    "1 Hz sigmas in N, E, D and arc-minutes become E, N, H and radians at every epoch"
    sbet = written(tmp_path / "sbet.out", sbet_records())
    records = np.zeros((4, len(SMRMSG_FIELDS)))
    records[:, 0] = 400_824.0 + np.arange(4)
    records[:, 1:4] = [0.01, 0.02, 0.03] + 0.01 * np.arange(4)[:, None]  # N, E, D
    records[:, 7:10] = [0.3, 0.6, 1.2]  # arc-minutes
    smrmsg = written(tmp_path / "smrmsg.out", records)
    trajectory = read_trajectory(sbet, "EPSG:32611", smrmsg)
    assert trajectory.position_sigma[100] == pytest.approx([0.035, 0.025, 0.045])
    assert np.degrees(trajectory.attitude_sigma[100]) == pytest.approx([0.005, 0.01, 0.02])


def test_sbet_height_needs_its_geoid_grid(tmp_path):
    "Asked for heights above the geoid without its grid, ellipsoidal ones are not passed off"
    path = written(tmp_path / "sbet.out", sbet_records())
    with pytest.raises(ValueError, match=r"sbet\.out: .*us_nga_egm96_15\.tif.*geoid grid"):
        read_sbet(path, "EPSG:32611+5773")


def test_sbet_height_is_transformed_with_a_geoid_grid(tmp_path):
    "With a grid of 25 m undulation everywhere, heights become 25 m smaller, E and N stay"
    grid = tmp_path / "flat.gtx"
    grid.write_bytes(
        np.array([37.0, -120.0, 1.0, 1.0], ">f8").tobytes()
        + np.array([2, 2], ">i4").tobytes()
        + np.full(4, 25.0, ">f4").tobytes()
    )
    path = written(tmp_path / "sbet.out", sbet_records())
    compound = f"+proj=utm +zone=11 +datum=WGS84 +geoidgrids={grid} +type=crs"
    flat = read_sbet(path, "EPSG:32611")
    physical = read_sbet(path, compound)
    assert np.abs(physical.position - flat.position - [0, 0, -25.0]).max() < 1e-6
    assert (physical.attitude * flat.attitude.inv()).magnitude().max() < 1e-12
    assert "transformed" in describe_projection(compound)[1]
    assert "kept" in describe_projection("EPSG:32611")[1]


def test_sbet_datum_is_the_one_of_the_crs(tmp_path):
    "ETRS89 and WGS84 zones give the same coordinates: no datum shift is applied in silence"
    path = written(tmp_path / "sbet.out", sbet_records())
    nad83 = read_sbet(path, "EPSG:6340")
    wgs84 = read_sbet(path, "EPSG:32611")
    assert np.abs(nad83.position - wgs84.position).max() < 1e-3
    assert "NAD83(2011), the datum of" in describe_projection("EPSG:6340")[0]


@pytest.mark.parametrize(
    ("crs", "message"),
    [
        (None, "set crs in survey.toml"),
        ("EPSG:99999", "'EPSG:99999' is unknown"),
        ("EPSG:4326", "projected CRS is needed"),
        ("EPSG:2227", "US survey foot, not in"),
        ("EPSG:2048", "axes must point east and north"),
        ("EPSG:32733+5715", "has the axes east, north, down; axes must .* up if there is a height"),
    ],
)
def test_sbet_needs_a_projected_crs_in_metres(tmp_path, crs, message):
    "No CRS, an unknown, a geographic one, feet, axes that point south or down: each in a sentence"
    path = written(tmp_path / "sbet.out", sbet_records())
    with pytest.raises(ValueError, match=message):
        read_trajectory(path, crs)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda records: records.ravel()[:-5], r"96 more than 199 whole SBET records"),
        (lambda records: records[:0], "is empty"),
        (spoil(3, 2, np.nan), "1 of 200 SBET records .* record 4"),
        (lambda records: records * np.where(np.isin(range(17), [1, 2]), 180 / np.pi, 1), "degrees"),
        (lambda records: records * np.where(np.arange(17) == 9, 180 / np.pi, 1), "heading of 41"),
        (spoil(3, 1, 1e60), "may not be an SBET"),
        (lambda records: records[::-1], "199 go back in time"),
        (lambda records: np.repeat(records, 2, axis=0), "200 epochs are duplicates"),
    ],
)
def test_bad_sbet_is_refused(tmp_path, change, message):
    "Cut off, empty, NaN, degrees, garbage, unsorted, doubled: each in one sentence"
    path = written(tmp_path / "sbet.out", change(sbet_records()))
    with pytest.raises(ValueError, match=message):
        read_sbet(path, "EPSG:32611")


@pytest.mark.parametrize("name", ["way.sbet", "way.pof", "way.txt"])
def test_an_empty_trajectory_is_no_kind_at_all(tmp_path, name):
    "Neither a CRS nor a version is asked of 0 bytes, whose copying was interrupted"
    (tmp_path / name).touch()
    with pytest.raises(ValueError, match=rf"{name} is empty \(0 bytes\): .* Copy it again"):
        read_trajectory(tmp_path / name)


def test_an_accuracy_file_of_another_drive_is_refused(tmp_path):
    "Sigmas are not extrapolated: both spans are named"
    sbet = written(tmp_path / "sbet.out", sbet_records())
    records = np.ones((10, len(SMRMSG_FIELDS)))
    records[:, 0] = 300_000.0 + np.arange(10)
    with pytest.raises(ValueError, match=r"covers \[300000.0, 300009.0\] s, not the trajectory"):
        read_sbet(sbet, "EPSG:32611", written(tmp_path / "smrmsg.out", records))


# ---- real data


def test_real_sbet_and_smrmsg_are_read(tmp_path):
    "Applanix' own files: two epochs 5 ms apart, and 6 h of 1 Hz sigmas of centimetres"
    sbet = shared("data", "las_samples", "2-points.sbet")
    trajectory = read_sbet(sbet, "EPSG:32611")
    assert np.diff(trajectory.gps_time) == pytest.approx(0.005, abs=1e-4)
    east, north, up = np.diff(trajectory.position, axis=0)[0]
    assert np.hypot(east, north) == pytest.approx(0.0118, abs=5e-4)  # 2.4 m/s for 5 ms
    assert up == pytest.approx(-1.5e-4, abs=1e-5)

    smrmsg = shared("data", "las_samples", "smrmsg.smrmsg")
    gps_time = np.fromfile(smrmsg).reshape(-1, 10)[:, 0]
    records = sbet_records(len(gps_time))
    records[:, 0] = gps_time
    long = read_sbet(written(tmp_path / "sbet.out", records), "EPSG:32611", smrmsg)
    assert np.median(long.position_sigma, axis=0) == pytest.approx(
        [0.0379, 0.0407, 0.0466], abs=1e-4
    )
    assert np.degrees(np.median(long.attitude_sigma, axis=0)) == pytest.approx(
        [0.00219, 0.00219, 0.0173], abs=1e-4
    )


def leeward():
    folder = shared("data", "leeward_sbet")
    cloud = laspy.read(folder / "points.las")
    return read_sbet(folder / "sbet.out", "EPSG:32611"), cloud


def turned(trajectory, degrees):
    "The same trajectory with a heading that is larger by so many degrees"
    turn = Rotation.from_euler("z", -degrees, degrees=True)
    return Trajectory(trajectory.gps_time, trajectory.position, turn * trajectory.attitude)


def scan_plane(trajectory, cloud):
    "Scan angles (deg), normal of the plane of the real beams, and their scatter (deg) about it"
    beams = to_scanner(trajectory, SCANNER_IS_BODY, cloud.xyz, np.asarray(cloud.gps_time))
    beams /= np.linalg.norm(beams, axis=1, keepdims=True)
    normal = np.linalg.svd(beams, full_matrices=False)[2][2]
    across = np.degrees(np.arctan2(beams[:, 0], -beams[:, 2]))
    return across, normal * np.sign(normal[1]), np.degrees(np.std(beams @ normal))


def test_real_beams_fall_in_the_scan_plane():
    """Real airborne beams, 5 km long, lie in one plane of the body to 0.0041 deg.

    Across-track angles follow the recorded scan angles (whole degrees) with r = 0.99984 and slope
    0.997: roll is right side down. The plane is upright to 0.07 deg at a pitch of 2.9 deg: pitch
    is nose up. Either sign turned, the beams scatter more than three times as much.
    """
    trajectory, cloud = leeward()
    across, normal, scatter = scan_plane(trajectory, cloud)
    recorded = np.asarray(cloud.scan_angle_rank, dtype=float)
    assert np.corrcoef(across, recorded)[0, 1] > 0.9998
    assert np.polyfit(recorded, across, 1)[0] == pytest.approx(1.0, abs=0.01)
    assert scatter < 0.0042
    assert np.degrees(np.arcsin(normal[2])) == pytest.approx(0.0, abs=0.1)
    roll, pitch, heading = angles_from_attitude(trajectory.attitude)
    for attitude in (
        attitude_from_angles(-roll, pitch, heading),
        attitude_from_angles(roll, -pitch, heading),
    ):
        wrong = Trajectory(trajectory.gps_time, trajectory.position, attitude)
        assert scan_plane(wrong, cloud)[2] > 3 * scatter


def test_real_beams_need_wander_and_convergence():
    """The beams are flattest near the grid heading that was read, not with a part left out.

    The plane stands 13.96 deg askew in the body, so a wrong heading mixes roll into it. Flatness
    over trial headings is least 0.13 deg from the one read, with a sigma of 0.22 deg; without
    the wander angle the heading is 1.02 deg too large (4 sigma), without the convergence 1.24 deg
    too small (6 sigma).
    """
    trajectory, cloud = leeward()
    trials = np.linspace(-4.0, 4.0, 9)
    variance = [scan_plane(turned(trajectory, trial), cloud)[2] ** 2 for trial in trials]
    curve = np.polyfit(trials, variance, 2)
    best = -curve[1] / (2 * curve[0])
    sigma = np.sqrt(np.polyval(curve, best) / curve[0] / len(cloud.gps_time))
    assert sigma < 0.25
    assert abs(best) < 2 * sigma
    assert abs(best - 1.0217) > 3 * sigma
    assert abs(best + 1.2397) > 3 * sigma


def uav(name):
    "Real points with the pose of their own epoch (ENU; conventions in data/README.md)"
    cloud = laspy.read(shared("data", "routescene_uav", f"{name}.adc.laz"))
    yaw, pitch, roll = (np.asarray(cloud[f"Sensor{axis}Rads"]) for axis in ("Yaw", "Pitch", "Roll"))
    enu = Rotation.from_euler("ZYX", np.column_stack([yaw + np.pi, -pitch, roll]))
    position = np.column_stack([cloud.SensorX, cloud.SensorY, cloud.SensorZ])
    epochs = 1000.0 + np.arange(len(cloud.points))  # an epoch for each point; the file's repeat
    return cloud, Trajectory(epochs, position, enu), epochs


@pytest.mark.parametrize("name", ["Car", "Tent"])
def test_real_points_return_from_the_scanner(name):
    "Back to the scanner and forward again, real UAV points meet themselves within the LAS scale"
    cloud, trajectory, epochs = uav(name)
    xyz = cloud.xyz
    mounting = Mounting(
        np.array([0.1, -0.6, 0.4]), Rotation.from_euler("xyz", [90.0, 0.0, 35.0], degrees=True)
    )
    for mount in (SCANNER_IS_BODY, mounting):
        beams = to_scanner(trajectory, mount, xyz, epochs)
        again = georeference(trajectory, mount, beams, epochs)
        assert np.abs(again - xyz).max() < 0.01 * cloud.header.scales.min()


@pytest.mark.long
@pytest.mark.parametrize("name", ["practice_none", "wuhan_drive"])
def test_frames_and_signs_of_simulated_beams(name):
    "Points taken back to the scanner lie in its plane to 0.4 mm and at their angle to 0.005 deg"
    folder = shared("surveys", name)
    trajectory = read_trajectory(folder / "trajectory.csv")
    boresight = Rotation.from_euler("xyz", [90.0, 0.0, 35.0], degrees=True)
    cloud = laspy.read(folder / "pass-1.laz")
    gps_time = np.asarray(cloud.gps_time)
    mounting = Mounting(np.array([0.10, -0.60, 0.40]), boresight)
    x, y, z = to_scanner(trajectory, mounting, cloud.xyz, gps_time).T
    assert np.sqrt(np.mean(z**2)) < 0.4e-3
    recorded = np.asarray(cloud.scan_angle) * 0.006  # LAS 1.4: units of 0.006 deg
    misfit = np.mod(np.degrees(np.arctan2(y, x)) - recorded + 180, 360) - 180
    assert np.sqrt(np.mean(misfit**2)) < 0.005
