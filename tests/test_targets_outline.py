import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from scipy.special import ndtr

from mlscorr.targets.outline import Size, fit_outline
from mlscorr.targets.plane import fit_plane
from mlscorr.targets.shapes import FORMS, distance_inside, distance_on_white, log_likelihood
from mlscorr.targets.visits import motion_covariance, split_visits

ORIGIN = np.array([523_000.0, 3_378_000.0, 42.0])  # m, UTM
START = 413_200.0  # s of the GPS week
SIZE = 0.6  # m
BLUR = 0.001  # m
KNOWN = Size(SIZE, 0.001, 0.595, 0.605)
UNKNOWN = Size(0.65, np.inf, 0.4, 0.8)


def beams(kind, seed, half=False, inner=0.0):
    "Scan lines 3 cm apart, their states, and the truth; four times as dense on one side"
    rng = np.random.default_rng(seed)
    centre, turn = rng.uniform(-0.05, 0.05, 2), rng.uniform(0, np.pi)
    lines = np.arange(-0.6, 0.6, 0.03) + rng.uniform(0, 0.03)
    along = np.arange(-0.6, 0.6, 0.008)
    points = np.concatenate(
        [np.column_stack([np.full(len(along), u), along + rng.uniform(0, 0.008)]) for u in lines]
    )
    points = points[(points[:, 1] > 0) | (rng.random(len(points)) < 0.25)]
    points = points[points[:, 0] > (-0.05 if half else -1.0)]
    noisy = points + BLUR * rng.standard_normal(points.shape)
    row = np.array([*centre, turn, SIZE, inner])
    inside = distance_inside(noisy, row, FORMS[kind]) > 0
    state = np.where(inside, 1, 0)
    if kind == "checkerboard":
        state = np.where(inside, np.where(distance_on_white(noisy, row) > 0, 1, 0), -1)
    elif kind == "hole":
        state = np.where(inside, -1, 0)
    elif kind == "board":
        state = np.where(inside, 0, -1)
    return points, state, row


@pytest.mark.parametrize("half", [False, True])
@pytest.mark.parametrize("kind", ["circle", "square", "hole", "checkerboard", "board"])
def test_outline_is_unbiased_by_density_and_its_covariance_honest(kind, half):
    "Errors are as large as stated, whatever the density and also where a side is unseen"
    squares, errors = [], []
    for seed in range(10):
        points, state, truth = beams(kind, seed, half)
        outline = fit_outline(points, state, kind, KNOWN, BLUR, by_edges=kind in ("hole", "board"))
        error = outline.centre - truth[:2]
        errors.append(error)
        squares.append(error @ np.linalg.solve(outline.covariance, error) / 2)
    assert 0.28 < np.mean(squares) < 2.3  # 99.9 % of chi-squared of 20 over 20
    assert np.linalg.norm(errors, axis=1).max() < 0.006  # m


@pytest.mark.parametrize("kind", ["circle", "square"])
def test_an_unknown_size_is_estimated(kind):
    "To 2 mm, and within four of its sigmas"
    for seed in range(6):
        points, state, _ = beams(kind, seed)
        outline = fit_outline(points, state, kind, UNKNOWN, BLUR)
        assert abs(outline.size - SIZE) < min(0.004, 4 * outline.size_sigma)


def test_a_ring_has_a_dark_inner_disc():
    "Centre to 2 mm and the inner disc's share of the diameter to 2 %"
    points, state, truth = beams("circle", 3, inner=0.5)
    outline = fit_outline(points, state, "circle", KNOWN, BLUR, ring=True)
    assert np.linalg.norm(outline.centre - truth[:2]) < 0.002  # m
    assert outline.inner == pytest.approx(0.5, abs=0.02)


