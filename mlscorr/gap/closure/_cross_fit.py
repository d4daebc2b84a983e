"""The size of a cause by the innovations of all folds but one.

Innovations are independent of each other under V, drift and all: what is found in some of them
says nothing of the noise of the others.
"""

from dataclasses import dataclass

import numpy as np

from mlscorr.gap.evidence import SETTINGS, ErrorModel, Observations


@dataclass(frozen=True)
class CrossFit:
    """Columns of a cause, whitened, and the folds of their observations.

    Parameters
    ----------
    columns : (n, p) array
        Innovations of the columns in the observations that may be learned from.
    fold : (n,) int array
    number : int
        Of folds.
    """

    columns: np.ndarray
    fold: np.ndarray
    number: int

    def sizes(self, innovations: np.ndarray) -> np.ndarray:
        """Sizes (f + 1, p, k) by all folds but each, and last by all, of k columns.

        Parameters
        ----------
        innovations : (n, k) array
        """
        sizes = []
        for number in range(self.number + 1):
            keep = (self.fold != number) | (self.number == 1)  # nothing is held out then
            columns = self.columns[keep]
            free = SETTINGS.free_sigma
            normal = columns.T @ columns + np.eye(columns.shape[1]) / free**2
            sizes.append(np.linalg.solve(normal, columns.T @ innovations[keep]))
        return np.array(sizes)


def cross_fitted(
    observations: Observations,
    model: ErrorModel,
    fold: np.ndarray,
    number: int,
    columns: np.ndarray,
    residual: np.ndarray,
) -> np.ndarray:
    """Sizes (f + 1, p) of columns by all folds but each, and last by all.

    Parameters
    ----------
    observations : Observations
        That may be learned from.
    model : ErrorModel
        Of their covariance.
    fold : (n,) int array
        Of each observation.
    number : int
        Of folds.
    columns : (n, p) array
    residual : (n,) array
    """
    scale = np.abs(columns).max(axis=0, initial=0.0)
    scale[scale == 0] = 1.0
    both = np.column_stack([columns / scale, residual])
    white = observations.whitener(model).innovations(both)[0]
    return CrossFit(white[:, :-1], fold, number).sizes(white[:, -1:])[:, :, 0] / scale
