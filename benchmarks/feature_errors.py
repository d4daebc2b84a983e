"""Errors of synthetic surveys of features without an effect, for studies and tests."""

import numpy as np
from gap_training.errors import process, scatter
from gap_training.features import Geometry
from numpy.random import Generator


def errors(g: Geometry, rng: Generator, kind: str = "sines") -> np.ndarray:
    """Residuals (m,) of a survey without an effect.

    Parameters
    ----------
    g : Geometry
    rng : Generator
    kind : str
        sines or walk.
    """
    rows = g.rows
    m = len(g.rows)
    scale = np.exp(0.2 * rng.standard_normal())
    time = np.append(rows.gps_time, np.where(rows.two_times, rows.gps_time_2, rows.gps_time))
    order = np.argsort(time)
    pose = np.empty((2 * m, 6))
    for i in range(6):
        pose[order, i] = process(rng, time[order], kind)
    sigma = np.append(np.full(3, g.survey.pos.position_sigma), g.survey.pos.attitude_sigma)
    pose *= scale * sigma
    residual = np.einsum("mi,mi->m", rows.partials, pose[:m])
    residual += np.einsum("mi,mi->m", rows.partials_2, pose[m:])
    return residual + scatter(rows, rng)