def test_the_likelihood_from_a_table_is_that_of_the_normal_distribution():
    "Of 300 beams about a disc, told to 5e-6 each; a beam along the plane makes it no number"
    rng = np.random.default_rng(3)
    points, side = rng.uniform(-0.5, 0.5, (300, 2)), rng.choice([-1, 1], 300).astype(np.int8)
    trials = np.array([[0.0, 0.0, 0.0, 0.6, 0.0], [0.05, 0.1, 0.0, 0.5, 0.0]])
    inside = trials[:, 3:4] / 2 - np.linalg.norm(points - trials[:, None, :2], axis=2)
    exact = np.log(0.01 + 0.98 * ndtr(inside * side / 0.05)).sum(axis=1)
    assert log_likelihood(points, side, trials, 0, 0.05) == pytest.approx(exact, abs=300 * 5e-6)
    points[0] = np.nan
    assert np.isnan(log_likelihood(points, side, trials, 0, 0.05)).all()


@pytest.mark.parametrize("seed", range(5))
def test_fit_plane_with_outliers(seed):
    "30 % of points up to 1 m off do not turn a plane by more than 0.3 deg, at UTM coordinates"
    rng = np.random.default_rng(seed)
    turn = Rotation.random(random_state=seed).as_matrix()
    local = np.column_stack([rng.uniform(-0.3, 0.3, (400, 2)), 0.004 * rng.standard_normal(400)])
    local[:120, 2] += rng.uniform(-1, 1, 120)
    plane = fit_plane(local @ turn.T + ORIGIN, 0.03)
    assert abs(plane.axes[2] @ turn[:, 2]) > np.cos(np.radians(0.3))
    assert abs((plane.origin - ORIGIN) @ turn[:, 2]) < 0.001  # m
    assert plane.inliers[120:].mean() > 0.95
    assert plane.sigma == pytest.approx(0.004, rel=0.3)


def test_fit_plane_needs_three_points():
    "Two points are refused with the number"
    with pytest.raises(ValueError, match="needs 3 points, there are 2"):
        fit_plane(np.zeros((2, 3)), 0.03)


def drive(*legs):
    "Times and places of a vehicle at 20 Hz that drives legs of (duration, speed north)"
    speed = np.concatenate([np.full(int(20 * duration), v) for duration, v in legs])
    north = np.cumsum(speed) / 20
    return START + np.arange(len(speed)) / 20, ORIGIN + np.outer(north, [0.0, 1.0, 0.0])


def test_a_stop_is_one_visit():
    "Ten seconds at a standstill before a target do not part what was seen before and after"
    assert len(split_visits(*drive((2, 5), (10, 0), (2, 5)))) == 1


def test_a_turn_back_is_two_visits():
    "The second begins where the vehicle turned, to half a metre, also after a stop there"
    time, place = drive((4, 5), (3, 0), (4, -5))
    first, second = split_visits(time, place)
    assert len(first) + len(second) == len(time)
    assert np.linalg.norm(place[second[0]] - place[80]) < 0.5  # m


def test_a_pause_is_two_visits():
    "Points three seconds apart were seen at two visits, in any order of points"
    time, place = drive((4, 5))
    time[40:] += 3.0
    order = np.random.default_rng(0).permutation(len(time))
    visits = split_visits(time[order], place[order])
    assert [len(rows) for rows in visits] == [40, 40]
    assert np.all(np.diff(time[order][visits[1]]) > 0)


def test_motion_of_the_pos_error_grows_with_its_sigma_and_the_time(straight_trajectory):
    "3 mm where a POS of 0.1 m is watched for half a second; nothing in no time"
    found = motion_covariance(straight_trajectory, [START + 10.0], [0.5])[0]
    assert np.sqrt(np.diag(found)) == pytest.approx(0.1 * np.sqrt(3) / 30 * 0.5)  # m
    assert not motion_covariance(straight_trajectory, [START + 10.0], [0.0]).any()


@pytest.fixture
def straight_trajectory():
    from mlscorr.survey import Trajectory, attitude_from_angles

    time, place = drive((20, 5))
    still = attitude_from_angles(0.0, 0.0, np.zeros(len(time)))
    return Trajectory(time, place, still, np.full((len(time), 3), 0.1))
