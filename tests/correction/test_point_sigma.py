"Sigmas of points: what pose, mounting and beam do to E, N and H, and how LAS files carry it."

from dataclasses import replace

import laspy
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mlscorr.correction import Correction, PointSigma
from mlscorr.frames import attitude_from_angles, mounting_partials, pose_partials
from mlscorr.survey import Mounting, Scanner, Trajectory
from tests.beds.copies import write_corrected
from tests.beds.shared import shared
from tests.io.clouds.test_las import cloud_of, covering, write_street

START = 357_900.0  # s of week
CORNER = np.array([532_000.0, 3_374_000.0, 40.0])  # m, UTM
NOISELESS = Scanner(range_noise=0.0, angle_noise=0.0)
MOUNTING = Mounting(
    np.array([0.1, -0.6, 0.4]), Rotation.from_euler("xyz", [90, 0, 35], degrees=True)
)
NAMES = ("sigma_easting", "sigma_northing", "sigma_height")


def drive(n=40, sigmas=True):
    "A trajectory with a turn and a gap, and with different sigmas on all six components"
    time = np.linspace(0.0, 20.0, n)
    time[n // 2 :] += 30.0
    heading = 0.3 + 0.05 * time
    angles = attitude_from_angles(0.02 * np.sin(time), 0.03 * np.cos(time), heading)
    position = CORNER + np.outer(time, [6.0, 3.0, 0.1])
    if sigmas:
        position_sigma = np.tile([0.01, 0.02, 0.03], (n, 1))
    else:
        position_sigma = None
    if sigmas:
        attitude_sigma = np.tile([1e-4, 2e-4, 4e-4], (n, 1))
    else:
        attitude_sigma = None
    return Trajectory(START + time, position, angles, position_sigma, attitude_sigma)


def points_at_epochs(trajectory, rng):
    "Points 2 to 40 m from the vehicle, at epochs (k, and the times)"
    k = rng.integers(0, len(trajectory), 300)
    direction = rng.normal(size=(300, 3))
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    away = rng.uniform(2.0, 40.0, (300, 1)) * direction
    return k, trajectory.gps_time[k], trajectory.position[k] + away


def sigma_of(partials, covariance):
    "Square roots of the diagonal of J C J^T"
    return np.sqrt(np.einsum("nij,njk,nik->ni", partials, covariance, partials))


@pytest.mark.long
def test_the_pose_is_carried_to_points_with_its_full_covariance():
    "With any covariance of the six components the sigmas are those of J C J^T"
    rng = np.random.default_rng(1)
    trajectory = drive()
    root = rng.normal(size=(len(trajectory), 6, 6)) * np.repeat([0.02, 5e-4], 3)[:, None]
    covariance = root @ root.swapaxes(1, 2)
    k, times, xyz = points_at_epochs(trajectory, rng)
    found = PointSigma.of(Correction(trajectory, trajectory, covariance=covariance), NOISELESS).at(
        xyz, times
    )
    expected = sigma_of(pose_partials(trajectory, xyz, times), covariance[k])
    assert np.allclose(found, expected, rtol=2e-4, atol=1e-5)  # m


def test_without_covariance_the_sigmas_of_the_trajectory_count():
    "Sigmas of roll, pitch and heading turn points about forward, right and up"
    trajectory = drive()
    k, times, xyz = points_at_epochs(trajectory, np.random.default_rng(2))
    found = PointSigma.of(Correction(trajectory, trajectory), NOISELESS).at(xyz, times)
    body = Rotation.from_matrix(trajectory.attitude[k].as_matrix())
    roll, pitch, heading = trajectory.attitude_sigma[0]
    variance = np.tile([0.01, 0.02, 0.03], (300, 1)) ** 2
    for axis, sigma in (([0, 1, 0], roll), ([1, 0, 0], pitch), ([0, 0, 1], heading)):
        turn = np.cross(body.apply(axis), xyz - trajectory.position[k])
        variance += (sigma * turn) ** 2
    assert np.allclose(found, np.sqrt(variance), rtol=2e-4, atol=1e-5)


def test_the_covariance_of_the_mounting_is_carried_to_points():
    "Lever arm and boresight count by the partial derivatives of the mounting, correlations too"
    rng = np.random.default_rng(3)
    nothing = np.zeros((40, 3))
    trajectory = replace(drive(), position_sigma=nothing, attitude_sigma=nothing)
    root = rng.normal(size=(6, 6)) * np.repeat([0.005, 5e-4], 3)[:, None]
    mounting = replace(MOUNTING, covariance=root @ root.T)
    _, times, xyz = points_at_epochs(trajectory, rng)
    found = PointSigma.of(Correction(trajectory, trajectory), NOISELESS, mounting).at(xyz, times)
    covariance = np.tile(mounting.covariance, (300, 1, 1))
    expected = sigma_of(mounting_partials(trajectory, mounting, xyz, times), covariance)
    assert np.allclose(found, expected, rtol=2e-4, atol=1e-5)


def test_range_noise_acts_along_the_beam_and_angle_noise_across():
    "20 m ahead, 5 mm of range are 5 mm along the way, 0.01 deg are 3.5 mm across it and up"
    n = 10
    still = np.zeros((n, 3))
    north = attitude_from_angles(np.zeros(n), np.zeros(n), np.zeros(n))
    trajectory = Trajectory(START + np.arange(n), CORNER + still, north, still, still)
    scanner = Scanner(range_noise=0.005, angle_noise=np.radians(0.01))
    level = Mounting(np.array([0.0, 0.5, 0.0]), MOUNTING.boresight)
    sigma = PointSigma.of(Correction(trajectory, trajectory), scanner, level)
    across = 20.0 * np.radians(0.01)
    found = sigma.at(CORNER[None] + np.array([0.0, 20.5, 0.0]), [START + 3.5])[0]
    assert np.allclose(found, [across, 0.005, across], rtol=1e-4)


def test_there_is_no_sigma_outside_the_trajectory_nor_in_a_gap():
    "Points without a pose have no sigma"
    trajectory = drive()
    times = np.array([START - 1.0, START + 25.0, START + 5.0, START + 99.0])
    sigma = PointSigma.of(Correction(trajectory, trajectory), NOISELESS)
    found = sigma.at(np.tile(CORNER, (4, 1)), times)
    assert np.isnan(found).any(axis=1).tolist() == [True, True, False, True]


def test_a_trajectory_without_sigmas_is_refused():
    "Points have no sigma if the poses have none"
    trajectory = drive(sigmas=False)
    with pytest.raises(ValueError, match="sigmas of position and attitude; this one has none"):
        PointSigma.of(Correction(trajectory, trajectory), NOISELESS)


def with_sigmas(path):
    "A correction that covers a file, and the sigmas of its points"
    correction = covering(path, shift=[0.3, -0.2, 0.1])
    n = len(correction.corrected)
    corrected = replace(
        correction.corrected,
        position_sigma=np.tile([0.01, 0.02, 0.03], (n, 1)),
        attitude_sigma=np.full((n, 3), 2e-4),
    )
    correction = Correction(correction.recorded, corrected)
    return correction, PointSigma.of(correction, Scanner(), MOUNTING)


def assert_only_sigmas_added(target, plain, sigma):
    "Every byte of a point equals the plain corrected copy's; then follow the sigmas to 0.1 mm"
    old = laspy.read(plain)
    new = laspy.read(target)
    raw = [las.points.array.view(np.uint8).reshape(len(las.points), -1) for las in (old, new)]
    assert np.array_equal(raw[0], raw[1][:, :-6])
    described = [name for name in old.point_format.dimension_names if name != "ExtraBytes"]
    assert set(described) <= set(new.point_format.dimension_names)
    assert tuple(new.point_format.dimension_names)[-3:] == NAMES
    expected = sigma.at(np.column_stack([new.x, new.y, new.z]), new.gps_time)
    found = np.column_stack([new[name] for name in NAMES])
    assert np.abs(found - np.minimum(expected, 6.5534)).max() < 0.6e-4  # m
    kept = [(v.user_id, v.record_id) for v in old.vlrs if v.record_id != 4]
    assert [(v.user_id, v.record_id) for v in new.vlrs if v.record_id != 4] == kept
    assert len(new.evlrs or []) == len(old.evlrs or [])


@pytest.mark.long
@pytest.mark.parametrize("suffix", [".laz", ".las"])
@pytest.mark.parametrize("point_format", [1, 7, 10])
def test_corrected_copies_carry_the_sigmas(point_format, suffix, tmp_path):
    "Old and new point formats, with extra bytes of their own, get three fields that laspy reads"
    path = write_street(tmp_path / f"in{suffix}", point_format)
    correction, sigma = with_sigmas(path)
    plain = tmp_path / f"plain{suffix}"
    target = tmp_path / f"out{suffix}"
    write_corrected(cloud_of(path), plain, correction)
    write_corrected(cloud_of(path), target, correction, sigma=sigma)
    assert_only_sigmas_added(target, plain, sigma)


@pytest.mark.long
@pytest.mark.parametrize("name", ["las_with_several_extra_byte_bloc.laz", "sample_c.las"])
def test_real_files_carry_the_sigmas(name, tmp_path):
    "Real files keep every field and get three"
    path = shared("data", "las_samples", name)
    target = tmp_path / name
    correction, sigma = with_sigmas(path)
    write_corrected(cloud_of(path), tmp_path / f"plain-{name}", correction)
    write_corrected(cloud_of(path), target, correction, sigma=sigma)
    assert_only_sigmas_added(target, tmp_path / f"plain-{name}", sigma)


@pytest.mark.long
def test_extra_bytes_that_nobody_described_stay_where_they_are(tmp_path):
    "Bytes behind the points without a description are kept, and described as such"
    path = write_street(tmp_path / "in.las", 6)
    raw = bytearray(path.read_bytes())
    at = raw.index(b"LASF_Spec")
    raw[at : at + 9] = b"LASF_Sp_c"  # the description is lost
    path.write_bytes(raw)
    before = laspy.read(path).points.array.view(np.uint8).reshape(12_345, -1)
    correction, sigma = with_sigmas(path)
    write_corrected(cloud_of(path), tmp_path / "out.las", correction, sigma=sigma)
    after = laspy.read(tmp_path / "out.las")
    assert list(after.point_format.extra_dimension_names) == ["undescribed_0", *NAMES]
    expected = sigma.at(np.column_stack([after.x, after.y, after.z]), after.gps_time)
    assert np.abs(after.sigma_height - expected[:, 2]).max() < 0.6e-4
    assert np.array_equal(after["undescribed_0"].reshape(12_345, -1), before[:, 30:])


def test_points_without_a_pose_are_marked_as_unknown(tmp_path):
    "Outside the trajectory the integers are 65535, which the description calls no data"
    path = write_street(tmp_path / "in.laz", 6)
    correction, _ = with_sigmas(path)
    rows = slice(0, 1000)  # of 2000 epochs

    def cut(t):
        sigmas = np.full((1000, 3), 0.01), np.full((1000, 3), 2e-4)
        return Trajectory(t.gps_time[rows], t.position[rows], t.attitude[rows], *sigmas)

    half = Correction(cut(correction.recorded), cut(correction.corrected))
    write_corrected(
        cloud_of(path), tmp_path / "out.laz", half, sigma=PointSigma.of(half, Scanner())
    )
    las = laspy.read(tmp_path / "out.laz")
    outside = las.gps_time > half.recorded.gps_time[-1]
    raw = las.points.array["sigma_height"]
    assert outside.any() and (raw[outside] == 65535).all() and (raw[~outside] < 65535).all()


def test_sigmas_are_not_added_twice(tmp_path):
    "A copy that has the fields is refused, in a sentence that says what to do"
    path = write_street(tmp_path / "in.laz", 6, points=100)
    correction, sigma = with_sigmas(path)
    write_corrected(cloud_of(path), tmp_path / "out.laz", correction, sigma=sigma)
    with pytest.raises(ValueError, match="have the field sigma_easting"):
        write_corrected(cloud_of(tmp_path / "out.laz"), tmp_path / "2.laz", correction, sigma=sigma)


def test_points_without_a_time_each_have_no_sigma():
    """Three points with six times are refused, as one sigma for each time would be another's."""
    recorded = drive()
    sigma = PointSigma.of(Correction(recorded, recorded), NOISELESS)
    with pytest.raises(ValueError, match=r"^3 points came with 6 times"):
        sigma.at(np.zeros((3, 3)), np.full(6, START + 1.0))
