"""Rows know by their partials what a wrong pose does to them."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mlscorr.frames import georeference, scanner_position, to_scanner
from mlscorr.gap.residuals import assemble, sample_pulses
from mlscorr.gap.residuals._surfaces import patch_pulses

COUNT = 40


@pytest.fixture(scope="module")
def looks(survey):
    "Points about the drive at random times: item, times, places, unit directions"
    rng = np.random.default_rng(1)
    passes = survey.trajectory.passes
    number = rng.integers(0, len(passes), COUNT)
    time = passes[number, 0] + rng.uniform(0.5, 7.0, COUNT)
    place = survey.trajectory.at(time).position + rng.uniform(-20.0, 20.0, (COUNT, 3))
    direction = rng.normal(size=(COUNT, 3))
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    return np.arange(COUNT), time, place, direction, number + 1


def pulses_at(survey, looks):
    item, time, place, direction, _ = looks
    ones = np.ones(COUNT)
    return sample_pulses(survey, item, ones, place, time, 500.0 * ones, direction)


def rows_at(survey, looks, **more):
    item, time, place, direction, number = looks
    zero = np.zeros(COUNT)
    pulses = pulses_at(survey, looks)
    points = np.full(COUNT, 30)
    channel = more.pop("channel", "surface")
    return assemble(
        survey,
        channel,
        item,
        time,
        place,
        direction,
        zero,
        zero + 1e-6,
        points,
        pulses,
        number,
        **more,
    )


def moved_by(survey, time, place, direction, shift, turn):
    "Shift of places along directions when every pose is shifted (m) and turned (rad, map axes)"
    trajectory = survey.trajectory
    wrong = replace(
        trajectory,
        position=trajectory.position + shift,
        attitude=Rotation.from_rotvec(turn) * trajectory.attitude,
    )
    scanned = to_scanner(trajectory, survey.mounting, place, time)
    there = georeference(wrong, survey.mounting, scanned, time)
    return np.einsum("mi,mi->m", direction, there - place)


@pytest.mark.parametrize("axis", range(6))
def test_partials_are_what_a_wrong_pose_does(survey, looks, axis):
    "A metre of position and a microradian of attitude, to 0.5 mm per m and rad"
    rows = rows_at(survey, looks)
    step = 1.0 if axis < 3 else 1e-6
    error = step * np.eye(6)[axis]
    _, time, place, direction, _ = looks
    moved = moved_by(survey, time, place, direction, error[:3], error[3:])
    np.testing.assert_allclose(rows.partials[:, axis], moved / step, atol=5e-4)


def test_a_plane_seen_twice_feels_both_poses(survey, looks):
    "The second time has minus its partials; a shift of the whole drive cancels"
    item, time, place, direction, number = looks
    later = np.where(np.arange(COUNT) % 2 == 0, time + 0.5, np.nan)
    rows = rows_at(survey, looks, channel="shared", gps_time_2=later)
    twice = np.isfinite(later)
    np.testing.assert_array_equal(rows.two_times, twice)
    assert not rows.partials_2[~twice].any()
    np.testing.assert_allclose((rows.partials + rows.partials_2)[twice, :3], 0.0, atol=1e-12)
    at_second = (item, np.where(twice, later, time), place, direction, number)
    expected = -rows_at(survey, at_second).partials[twice]
    np.testing.assert_allclose(rows.partials_2[twice], expected, atol=1e-12)


def test_what_is_not_given_is_nothing(survey, looks):
    "No second time, no survey error, no belief"
    rows = rows_at(survey, looks)
    assert not rows.two_times.any() and (rows.survey_item == -1).all()
    assert not rows.survey.any() and np.isnan(rows.assumed).all()
    assert rows.channel.dtype.kind == "U" and (rows.channel == "surface").all()


def test_the_survey_variance_is_the_factors_length(survey, looks):
    "Of 1, 2 and 2 mm it is 9 mm^2"
    factor = np.tile([0.001, 0.002, 0.002], (COUNT, 1))
    rows = rows_at(survey, looks, survey_factor=factor, survey_item=np.zeros(COUNT, int))
    np.testing.assert_allclose(rows.survey, 9e-6)


def test_channels_of_rows_can_differ(survey, looks):
    "A list of channels is one for each row, a word is that of all"
    mixed = np.where(np.arange(COUNT) < 10, "target", "return_rate")
    rows = rows_at(survey, looks, channel=mixed)
    assert rows.metric.sum() == 10 and rows.channel[-1] == "return_rate"


def test_no_rows_are_no_fault(survey, looks):
    "Of nothing there are rows of nothing, with six partials"
    none = tuple(values[:0] for values in looks)
    zero = np.zeros(0)
    pulses = pulses_at(survey, looks)[:0]
    rows = assemble(survey, "target", *none[:4], zero, zero, zero.astype(int), pulses, none[4])
    assert len(rows) == 0 and rows.partials.shape == (0, 6)


def test_incidence_is_the_cosine_between_beam_and_normal(survey, looks):
    "One where the surface faces the scanner, zero where it is seen from its edge"
    item, time, place, _, _ = looks
    beam = place - scanner_position(survey.trajectory, survey.mounting, time)
    beam /= np.linalg.norm(beam, axis=1, keepdims=True)
    across = np.cross(beam, [0.0, 0.0, 1.0])
    ones = np.ones(COUNT)
    for normal, cosine in ((beam, 1.0), (-beam, 1.0), (across, 0.0)):
        pulses = sample_pulses(survey, item, ones, place, time, ones.astype(np.uint16), normal)
        np.testing.assert_allclose(pulses.incidence, cosine, atol=1e-9)
    assert pulses.intensity.dtype == float


def test_scanner_coordinates_lead_back_to_the_map(survey, looks):
    "Georeferenced with mounting and trajectory they are the points, to 1 um; NaN without mounting"
    pulses = pulses_at(survey, looks)
    back = georeference(survey.trajectory, survey.mounting, pulses.scanner_xyz, pulses.gps_time)
    np.testing.assert_allclose(back, pulses.xyz, atol=1e-6)
    bare = replace(survey, mounting=None, reference=None)
    assert np.isnan(pulses_at(bare, looks).scanner_xyz).all()


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_pulses_of_a_patch_stand_for_its_mean(survey, patches, sign):
    "Twelve of each, of weights that sum to one, or to minus one for a second view"
    some = patches[:7]
    item = 10 + np.arange(7)
    pulses = patch_pulses(survey, some, item, sign)
    assert len(pulses) == 7 * some.time.shape[1]
    np.testing.assert_allclose(np.bincount(pulses.item, pulses.weight)[10:], sign)
    for i, number in enumerate(item):
        own = pulses[pulses.item == number]
        np.testing.assert_array_equal(own.xyz, some.xyz[i])
        np.testing.assert_array_equal(own.gps_time, some.time[i])
        np.testing.assert_array_equal(own.normal, np.tile(some.normal[i], (len(own), 1)))
