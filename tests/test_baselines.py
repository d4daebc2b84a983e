"""The baselines: each recovers what it can express, and refuses what the targets can't tell."""

import warnings
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mlscorr.baselines import (
    RAW,
    Undetermined,
    fit_affine,
    fit_horizontal_and_height,
    fit_literal,
    fit_polynomial,
    fit_rigid,
    fit_shift,
)
from mlscorr.correction import estimate_correction
from mlscorr.evaluation import misclosures
from mlscorr.survey import (
    ControlPoints,
    PointCloud,
    Pos,
    TargetObservations,
    Trajectory,
    attitude_from_angles,
)

START = np.array([523000.0, 3378000.0, 20.0])
TIME = 413200.0
SHIFT = np.array([0.42, -0.31, 0.27])
LENGTH, DURATION = 400.0, 100.0
SIGMA = 0.003
UP = np.array([0.0, 0.0, 2.0])


def trajectory(sigma=0.05):
    "A straight drive to the north-east at 4 m/s"
    time = TIME + np.arange(0.0, DURATION + 0.05, 0.1)
    along = (time - TIME) / DURATION * LENGTH
    heading = np.full(len(time), np.radians(60.0))
    ahead = np.array([np.sin(heading[0]), np.cos(heading[0]), 0.0])
    return Trajectory(
        gps_time=time,
        position=START + along[:, None] * ahead,
        attitude=attitude_from_angles(0.0 * time, 0.0 * time, heading),
        position_sigma=None if sigma is None else np.full((len(time), 3), sigma),
        attitude_sigma=np.full((len(time), 3), 1e-4),
    )


def targets(rng, n=16, first=3.0, last=97.0):
    "Places (n, 3) beside the drive, and the times at which it passes them"
    drive = trajectory()
    time = np.sort(TIME + rng.uniform(first, last, n))
    time[[0, -1]] = TIME + first, TIME + last
    ahead = np.array([np.sin(np.radians(60.0)), np.cos(np.radians(60.0)), 0.0])
    right = np.array([ahead[1], -ahead[0], 0.0])
    beside = rng.choice([-1.0, 1.0], n) * rng.uniform(4.0, 12.0, n)
    up = rng.uniform(-2.0, 5.0, n)[:, None] * [0.0, 0.0, 1.0]
    return drive.at(time).position + beside[:, None] * right + up, time


def observed(place, time, surveyed, name=None):
    "Observations at places, and the control points that they belong to"
    n = len(place)
    name = tuple(f"T{i:02d}" for i in range(n)) if name is None else name
    control = ControlPoints(
        name, surveyed, np.full((n, 3), SIGMA), ("circle",) * n, np.full(n, 0.6), nan(n)
    )
    observations = TargetObservations(
        name=name,
        pass_number=np.ones(n, int),
        gps_time=time,
        position=place,
        covariance=np.tile(1e-6 * np.eye(3), (n, 1, 1)),
        normal=np.tile([0.6, -0.8, 0.0], (n, 1)),
        kind=("circle",) * n,
        size=np.full(n, 0.6),
        points=np.full(n, 300),
    )
    return observations, control


def nan(n):
    return np.full((n, 3), np.nan)


def moved(place, change):
    "Places after a shift and a small change of the matrix, about a point far from their mean"
    origin = START + np.array([-150.0, 90.0, 4.0])
    return place + SHIFT + (place - origin) @ change.T


TURN = Rotation.from_rotvec([0.002, -0.001, 0.004]).as_matrix() - np.eye(3)
SCALED = 1.0003 * Rotation.from_rotvec([0.0, 0.0, 0.004]).as_matrix() - np.eye(3)
PLAN_AND_PLANE = np.vstack([SCALED[:2], [0.01, -0.02, 0.0]])
KNOWN = [  # a method, and a change of the matrix that it can express
    (fit_shift, np.zeros((3, 3))),
    (fit_horizontal_and_height, PLAN_AND_PLANE),
    (fit_rigid, TURN),
    (fit_affine, np.array([[0.01, 0.02, -0.01], [0.0, -0.01, 0.03], [0.02, 0.01, 0.005]])),
]


