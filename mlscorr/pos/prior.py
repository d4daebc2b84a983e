"""Prior of a POS's unknown scales, before any observation.

No room multiplies stated sigmas by its own constant. Estimates with observations give a posterior
of scales and times; the diagnosis averages over processes with a prior of their scale, and fast
computations use a few hypotheses (``Predictive``) for all possible drives.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product
from typing import NamedTuple

import numpy as np

from mlscorr.pos.settings import SETTINGS

RISE, HUMP = EXCURSIONS = ("rise", "hump")


class Process(NamedTuple):
    """A hypothesis on the error of a POS as one process: its scale, family, time and probability.

    Parameters
    ----------
    scale : float
        On the stated sigma.
    family : str
        Of the covariance function.
    time : float
        On the assumed correlation time.
    weight : float
        Prior probability.
    """

    scale: float
    family: str
    time: float
    weight: float


def stated_processes() -> Iterator[Process]:
    """Yield processes of a POS with roughly correct sigmas; their weights add up to one."""
    scales = np.asarray(SETTINGS.process_scales)
    share = np.exp(-0.5 * (np.log(scales) / SETTINGS.process_scale_spread) ** 2)
    for family, time, weight in SETTINGS.process_shapes:
        for scale, part in zip(scales, share / share.sum(), strict=True):
            yield Process(float(scale), family, time, float(part * weight))


class Predictive(NamedTuple):
    """Possible errors of a POS at n epochs, by m hypotheses of equal weight.

    Parameters
    ----------
    sigma : (m, n, 3) array
        Of an error that changes smoothly (Matern 3/2). Units: m.
    rough_variance : (m, n, 3) array
        Of an error that is independent at each epoch. Units: m^2.
    correlation_time : (m,) array
        Of the former. Units: s.
    """

    sigma: np.ndarray
    rough_variance: np.ndarray
    correlation_time: np.ndarray


def predictive(sigma: np.ndarray, correlation_time: float) -> Predictive:
    """Return hypotheses about stated sigmas: other scales, biases and unstated errors.

    Parameters
    ----------
    sigma : (n, 3) array
        As stated. Units: m.
    correlation_time : float
        As assumed. Units: s.
    """
    drifts = [(scale, 0.0) for scale in SETTINGS.sigma_scales]
    drifts += [(1.0, bias) for bias in SETTINGS.slow_biases]
    groups = product(drifts, SETTINGS.unstated_sigmas, SETTINGS.time_shares)
    table = np.array([(*drift, unstated, share) for drift, unstated, share in groups])
    scale, bias, unstated, share = table.T[:, :, None, None]
    smooth = np.sqrt((scale * sigma) ** 2 + bias**2 + unstated**2)
    rough = (SETTINGS.rough_share * smooth) ** 2 + (unstated / 2) ** 2
    return Predictive(smooth, rough, share[:, 0, 0] * correlation_time)


def excursion_profile(gps_time: np.ndarray, start: float, end: float, shape: str) -> np.ndarray:
    """Profile (n,) from 0 to 1 of a temporary error, zero outside of its two times.

    Parameters
    ----------
    gps_time : (n,) array
        Units: s.
    start, end : float
        Units: s.
    shape : str
        RISE, as in real time until GNSS is back; HUMP, as a smoother constrains it at both ends.
    """
    share = (gps_time - start) / (end - start)
    is_inside = (share >= 0) & (share < 1)
    if shape == RISE:
        profile = share
    else:
        profile = 4.0 * share * (1.0 - share)
    return np.where(is_inside, profile, 0.0)
