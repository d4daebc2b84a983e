import itertools

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from mlscorr.matching import SETTINGS
from mlscorr.matching._hypotheses import (
    displacement,
    log_likelihoods,
    predict,
    select,
    start,
)
from mlscorr.matching._marginals import use
from tests.matching.test_marginals import small_chain


@pytest.fixture
def chain():
    "Four observations with two pairs each, one belief"
    return small_chain(np.random.default_rng(1))


def test_the_weights_before_the_first_observation_do_not_know_the_direction(chain):
    "A walk forwards and one backwards both start with one hypothesis of each belief"
    for order in (range(4), range(3, -1, -1)):
        now = start(chain)
        assert len(now.weight) == len(chain.rate)
        for last, row in itertools.pairwise(order):
            now = predict(use(now, chain, last), chain, last, row)
        assert len(now.weight) > len(chain.rate)


def test_drift_goes_on_or_starts_anew(chain):
    "Nine seconds on, both cases hold all the weight, and the new drift has its prior's variance"
    now = predict(start(chain), chain, 0, 2)
    assert len(now.weight) == 2
    stays = np.exp(-9.0 / SETTINGS.restart_time)
    assert np.exp(now.weight) == pytest.approx([stays, 1.0 - stays])
    assert now.covariance[1] == pytest.approx(np.tile(np.eye(3), (3, 1, 1)))


def test_what_was_used_is_forgotten_after_two_seconds(chain):
    "The window holds the observation of a second ago, and not that of five seconds ago"
    near = predict(use(start(chain), chain, 3), chain, 3, 2)
    assert near.window.tolist() == [3]
    assert set(near.used[:, 0]) == {-1, 4, 5}
    assert len(predict(near, chain, 2, 1).window) == 0


def test_selected_hypotheses_keep_all_that_belongs_to_them(chain):
    "Two of them, in the order asked for"
    now = predict(use(start(chain), chain, 0), chain, 0, 1)
    both = select(now, np.array([2, 0]), len(now.window), len(now.window))
    assert both.weight.tolist() == now.weight[[2, 0]].tolist()
    assert np.array_equal(both.covariance, now.covariance[[2, 0]])


def test_displacement_is_the_constant_and_the_drift():
    "c + g s, with the variance of that sum and the noise's"
    chain = small_chain(np.random.default_rng(1))
    now = start(chain)
    now.mean[:] = [0.2, 0.5, 0.0]
    now.covariance[:] = [[0.04, 0.1, 0.0], [0.1, 1.0, 0.0], [0.0, 0.0, 0.1]]
    value, variance = displacement(now, chain, 1)
    # m
    sigma = SETTINGS.constant_sigma
    gain = 0.4
    assert value == pytest.approx(np.full((1, 3), 0.2 * sigma + 0.5 * gain))
    spread = 0.04 * sigma**2 + 0.2 * sigma * gain + gain**2 + 0.05**2  # m^2
    assert variance == pytest.approx(np.full((1, 3), spread))


def test_densities_are_normal_ones_times_their_shares():
    "A pair that agrees in appearance, one that doesn't, both moved, and none of them"
    chain = small_chain(np.random.default_rng(1))
    density = log_likelihoods(start(chain), chain, 1)[0]
    sigma2 = SETTINGS.constant_sigma**2 + 0.4**2 + 0.05**2 + 0.01**2  # m^2
    near, other = multivariate_normal.logpdf(chain.pairs.misclosure[2:4], cov=sigma2 * np.eye(3))
    moved = (sigma2 + SETTINGS.moved_sigma**2) * np.eye(3)
    far = multivariate_normal.logpdf(chain.pairs.misclosure[2], cov=moved)
    sound = (1.0 - SETTINGS.moved_share) * (1.0 - SETTINGS.exchanged_share)
    assert density[0] == pytest.approx(near + np.log(sound))
    assert density[1] == pytest.approx(other + np.log(SETTINGS.exchanged_share))
    assert density[2] == pytest.approx(far + np.log(SETTINGS.moved_share))
    assert density[3:] == pytest.approx([-np.inf, np.log(1e-3)])


def test_a_point_in_use_is_no_pair_of_the_next_observation():
    "A second later the hypothesis that used point 4 can't use it again"
    chain = small_chain(np.random.default_rng(1))
    now = predict(use(start(chain), chain, 2), chain, 2, 3)
    used = now.used[:, 0] == 4
    density = log_likelihoods(now, chain, 3)
    assert used.any() and not used.all()
    assert np.isneginf(density[:, 0]).tolist() == used.tolist()
    assert np.isfinite(density[:, 1]).all()
