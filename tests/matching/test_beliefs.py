from dataclasses import replace

import numpy as np
import pytest

from mlscorr.collocation import Covariance
from mlscorr.matching._beliefs import build_chain, transition
from mlscorr.matching._pairs import find_pairs
from mlscorr.pos import SETTINGS as POS
from mlscorr.pos import PosErrors
from mlscorr.survey import Pos
from tests.matching.test_association import PLACES, control_points, observations, trajectory


@pytest.fixture
def chain():
    "Ten targets on a straight drive whose POS states 0.2 m of easting"
    drive = trajectory(lambda t: np.full(len(t), 0.2))
    seen = observations(PLACES)
    control = control_points(PLACES)
    pos = Pos()
    pairs = find_pairs(seen, control, 1.0)
    errors = PosErrors.stated(drive, pos)
    return build_chain(seen, control, drive.at(seen.gps_time), errors, pairs)


def test_beliefs_are_all_combinations(chain):
    "Each scale of the stated sigma or slow bias with each unstated error and correlation time"
    scales = POS.sigma_scales
    unstated = POS.unstated_sigmas
    drifts = [0.2 * scale for scale in scales]
    drifts += [np.hypot(0.2, bias) for bias in POS.slow_biases]
    assert len(chain.gain) == len(drifts) * len(unstated) * len(POS.time_shares)
    expected = {round(np.hypot(drift, u), 9) for drift in drifts for u in unstated}
    assert set(chain.gain[:, 0, 0].round(9)) == expected  # m, easting
    biases = (0.0, *POS.slow_biases)
    northing = {round(np.hypot(bias, u), 9) for bias in biases for u in unstated}
    assert set(chain.gain[:, 0, 1].round(9)) == northing  # m: nothing is stated


def test_drift_starts_anew_at_a_step_of_the_path():
    "Across a step of 2 m in 0.1 s the constant goes on, and s tells nothing of what follows"
    drive = trajectory()
    seen = observations(PLACES)
    path = drive.position.copy()
    path[drive.gps_time > 357_750.0, 0] += 2.0
    drive = replace(drive, position=path)
    pos = Pos()
    pairs = find_pairs(seen, control_points(PLACES), 10.0)
    errors = PosErrors.stated(drive, pos)
    pose = drive.at(seen.gps_time)
    chain = build_chain(seen, control_points(PLACES), pose, errors, pairs)
    matrix = transition(chain, 4, 5)
    assert matrix[:, 0, 0] == pytest.approx(1.0)
    assert np.abs(matrix[:, 1:, 1:]).max() == 0.0
    assert np.abs(transition(chain, 3, 4)[:-1, 1, 1]).min() > 0.0
    assert np.abs(transition(chain, 3, 4)[-1, 1:, 1:]).max() == 0.0


def test_the_state_moves_as_its_covariance_function_says(chain):
    "From one target to the next, s correlates by Matern 3/2, noise is a covariance; back as well"
    matrix = transition(chain, 2, 4)
    times = np.sqrt(3.0) / chain.rate
    expected = [Covariance("matern32", time)(np.array([20.0]))[0] for time in times]
    assert matrix[:-1, 1, 1] == pytest.approx(expected)
    noise = np.eye(3) - matrix @ matrix.swapaxes(1, 2)
    assert np.linalg.eigvalsh(noise).min() > -1e-12
    back = transition(chain, 4, 2)
    assert back[:, 1, 1] == pytest.approx(matrix[:, 1, 1])
    assert back[:, 1, 2] == pytest.approx(-matrix[:, 1, 2])


def test_the_constant_part_stays_on_a_straight_drive(chain):
    "Heading unchanged, datum and mounting are the same at both ends"
    matrix = transition(chain, 0, 9)
    assert matrix[:, 0, 0] == pytest.approx(1.0)
