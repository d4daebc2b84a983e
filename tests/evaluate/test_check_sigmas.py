"""The stated sigmas, tested by check points."""

import numpy as np

from mlscorr.evaluate import CheckSigmas


def test_right_sigmas_are_rejected_as_often_as_the_significance_says():
    "5 % of 2000 sets of 12 check points, within three standard errors"
    rng = np.random.default_rng(1)
    sigma = rng.uniform(0.003, 0.02, (12, 3))
    verdicts = [CheckSigmas.of(rng.normal(0, sigma), sigma, 12).verdict for _ in range(2000)]
    share = np.mean([verdict != "hold" for verdict in verdicts])
    assert abs(share - 0.05) < 3 * np.sqrt(0.05 * 0.95 / 2000)


def test_wrong_sigmas_are_named_by_their_direction_and_factor():
    "Twice too small and twice too large, at 30 check points"
    rng = np.random.default_rng(2)
    sigma = np.full((30, 3), 0.01)
    small, large = (CheckSigmas.of(rng.normal(0, f * sigma), sigma, 30) for f in (2.0, 0.5))
    assert (small.verdict, large.verdict) == ("too small", "too large")
    assert abs(small.factor - 2.0) < 0.3 and abs(large.factor - 0.5) < 0.1
    document = small.document()
    low, high = document["limits"]
    assert low < document["degrees_of_freedom"] == 90 < high < document["statistic"]
