"""A random survey of targets that see one epoch each."""

import numpy as np

from mlscorr.collocation import FAMILIES, Covariance, Noise, Signal, SparseRows, collocate

START = 413_200.0  # s of week
SPAN = 200.0  # s


class RandomSurvey:
    "Targets at random times in any order, three signals of 3, 2 and 3 processes, shared noise"

    def __init__(self, seed, families=None, n=14, p=3, asked=30, groups=6):
        rng = np.random.default_rng(seed)
        if families is None:
            families = rng.choice(FAMILIES, 3)
        times = 10 ** rng.uniform(0, 3, 3)
        self.covariances = [Covariance(f, t) for f, t in zip(families, times, strict=True)]
        self.gps_time = START + rng.uniform(0, SPAN, n)
        self.gps_time[3:5] = self.gps_time[2]  # three targets at one time,
        self.gps_time[6] = self.gps_time[5] + 1e-3  # and two a millisecond apart
        self.mixing = [rng.normal(size=(n, 3, k)) for k in (3, 2, 3)]
        root = 0.1 * rng.normal(size=(n, 3, 3))
        own = root @ root.swapaxes(1, 2) + 1e-4 * np.eye(3)
        shared = rng.uniform(0.0, 0.1, (groups, 3))
        self.noise = Noise(own, rng.integers(0, groups, n), shared)
        self.design = rng.normal(size=(n, 3, p))
        self.misclosure = rng.normal(size=(n, 3))
        self.asked = START + rng.uniform(-100, SPAN + 100, asked)
        self.asked[:3] = self.gps_time[0], self.gps_time.max() + 1e6, START - 1e6
        self.asked_design = rng.normal(size=(asked, 6, p))
        self.asked_mixing = [rng.normal(size=(asked, 6, k)) for k in (3, 2, 3)]
        self.rng = rng

    @property
    def signals(self):
        return [Signal(m, c) for m, c in zip(self.mixing, self.covariances, strict=True)]

    @property
    def rows(self):
        given = self.misclosure, self.noise, self.design, self.signals
        return SparseRows(self.gps_time[:, None], *given)

    def solve(self):
        return collocate(self.gps_time, self.misclosure, self.noise, self.design, self.signals)

    def predict(self, solved):
        return solved.predict(self.asked, self.asked_design, self.asked_mixing)
