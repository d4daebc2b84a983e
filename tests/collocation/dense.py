"""Collocation by the dense formula of observations that see one epoch each, as of collocate."""

import numpy as np

from mlscorr.collocation import Noise, Signal, SparseRows, collocate_rows_dense


def collocate_dense(gps_time, misclosure, noise, design, signals):
    "The result of collocate"
    epochs = np.reshape(gps_time, (len(misclosure), 1))
    return collocate_rows_dense([SparseRows(epochs, misclosure, noise, design, signals)])


def collocate_correlated(gps_time, misclosure, covariance, design, signals):
    "Of single rows (n,), whose noise may be correlated in any manner: one that sees n epochs"
    n = len(misclosure)
    each = [Signal(_apart(signal.mixing), signal.covariance) for signal in signals]
    noise = Noise(np.asarray(covariance)[None])
    epochs = np.reshape(gps_time, (1, n))
    values = np.reshape(misclosure, (1, n))
    return collocate_rows_dense([SparseRows(epochs, values, noise, design[None], each)])


def _apart(mixing):
    "Mixing (n epochs, n rows, k) of rows (n, k) of which each sees an epoch of its own"
    return np.eye(len(mixing))[:, :, None] * mixing[:, None]
