"""Parameters of the signals: their prior, and their posterior from observations.

The prior is log-normal about the stated values. With the restricted likelihood it gives a
posterior, whose mode and spread (Laplace, importance sampling) represent the parameters in all
predictions.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace

import numpy as np
from scipy.linalg import cholesky
from scipy.optimize import minimize
from scipy.special import ndtri

from mlscorr.collocation import FAMILIES, INTEGRATED
from mlscorr.estimate.adjustment import NO_TREND, Adjustment
from mlscorr.estimate.factors import REACQUISITION, TARGET
from mlscorr.estimate.settings import SETTINGS
from mlscorr.pos import SignalParameters

SCALES = ("drift_scale", "walk_scale", "jitter_scale", "bias_scale")
# One sigma of the logarithms about their start
SPREAD = {
    name: float(np.log(factor))
    for factor, names in (
        (SETTINGS.precise_factor, ("drift_time", "attitude_scale")),
        (SETTINGS.time_factor, ("jitter_time", "bias_time", "attitude_time", "trend_sigma")),
        (SETTINGS.scale_factor, (*SCALES, "level_scale")),
    )
    for name in names
}
SPLIT = ("jitter_scale", "jitter_time", "bias_scale", "bias_time")  # if sigma(t) has two parts
NAMES = tuple(field.name for field in fields(SignalParameters) if field.name != "family")
IMPROBABLE = -1e12  # log posterior below any real one, yet finite for differences


@dataclass(frozen=True)
class Prior:
    """Log-normal prior of the parameters about start values.

    Parameters
    ----------
    start : (len(NAMES),) array
        Logarithms.
    free : (k,) int array
        Indices of estimated parameters.
    spread : (k,) array
        One sigma of their logarithms.
    attitude_follows : bool
        True if the attitude's correlation time is that of the drift.
    """

    start: np.ndarray
    free: np.ndarray
    spread: np.ndarray
    attitude_follows: bool


def position_prior(adjustment: Adjustment) -> Prior:
    """Prior of a correction.

    The time of drift and bias follows the paper's rule, or the assumptions if the trajectory has no
    sigmas; the attitude's time is that of the drift.

    Parameters
    ----------
    adjustment : Adjustment
    """
    time = SETTINGS.start_ratio * adjustment.interval
    if adjustment.trajectory.position_sigma is None:
        time = adjustment.errors.pos.correlation_time
    return _prior(adjustment, time, attitude_follows=True)


def drifting_prior(adjustment: Adjustment) -> Prior:
    """Prior of a correction if the POS drifts between control points without stating it.

    Differences between control points are then drift of any size, and not noise of GNSS.

    Parameters
    ----------
    adjustment : Adjustment
    """
    prior = position_prior(adjustment)
    is_drift = ~np.isin(prior.free, [NAMES.index("jitter_scale"), NAMES.index("jitter_time")])
    return replace(prior, free=prior.free[is_drift], spread=prior.spread[is_drift])


def mounting_prior(adjustment: Adjustment) -> Prior:
    """Prior of a calibration.

    A site's targets are so close that their interval is not informative about the POS, so the time
    is the assumed correlation time; the attitude's is that of gyro biases.

    Parameters
    ----------
    adjustment : Adjustment
    """
    return _prior(adjustment, adjustment.errors.pos.correlation_time, attitude_follows=False)


def _prior(adjustment, time, attitude_follows):
    start = {
        "drift_time": time,
        "jitter_time": adjustment.interval,
        "bias_time": time,
        "attitude_time": SETTINGS.attitude_time,
        "walk_scale": SETTINGS.walk_scale,
        "trend_sigma": SETTINGS.trend_sigma,
    }
    if adjustment.errors.history.is_stated:  # otherwise jitter may represent drift, too
        start["jitter_time"] = min(adjustment.interval, SETTINGS.jitter_time)
    is_constrained = len(adjustment.names) > 0
    if not is_constrained:  # the error common to all passes is undetermined, but stated so
        start["trend_sigma"] = float(np.sqrt(np.mean(adjustment.errors.epochs.gnss**2)))
    is_split = bool(np.any(adjustment.errors.epochs.gnss))
    fixed: list[str] = []
    if not is_split:
        fixed += SPLIT
    if attitude_follows:
        fixed.append("attitude_time")
    if len(adjustment.errors.history.turns) == 0:
        fixed.append("level_scale")
    if adjustment.order == NO_TREND or not is_constrained:
        fixed.append("trend_sigma")
    free = [name for name in NAMES if name not in fixed]
    return Prior(
        np.log([start.get(name, 1.0) for name in NAMES]),
        np.array([NAMES.index(name) for name in free]),
        np.array([SPREAD[name] for name in free]),
        attitude_follows,
    )


@dataclass(frozen=True)
class Posterior:
    """Posterior distribution of parameters, given the control points.

    Parameters
    ----------
    modes : tuple of (SignalParameters, float)
        Most probable ones of each family and the family's probability, most probable first.
    points : tuple of (SignalParameters, float)
        Parameters and weights that represent the whole distribution.
    """

    modes: tuple[tuple[SignalParameters, float], ...]
    points: tuple[tuple[SignalParameters, float], ...]

    @property
    def mixture(self) -> list[tuple[SignalParameters, float]]:
        """The points of significant weight, with weights that sum up to one."""
        weighty = [point for point in self.points if point[1] > SETTINGS.least_parameter_weight]
        total = sum(weight for _, weight in weighty)
        return [(parameters, weight / total) for parameters, weight in weighty]


@dataclass(frozen=True)
class Objective:
    """Restricted likelihood times prior, as a function of the free parameters' logarithms.

    Large surveys are split into blocks of targets whose likelihoods are multiplied: the work then
    grows with their number, not with its cube.

    Parameters
    ----------
    blocks : tuple of an Adjustment
    prior : Prior
    """

    blocks: tuple[Adjustment, ...]
    prior: Prior

    @classmethod
    def of(cls, adjustment: Adjustment) -> Objective:
        """The objective of Equations under their own prior."""
        return cls(_blocks(adjustment), adjustment.prior(adjustment))

    @property
    def initial(self) -> np.ndarray:
        """Logarithms of the free parameters at the start."""
        return self.prior.start[self.prior.free]

    @property
    def spread(self) -> np.ndarray:
        """One sigma of the free parameters' logarithms."""
        return self.prior.spread

    def parameters(self, family: str, logarithms: np.ndarray) -> SignalParameters:
        """Return the parameters of a family for its free logarithms.

        Parameters
        ----------
        family : str
        logarithms : (k,) array
        """
        full = self.prior.start.copy()
        full[self.prior.free] = logarithms
        if self.prior.attitude_follows:
            full[NAMES.index("attitude_time")] = full[NAMES.index("drift_time")]
        return SignalParameters(family, *np.exp(full).tolist())

    def logarithms(self, parameters: SignalParameters) -> np.ndarray:
        """Return the free logarithms (k,) of parameters.

        Parameters
        ----------
        parameters : SignalParameters
        """
        return np.log([getattr(parameters, name) for name in NAMES])[self.prior.free]

    def __call__(self, family: str, logarithms: np.ndarray) -> float:
        """The log posterior of a family at free logarithms (k,), but for a constant.

        A search may try scales at which rounding leaves no likelihood, and turns back there.

        Parameters
        ----------
        family : str
        logarithms : (k,) array
        """
        chosen = self.parameters(family, logarithms)
        try:
            likelihood = sum(block.weigh(chosen).log_likelihood for block in self.blocks)
        except np.linalg.LinAlgError:
            return IMPROBABLE
        return float(self._prior(logarithms) + likelihood)

    def _prior(self, logarithms):
        """Log priors of logarithms (..., k), but for a constant."""
        return -0.5 * np.sum(((logarithms - self.initial) / self.spread) ** 2, axis=-1)

    def gradient(self, family: str, logarithms: np.ndarray) -> tuple[float, np.ndarray]:
        """The log posterior and its gradient (k,).

        Parameters
        ----------
        family : str
        logarithms : (k,) array
        """
        steps = logarithms + SETTINGS.gradient_step * np.eye(len(logarithms))
        chosen, *near = (self.parameters(family, each) for each in (logarithms, *steps))
        try:
            solved = [block.weigh(chosen) for block in self.blocks]
            pairs = zip(self.blocks, solved, strict=True)
            ahead = sum(block.likelihoods(near, chosen, part) for block, part in pairs)
        except np.linalg.LinAlgError:
            return IMPROBABLE, np.zeros(len(logarithms))
        value = self._prior(logarithms) + sum(part.log_likelihood for part in solved)
        return value, (self._prior(steps) + ahead - value) / SETTINGS.gradient_step

    def maximum(self, family: str, start: np.ndarray) -> tuple[np.ndarray, float]:
        """The most probable logarithms of a family, and the log posterior there.

        Parameters
        ----------
        family : str
        start : (k,) array
        """

        def negative(x):
            value, slope = self.gradient(family, x)
            return -value, -slope

        limit = SETTINGS.farthest_spreads * self.spread
        best = minimize(
            negative,
            np.clip(start, self.initial - limit, self.initial + limit),
            jac=True,
            method="L-BFGS-B",
            bounds=list(zip(self.initial - limit, self.initial + limit, strict=True)),
            options={"maxiter": 40, "ftol": 1e-4, "gtol": 0.05},
        )
        return best.x, -float(best.fun)

    def covariance(self, family: str, mode: np.ndarray, value: float) -> np.ndarray:
        """Covariance of the logarithms about a mode (Laplace), never wider than the prior.

        Parameters
        ----------
        family : str
        mode : (k,) array
        value : float
            The log posterior there.
        """
        step = SETTINGS.curvature_step * np.eye(len(mode))
        once = np.array([[self(family, mode + sign * s) for s in step] for sign in (1, -1)])
        curvature = np.diag(2 * value - once.sum(axis=0)) / SETTINGS.curvature_step**2
        for i in range(len(mode)):
            for j in range(i):
                both = self(family, mode + step[i] + step[j]) + value - once[0, i] - once[0, j]
                curvature[i, j] = curvature[j, i] = -both / SETTINGS.curvature_step**2
        scale = np.outer(self.spread, self.spread)
        values, vectors = np.linalg.eigh(curvature * scale)
        return scale * ((vectors / np.maximum(values, 1.0)) @ vectors.T)


