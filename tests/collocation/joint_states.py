"""Processes of several signals with the joint covariance of all their states written out."""

from functools import cached_property

import numpy as np
from scipy.linalg import block_diag, expm, solve_continuous_lyapunov

from mlscorr.collocation import FAMILIES, INTEGRATED, Covariance, Signal
from mlscorr.collocation._states import Layout

START = 413_200.0  # s of week
ALL_FAMILIES = (*FAMILIES, INTEGRATED)
GENERATORS = {  # d states / d (rate t)
    "exponential": np.array([[-1.0]]),
    "matern32": np.array([[0.0, 1.0], [-1.0, -2.0]]),
    "matern52": np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [-1.0, -3.0, -3.0]]),
    INTEGRATED: np.array([[-1.5, np.sqrt(3.0)], [0.0, -0.5]]),
}


def stationary(family):
    "Covariance of a process's states: what white noise on the last one makes, of unit variance"
    generator = GENERATORS[family]
    driven = np.zeros_like(generator)
    driven[-1, -1] = 1.0
    covariance = solve_continuous_lyapunov(generator, -driven)
    return covariance / covariance[0, 0]


def carried(family, x):
    "F over a lag in units of 1 / rate"
    return expm(GENERATORS[family] * x)


class Bed:
    "Signals of 2, 1 and 2 processes at n epochs with r observations each, and all matrices dense"

    def __init__(self, seed, families=None, n=7, r=2):
        rng = np.random.default_rng(seed)
        if families is None:
            names = rng.choice(ALL_FAMILIES, 3)
        else:
            names = families
        self.families = [str(name) for name in names]
        self.covariances = [
            Covariance(name, time)
            for name, time in zip(self.families, (20.0, 5.0, 60.0), strict=True)
        ]
        self.gps_time = START + np.sort(rng.uniform(0.0, 60.0, n))
        self.gps_time[2] = self.gps_time[1]  # two targets at one time
        self.signals = [
            Signal(rng.normal(size=(n, r, k)), covariance)
            for covariance, k in zip(self.covariances, (2, 1, 2), strict=True)
        ]
        self.mixing = np.concatenate([signal.mixing for signal in self.signals], axis=2)
        root = rng.normal(size=(n, r, r))
        self.noise = 0.01 * root @ root.swapaxes(1, 2) + 0.01 * np.eye(r)
        self.layout = Layout.of(self.signals)
        self.columns = rng.normal(size=(n, r, 3))
        self.steps = np.repeat(
            np.diff(self.gps_time, prepend=self.gps_time[:1])[:, None], 3, axis=1
        )
        self.processes = np.repeat(self.families, [2, 1, 2])

    def transition(self, lag):
        "F of all states over a lag (s)"
        parts = zip(self.families, self.covariances, (2, 1, 2), strict=True)
        blocks = [[carried(name, c.rate * lag)] * k for name, c, k in parts]
        return block_diag(*(block for same in blocks for block in same))

    @cached_property
    def prior(self):
        "Covariance (d, d) of all states at one time"
        return block_diag(*map(stationary, self.processes))

    @property
    def first(self):
        "First state of each process"
        sizes = [len(GENERATORS[name]) for name in self.processes]
        return np.cumsum([0, *sizes[:-1]])

    def joint(self, times):
        "Covariance (q d, q d) of the states at several times"
        q = len(times)
        d = len(self.prior)
        total = np.zeros((q, d, q, d))
        for i, late in enumerate(times):
            for j, early in enumerate(times):
                if late >= early:
                    total[i, :, j] = self.transition(late - early) @ self.prior
                    total[j, :, i] = total[i, :, j].T
        return total.reshape(q * d, q * d)

    @property
    def observing(self):
        "H (n r, n d) of all epochs"
        n, r, _ = self.mixing.shape
        rows = np.zeros((n, r, len(self.prior)))
        rows[:, :, self.first] = self.mixing
        return block_diag(*rows)

    @cached_property
    def total(self):
        "V (n r, n r)"
        h = self.observing
        return h @ self.joint(self.gps_time) @ h.T + block_diag(*self.noise)
