"""Errors of synthetic surveys of features, none of them drawn from the estimator's model.

The drift is a sum of sinusoids or a random walk with bias instability through a crude smoother;
survey and extraction errors often have heavier tails than assumed.
"""

import numpy as np
from numpy.random import Generator

from mlscorr.gap.evidence import SETTINGS as INFERENCE
from mlscorr.gap.residuals import SETTINGS, Rows
from mlscorr.survey import Scanner

ODD_SHARE = 0.12  # at most, estimated: of 5 surveys by ray casting 2 have more than a twentieth
ODD_DEPTH = 0.02  # m from the plane, mode, estimated: a curb of 10 cm along the edge of a patch


def process(rng: Generator, time: np.ndarray, kind: str) -> np.ndarray:
    """A drift (n,) of unit rms that no covariance of the estimator describes.

    Parameters
    ----------
    rng : Generator
    time : (n,) array
        Units: s.
    kind : str
        sines or walk.
    """
    t = time - time.min()
    if kind == "sines":
        periods = np.exp(rng.uniform(np.log(8.0), np.log(250.0), 5))
        phases = rng.uniform(0, 2 * np.pi, 5)
        sizes = rng.standard_normal(5)
        return np.sqrt(2 / 5) * np.sin(2 * np.pi * t[:, None] / periods + phases) @ sizes
    grid = np.arange(0.0, t.max() + 1.0, 1.0)
    walk = np.cumsum(rng.standard_normal(len(grid)))  # velocity noise, in
    flicker = sum(
        np.repeat(rng.standard_normal(len(grid) // k + 1), k)[: len(grid)] for k in (4, 16, 64)
    )
    walk = walk / 6 + flicker
    for fixes in (10, 25):  # a crude smoother: GNSS every so often pulls it back
        fit = np.interp(grid, grid[::fixes], walk[::fixes])
        walk = walk - 0.6 * fit
    walk = np.convolve(walk, np.ones(5) / 5, mode="same")
    return np.interp(t, grid, walk / np.sqrt(np.mean(walk**2)))


def scatter(rows: Rows, rng: Generator, heavy: bool = True) -> np.ndarray:
    """Errors (m,) of the survey of targets and of each row's own.

    No target has an error as large as an outlier, which is an effect: clean surveys must stay
    clean.

    Parameters
    ----------
    rows : Rows
    rng : Generator
    heavy : bool
        True for the tails of Student's t with five degrees of freedom.
    """

    def draw(n):
        if heavy:
            return rng.standard_t(5, n) * np.sqrt(3 / 5)
        return rng.standard_normal(n)

    survey = np.clip(draw(3 * len(rows.targets)), -INFERENCE.outlier, INFERENCE.outlier)
    own = draw(len(rows)) * np.sqrt(rows.noise)
    rough = rows.channel == "roughness"
    own[rough] = np.log(rng.chisquare(77, rough.sum()) / 77) + 1 / 77
    own[rough] += 0.1 * rng.standard_normal(rough.sum())
    rate = rows.channel == "return_rate"
    share = np.full(rate.sum(), rng.uniform(0.0, SETTINGS.least_loss))
    own[rate] = -rng.binomial(rows.points[rate], share) / rows.points[rate]
    return rows.survey_design() @ survey + own


def odd_patches(rows: Rows, rng: Generator) -> np.ndarray:
    """Changes in roughness and return rate (m,) by crowns and curbs in some patches.

    Parameters
    ----------
    rows : Rows
    rng : Generator
    """
    is_odd = (rng.random(rows.item.max() + 1) < rng.uniform(0.0, ODD_SHARE))[rows.item]
    depth = rng.rayleigh(ODD_DEPTH / Scanner().range_noise, len(rows))
    rough = np.log1p(depth**2) * (rows.channel == "roughness")
    return is_odd * (rough - 0.5 * rng.random(len(rows)) * (rows.channel == "return_rate"))
