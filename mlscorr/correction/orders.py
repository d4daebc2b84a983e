"""Orders of the trend side by side: restricted likelihood, probability, leave-one-out."""

from dataclasses import dataclass

import numpy as np

from mlscorr.correction.likelihood import BLOCK, Objective, most_probable
from mlscorr.correction.model import Parameters

HIGHEST = 3  # the control intervals of higher ones are the signal's part


@dataclass(frozen=True)
class Alternative:
    """A trend's order and a covariance family with its most probable parameters.

    ``log_likelihood`` is the restricted one with a proper prior of the trend, so that orders can
    be compared; ``probability`` among all alternatives; ``leave_one_out`` (3,) RMSE in m, NaN
    where there is none.
    """

    order: int
    parameters: Parameters
    log_likelihood: float
    probability: float
    leave_one_out: np.ndarray


def affordable_order(order, model):
    """The order that leaves one control epoch more than the trend needs."""
    return max(min(order, len(model.target_rows) - 2, model.epochs - 2), 0)


def compare_orders(model, order, families):
    """Alternatives of all families, for orders 0 to 3 and the one in use, as far as affordable.

    The restricted likelihood treats coefficients as if any value were as likely, so a higher
    order costs a unit that it depends on. Each coefficient is given a normal prior as wide as the
    misclosures' RMS, a trend that explains all of them.
    """
    if len(model.gps_time) > BLOCK:
        orders = [order]  # blocks have trends of their own, which can't be compared
    else:
        orders = range(max(order, affordable_order(HIGHEST, model)) + 1)
    size = max(np.sqrt(np.mean(model.misclosure**2)), 1e-6)
    start = [chosen for chosen, _ in families]
    rows = []
    for tried in orders:
        objective = Objective.of(model, tried)
        unit = 1.5 * (tried + 1) * np.log(2 * np.pi * size**2)
        modes = families if tried == order else most_probable(model, tried, start)
        for chosen, _ in modes:
            value = objective(chosen.family, objective.logarithms(chosen)) - unit
            solved = model.solve(chosen, tried)
            left = leave_targets_out(model, solved)
            left = left[np.isfinite(left).all(axis=1)]
            left = np.sqrt(np.mean(left**2, axis=0)) if len(left) else np.full(3, np.nan)
            rows.append((tried, chosen, solved.log_likelihood - unit, value, left))
    share = np.exp([row[3] - max(row[3] for row in rows) for row in rows])
    share /= share.sum()
    return tuple(
        Alternative(tried, chosen, float(likelihood), float(probability), left)
        for (tried, chosen, likelihood, _, left), probability in zip(rows, share, strict=True)
    )


def leave_targets_out(model, solved):
    """Misclosures (n, 3) that remain when each target in turn takes no part; NaN where the
    others don't determine the trend."""
    residuals = np.full(model.misclosure.size, np.nan)
    for rows in model.target_rows.values():
        if solved.determined_without(rows):
            residuals[rows] = solved.leave_out(rows)[0]
    return residuals.reshape(-1, 3)
