"""The parameters of the signals, and how well the control points know them."""

from dataclasses import dataclass, fields

import numpy as np
from scipy.linalg import cholesky
from scipy.optimize import minimize
from scipy.stats import norm, qmc

from mlscorr.correction.model import Model, Parameters
from mlscorr.covariance import FAMILIES

START_RATIO = 4.0  # correlation time over control interval: 3 to 5 in the paper, section 3.1.4
# One sigma of each logarithm about its start, fixed by benchmarks/lsc_study.py. Stated sigmas are
# right within a factor of three, the paper's rule within two; a bias is what is not stated.
SPREAD = {
    "drift_scale": np.log(3.0),
    "drift_time": np.log(2.0),
    "jitter_scale": np.log(3.0),
    "jitter_time": np.log(3.0),
    "bias_scale": np.log(10.0),
    "bias_time": np.log(3.0),
    "attitude_scale": np.log(2.0),
}
UNSPLIT = ("drift_scale", "drift_time", "attitude_scale")  # where all of sigma(t) is drift
NAMES = tuple(field.name for field in fields(Parameters))[1:]
BLOCK = 100  # observations; 25 correlation times at the start, so blocks tell little of each other
STEP = 0.01  # of a logarithm, for gradients
WIDE_STEP = 0.2  # for curvatures, which should tell of a sigma's width and not of a point
FARTHEST = 4.0  # spreads from the start; there a likelihood is flat, or the POS is not what it says
POINTS = 32  # parameters over which a prediction is averaged: 64 give the same sigmas to 2 %
NEGLIGIBLE = 0.02  # probability of a family that isn't worth points
HEAVIEST = 5.0  # times the mean weight, so that one point in the tail can't stand for all


@dataclass(frozen=True)
class Posterior:
    """What control points say of parameters.

    ``modes``: most probable Parameters of each family and the family's probability, the most
    probable first; ``points``: Parameters and weights that stand for the whole distribution.
    """

    modes: tuple[tuple[Parameters, float], ...]
    points: tuple[tuple[Parameters, float], ...]


@dataclass(frozen=True)
class Objective:
    """Restricted likelihood times prior, as a function of the free parameters' logarithms.

    Large surveys are cut into blocks of time whose likelihoods are multiplied: the work then
    grows with their length, not with its cube.
    """

    blocks: tuple[tuple[Model, int], ...]
    start: np.ndarray  # logarithms of all NAMES
    free: np.ndarray  # numbers of those that are chosen
    spread: np.ndarray  # of the free ones

    @classmethod
    def of(cls, model, order):
        """Starts: the stated sigmas, the paper's rule for the time of drift and bias, or what is
        believed where the trajectory has no sigmas; jitter is correlated over one interval."""
        interval = model.interval
        time = START_RATIO * interval
        if model.trajectory.position_sigma is None:
            time = model.pos.correlation_time
        start = {"drift_time": time, "jitter_time": interval, "bias_time": time}
        split = bool(np.any(model.sigmas.jitter))
        free = NAMES if split else UNSPLIT
        spread = SPREAD if split else SPREAD | {"drift_scale": SPREAD["bias_scale"]}
        return cls(
            _blocks(model, order),
            np.log([start.get(name, 1.0) for name in NAMES]),
            np.array([NAMES.index(name) for name in free]),
            np.array([spread[name] for name in free]),
        )

    @property
    def initial(self):
        return self.start[self.free]

    def parameters(self, family, logarithms):
        full = self.start.copy()
        full[self.free] = logarithms
        return Parameters(family, *np.exp(full).tolist())

    def logarithms(self, parameters):
        return np.log([getattr(parameters, name) for name in NAMES])[self.free]

    def __call__(self, family, logarithms):
        chosen = self.parameters(family, logarithms)
        prior = -0.5 * np.sum(((logarithms - self.initial) / self.spread) ** 2)
        return prior + sum(block.solve(chosen, low).log_likelihood for block, low in self.blocks)

    def gradient(self, family, logarithms, value):
        steps = logarithms + STEP * np.eye(len(logarithms))
        return np.array([self(family, step) - value for step in steps]) / STEP

    def maximum(self, family, start):
        """The most probable logarithms of a family, and the log posterior there."""

        def negative(x):
            value = self(family, x)
            return -value, -self.gradient(family, x, value)

        reach = FARTHEST * self.spread
        best = minimize(
            negative,
            np.clip(start, self.initial - reach, self.initial + reach),
            jac=True,
            method="L-BFGS-B",
            bounds=list(zip(self.initial - reach, self.initial + reach, strict=True)),
            options={"maxiter": 40, "ftol": 1e-4, "gtol": 0.05},
        )
        return best.x, -float(best.fun)

    def covariance(self, family, mode, value):
        """Covariance of the logarithms about a mode (Laplace), never wider than the prior."""
        step = WIDE_STEP * np.eye(len(mode))
        once = np.array([[self(family, mode + sign * s) for s in step] for sign in (1, -1)])
        curvature = np.diag(2 * value - once.sum(axis=0)) / WIDE_STEP**2
        for i in range(len(mode)):
            for j in range(i):
                both = self(family, mode + step[i] + step[j]) + value - once[0, i] - once[0, j]
                curvature[i, j] = curvature[j, i] = -both / WIDE_STEP**2
        scale = np.outer(self.spread, self.spread)
        values, vectors = np.linalg.eigh(curvature * scale)
        return scale * ((vectors / np.maximum(values, 1.0)) @ vectors.T)


