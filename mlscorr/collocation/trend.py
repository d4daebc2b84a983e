"""The polynomial trend of the position error (Mao et al. 2015, Eq. 11)."""

import numpy as np

from mlscorr.survey import SAME_EPOCH


def polynomial_design(
    gps_time: np.ndarray, span: tuple[float, float], order: int, extrapolate: bool = False
) -> np.ndarray:
    """Partial derivatives of a polynomial per axis, in Legendre's well-conditioned basis.

    Parameters
    ----------
    gps_time : (q,) array
        Units: s.
    span : (float, float)
        First and last control epoch. Units: s.
    order : int
    extrapolate : bool
        Whether the polynomial runs on outside the span, as in the paper; else it keeps its value
        at the end, as it would run away there.

    Returns
    -------
    (q, 3, 3 (order + 1)) array
        Parameters of one degree, three axes, follow each other.
    """
    first, last = span
    middle = (first + last) / 2
    half = max((last - first) / 2, SAME_EPOCH)
    argument = (gps_time - middle) / half
    if not extrapolate:
        argument = np.clip(argument, -1, 1)
    basis = np.polynomial.legendre.legvander(argument, order)
    return np.einsum("qi,jk->qjik", basis, np.eye(3)).reshape(len(basis), 3, 3 * (order + 1))
