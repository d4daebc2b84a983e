"""Products and roots of matrices so small that plain loops are as fast as BLAS."""

import numpy as np

from mlscorr.compiled_loops import loop

SINGULAR = 1e-15  # share of an observation's prior variance below which nothing is left of it


@loop
def assign(out: np.ndarray, values: np.ndarray) -> None:
    """Put values in the place of a matrix; by slices the words of an error take long to compile.

    Parameters
    ----------
    out, values : (i, j) array
    """
    for i in range(out.shape[0]):
        for j in range(out.shape[1]):
            out[i, j] = values[i, j]


@loop
def multiply(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """A b. Plain loops: on matrices this small they are as fast as BLAS, and quick to compile.

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
    """L^-1 with L L^T = s (r, r); a first element that is no number where s is singular.

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
