from dataclasses import replace

import numpy as np
import pytest

from mlscorr.frames import attitude_from_angles
from mlscorr.matching import match
from mlscorr.survey import ControlPoints, TargetObservations, Trajectory

ORIGIN = np.array([532_000.0, 3_374_000.0, 42.0])  # m, UTM
START = 357_700.0  # s of the GPS week
SPEED = 10.0  # m/s


def trajectory(sigma=None):
    "A drive of 200 s to the north; sigma (m) of the easting as a function of elapsed time"
    elapsed = np.arange(0.0, 200.0, 0.1)
    path = ORIGIN + np.outer(elapsed, [0.0, SPEED, 0.0])
    if sigma is None:
        sigmas = None
    else:
        sigmas = np.outer(sigma(elapsed), [1.0, 0.0, 0.0])
    still = attitude_from_angles(0.0, 0.0, np.zeros(len(elapsed)))
    return Trajectory(START + elapsed, path, still, sigmas)


def control_points(local, kind="circle", size=0.6):
    n = len(local)
    return ControlPoints(
        tuple(f"T{i + 1:02d}" for i in range(n)),
        ORIGIN + np.reshape(local, (n, 3)),
        np.full((n, 3), 0.003),
        (kind,) * n if isinstance(kind, str) else kind,
        np.broadcast_to(size, n).astype(float),
        np.full((n, 3), np.nan),
    )


def observations(local, kind="circle", size=0.6, pass_number=1):
    "Observations at local places, each at the time when the vehicle drives by"
    local = np.reshape(local, (-1, 3))
    n = len(local)
    return TargetObservations(
        (None,) * n,
        np.broadcast_to(pass_number, n).copy(),
        START + local[:, 1] / SPEED,
        ORIGIN + local,
        np.tile(np.eye(3) * 0.002**2, (n, 1, 1)),
        np.tile([1.0, 0.0, 0.0], (n, 1)),
        (kind,) * n if isinstance(kind, str) else kind,
        np.broadcast_to(size, n).astype(float),
        np.full(n, 200),
    )


EAST = np.array([1.0, 0.0, 0.0])
PLACES = np.array([[5.0, 100.0 * i + 50.0, 1.0] for i in range(10)])


def test_each_observation_gets_its_own_control_point():
    "Ten targets 0.5 m from their surveyed points are all named right, in any order"
    order = np.random.default_rng(1).permutation(10)
    found = match(observations(PLACES[order] + 0.3), control_points(PLACES), trajectory())
    assert found.matched.name == tuple(f"T{i + 1:02d}" for i in order)
    assert len(found.unmatched) == 0
    assert found.refusals == ()


@pytest.mark.parametrize("radius", [2.0, 10.0])
def test_beyond_the_search_radius_nothing_is_matched(radius):
    "Ten targets that agree are named within the radius, none of them half a metre beyond"
    for away, count in ((radius - 0.5, 10), (radius + 0.5, 0)):
        seen = observations(PLACES + away * EAST)
        found = match(seen, control_points(PLACES), trajectory(), search_radius=radius)
        assert len(found.matched) == count
    assert f"search radius {radius:.2f} m" in found.refusals[0].reason


@pytest.mark.parametrize("sigma", [None, 0.5, 0.05, 5.0])
def test_drift_of_two_metres_is_matched_whatever_the_sigma_says(sigma):
    "A slow bias of 2 m at a stated 0.5 m, none, a tenth or ten times that: all named, none wrong"
    seconds = PLACES[:, 1] / SPEED
    bias = 2.0 * np.outer(0.7 + 0.3 * np.sin(seconds / 50.0), [0.6, -0.8, 0.0])
    drive = trajectory(None if sigma is None else lambda t: np.full(len(t), sigma))
    found = match(observations(PLACES + bias), control_points(PLACES), drive)
    assert found.matched.name == control_points(PLACES).name
    assert found.refusals == ()


@pytest.mark.parametrize("sigma", [None, 0.5, 5.0])
@pytest.mark.parametrize("seed", range(3))
def test_look_alikes_in_an_unstated_bias_are_right_or_refused(sigma, seed):
    "Each target has a look-alike 1.5 m off that nobody surveyed, in 2 m of bias: none is wrong"
    rng = np.random.default_rng(seed)
    away = rng.normal(size=PLACES.shape)
    away *= 1.5 / np.linalg.norm(away, axis=1, keepdims=True)
    bias = 2.0 * np.array([0.6, -0.8, 0.0])
    seen = np.vstack([PLACES, PLACES + away]) + bias
    drive = trajectory(None if sigma is None else lambda t: np.full(len(t), sigma))
    found = match(observations(seen), control_points(PLACES), drive).matched
    truth = {tuple(ORIGIN + place): f"T{i + 1:02d}" for i, place in enumerate(PLACES + bias)}
    for name, position in zip(found.name, found.position, strict=True):
        assert truth.get(tuple(position)) == name


def test_drift_starts_anew_at_a_step_in_the_path():
    "2 m of drift that no sigma states fall back within 0.1 s: targets on both sides are named"
    drive = trajectory(lambda t: np.full(len(t), 0.1))
    error = np.where(drive.gps_time < START + 99.95, (drive.gps_time - START) / 50.0, 0.0)
    recorded = replace(drive, position=drive.position + error[:, None] * EAST)
    places = np.column_stack([np.full(30, 5.0), 50.0 * np.arange(30) + 30.0, np.ones(30)])
    at = np.interp(places[:, 1] / SPEED, drive.gps_time - START, error)
    found = match(observations(places + at[:, None] * EAST), control_points(places), recorded)
    assert found.matched.name == control_points(places).name


