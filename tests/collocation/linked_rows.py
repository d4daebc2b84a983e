"""A street driven twice: control in both passes, ties between them, and V of all rows."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from mlscorr.collocation import INTEGRATED, Covariance, Noise, Signal, SparseRows

START = 413_200.0  # s of week
LENGTH = 300.0  # s of both passes
RESTART = START + 150.0  # where an integrated drift begins anew
AXES = np.eye(3)


def turned(rows, lever):
    "Partials of rows (n, r, 3) by position and rotation at points with a lever arm (n, 3)"
    return np.concatenate([rows, np.cross(lever[:, None], rows)], axis=2)


@dataclass
class Street:
    "Parameters of the signals, and the seed and number of rows"

    family: str
    time: float  # s
    seed: int = 1
    targets: int = 6
    ties: int = 60

    def __post_init__(self):
        rng = np.random.default_rng(self.seed)
        n = 2 * self.targets
        t = self.ties
        there = rng.uniform(0.0, LENGTH / 2, self.targets)
        back = LENGTH - there + rng.uniform(-1.0, 1.0, self.targets)
        self.control_time = START + np.append(there, back)[:, None]
        self.control_time[1] = self.control_time[0] + 1e-3  # two a millisecond apart
        self.control_seen = turned(np.tile(AXES, (n, 1, 1)), rng.uniform(-15, 15, (n, 3)))
        root = 0.003 * rng.normal(size=(n, 3, 3))
        own = root @ root.swapaxes(1, 2) + 2e-6 * AXES
        group = np.tile(np.arange(self.targets), 2)
        self.noise = Noise(own, group, rng.uniform(0.002, 0.006, (self.targets, 3)))
        first = rng.uniform(0.0, LENGTH / 2, t)
        second = LENGTH - first + rng.uniform(-1.0, 1.0, t)
        self.tie_time = START + np.column_stack([first, np.clip(second, LENGTH / 2, LENGTH)])
        normal = rng.normal(size=(t, 1, 3))
        normal /= np.linalg.norm(normal, axis=2, keepdims=True)
        seen = [sign * turned(normal, rng.uniform(-15, 15, (t, 3))) for sign in (1, -1)]
        self.tie_seen = np.stack(seen, axis=1).reshape(2 * t, 1, 6)
        self.tie_noise = Noise(rng.uniform(0.005, 0.01, (t, 1, 1)) ** 2)
        self.asked = np.append(START + rng.uniform(-20, LENGTH + 20, 25), self.tie_time[:2])
        self.draw_misclosures(rng)

    def draw_misclosures(self, rng=None):
        "Misclosures of the covariance of all rows; anew, once times are other ones"
        for known in ("total", "_views"):
            self.__dict__.pop(known, None)
        root = np.linalg.cholesky(self.total)
        self.misclosure = root @ (rng or np.random.default_rng(1)).normal(size=len(root))

    def signals(self, gps_time, seen):
        "Drift, jitter and attitude, as they enter rows (n, r, 6)"
        drift = Signal(seen[:, :, :3], Covariance(self.family, self.time))
        family = self.family
        if self.family == INTEGRATED:
            number = (gps_time >= RESTART).astype(int)
            since = np.maximum(gps_time - np.array([START - 30.0, RESTART])[number], 0.05)
            mixing = seen[:, :, :3] * ((since / 60.0) ** 1.5)[:, None, None]
            family = "matern32"
            drift = Signal(mixing, Covariance(INTEGRATED, 1.0), np.log(since) + 2000.0 * number)
        jitter = Signal(0.02 * seen[:, :, :3], Covariance("exponential", self.time / 8))
        return [drift, jitter, Signal(1e-3 * seen[:, :, 3:], Covariance(family, self.time / 2))]

    @property
    def rows(self):
        "Control and ties, of which control has a datum difference as trend"
        n = 2 * self.targets
        t = self.ties
        control = SparseRows(
            self.control_time,
            self.misclosure[: 3 * n].reshape(n, 3),
            self.noise,
            np.tile(AXES, (n, 1, 1)),
            self.signals(self.control_time.ravel(), self.control_seen),
        )
        ties = SparseRows(
            self.tie_time,
            self.misclosure[3 * n :].reshape(t, 1),
            self.tie_noise,
            np.zeros((t, 1, 3)),
            self.signals(self.tie_time.ravel(), self.tie_seen),
        )
        return [control, ties]

    @property
    def design(self):
        "A of all rows"
        return np.vstack([np.tile(AXES, (2 * self.targets, 1)), np.zeros((self.ties, 3))])

    @cached_property
    def _views(self):
        "Times and signals of all views of epochs, and the row of each"
        n = 2 * self.targets
        t = self.ties
        seen = np.concatenate([self.control_seen.reshape(-1, 1, 6), self.tie_seen])
        times = np.concatenate([np.repeat(self.control_time.ravel(), 3), self.tie_time.ravel()])
        row = np.append(np.arange(3 * n), 3 * n + np.repeat(np.arange(t), 2))
        return times, self.signals(times, seen), row

    @cached_property
    def total(self):
        "V of all rows"
        times, signals, row = self._views
        sums = np.eye(row[-1] + 1)[row].T
        views = sum(_across(s, times, s, times) for s in signals)
        total = sums @ views @ sums.T
        c = 6 * self.targets
        total[:c, :c] += self.noise.matrix
        total[c:, c:] += np.diag(self.tie_noise.own.ravel())
        return total

    def predicted(self):
        "Mean (q, 6), sigma (q, 6), weights and restricted log-likelihood by the dense formula"
        times, signals, row = self._views
        sums = np.eye(row[-1] + 1)[row].T
        here = self.asked_signals
        pairs = zip(here, signals, strict=True)
        cross = sum(_across(a, self.asked, b, times) for a, b in pairs) @ sums.T
        prior = sum(np.einsum("qij,qij->qi", s.mixing, s.mixing) for s in here).ravel()
        inverse = np.linalg.inv(self.total)
        design = self.design
        normal = design.T @ inverse @ design
        trend = np.linalg.solve(normal, design.T @ inverse @ self.misclosure)
        weights = inverse @ (self.misclosure - design @ trend)
        asked = np.tile(np.eye(6, 3), (len(self.asked), 1))
        left = asked - cross @ inverse @ design
        variance = prior - np.einsum("ij,jk,ik->i", cross, inverse, cross)
        variance += np.einsum("ij,jk,ik->i", left, np.linalg.inv(normal), left)
        mean = asked @ trend + cross @ weights
        terms = np.linalg.slogdet(self.total)[1], np.linalg.slogdet(normal)[1]
        redundancy = len(weights) - 3
        square = (self.misclosure - design @ trend) @ weights
        likelihood = -0.5 * (square + sum(terms) + redundancy * np.log(2 * np.pi))
        return mean.reshape(-1, 6), np.sqrt(variance).reshape(-1, 6), weights, likelihood

    @property
    def asked_signals(self):
        "Signals of the pose at the epochs that are asked"
        return self.signals(self.asked, np.tile(np.eye(6), (len(self.asked), 1, 1)))

    @property
    def asked_rows(self):
        "Times, design, mixings and clocks of the pose at the epochs that are asked"
        signals = self.asked_signals
        design = np.tile(np.eye(6, 3), (len(self.asked), 1, 1))
        return self.asked, design, [s.mixing for s in signals], [s.clock for s in signals]

    def predict(self, solved):
        "Mean (q, 6) and sigma (q, 6) by a solved collocation"
        mean, covariance = solved.predict(*self.asked_rows)
        return mean, np.sqrt(np.einsum("qii->qi", covariance))


def _across(left, times, right, others):
    "Covariance of what two sets of epochs see of a signal, all rows of each"
    a, b = (s.mixing.reshape(-1, s.mixing.shape[2]) for s in (left, right))
    clocks = [
        np.repeat(time if s.clock is None else s.clock, s.mixing.shape[1])
        for s, time in ((left, times), (right, others))
    ]
    return (a @ b.T) * left.covariance(clocks[0][:, None] - clocks[1])
