"""Noise that observations have alone, and what passes share."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from mlscorr.collocation import Noise
from tests.beds.shared_noise import noise_of, written_out


@settings(max_examples=40, deadline=None)
@given(seed=st.integers(0, 10_000), n=st.integers(1, 9), groups=st.integers(1, 9))
def test_passes_share_the_survey_error(seed, n, groups):
    "All of the noise is the formula written out, whichever targets are seen once or more"
    noise = noise_of(seed, n, groups=groups)
    np.testing.assert_allclose(noise.matrix, written_out(noise), atol=1e-18)


@settings(max_examples=40, deadline=None)
@given(seed=st.integers(0, 10_000), size=st.integers(0, 12))
def test_a_block_is_one_of_the_matrix(seed, size):
    "Any rows in any order, with their own and shared part"
    noise = noise_of(seed)
    rows = np.random.default_rng(seed).permutation(24)[:size]
    np.testing.assert_allclose(noise.block(rows), noise.matrix[np.ix_(rows, rows)], atol=1e-18)


def test_separate_and_common_parts_are_all_of_it():
    "The noise of each epoch and the shared U U^T sum to the whole covariance"
    noise = noise_of(3)
    separate = np.zeros((8, 3, 8, 3))
    separate[np.arange(8), :, np.arange(8)] = noise.separate
    total = separate.reshape(24, 24) + noise.common @ noise.common.T
    np.testing.assert_allclose(total, written_out(noise), atol=1e-18)


def test_a_target_seen_once_costs_no_column():
    "Three columns for each target of several passes, none for one that is known perfectly"
    own = np.tile(np.eye(3), (5, 1, 1))
    group = np.array([0, 1, 1, 2, 2])
    shared = np.array([[0.01] * 3, [0.02] * 3, [0.0] * 3])
    noise = Noise(own, group, shared)
    assert noise.common.shape == (15, 3)
    np.testing.assert_allclose(noise.separate[0], np.eye(3) * (1.0 + 0.01**2))
    np.testing.assert_allclose(noise.separate[1:], own[1:])
    assert Noise(own).common.shape == (15, 0)


def test_noise_of_some_epochs_is_that_part_of_all():
    "Chosen by number or by mask, a target that is left with one pass shares nothing more"
    noise = noise_of(5)
    kept = np.array([True, False] * 4)
    rows = np.flatnonzero(np.repeat(kept, 3))
    for choice in (kept, np.flatnonzero(kept)):
        part = noise.select(choice)
        np.testing.assert_allclose(part.matrix, noise.matrix[np.ix_(rows, rows)], atol=1e-18)
    alone = Noise(noise.own).select(kept)
    np.testing.assert_array_equal(alone.own, noise.own[kept])
