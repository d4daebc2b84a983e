"""Collocation of rows that link epochs: ties between passes, targets seen in any number of them.

Beside ``collocate``, which is exact to 1e-9 and for rows of one epoch each.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mlscorr.collocation._information import InformationSolver
from mlscorr.collocation.model import SMALLEST_INFORMATION, Collocation, solve_trend
from mlscorr.collocation.sparse_rows import SparseRows


def collocate_rows(
    rows: Sequence[SparseRows],
    like: InformationSolver | None = None,
    tolerance: float = 0.0,
    believed: np.ndarray | None = None,
) -> Collocation:
    r"""Separate the misclosures of sparse rows into trend, signal and noise.

    Solves l = A x + B s + n as ``collocate`` does, to 1e-5 m and 1 % of sigma where signals have a
    sigma of some metres. This one is for rows that see the signals at two epochs (ties) and for
    targets seen in more than one pass, dozens of them or thousands: work and memory grow with rows
    and knots, and an error that passes share costs no more than a knot. For rows of one epoch each
    that share nothing ``collocate`` is exact to 1e-9, and five times as fast. Observations in the
    order of time are solved twice as fast as others.

    Parameters
    ----------
    rows : sequence of SparseRows
        With the same signals and trend: control, ties, steps.
    like : InformationSolver, optional
        Of the same epochs: its knots and order of elimination are used again. A likelihood is
        smooth in the signals' parameters only where knots stay.
    tolerance : float
        What knots may leave over what the observations of an interval between two of them leave
        open together: fewer knots, where those for all digits would only cost time.
    believed : (k, p) array, optional
        Of the trend, as of a Collocation.

    Returns
    -------
    solved : Collocation
        Its rows are those of all observations, one after the other.

    Raises
    ------
    ValueError
        As ``collocate`` does, and where knots stand so close that rounding is all that is left.

    Examples
    --------
    A step of 0.3 m that a tie sees between two passes, of which the first is held to 1 mm:

    >>> from mlscorr.collocation import Noise, Signal, SparseRows, collocate_rows
    >>> from mlscorr.collocation.covariance import Covariance
    >>> drift, none = Covariance("matern32", 30.0), np.zeros((1, 1, 0))
    >>> noise, unit = Noise(np.full((1, 1, 1), 1e-6)), np.ones((1, 1, 1))
    >>> held = SparseRows(np.array([[0.0]]), np.zeros((1, 1)), noise, none, [Signal(unit, drift)])
    >>> sides = Signal(np.array([-1.0, 1.0])[:, None, None], drift)
    >>> tie = SparseRows(np.array([[0.0, 900.0]]), np.full((1, 1), 0.3), noise, none, [sides])
    >>> mean, covariance = collocate_rows([held, tie]).predict(np.array([900.0]), none, [unit])
    >>> mean.round(4), np.sqrt(covariance).round(4)
    (array([[0.3]]), array([[[0.0014]]]))
    """
    return _solve(InformationSolver.of(rows, like, tolerance), believed)


def reweight(solved: Collocation, weights: Sequence[np.ndarray]) -> Collocation:
    """The same rows with their own noise's variance divided by weights.

    Only numbers are worked out again, neither knots nor the order of elimination: for robust
    estimation, which changes weights in each round.

    Parameters
    ----------
    solved : Collocation
        By ``collocate_rows``.
    weights : sequence of (n,) arrays
        Of the observations of each SparseRows, positive; one for the noise they have.

    Raises
    ------
    ValueError
        Where a weight isn't positive.
    """
    return _solve(solved.solver.reweighted(weights), solved.believed)


def _solve(solver, believed):
    return solve_trend(solver, solver.columns[:, -1], solver.columns[:, :-1], believed)


@dataclass(frozen=True)
class LeftOut:
    """What the other observations say of each of n, of r rows.

    Parameters
    ----------
    residual : (n, r) array
        l less its prediction by all others.
    covariance : (n, r, r) array
        Of the residual, with the observation's own noise.
    redundancy : (n, r) array
        Share of an error in a row that its residual shows. All sum to the redundancy of the
        solution, m - p less what the signals take up.
    """

    residual: np.ndarray
    covariance: np.ndarray
    redundancy: np.ndarray


def leave_each_out(solved: Collocation) -> list[LeftOut]:
    """Leave each observation out in turn: of each SparseRows a LeftOut.

    Not a number where the others don't determine the trend. Passes of a target that share its
    survey are left out together by ``Collocation.leave_out``.

    Parameters
    ----------
    solved : Collocation
        By ``collocate_rows``.
    """
    solver = solved.solver
    projected = solver.by_rows(solved.projected)
    weights = solver.by_rows(solved.weights[:, None])
    left_out = []
    for sides, block, part, weight in zip(
        solver.sides, solver.blocks, projected, weights, strict=True
    ):
        information = block - part @ part.swapaxes(1, 2)
        root = np.linalg.inv(sides.white)
        redundancy = np.einsum("nij,nkj,nki->ni", root, root, information)
        information[(redundancy < SMALLEST_INFORMATION).any(axis=1)] = np.nan
        covariance = np.linalg.inv(information)
        left_out.append(LeftOut((covariance @ weight)[:, :, 0], covariance, redundancy))
    return left_out
