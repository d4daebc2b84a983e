"""Orders of the trend side by side: restricted likelihood, probability, leave-one-out."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from mlscorr.collocation import Collocation
from mlscorr.estimate.equations import NO_TREND, Equations
from mlscorr.estimate.posterior import Objective, most_probable
from mlscorr.estimate.settings import SETTINGS
from mlscorr.estimate.signals import SignalParameters
from mlscorr.survey import control_epochs


@dataclass(frozen=True)
class Alternative:
    """A trend's order and a covariance family with its most probable parameters.

    Parameters
    ----------
    order : int
    parameters : SignalParameters
    log_likelihood : float
    probability : float
        Among all alternatives.
    leave_one_out : (3,) array
        RMSE. Units: m.
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
    sizes = len(equations.target_rows), len(control_epochs(equations.observed))
    return max(min(order, min(sizes) - 2), 0)


def compare_orders(
    equations: Equations, families: Sequence[tuple[SignalParameters, float]]
) -> tuple[Alternative, ...]:
    """Alternatives of all families, for no trend and all orders up to one above that in use.

    Parameters
    ----------
    equations : Equations
    families : sequence of (SignalParameters, float)
        Most probable parameters of each family at the order in use.
    """
    order = equations.order
    # Blocks have trends of their own, which can't be compared; ties tell none
    is_alone = len(equations.names) > SETTINGS.block or equations.ties is not None
    orders = [order] if is_alone else range(NO_TREND, order + 2)
    start = [chosen for chosen, _ in families]
    rows = []
    for tried in orders:
        with_order = replace(equations, order=tried)
        objective = Objective.of(with_order)
        if tried == order:
            modes = families
        else:
            modes = most_probable(with_order, start)
        for chosen, _ in modes:
            value = objective(chosen.family, objective.logarithms(chosen))
            solved = with_order.solve(chosen)
            left = np.sqrt(np.mean(leave_targets_out(with_order, solved) ** 2, axis=0))
            rows.append((tried, chosen, solved.log_likelihood, value, left))
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
    """
    residuals = np.empty(3 * len(equations.names))
    for rows in equations.target_rows.values():
        residuals[rows] = solved.leave_out(rows)[0]
    return residuals.reshape(-1, 3)
