"""Products and roots of matrices so small that plain loops are as fast as BLAS."""

import numpy as np

from mlscorr.compiled_loops import loop

SINGULAR = 1e-15  # share of an observation's prior variance below which the rest is rounding error


@loop
def assign(out: np.ndarray, values: np.ndarray) -> None:
    """Assign values to a matrix by loops, because slices with their error text compile slowly.

    Parameters
    ----------
    out, values : (i, j) array
    """
    for i in range(out.shape[0]):
        for j in range(out.shape[1]):
            out[i, j] = values[i, j]


@loop
def multiply(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """A b by plain loops, which are as fast as BLAS on small matrices, and compile quickly.

    Parameters
    ----------
    a, b : (i, k), (k, j) array
    """
    out = np.zeros((a.shape[0], b.shape[1]))
    for i in range(a.shape[0]):
        for k in range(a.shape[1]):
            for j in range(b.shape[1]):
                out[i, j] += a[i, k] * b[k, j]
    return out


@loop
def multiply_transposed(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """a^T b.

    Parameters
    ----------
    a, b : (k, i), (k, j) array
    """
    return multiply(a.T, b)


@loop
def whitening_root(s: np.ndarray, prior: np.ndarray) -> np.ndarray:
    """L^-1 with L L^T = s (r, r); the first element is NaN if s is singular.

    Parameters
    ----------
    s, prior : (r, r), (r,) array
    """
    r = s.shape[0]
    lower = np.zeros((r, r))
    white = np.zeros((r, r))
    for i in range(r):
        for j in range(i + 1):
            total = s[i, j]
            for k in range(j):
                total -= lower[i, k] * lower[j, k]
            if j < i:
                lower[i, j] = total / lower[j, j]
            elif total > SINGULAR * prior[i]:
                lower[i, i] = np.sqrt(total)
            else:
                white[0, 0] = np.nan
                return white
        white[i, i] = 1.0 / lower[i, i]
        for j in range(i):
            total = 0.0
            for k in range(j, i):
                total -= lower[i, k] * white[k, j]
            white[i, j] = total / lower[i, i]
    return white
