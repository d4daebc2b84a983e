"""Degrees of boresight from the planes that two passes both saw, and nothing else."""

from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from mlscorr.frames import georeference, to_scanner
from mlscorr.survey import Mounting
from mlscorr.ties import coarse_mounting, remounted
from mlscorr.ties.thinning import some_blocks
from tests.beds import painted_roads as road
from tests.beds import tie_streets as street

TRUE = Mounting(np.zeros(3), Rotation.identity())
KNOWN = np.diag(np.repeat([0.01, np.radians(5.0)], 3) ** 2)  # m, rad: a drawing of the boresight


def wrong(degrees):
    "A mounting whose boresight lacks degrees about right, forward and up"
    turn = Rotation.from_rotvec(np.radians(degrees))
    return Mounting(TRUE.lever_arm, turn.inv(), KNOWN)


def scanned_wrong(degrees, survey=None, clouds=None):
    "Features of a street whose every point a wrong mounting put where it is"
    survey = street.survey() if survey is None else survey
    parts = []
    way = survey.trajectory
    for cloud in street.clouds() if clouds is None else clouds:
        seen = to_scanner(way, TRUE, cloud.xyz, cloud.gps_time)
        put = georeference(way, wrong(degrees), seen, cloud.gps_time)
        parts.append(type(cloud)(put, cloud.gps_time, cloud.intensity))
    return street.collect(survey, parts)


def test_a_wall_that_is_passed_keeps_its_direction():
    "A heading wrong by 3 deg shifts a wall along the way, and turns none; corrected, none turns"
    features = scanned_wrong([0.0, 0.0, 3.0])
    is_wall = np.abs(features.direction[:, 1]) > 0.95
    corrected = remounted(features, street.trajectory(), [wrong([0.0, 0.0, 3.0])], [TRUE])
    for direction in (features.direction[is_wall], corrected.direction[is_wall]):
        assert np.degrees(np.abs(np.median(direction[:, 0]))) < 0.1


def test_paint_turns_with_the_mounting():
    "A scanner that rolls 4 deg too far paints lines and dashes aside; corrected, they lie true"
    survey = road.survey()
    rng = np.random.default_rng(1)
    clouds = [road.cloud(number, rng) for number in (0, 1)]
    features = scanned_wrong([1.0, 4.0, 2.0], survey, clouds)
    corrected = remounted(features, survey.trajectory, [wrong([1.0, 4.0, 2.0])], [TRUE])
    way = road.turned(np.eye(3)[:1], 70.0)[0] - road.ORIGIN
    left = np.cross([0.0, 0.0, 1.0], way)
    for kind, axis in (("line", left), ("dash", way)):
        seen, true = (f[f.kind == kind] for f in (features, corrected))
        assert len(true) > 4
        off = np.abs(road.along_and_left(seen.centre)[:, 1])
        assert np.median(np.minimum(off, np.abs(off - road.EDGE))) > 0.05  # m
        left_over = np.abs(road.along_and_left(true.centre)[:, 1])
        assert np.median(np.minimum(left_over, np.abs(left_over - road.EDGE))) < 0.01  # m
        assert np.median(np.abs(true.direction @ axis)) > np.cos(np.radians(0.5))


def test_degrees_are_found_from_planes():
    "A boresight wrong by 2 and 3 deg, road decimetres apart: about forward found to 0.02 deg"
    lacks = [0.0, -3.0, 2.0]  # about up a scan plane straight across tells little
    features = scanned_wrong(lacks)
    sigma = np.full(len(features), 0.01)
    (found,) = coarse_mounting(features, street.trajectory(), [wrong(lacks)], sigma, 5.0)
    left = np.degrees((TRUE.boresight * found.boresight.inv()).as_rotvec())
    assert np.abs(left[:2]).max() < 0.02
    assert found.covariance is KNOWN


def test_one_pass_leaves_the_mounting_as_it_was():
    "Nothing was seen twice: the mounting comes back unchanged"
    features = street.features(1, 1)
    sigma = np.full(len(features), 0.01)
    start = wrong([1.0, 0.0, 0.0])
    (found,) = coarse_mounting(features, street.trajectory(1), [start], sigma, 5.0)
    assert np.allclose(found.boresight.as_rotvec(), start.boresight.as_rotvec(), atol=1e-9)


def test_some_blocks_are_the_same_in_both_passes():
    "A third of the features: what is left of one pass has a neighbour in the other, as before"
    features = street.features()
    part = some_blocks(features, len(features) // 3)
    assert len(features) / 4 < len(part) < len(features) / 2
    places = [
        {tuple(c) for c in np.floor(part.centre[part.pass_number == n] / 4.0).astype(int)}
        for n in (1, 2)
    ]
    assert len(places[0] & places[1]) > 0.6 * min(map(len, places))


def test_a_scanner_that_passed_once_is_found_by_what_another_saw():
    "One pass of each, the second wrong by 3 deg: about forward to 0.02 deg, about right to 0.1"
    lacks = [0.0, -3.0, 2.0]
    way = street.trajectory()
    parts = []
    first = Mounting(TRUE.lever_arm, TRUE.boresight, np.diag(np.repeat([1e-3, 1e-4], 3) ** 2))
    for cloud, mounting in zip(street.clouds(), (TRUE, wrong(lacks)), strict=True):
        seen = to_scanner(way, TRUE, cloud.xyz, cloud.gps_time)
        put = georeference(way, mounting, seen, cloud.gps_time)
        parts.append(type(cloud)(put, cloud.gps_time, cloud.intensity))
    features = street.collect(street.survey(), parts)
    features = replace(features, scanner=features.pass_number - 1)
    sigma = np.full(len(features), 0.01)
    found = coarse_mounting(features, way, [first, wrong(lacks)], sigma, 5.0)
    left = [np.degrees((TRUE.boresight * m.boresight.inv()).as_rotvec()) for m in found]
    assert np.abs(left[0]).max() < 0.02
    assert (np.abs(left[1][:2]) < [0.1, 0.02]).all()