def most_probable(model, order, start=()):
    """Most probable Parameters of each family and its log posterior, the best first.

    start may hold Parameters of each family near which the maxima are expected.
    """
    objective = Objective.of(model, order)
    near = {chosen.family: objective.logarithms(chosen) for chosen in start}
    found, at = [], objective.initial
    for family in FAMILIES:
        at, value = objective.maximum(family, near.get(family, at))
        found.append((objective.parameters(family, at), value))
    return sorted(found, key=lambda row: -row[1])


def choose_parameters(model, order, start=(), points=POINTS):
    """Posterior of the parameters: restricted likelihood, weakly held to what is stated.

    A family's probability is its share of the posterior at the maximum. Points drawn from the
    log-normal about a mode (Laplace) in antithetic pairs, always the same, are weighted by the
    true posterior over it.
    """
    objective = Objective.of(model, order)
    modes, spreads = [], []
    for parameters, value in most_probable(model, order, start):
        mode = objective.logarithms(parameters)
        covariance = objective.covariance(parameters.family, mode, value)
        modes.append(parameters)
        spreads.append((mode, covariance, value))
    share = np.exp([value - spreads[0][2] for _, _, value in spreads])
    share /= share.sum()
    by_share = tuple(zip(modes, share.tolist(), strict=True))
    if len(model.gps_time) > BLOCK:  # so many know the parameters well
        return Posterior(by_share, by_share)
    drawn = []
    for parameters, spread, probability in zip(modes, spreads, share.tolist(), strict=True):
        if probability > NEGLIGIBLE:
            pairs = int(np.ceil(points * probability / 2))
            drawn += _points(objective, parameters.family, *spread, probability, pairs)
    total = sum(weight for _, weight in drawn)
    return Posterior(by_share, tuple((chosen, weight / total) for chosen, weight in drawn))


def _points(objective, family, mode, covariance, value, probability, pairs):
    """Parameters and weights, which sum to the family's probability."""
    half = norm.ppf(qmc.Halton(len(mode), seed=0).random(pairs))
    normal = np.vstack([half, -half])
    drawn = mode + normal @ cholesky(covariance, lower=True).T
    ratio = np.array([objective(family, x) for x in drawn]) - value + 0.5 * (normal**2).sum(axis=1)
    weights = np.exp(ratio - ratio.max())
    weights = np.minimum(weights, HEAVIEST * weights.mean())
    weights *= probability / weights.sum()
    chosen = (objective.parameters(family, x) for x in drawn)
    return list(zip(chosen, weights.tolist(), strict=True))


def _blocks(model, order):
    """The model in blocks of time, each with the order that its epochs can carry."""
    number = -(-len(model.gps_time) // BLOCK)
    parts = np.array_split(np.argsort(model.gps_time, kind="stable"), number)
    return tuple((block, min(order, block.epochs - 1)) for block in map(model.select, parts))
