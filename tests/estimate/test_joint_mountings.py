"""The mountings of two scanners in one estimate, with one POS error and what both of them saw."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mlscorr.estimate import (
    calibration_with_ties,
    estimate_mounting,
    prior_mounting,
    with_scanner_errors,
)
from mlscorr.frames import scanner_position
from tests.beds.scanner_site import LACKS, RECORDED, scanner_site

pytestmark = pytest.mark.long

SEEDS = range(1, 5)
UNITS = np.repeat([1.0, np.degrees(1.0)], 3)  # m, deg


def together(site):
    "The calibration of both scanners with all that they saw"
    start = estimate_mounting(site.trajectory, RECORDED, site.matched)
    return calibration_with_ties(start, site.matched, site.ties)


def separate(site, ties=True):
    "The calibration of each scanner by what it alone saw"
    for number, mounting in enumerate(RECORDED):
        matched, own = site.of(number)
        alone = estimate_mounting(site.trajectory, [mounting], matched)
        yield calibration_with_ties(alone, matched, own) if ties else alone


@pytest.fixture(scope="module")
def sites():
    "Half a degree and centimetres of both, 6 control points, 60 planes of each and of both"
    return [scanner_site(seed) for seed in SEEDS]


@pytest.fixture(scope="module")
def joint(sites):
    return [together(site) for site in sites]


@pytest.fixture(scope="module")
def alone(sites):
    return [list(separate(site)) for site in sites]


def test_sentences_of_two_mountings_are_those_that_both_share(joint):
    "Undetermined parameters of one mounting are stated in the calibration of that scanner"
    for calibration in joint:
        assert calibration.warnings == calibration.shared_warnings
        assert not calibration.determined.all()


def test_both_mountings_are_found(joint):
    "Lever arms to 7 mm and boresights to 3 mdeg, within 3 sigmas, over seeds"
    for calibration in joint:
        error = calibration.lsc.correction.reshape(2, 6) - LACKS
        assert (np.abs(error) < 3 * calibration.lsc.sigma.reshape(2, 6)).all()
        assert np.abs(error[:, :3]).max() < 0.007  # m
        assert np.degrees(np.abs(error[:, 3:]).max()) < 0.003  # deg
        assert calibration.determined.tolist() == 2 * [True, True, False, True, True, True]


def test_one_scanner_beside_the_other_is_found_to_millidegrees(joint):
    "Lever arm to 1 mm and boresight to 3 mdeg, within 3 sigmas that claim as much"
    turns = Rotation.from_rotvec(LACKS[:, 3:])
    turn = (turns[1] * turns[0].inv()).as_rotvec()
    truth = np.append(LACKS[1, :3] - LACKS[0, :3], turn)
    for calibration in joint:
        lacks, sigma = calibration.lsc.relative_to_first(1)
        error = np.abs(lacks - truth)
        assert (error < 3 * sigma).all()
        assert (UNITS * error < np.repeat([1e-3, 3e-3], 3)).all()
        assert (UNITS * sigma < np.repeat([1e-3, 3e-3], 3)).all()
        assert calibration.fit_sigma(1) < 1e-3  # m


def test_together_they_are_better_than_alone(joint, alone):
    "Sigmas of the one beside the other fall, by half in the lever arm; over seeds errors do too"
    errors = {"joint": [], "alone": []}
    for both, parts in zip(joint, alone, strict=True):
        sigma = np.sqrt(sum(part.lsc.sigma**2 for part in parts))
        assert (both.lsc.relative_to_first(1)[1] < np.repeat([0.5, 0.9], 3) * sigma).all()
        for name, estimates in (
            ("joint", both.lsc.correction.reshape(2, 6)),
            ("alone", np.array([part.lsc.correction for part in parts])),
        ):
            errors[name].append(np.diff(estimates - LACKS, axis=0)[0])
    for rows in (slice(0, 3), slice(3, 6)):
        rms = {name: np.sqrt(np.mean(np.square(e)[:, rows])) for name, e in errors.items()}
        assert rms["joint"] < 0.8 * rms["alone"]


@pytest.mark.parametrize(("ties", "share"), [(False, 0.01), (True, 0.1)])
def test_scanners_that_share_nothing_come_out_as_alone(ties, share):
    "No common control, no common plane, a perfect POS: the same to a share of a sigma"
    site = scanner_site(5, targets=12, between=0, share=False, drift=1e-3)
    if ties:
        both = together(site)
    else:
        both = estimate_mounting(site.trajectory, RECORDED, site.matched)
    for number, part in enumerate(separate(site, ties)):
        of_it = both.lsc.of(number)
        assert (np.abs(of_it.correction - part.lsc.correction) < share * part.lsc.sigma).all()
        assert np.allclose(of_it.sigma, part.lsc.sigma, rtol=0.05)
        between = both.lsc.covariance[:6, 6:] / np.outer(part.lsc.sigma, part.lsc.sigma)
        assert np.abs(between).max() < 0.03  # of a POS error of micrometres that both share
    assert both.fit_sigma(1) is None


def test_a_scanner_that_saw_no_target_and_nothing_twice_is_held_by_the_other(sites):
    "By planes of one pass that both saw: boresight within 3 sigmas, and these below 10 mdeg"
    site = sites[0]
    matched = site.matched[site.matched.scanner == 0]
    ties = site.ties[(site.ties.scanner == 0).any(axis=1)]
    start = estimate_mounting(site.trajectory, RECORDED, matched)
    second = calibration_with_ties(start, matched, ties).of(1, matched.scanner)
    error = second.lsc.correction - LACKS[1]
    assert (np.abs(error) < 3 * second.lsc.sigma).all()
    assert np.degrees(second.lsc.sigma[3:].max()) < 0.01  # deg
    assert len(second.used) == 0 and second.ties.used.any()


def test_planes_that_both_saw_on_one_pass_tell_the_one_beside_the_other_alone(sites):
    "Without control or a second visit to 5 mm and 10 mdeg; both lever arms stay open by 5 cm"
    site = sites[0]
    none = site.matched[[]]
    ties = site.ties[site.ties.scanner[:, 0] != site.ties.scanner[:, 1]]
    start = prior_mounting(site.trajectory, RECORDED, none)
    both = calibration_with_ties(start, none, ties)
    assert not both.determined[[2, 8]].any()
    _, sigma = both.lsc.relative_to_first(1)
    assert (sigma < np.repeat([0.005, np.radians(0.01)], 3)).all()
    assert (both.lsc.sigma.reshape(2, 6)[:, :3] > 0.05).all()  # m


def test_ranges_of_one_scanner_are_told_from_those_of_the_other():
    "The second's are all 30 mm too short: found within 3 sigmas, and nothing of the first's"
    site = scanner_site(3, targets=16, number=30)

    def shortened(place, gps_time, scanner):
        beam = place - scanner_position(site.trajectory, RECORDED[1], gps_time)
        beam /= np.linalg.norm(beam, axis=1, keepdims=True)
        return place - 0.03 * beam * (scanner == 1)[:, None]

    matched = site.matched
    ties = site.ties
    position = shortened(matched.observations.position, matched.gps_time, matched.scanner)
    matched = replace(matched, observations=replace(matched.observations, position=position))
    views = ties.place.reshape(-1, 3), ties.gps_time.ravel(), ties.scanner.ravel()
    place = shortened(*views).reshape(-1, 2, 3)
    misclosure = np.einsum("ni,ni->n", ties.direction, place[:, 1] - place[:, 0])
    off = replace(site, matched=matched, ties=replace(ties, place=place, misclosure=misclosure))
    freed = with_scanner_errors(together(off), matched)
    lacks = freed.scanner
    assert lacks.significant.tolist() == [False, False, True, False]
    assert abs(lacks.correction[2] - 0.03) < 3 * lacks.sigma[2]
    assert lacks.of(0).statements == ()
    assert lacks.of(1).statements[0].values["components"] == ("range offset",)
    error = freed.lsc.correction.reshape(2, 6) - LACKS
    assert (np.abs(error) < 3 * freed.lsc.sigma.reshape(2, 6)).all()
