"""The parameters of the signals by the control points' own likelihood."""

import numpy as np
from scipy.optimize import minimize

from mlscorr.correction.model import Parameters
from mlscorr.covariance import FAMILIES

START_RATIO = 4.0  # correlation time over control interval: 3 to 5 in the paper, section 3.1.4
PRIOR_SPREAD = np.log(3.0)  # one sigma of a factor of three about each start value
BLOCK = 100  # observations; 25 correlation times at the start, so blocks tell little of each other


def choose_parameters(model, order):
    """Maximise the restricted likelihood over each family, weakly held to the start values.

    The starts are the POS's stated sigmas and the paper's rule for the correlation time, or what
    is believed of it where the trajectory has no sigmas; jitter is correlated over one control
    interval. Large surveys are cut into blocks of time whose
    likelihoods are multiplied: the work then grows with their length, not with its cube.

    Returns (Parameters, probability) of each family, the most probable first. The probability is
    the family's share of the posterior at its maximum.
    """
    interval = model.interval
    drift_time = START_RATIO * interval
    if model.trajectory.position_sigma is None:
        drift_time = model.pos.correlation_time
    start = np.log([1.0, drift_time, 1.0, interval])
    has_jitter = bool(np.any(model.sigmas.jitter))
    free = slice(0, 4 if has_jitter else 2)
    blocks = _blocks(model, order)

    def parameters(family, logarithms):
        full = start.copy()
        full[free] = logarithms
        return Parameters(family, *(float(v) for v in np.exp(full)))

    def objective(logarithms, family):
        prior = 0.5 * np.sum(((logarithms - start[free]) / PRIOR_SPREAD) ** 2)
        chosen = parameters(family, logarithms)
        return prior - sum(block.solve(chosen, low).log_likelihood for block, low in blocks)

    corners = start[free] + np.vstack([np.zeros(free.stop), PRIOR_SPREAD * np.eye(free.stop)])
    options = {"xatol": 0.02, "fatol": 0.02, "maxfev": 600, "initial_simplex": corners}
    found = []
    for family in FAMILIES:
        best = minimize(objective, start[free], (family,), "Nelder-Mead", options=options)
        found.append((parameters(family, best.x), -float(best.fun)))
    best = max(value for _, value in found)
    share = np.exp([value - best for _, value in found])
    rows = zip((chosen for chosen, _ in found), (share / share.sum()).tolist(), strict=True)
    return tuple(sorted(rows, key=lambda row: -row[1]))


def _blocks(model, order):
    """The model in blocks of time, each with the order that its epochs can carry."""
    number = -(-len(model.gps_time) // BLOCK)
    parts = np.array_split(np.argsort(model.gps_time, kind="stable"), number)
    return [(block, min(order, block.epochs - 1)) for block in map(model.select, parts)]
