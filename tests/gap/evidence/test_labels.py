"""Replicas of a survey in which nothing acts."""

import numpy as np
import pytest

from mlscorr.gap.evidence.labels import p_value


def test_the_p_value_is_the_share_of_replicas_that_go_as_far():
    "And beyond the last of them it goes on falling"
    rng = np.random.default_rng(0)
    replicas = rng.exponential(size=100)
    told = [
        p_value({"none": np.zeros(101), "range_bias": np.append(score, replicas)})
        for score in (np.median(replicas), 10.0)
    ]
    assert told[0] == pytest.approx(0.5, abs=0.02)
    assert 1e-6 < told[1] < 1e-3
