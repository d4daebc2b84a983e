"""Ranges that are all too short, an encoder of a wrong scale: found beside the mounting."""

from dataclasses import replace

import numpy as np
import pytest

from mlscorr.estimate import (
    calibration_with_ties,
    estimate_mounting,
    prior_mounting,
    with_scanner_errors,
)
from mlscorr.frames import georeference, scanner_partials, to_scanner
from tests.beds.tied_site import RECORDED, tied_site


def distorted(site, ranges, scale):
    "Matched and Ties as a scanner recorded them that lacks so much of its ranges (m) and angles"

    def record(place, gps_time):
        beam = to_scanner(site.trajectory, RECORDED, place, gps_time)
        distance = np.linalg.norm(beam, axis=1, keepdims=True)
        angle = np.arctan2(beam[:, 1], beam[:, 0])
        turn = angle / (1 + scale) - angle
        x, y, z = (beam * (1 - ranges / distance)).T
        beam = np.column_stack(
            [x * np.cos(turn) - y * np.sin(turn), x * np.sin(turn) + y * np.cos(turn), z]
        )
        return georeference(site.trajectory, RECORDED, beam, gps_time)

    matched = site.matched
    ties = site.ties
    position = record(matched.observations.position, matched.gps_time)
    matched = replace(matched, observations=replace(matched.observations, position=position))
    place = record(ties.place.reshape(-1, 3), ties.gps_time.ravel()).reshape(-1, 2, 3)
    misclosure = np.einsum("ni,ni->n", ties.direction, place[:, 1] - place[:, 0])
    return matched, replace(ties, place=place, misclosure=misclosure)


def calibrated(seed, ranges=0.0, scale=0.0):
    "Site, calibrations of 16 targets and 30 ties without and with the scanner's own errors"
    site = tied_site(seed, targets=16, number=30)
    matched, ties = distorted(site, ranges, scale)
    alone = estimate_mounting(site.trajectory, [RECORDED], matched)
    tied = calibration_with_ties(alone, matched, ties)
    return site, tied, with_scanner_errors(tied, matched)


@pytest.mark.long
@pytest.mark.parametrize(("ranges", "scale"), [(0.03, 0.0), (0.0, 0.003)])
def test_what_ranges_or_encoder_lack_is_found_and_the_mounting_freed_of_it(ranges, scale):
    "30 mm, or 3 mrad per rad, within three sigmas, and the mounting within three of the truth"
    site, tied, freed = calibrated(1, ranges, scale)
    lacks = freed.scanner
    assert lacks.significant.tolist() == [ranges > 0, scale > 0]
    assert (np.abs(lacks.correction - [ranges, scale]) < 3 * lacks.sigma).all()
    assert lacks.sigma[0] < 0.01 and lacks.sigma[1] < 5e-4  # m, ratio
    errors = [np.abs(c.lsc.correction - site.lacks) for c in (tied, freed)]
    assert (errors[1] < 3 * freed.lsc.sigma).all()
    assert np.degrees(errors[1][3:].max()) < 0.02  # deg
    assert "The scanner itself has errors" in freed.warnings[-1]
    anew = freed.with_residuals(tied.ties.ties, tied.ties.used).ties.after
    assert np.array_equal(freed.ties.after, anew) and not np.array_equal(tied.ties.after, anew)


@pytest.mark.long
def test_an_encoder_beyond_any_data_sheet_is_not_pulled_to_it():
    "5 mrad per rad by 8 targets: within two sigmas, not determined, as the mounting is"
    site = tied_site(2, targets=8, number=3)
    matched, _ = distorted(site, 0.0, -0.005)
    freed = with_scanner_errors(estimate_mounting(site.trajectory, [RECORDED], matched), matched)
    lacks = freed.scanner
    assert lacks.significant.tolist() == [False, True] and not lacks.determined[1]
    assert abs(lacks.correction[1] + 0.005) < 2 * lacks.sigma[1]
    assert (np.abs(freed.lsc.correction - site.lacks) < 2 * freed.lsc.sigma).all()
    assert freed.scanner.statements[0].values["determined"] == (False,)


def test_an_encoder_that_looks_like_a_boresight_leaves_it_undetermined():
    "Targets far to the left alone: by its scale or by a turn, roll and pitch come to the same"
    site = tied_site(1, targets=48, number=3)
    matched, _ = distorted(site, 0.0, 0.03)
    beam = to_scanner(site.trajectory, RECORDED, matched.observations.position, matched.gps_time)
    one_way = matched[np.arctan2(beam[:, 1], beam[:, 0]) > np.radians(165.0)]
    known = prior_mounting(site.trajectory, [RECORDED], one_way)
    assert known.determined[3:].all()
    freed = with_scanner_errors(known, one_way)
    assert freed.scanner.significant[1]
    assert freed.determined.tolist() == [True, True, False, False, False, True]
    assert freed.lsc.sigma[4] > 0.002  # rad
    assert "boresight about forward" in freed.sigma_note


@pytest.mark.long
def test_a_scanner_that_is_right_changes_nothing():
    "No sentence, the same mounting, and values within three sigmas of zero"
    _, tied, freed = calibrated(1)
    assert not freed.scanner.significant.any() and freed.scanner.statements == ()
    assert (np.abs(freed.scanner.correction) < 3 * freed.scanner.sigma).all()
    assert freed.lsc is tied.lsc


def test_the_partials_are_differences_of_georeferenced_points():
    "A range longer by 0.1 mm, an angle by a hundred thousandth, move points as the partials say"
    site = tied_site(1)
    times = site.matched.gps_time
    place = site.matched.observations.position
    beam = to_scanner(site.trajectory, RECORDED, place, times)
    angle = np.arctan2(beam[:, 1], beam[:, 0])
    radius = np.hypot(beam[:, 0], beam[:, 1])
    longer = beam * (1 + 1e-4 / np.linalg.norm(beam, axis=1, keepdims=True))
    turned = np.column_stack(
        [*(radius * f(angle * (1 + 1e-5)) for f in (np.cos, np.sin)), beam[:, 2]]
    )
    partials = scanner_partials(site.trajectory, RECORDED, place, times)
    for column, changed, step in ((0, longer, 1e-4), (1, turned, 1e-5)):
        moved = georeference(site.trajectory, RECORDED, changed, times) - place
        assert np.abs(moved / step - partials[:, :, column]).max() < 5e-3  # of 60 m a radian