def most_probable(
    adjustment: Adjustment, start: Sequence[SignalParameters] = ()
) -> list[tuple[SignalParameters, float]]:
    """Most probable SignalParameters of each family and its log posterior, the best first.

    Parameters
    ----------
    adjustment : Adjustment
    start : sequence of SignalParameters
        Of each family, near which the maxima are expected.
    """
    objective = Objective.of(adjustment)
    near = {chosen.family: objective.logarithms(chosen) for chosen in start}
    modes = []
    at = objective.initial
    for family in (*FAMILIES, INTEGRATED):
        at, value = objective.maximum(family, near.get(family, at))
        modes.append((objective.parameters(family, at), value))
    return sorted(modes, key=lambda row: -row[1])


def choose_parameters(
    adjustment: Adjustment,
    start: Sequence[SignalParameters] = (),
    points: int = SETTINGS.posterior_points,
) -> Posterior:
    """Posterior of the parameters: restricted likelihood with a weak prior about the stated values.

    A family's probability is its share of the posterior at the maximum. Points drawn from the
    log-normal about a mode (Laplace) in antithetic pairs, always the same, are weighted by the true
    posterior over it. With no more rows than columns of A, the stated values are kept.

    Parameters
    ----------
    adjustment : Adjustment
    start : sequence of SignalParameters
        See ``most_probable``.
    points : int
        Number of points over which a prediction is averaged.
    """
    objective = Objective.of(adjustment)
    ties = 0
    if adjustment.ties is not None:
        ties = len(adjustment.ties)  # one row each, whereas targets have three
    others = [f for f in adjustment.observing if f.kind != REACQUISITION]
    if sum(f.misclosure.size for f in others) <= adjustment.prior_rows(None).shape[1] - 1:
        families = (*FAMILIES, INTEGRATED)
        stated = [objective.parameters(family, objective.initial) for family in families]
        prior_modes = tuple((parameters, 1 / len(families)) for parameters in stated)
        return Posterior(prior_modes, prior_modes)
    probable = most_probable(adjustment, start)
    share = np.exp([value - probable[0][1] for _, value in probable])
    chosen = zip([row[0] for row in probable], (share / share.sum()).tolist(), strict=True)
    by_share = tuple(chosen)
    if max(len(adjustment.names), ties / 3) > SETTINGS.block:
        return Posterior(by_share, by_share)  # so many determine them well
    drawn = []
    for (parameters, probability), (_, value) in zip(by_share, probable, strict=True):
        if probability > SETTINGS.smallest_share:
            mode = objective.logarithms(parameters)
            covariance = objective.covariance(parameters.family, mode, value)
            pairs = int(np.ceil(points * probability / 2))
            spread = mode, covariance, value
            drawn += _points(objective, parameters.family, *spread, probability, pairs)
    total = sum(weight for _, weight in drawn)
    return Posterior(by_share, tuple((chosen, weight / total) for chosen, weight in drawn))


