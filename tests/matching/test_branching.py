import numpy as np
import pytest

from mlscorr.matching import SETTINGS
from mlscorr.matching._hypotheses import log_likelihoods, start
from mlscorr.matching._marginals import best_of_each, merge, use
from tests.matching.test_marginals import small_chain


def test_an_observation_is_each_of_its_pairs_a_moved_one_or_none():
    "Five branches, of which the two moved ones and none agree in their histories but not in use"
    chain = small_chain(np.random.default_rng(1))
    after = use(start(chain), chain, 0)
    assert sorted(after.used[:, 0]) == [-1, 0, 0, 1, 1]
    assert sorted(after.history[:, -1]) == [-1, -1, -1, 0, 1]
    total = np.log(np.exp(log_likelihoods(start(chain), chain, 0)).sum())
    assert np.log(np.exp(after.weight).sum()) == pytest.approx(total)


def test_a_pair_updates_the_state_as_a_dense_normal_does():
    "Mean and covariance of c, s and its rate given one misclosure, per axis"
    chain = small_chain(np.random.default_rng(1))
    after = use(start(chain), chain, 0)
    (row,) = np.flatnonzero(after.history[:, -1] == 0)
    prior = np.eye(3)
    seen = np.array([SETTINGS.constant_sigma, 0.5, 0.0])  # m; c + g s, each over its sigma
    cross = prior @ seen
    spread = seen @ cross + 0.05**2 + 0.01**2  # m^2
    for axis in range(3):
        mean = cross / spread * chain.pairs.misclosure[0, axis]
        assert after.mean[row, axis] == pytest.approx(mean)
        expected = prior - np.outer(cross, cross) / spread
        assert after.covariance[row, axis] == pytest.approx(expected)


def test_the_best_of_each_belief_are_kept_while_they_count():
    "Two of each belief at most, and none that is a ten-millionth of the best"
    belief = np.array([0, 0, 0, 1, 1])
    weight = np.array([-1.0, -3.0, -2.0, 0.0, 2 * SETTINGS.least_log_weight])
    assert sorted(best_of_each(belief, weight, 2, SETTINGS.least_log_weight)) == [0, 2, 3]


def test_the_heaviest_comes_first():
    "In order of weight, whatever the belief"
    weight = np.array([-3.0, 0.0, -1.0])
    assert best_of_each(np.array([0, 1, 0]), weight, 5, -16.0).tolist() == [1, 2, 0]


def test_hypotheses_that_agree_are_merged_with_the_sum_of_their_weights():
    "Rows 0 and 2 agree in all; 1 has another belief, 3 another history, 4 another point in use"
    belief = np.array([0, 1, 0, 0, 0])
    history = np.array([[7, 8], [7, 8], [7, 8], [8, 7], [7, 8]])
    used = np.array([[3], [3], [3], [3], [-1]])
    weight = np.array([0.0, -1.0, -2.0, -3.0, -4.0])
    rows, total = merge(belief, history, used, weight)
    assert sorted(rows) == [0, 1, 3, 4]
    expected = {0: np.logaddexp(0.0, -2.0), 1: -1.0, 3: -3.0, 4: -4.0}
    assert total == pytest.approx([expected[row] for row in rows])
