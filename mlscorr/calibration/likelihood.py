"""The parameters of the POS error, weighed by the control points' own likelihood.

A calibration site has few targets, which seldom tell how long an error lasts, and the sigmas of
the mounting depend on that. So no best set of parameters is chosen: many are drawn and weighed.
"""

import numpy as np
from scipy.stats import norm, qmc

from mlscorr.calibration.equations import Parameters
from mlscorr.covariance import FAMILIES

ATTITUDE_TIME = 120.0  # s, Mao et al. 2015, Table 7: gyro biases change over minutes
SPREAD = np.log([3.0, 3.0, 2.0, 3.0])  # one sigma of the logarithms about the start values
DRAWS = 96  # of each of the two rounds
WIDER = 1.5  # factor on the second round's sigmas, so that it covers the tails
LEAST_WIDTH = 0.1  # of a logarithm
NEGLIGIBLE = 1e-3  # probability below which a draw isn't worth the work
LARGE = 200  # observations; more tell little more of the POS, and cost as their cube
FEW = 10  # draws kept of a large site, where each one costs the more


def weigh_parameters(equations, pos):
    """Parameters and their probabilities, the most probable first.

    Importance sampling in two rounds: quasi-random draws from what is believed beforehand (the
    stated sigmas and correlation times, each within a factor of two or three), then from a normal
    distribution about those that the restricted likelihood favours. Of large sites some targets,
    evenly chosen, tell the likelihood, and few draws are kept.
    """
    is_large = len(equations.names) > LARGE
    if is_large:
        equations = equations.thinned(LARGE)
    start = np.log([1.0, pos.correlation_time, 1.0, ATTITUDE_TIME])
    uniform = qmc.Halton(len(start), scramble=False).random(2 * DRAWS + 1)[1:]
    normal = norm.ppf(uniform)
    logarithms = start + SPREAD * normal[:DRAWS]
    likelihood = _log_likelihood(equations, logarithms)
    middle, factor = _favoured(logarithms, likelihood)
    second = middle + normal[DRAWS:] @ factor.T
    logarithms = np.vstack([logarithms, second])
    likelihood = np.append(likelihood, _log_likelihood(equations, second))
    prior = _log_normal((logarithms - start) / SPREAD, SPREAD)
    other = _log_normal(np.linalg.solve(factor, (logarithms - middle).T).T, np.diag(factor))
    proposal = np.logaddexp(prior, other) - np.log(2)
    weights = _normalised(likelihood + prior - proposal)
    found = [
        (_parameters(number, logarithms[number]), float(weights[number]))
        for number in np.argsort(-weights)[: FEW if is_large else None]
        if weights[number] > NEGLIGIBLE
    ]
    total = sum(weight for _, weight in found)
    return tuple((parameters, weight / total) for parameters, weight in found)


def _parameters(number, logarithms):
    """The draw's parameters; the families take turns."""
    return Parameters(FAMILIES[number % len(FAMILIES)], *np.exp(logarithms).tolist())


def _log_likelihood(equations, logarithms):
    return np.array(
        [
            equations.solve(equations.signals(_parameters(number, row))).log_likelihood
            for number, row in enumerate(logarithms)
        ]
    )


def _favoured(logarithms, likelihood):
    """Mean, and lower triangular root of the widened covariance, of draws by their likelihood."""
    weights = _normalised(likelihood)
    middle = weights @ logarithms
    left = logarithms - middle
    covariance = WIDER**2 * (left.T * weights) @ left + LEAST_WIDTH**2 * np.eye(len(middle))
    return middle, np.linalg.cholesky(covariance)


def _normalised(logarithms):
    weights = np.exp(logarithms - logarithms.max())
    return weights / weights.sum()


def _log_normal(standard, sigmas):
    """Log density of standard normal draws (n, d) whose axes were stretched by sigmas (d,)."""
    return -0.5 * (standard**2).sum(axis=1) - np.log(sigmas).sum()