@pytest.mark.parametrize(("fit", "change"), KNOWN, ids=lambda one: getattr(one, "__name__", ""))
def test_each_transformation_is_recovered_at_map_coordinates(fit, change):
    "Points that took no part come to their places within a micrometre, at UTM size"
    rng = np.random.default_rng(1)
    place, time = targets(rng)
    correction = fit(*observed(place, time, moved(place, change)))
    other, at = targets(rng, 50)
    cloud = correction.apply(PointCloud(other, at, np.arange(50)))
    assert np.abs(cloud.xyz - moved(other, change)).max() < 1e-6
    assert np.array_equal(cloud.intensity, np.arange(50))


@pytest.mark.parametrize("order", [2, 3, 4, 5])
def test_a_polynomial_of_time_is_recovered(order):
    "LS-n removes a polynomial drift of its order everywhere, beyond the control points too"
    rng = np.random.default_rng(order)
    coefficients = rng.normal(0.0, 0.3, (order + 1, 3))

    def drift(time):
        return np.polynomial.polynomial.polyval((time - TIME) / DURATION, coefficients).T

    place, time = targets(rng)
    correction = fit_polynomial(trajectory(), *observed(place, time, place + drift(time)), order)
    error = correction.corrected.position - trajectory().position - drift(trajectory().gps_time)
    assert np.abs(error).max() < 1e-6


@pytest.mark.parametrize("order", [2, 5])
def test_the_literal_collocation_is_that_of_the_paper(order):
    "Two sweeps over the epochs give what Eq. 13-15 give when written out with full matrices"
    rng = np.random.default_rng(7)
    place, time = targets(rng)
    drive = trajectory()
    observations, control = observed(place, time, place + rng.normal(0.0, 0.2, place.shape))
    correction, found = fit_literal(drive, observations, control, Pos(), order)
    assert found["correlation_time"] == pytest.approx(4 * epochs_interval(time))
    arm = place - drive.at(time).position
    n, c0 = len(time), np.array(found["c0"])
    b = np.zeros((3 * n, 6 * n))
    for i, (x, y, z) in enumerate(arm):
        minus_phi = [[0, z, -y], [-z, 0, x], [y, -x, 0]]
        b[3 * i : 3 * i + 3, 6 * i : 6 * i + 6] = np.hstack([np.eye(3), minus_phi])
    scaled = (time - TIME) / DURATION
    a = np.kron(np.vander(scaled, order + 1), np.eye(3))
    v = b @ np.diag(np.tile(c0, n)) @ b.T + (SIGMA**2 + 1e-6) * np.eye(3 * n)
    l_ = (control.position - place).ravel()
    y = np.linalg.solve(a.T @ np.linalg.solve(v, a), a.T @ np.linalg.solve(v, l_))
    at = np.array([0, 333, 700, 1000])
    lag = np.abs(drive.gps_time[at, None] - time)
    cross = np.kron(np.exp(-lag / found["correlation_time"]), np.diag(c0))
    signal = (cross @ b.T @ np.linalg.solve(v, l_ - a @ y)).reshape(-1, 6)
    trend = np.kron(np.vander((drive.gps_time[at] - TIME) / DURATION, order + 1), np.eye(3)) @ y
    wanted = signal[:, :3] + trend.reshape(-1, 3)
    got = correction.corrected.position[at] - drive.position[at]
    assert np.abs(got - wanted).max() < 1e-6
    turned = correction.corrected.attitude[at] * drive.attitude[at].inv()
    assert np.abs(turned.as_rotvec() - signal[:, 3:]).max() < 1e-9


def epochs_interval(time):
    "Mean interval of the times that are more than a second apart"
    kept = [time[0]]
    for one in time[1:]:
        if one - kept[-1] > 1.0:
            kept.append(one)
    return (kept[-1] - kept[0]) / (len(kept) - 1)


@pytest.mark.parametrize("fit", [fit_shift, fit_horizontal_and_height, fit_rigid, fit_affine])
def test_the_order_of_the_targets_changes_nothing(fit):
    "Shuffled targets give the same corrected places to a nanometre"
    rng = np.random.default_rng(2)
    place, time = targets(rng)
    observations, control = observed(place, time, moved(place, TURN) + rng.normal(0, 0.01, (16, 3)))
    cloud = PointCloud(place, time, np.zeros(16))
    shuffled = observations[rng.permutation(16)]
    one, other = (fit(given, control).apply(cloud).xyz for given in (observations, shuffled))
    assert np.abs(one - other).max() < 1e-9


# ---- what the targets can't tell


