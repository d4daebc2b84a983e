"""Ties of a survey of which only the POS's sigma is known."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mlscorr.surfaces import SETTINGS as SURFACES
from mlscorr.survey import Mounting, Pos
from mlscorr.ties import SETTINGS, feature_sigma, least_pause, residuals, search_ties
from tests.beds import tie_streets as street


@pytest.mark.parametrize("shift", [(0.0, 0.0, 0.0), (0.9, -0.8, 0.6)])
def test_passes_of_a_poor_pos_are_tied(shift):
    "Passes 1.3 m apart whose POS states 0.5 m are tied within 2 cm, cars and all"
    wrong, truth = street.misplaced(street.features(), shift)
    survey = replace(street.survey(), pos=Pos(position_sigma=0.5))
    search = search_ties(survey, wrong)
    assert len(search.ties) > 250
    assert np.mean(np.abs(residuals(search.ties, truth)) < 0.02) > 0.97
    assert len(search.refused) < 0.1 * len(search.ties)


def test_the_survey_limits_the_search():
    "A POS that states 50 m is searched to the survey's radius alone"
    survey = replace(street.survey(), pos=Pos(position_sigma=50.0), search_radius=2.0)
    assert search_ties(survey, street.features()).radius == 2.0


def test_sigma_grows_with_the_distance():
    "A heading that may be off by 10 deg moves what is 8 m away by 1.4 m, one sigma"
    survey = replace(street.survey(), pos=Pos(0.001, np.radians([0.0, 0.0, 10.0])))
    features = street.features()
    apart = features.centre - survey.trajectory.at(features.gps_time).position
    distance = np.linalg.norm(apart, axis=1)
    sigma = feature_sigma(survey, features)
    assert np.allclose(sigma[distance > 8], distance[distance > 8] * np.radians(10.0), rtol=0.01)
    assert sigma.min() > 0.4  # the mounting may be off


def test_a_scanner_that_spins_is_tied_to_itself():
    "Each wall seen again 1.5 s later: ties of one visit; not where it does so for a moment alone"
    survey = street.survey(1)
    once = street.features(1, 1)
    once = once[once.gps_time < survey.trajectory.gps_time[-1] - 1.6]
    assert least_pause(survey, once) == SETTINGS.pause
    later = replace(once, gps_time=once.gps_time + 1.5)
    twice = type(once).concatenate([once, later])
    assert least_pause(survey, twice) == SURFACES.moment
    session = np.zeros(len(survey.trajectory), int)
    joined = replace(survey, trajectory=replace(survey.trajectory, session=session))
    assert least_pause(joined, twice) == SETTINGS.pause  # of vehicles that may differ
    same = replace(joined, mounting=Mounting(np.zeros(3), Rotation.identity()))
    assert least_pause(same, twice) == SURFACES.moment
    ties = search_ties(survey, twice).ties
    assert len(ties) > 100
    assert ties.is_of_visit.all()


def slowed(times):
    "A survey of one pass that takes so many times as long, and what it saw once"
    survey = street.survey(1)
    once = street.features(1, 1)
    drive, seen = (
        replace(part, gps_time=street.START + times * (part.gps_time - street.START))
        for part in (survey.trajectory, once)
    )
    return replace(survey, trajectory=drive), seen


@pytest.mark.parametrize(("times", "seconds"), [(6.0, 1.0), (20.0, 70.0)])
def test_a_profile_scanner_is_not_tied_to_itself(times, seconds):
    "Walls seen again 1.5 s later, in one of 24 seconds or on foot: visits make its ties, as ever"
    survey, seen = slowed(times)
    again = replace(seen, gps_time=seen.gps_time + 1.5)
    again = again[seen.gps_time - street.START < seconds]
    assert len(again) > 10
    assert least_pause(survey, type(seen).concatenate([seen, again])) == SETTINGS.pause
