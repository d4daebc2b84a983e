"""Orders of the trend side by side: restricted likelihood, probability, leave-one-out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mlscorr.collocation import Collocation
from mlscorr.estimate.equations import Equations
from mlscorr.estimate.posterior import Objective, most_probable
from mlscorr.estimate.settings import SETTINGS
from mlscorr.estimate.signals import SignalParameters


@dataclass(frozen=True)
class Alternative:
    """A trend's order and a covariance family with its most probable parameters.

    Parameters
    ----------
    order : int
    parameters : SignalParameters
    log_likelihood : float
        The restricted one with a proper prior of the trend, so that orders can be compared.
    probability : float
        Among all alternatives.
    leave_one_out : (3,) array
        RMSE, NaN where there is none. Units: m.
    """

    order: int
    parameters: SignalParameters
    log_likelihood: float
    probability: float
    leave_one_out: np.ndarray


def affordable_order(order: int, equations: Equations) -> int:
    """The order that leaves one control epoch more than the trend needs.

    Parameters
    ----------
    order : int
        As asked for.
    equations : Equations
    """
    return max(min(order, len(equations.target_rows) - 2, equations.epochs - 2), 0)


def compare_orders(
    equations: Equations, families: Sequence[tuple[SignalParameters, float]]
) -> tuple[Alternative, ...]:
    """Alternatives of all families, for orders 0 to 3 and the one in use, as far as affordable.

    The restricted likelihood treats coefficients as if any value were as likely, so a higher
    order costs a unit that it depends on. Each coefficient is given a normal prior as wide as the
    misclosures' RMS, a trend that explains all of them.

    Parameters
    ----------
    equations : Equations
    families : sequence of (SignalParameters, float)
        Most probable parameters of each family at the order in use.
    """
    order = equations.order
    if len(equations.names) > SETTINGS.block or equations.ties is not None:
        orders = [order]  # blocks have trends of their own, which can't be compared; ties tell none
    else:
        orders = range(max(order, affordable_order(SETTINGS.highest_order, equations)) + 1)
    size = max(np.sqrt(np.mean(equations.misclosure**2)), SETTINGS.resolution)
    start = [chosen for chosen, _ in families]
    rows = []
    for tried in orders:
        with_order = equations.with_order(tried)
        objective = Objective.of(with_order)
        unit = 1.5 * (tried + 1) * np.log(2 * np.pi * size**2)
        modes = families if tried == order else most_probable(with_order, start)
        for chosen, _ in modes:
            value = objective(chosen.family, objective.logarithms(chosen)) - unit
            solved = with_order.solve(chosen)
            left = leave_targets_out(with_order, solved)
            left = left[np.isfinite(left).all(axis=1)]
            left = np.sqrt(np.mean(left**2, axis=0)) if len(left) else np.full(3, np.nan)
            rows.append((tried, chosen, solved.log_likelihood - unit, value, left))
    share = np.exp([row[3] - max(row[3] for row in rows) for row in rows])
    share /= share.sum()
    return tuple(
        Alternative(tried, chosen, float(likelihood), float(probability), left)
        for (tried, chosen, likelihood, _, left), probability in zip(rows, share, strict=True)
    )


def leave_targets_out(equations: Equations, solved: Collocation) -> np.ndarray:
    """Misclosures (n, 3) that remain when each target in turn takes no part. Units: m.

    Parameters
    ----------
    equations : Equations
    solved : Collocation

    Returns
    -------
    (n, 3) array
        NaN where the others don't determine the trend.
    """
    residuals = np.full(3 * len(equations.names), np.nan)
    for rows in equations.target_rows.values():
        if solved.determined_without(rows):
            residuals[rows] = solved.leave_out(rows)[0]
    return residuals.reshape(-1, 3)