def on_a_line(n, rng):
    "Targets on one straight and level line"
    time = TIME + np.linspace(3.0, 97.0, n)
    return trajectory().at(time).position + UP, time


def on_a_plane(n, rng):
    "Targets on both sides of the street, all on one level"
    place, time = targets(rng, n)
    return place * [1, 1, 0] + [0, 0, 22.0], time


def few(n):
    def place(_, rng):
        return targets(rng, n)

    place.__name__ = f"{n}_targets"
    return place


@pytest.mark.parametrize(
    ("fit", "layout", "words"),
    [
        (fit_horizontal_and_height, few(1), "at least 2 control points"),
        (fit_rigid, few(1), "at least 3 control points"),
        (fit_rigid, few(2), "at least 3 control points"),
        (fit_rigid, on_a_line, "lie on one line, from which they differ by 0.0000 m"),
        (fit_affine, few(3), "at least 4 control points"),
        (fit_affine, on_a_line, "lie on one plane, from which they differ by 0.0000 m"),
        (fit_affine, on_a_plane, "lie on one plane, from which they differ by 0.0000 m"),
    ],
)
def test_a_degenerate_geometry_is_refused_with_numbers(fit, layout, words):
    "Too few targets, or targets on a line or plane, are told from those that determine a method"
    place, time = layout(9, np.random.default_rng(3))
    with pytest.raises(Undetermined, match=words):
        fit(*observed(place, time, place + SHIFT))


def test_targets_nearly_on_a_plane_are_refused():
    "Targets 5 mm off a plane, with a sigma of 3 mm, don't determine an affine transformation"
    rng = np.random.default_rng(4)
    place, time = on_a_plane(12, rng)
    place += rng.normal(0.0, 0.005, place.shape)
    with pytest.raises(Undetermined, match="lie on one plane"):
        fit_affine(*observed(place, time, place + SHIFT))


def test_passes_over_one_target_are_one_target():
    "Four observations of two targets don't determine a rigid motion"
    place, time = targets(np.random.default_rng(5), 2)
    twice, times = np.vstack([place, place + 0.3]), np.append(time, time + 0.2)
    observations, control = observed(twice, times, twice, ("T1", "T2", "T3", "T4"))
    observations = replace(observations, name=("T1", "T2", "T1", "T2"))
    with pytest.raises(Undetermined, match="there are 2"):
        fit_rigid(observations, control)


def test_the_height_is_shifted_alone_where_targets_lie_on_a_line():
    "On a line the plan is still solved, and the height is a mean shift without inclination"
    place, time = on_a_line(9, None)
    correction = fit_horizontal_and_height(*observed(place, time, place + SHIFT))
    assert correction.shift == pytest.approx(SHIFT, abs=1e-6)
    assert np.abs(correction.change).max() < 1e-9


@pytest.mark.parametrize("order", [2, 5])
def test_a_polynomial_needs_more_epochs_than_its_order_and_one(order):
    "n + 1 epochs are refused, also when there are more targets, within a second of each other"
    place, time = targets(np.random.default_rng(6), order + 3)
    time = TIME + np.linspace(3.0, 97.0, order + 3)
    time[-2:] = time[-3] + [0.3, 0.6]
    given = observed(place, time, place + SHIFT)
    with pytest.raises(Undetermined, match=f"at {order + 2} epochs at least.*here are {order + 1}"):
        fit_polynomial(trajectory(), *given, order)
    with pytest.raises(Undetermined, match="epochs at least"):
        fit_literal(trajectory(), *given, Pos(), order)


# ---- when nothing but a shift is wrong


@pytest.mark.parametrize("seed", range(5))
def test_a_constant_shift_is_removed_by_shift_rigid_and_collocation_alike(seed):
    "Where the POS doesn't drift, collocation costs at most 2 mm against the right model"
    rng = np.random.default_rng(seed)
    place, time = targets(rng)
    noise = np.hypot(SIGMA, 0.001)
    control = observed(place + rng.normal(0.0, noise, place.shape), time, place + SHIFT)
    other, at = targets(rng, 30)
    check = observed(other + rng.normal(0.0, noise, other.shape), at, other + SHIFT)
    corrections = {
        "shift": fit_shift(*control),
        "rigid": fit_rigid(*control),
        "lsc": estimate_correction(trajectory(), *control).correction,
    }
    rmse = {
        name: np.sqrt(np.mean(misclosures(*check, correction) ** 2, axis=0))
        for name, correction in corrections.items()
    }
    for name in ("rigid", "lsc"):
        assert np.all(rmse[name] < rmse["shift"] + 0.002), rmse
    assert rmse["lsc"].max() < 0.006


