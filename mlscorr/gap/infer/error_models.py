"""What the simulator expects the residuals to be when nothing is wrong: models of their covariance.

V = drift, jitter and attitude of the POS + survey errors + noise of each row. Residuals of one
drive are not white: without V every clean survey is "explained" by some effect, and with one fixed
V nearly half of those whose drift merely has another shape. So V is a family of ErrorModels with
prior weights, to be averaged over.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from mlscorr.gap.infer.settings import SETTINGS


@dataclass(frozen=True)
class ErrorModel:
    """One covariance V: factors on what is believed, and what is added to it.

    Parameters
    ----------
    scale : float
        On the sigmas of drift, jitter and attitude.
    family : str
        Of drift and attitude.
    time : float
        On their correlation time.
    jitter_time : float
        Units: s.
    noise : float
        On the sigma of each row's own noise.
    fixes : float
        Sigma of noise of GNSS fixes, in E, N and H. Units: m.
    weight : float
        Prior probability.
    windows : tuple of (start, length, factor, shape)
        Times (s) in which the POS has a further error, whose sigma is at most the stated one of
        the position times a factor. It rises with time or has its largest value in the middle.
    """

    scale: float = 1.0
    family: str = "matern32"
    time: float = 1.0
    jitter_time: float = 5.0
    noise: float = 1.0
    fixes: float = 0.0
    weight: float = 1.0
    windows: tuple[tuple[float, float, float, str], ...] = ()


STATED = ErrorModel()


def window_growth(
    windows: Sequence[tuple[float, float, float, str]], gps_time: np.ndarray
) -> np.ndarray:
    """Sigma that windows of a worse POS add, over the stated one of the position.

    Parameters
    ----------
    windows : sequence of (start, length, factor, shape)
    gps_time : (n,) array
        Units: s.

    Returns
    -------
    growth : (n, 1) array
    """
    growth = np.zeros(len(gps_time))
    for start, length, largest, shape in windows:
        part = (gps_time - start) / length
        inside = (part >= 0) & (part < 1)
        profile = part if shape == "rise" else 4 * part * (1 - part)
        growth[inside] = largest * profile[inside]
    return growth[:, None]


def error_models() -> tuple[ErrorModel, ...]:
    """Those within the belief, with prior weights that sum to one."""
    scales = np.asarray(SETTINGS.pos_scales)
    share = np.exp(-0.5 * (np.log(scales) / SETTINGS.scale_spread) ** 2)
    share /= share.sum()
    return tuple(
        ErrorModel(float(scale), family, time, jitter, noise, 0.0, float(s * weight * w))
        for family, time, jitter, weight in SETTINGS.shapes
        for scale, s in zip(scales, share, strict=True)
        for noise, w in SETTINGS.noise_scales
    )


def shaped_models(scale: float = 1.0, fixes: float = 0.0) -> list[ErrorModel]:
    """One of each shape.

    Parameters
    ----------
    scale : float
        On the POS's sigmas.
    fixes : float
        Sigma of noise of GNSS fixes. Units: m.
    """
    return [ErrorModel(scale, *shape[:3], 1.0, fixes, shape[3]) for shape in SETTINGS.shapes]


def nearby_models(model: ErrorModel) -> tuple[ErrorModel, ...]:
    """Models about one: the steps between scales and shapes are wider than data may leave."""
    steps = (0.8, 1.0, 1.25), (0.7, 1.0, 1.4), (0.9, 1.0, 1.15)
    return tuple(
        replace(
            model,
            scale=model.scale * scale,
            time=model.time * time,
            noise=model.noise * noise,
            weight=model.weight / 27,
        )
        for scale, time, noise in product(*steps)
        if model.scale * scale <= SETTINGS.scale_limit
    )
