"""Noise of observations that see some targets more than once."""

import numpy as np

from mlscorr.collocation import Noise


def noise_of(seed, n=8, r=3, groups=4):
    "Noise of n epochs of which some see one target"
    rng = np.random.default_rng(seed)
    root = rng.normal(size=(n, r, r))
    own = 1e-4 * (root @ root.swapaxes(1, 2) + np.eye(r))
    return Noise(own, rng.integers(0, groups, n), rng.uniform(0.0, 0.02, (groups, r)))


def written_out(noise):
    "The covariance element by element: own on the diagonal, the survey wherever a target is one"
    n, r = noise.own.shape[:2]
    total = np.zeros((n, r, n, r))
    for i in range(n):
        total[i, :, i] += noise.own[i]
        for j in range(n):
            if noise.group[i] == noise.group[j]:
                total[i, :, j] += np.diag(noise.shared[noise.group[i]] ** 2)
    return total.reshape(n * r, n * r)
