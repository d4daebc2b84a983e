"""How far apart knots may stand, by what the rows between them can tell.

What knots leave of a signal, r, is taken for noise that each row has alone, though rows near each
other share it. It does no harm while it is small beside what all rows between two knots together
leave open of the signal, sigma / sqrt(n): a signal below the noise needs knots a good part of its
correlation time apart, where one far above it needs dozens in that time.
"""

from collections.abc import Sequence

import numpy as np

from mlscorr.collocation._knots import SHARE, knot_step
from mlscorr.collocation.covariance import Covariance
from mlscorr.collocation.sparse_rows import SparseRows

LARGEST_SHARE = 0.3  # of a signal's sigma; for larger ones Q_11 is no power of the step any more


def sufficient_steps(rows: Sequence[SparseRows], tolerance: float) -> list[float]:
    """Largest step of each signal between its knots, on its clock.

    Parameters
    ----------
    rows : sequence of SparseRows
    tolerance : float
        Largest sigma of r over that of the mean of the rows between two knots; of zero, r is
        ``SHARE`` of the signal's sigma whatever the rows tell.
    """
    steps = []
    for number, signal in enumerate(rows[0].signals):
        covariance = signal.covariance
        parts = (_information(part, number) for part in rows)
        share = min([LARGEST_SHARE, *(_share(covariance, *part, tolerance) for part in parts)])
        steps.append(knot_step(covariance, max(share, SHARE)))
    return steps


def _information(rows, number):
    """What a view tells of a signal on average, and how many views there are a unit of its clock.

    The first is the square of the signal's sigma in a row over that of the row's noise.
    """
    signal = rows.signals[number]
    variance = np.einsum("nii->ni", rows.noise.separate)
    variance = np.maximum(variance, np.finfo(float).eps ** 2)  # where there is none, others refuse
    n, r = variance.shape
    square = (signal.mixing**2).sum(axis=2).reshape(n, rows.gps_time.shape[1], r)
    ratio = (square / variance[:, None]).mean(axis=2).ravel()
    clock = np.ravel(rows.gps_time if signal.clock is None else signal.clock)[ratio > 0]
    if len(clock) == 0:
        return 0.0, 0.0
    away = 1.0 / signal.covariance.rate  # beyond it views tell nothing of each other
    covered = np.minimum(np.diff(np.unique(clock)), away).sum() + away
    return ratio.sum() / len(clock), len(clock) / covered


def _share(covariance: Covariance, information, density, tolerance):
    """The share s of sigma with s^2 information max(1, density step(s)) <= tolerance^2."""
    if information == 0.0:
        return LARGEST_SHARE
    largest = tolerance / np.sqrt(information)
    power = 1.0 / (2 * covariance.states - 1)  # step(s) = step(1) s^(2 power)
    of_all = tolerance**2 / (information * density * knot_step(covariance, 1.0))
    return min(largest, of_all ** (0.5 / (1.0 + power)))