def test_kind_and_size_must_agree():
    "A square is no circle, and 0.6 m is not 0.5 m, however near"
    control = control_points(PLACES[:1], "circle", 0.6)
    assert len(match(observations(PLACES[:1], "square", 0.6), control, trajectory()).matched) == 0
    assert len(match(observations(PLACES[:1], "circle", 0.5), control, trajectory()).matched) == 0
    assert len(match(observations(PLACES[:1], "circle", 0.6), control, trajectory()).matched) == 1


def test_a_square_beside_a_circle_is_no_rival():
    "Targets of two kinds at one place do not disturb each other"
    places = np.array([[5.0, 50.0, 1.0], [5.0, 50.3, 1.0]])
    kinds = ("circle", "square")
    found = match(observations(places + 0.2, kinds), control_points(places, kinds), trajectory())
    assert found.matched.name == ("T01", "T02")


def test_two_look_alikes_apart_are_told_apart():
    "Control 1.5 m apart and misclosures of 0.2 m: clear"
    places = np.array([[5.0, 50.0, 1.0], [5.0, 51.5, 1.0]])
    found = match(
        observations(places + np.array([0.0, 0.2, 0.0])), control_points(places), trajectory()
    )
    assert found.matched.name == ("T01", "T02")


def test_an_observation_between_look_alikes_is_refused():
    "An observation alone, halfway between two surveyed points, could be either: it stays unnamed"
    places = np.array([[5.0, 50.0, 1.0], [5.0, 51.0, 1.0]])
    found = match(
        observations(places[:1] + np.array([0.0, 0.45, 0.0])), control_points(places), trajectory()
    )
    assert len(found.matched) == 0
    assert len(found.unmatched) == 1
    assert {refusal.name for refusal in found.refusals} == {"T01", "T02"}
    for refusal in found.refusals:
        assert refusal.pass_number == 1
        assert "T01" in refusal.reason and "T02" in refusal.reason
        assert "both match" in refusal.reason
        assert "search radius 10.00 m" in refusal.reason
    assert found.reasons == (found.refusals[0].reason,)


def test_an_observation_without_control_is_left_over():
    "A target that nobody surveyed stays unnamed, with its data"
    found = match(observations(PLACES[:3]), control_points(PLACES[[0, 2]]), trajectory())
    assert found.matched.name == ("T01", "T02")
    assert found.unmatched.name == (None,)
    assert np.array_equal(found.unmatched.position[0], ORIGIN + PLACES[1])


def test_a_control_point_is_matched_once_in_a_pass():
    "Of two finds near one surveyed point the one that agrees with the neighbours gets it"
    seen = np.vstack([PLACES, PLACES[:1] + np.array([0.0, 0.7, 0.0])]) + np.array([0.0, 0.1, 0.0])
    found = match(observations(seen), control_points(PLACES), trajectory())
    assert found.matched.name == control_points(PLACES).name
    assert np.array_equal(found.matched.position[0], ORIGIN + seen[0])
    assert len(found.unmatched) == 1
    assert "T01, already matched in this pass" in found.reasons[0]


def test_each_pass_has_its_own_misclosure():
    "Two passes 400 s apart, 0.8 m from each other, each get the same ten names"
    one = trajectory(lambda t: np.full(len(t), 0.3))
    seen = observations(PLACES + 0.4 * EAST), observations(PLACES - 0.4 * EAST, pass_number=2)
    drive = Trajectory(
        np.append(one.gps_time, one.gps_time + 400.0),
        np.vstack([one.position, one.position]),
        attitude_from_angles(0.0, 0.0, np.zeros(2 * len(one))),
        np.vstack([one.position_sigma, one.position_sigma]),
    )
    both = TargetObservations(
        (None,) * 20,
        np.repeat([1, 2], 10),
        np.append(seen[0].gps_time, seen[1].gps_time + 400.0),
        np.vstack([part.position for part in seen]),
        np.vstack([part.covariance for part in seen]),
        np.vstack([part.normal for part in seen]),
        seen[0].kind * 2,
        np.append(seen[0].size, seen[1].size),
        np.append(seen[0].points, seen[1].points),
    )
    found = match(both, control_points(PLACES), drive)
    assert found.matched.name == control_points(PLACES).name * 2
    assert np.array_equal(found.matched.pass_number, both.pass_number)


@pytest.mark.parametrize("seed", range(10))
def test_smooth_drift_of_two_metres_between_targets_ten_metres_apart(seed):
    "An outage's drift, stated by the POS, names 60 targets right: none wrong, none lost"
    rng = np.random.default_rng(seed)
    along = 10.0 * np.arange(60) + 50.0
    places = np.column_stack([rng.choice([-5.0, 5.0], 60), along, rng.uniform(0, 2, 60)])
    shape = np.sin(np.pi * np.arange(60) / 59)[:, None]
    direction = rng.standard_normal(3)
    drift = 2.0 * shape * direction / np.linalg.norm(direction)
    drive = trajectory(lambda t: np.full(len(t), 0.7))
    found = match(observations(places + drift), control_points(places), drive)
    assert found.matched.name == control_points(places).name
    assert found.refusals == ()


def test_origin_and_time_zero_do_not_matter():
    "Only differences count: local coordinates and times give the same names and probabilities"
    control = control_points(PLACES)
    seen = observations(PLACES + 0.4)
    drive = trajectory()
    near = match(
        replace(seen, position=seen.position - ORIGIN, gps_time=seen.gps_time - START),
        replace(control, position=control.position - ORIGIN),
        replace(drive, position=drive.position - ORIGIN, gps_time=drive.gps_time - START),
    )
    far = match(seen, control, drive)
    assert near.matched.name == far.matched.name == control.name
    assert near.probability == pytest.approx(far.probability, abs=1e-6)