# ---- ICP


def surface_points(rng, observations, density=400):
    "Points on the discs of observed targets, with 3 mm of noise: (PointCloud, pass numbers)"
    xyz, time = [], []
    for i in range(len(observations)):
        normal = observations.normal[i]
        level = np.cross([0.0, 0.0, 1.0], normal)
        radius = 0.3 * np.sqrt(rng.uniform(0, 1, density))
        angle = rng.uniform(0, 2 * np.pi, density)
        local = np.outer(radius * np.cos(angle), level)
        local += np.outer(radius * np.sin(angle), np.cross(normal, level))
        local += np.outer(rng.normal(0, 0.003, density), normal)
        xyz.append(observations.position[i] + local)
        time.append(np.full(density, observations.gps_time[i]))
    count = len(observations) * density
    cloud = PointCloud(np.vstack(xyz), np.concatenate(time), np.full(count, 60000))
    return cloud, np.ones(count, int)


def icp_case(rng, surveyed, n=12):
    place, time = targets(rng, n)
    observations, control = observed(place, time, surveyed(place, time))
    turn = rng.uniform(0, 2 * np.pi, n)
    normal = np.column_stack([np.cos(turn), np.sin(turn), np.zeros(n)])
    return replace(observations, normal=normal), control


def test_icp_finds_a_small_motion():
    "A shift of 4 cm and a turn of 0.2 mrad are found within a centimetre at every target"
    from mlscorr.baselines.registration import fit_icp

    rng = np.random.default_rng(8)
    change = Rotation.from_rotvec([0.0, 0.0, 0.0002]).as_matrix() - np.eye(3)
    centre = START + np.array([173.0, 100.0, 0.0])
    case = icp_case(rng, lambda p, _: p + [0.03, -0.02, 0.02] + (p - centre) @ change.T)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = fit_icp(*case, *surface_points(rng, case[0]))
    assert np.abs(misclosures(*case, found)).max() < 0.010
    assert found.fitness > 0.95
    assert found.inlier_rmse < 0.02
    assert found.control_after < 0.010 < found.control_before


def test_icp_says_loudly_that_it_failed():
    "Where the POS drifts by a metre, ICP tells fitness and RMSE, and that it moved from control"
    from mlscorr.baselines.registration import fit_icp

    rng = np.random.default_rng(9)
    # alternately to the left and to the right: ICP takes partners on the wrong side
    case = icp_case(rng, lambda p, t: p + np.outer(np.sin((t - TIME) / 5.0), [1.0, 0.8, 0.3]))
    with pytest.warns(UserWarning, match="brings only .* % of the targets' points") as caught:
        found = fit_icp(*case, *surface_points(rng, case[0]))
    assert found.fitness < 0.5
    is_worse = found.control_after > found.control_before + 0.001
    assert is_worse == any("away from control" in str(one.message) for one in caught)


def test_icp_warns_when_it_moved_away_from_control():
    "Discs of which one side was scanned draw ICP off their centres, and it says by how much"
    from mlscorr.baselines.registration import fit_icp

    rng = np.random.default_rng(10)
    case = icp_case(rng, lambda p, _: p)
    cloud, passes = surface_points(rng, case[0])
    beside = replace(cloud, xyz=cloud.xyz + np.array([0.2, 0.2, 0.0]))
    with pytest.warns(UserWarning, match="moved the cloud away from control: 3D RMSE 0.0000 m"):
        fit_icp(*case, beside, passes)


def test_icp_is_refused_for_targets_on_a_line():
    "The turn about a line of targets can't be told from their centres"
    from mlscorr.baselines.registration import fit_icp

    place, time = on_a_line(6, None)
    observations, control = observed(place, time, place + SHIFT)
    with pytest.raises(Undetermined, match="lie on one line"):
        fit_icp(observations, control, *surface_points(np.random.default_rng(1), observations))


def test_raw_leaves_every_coordinate_as_it_was():
    "The cloud as recorded keeps every bit"
    place, time = targets(np.random.default_rng(11))
    assert np.array_equal(RAW.apply(PointCloud(place, time, np.zeros(16))).xyz, place)