def _points(objective, family, mode, covariance, value, probability, pairs):
    """Parameters and weights, which sum to the family's probability."""
    from scipy.stats import qmc  # imported late to save workers 0.5 s and 36 MB

    half = ndtri(qmc.Halton(len(mode), seed=0).random(pairs))
    normal = np.vstack([half, -half])
    drawn = mode + normal @ cholesky(covariance, lower=True).T
    ratio = np.array([objective(family, x) for x in drawn]) - value + 0.5 * (normal**2).sum(axis=1)
    weights = np.exp(ratio - ratio.max())
    weights = np.minimum(weights, SETTINGS.heaviest * weights.mean())
    weights *= probability / weights.sum()
    chosen = (objective.parameters(family, x) for x in drawn[weights > 0])
    return list(zip(chosen, weights[weights > 0].tolist(), strict=True))


def _blocks(adjustment):
    """The equations in blocks of targets, each with a trend of its own.

    A target is in one block with all its passes, which test each other; targets are sorted by their
    first observation, so that a block is a part of the street.
    """
    number = -(-len(adjustment.names) // SETTINGS.block)
    kinds = {factor.kind for factor in adjustment.observing}
    if number <= 1 or kinds - {TARGET, REACQUISITION}:  # others may link any two blocks
        return (adjustment,)
    order = np.argsort(adjustment.observed, kind="stable")
    _, first, target, counts = np.unique(adjustment.names[order], True, True, True)
    before = np.empty(len(first), int)
    rank = np.argsort(first)
    before[rank] = np.cumsum(counts[rank]) - counts[rank]
    block = (before * number // len(order))[target]
    parts = (adjustment.select(np.sort(order[block == k])) for k in np.unique(block))
    return tuple(part.without_outer_steps() for part in parts)
