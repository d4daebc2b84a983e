"""What the simulator expects the residuals to be when nothing is wrong: models of their covariance.

V = position and attitude of the POS + survey errors + noise of each row. Residuals of one drive
are not white: without V every clean survey is "explained" by some effect, and with one fixed V
nearly half of those whose drift merely has another shape. The position errs by one process of the
stated sigma(t), the attitude by one of its own; scale, shape, and how far the POS errs beyond its
sigma in each stretch in which that is raised, are open. So V is a family of ErrorModels with prior
weights, to be averaged over.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from mlscorr.gap.evidence.settings import SETTINGS


@dataclass(frozen=True)
class ErrorModel:
    """One covariance V: factors on what is believed, and what is added to it.

    Parameters
    ----------
    scale : float
        On the sigmas of the position.
    family : str
        Of the position's error.
    time : float
        On its correlation time.
    attitude : tuple of (scale, family, time)
        The same of the attitude.
    raised : tuple of float
        Further factor on the position's sigma in each stretch in which that is raised; one in
        stretches that it doesn't name.
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
    attitude: tuple[float, str, float] = (1.0, "matern32", 1.0)
    raised: tuple[float, ...] = ()
    noise: float = 1.0
    fixes: float = 0.0
    weight: float = 1.0
    windows: tuple[tuple[float, float, float, str], ...] = ()


STATED = ErrorModel()


def shares(score: np.ndarray) -> np.ndarray:
    """Probabilities (n,) that add up to one, of their logs up to a constant of any size.

    Parameters
    ----------
    score : (n,) array
    """
    share = np.exp(score - score.max())
    return share / share.sum()


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
    """Those within the belief whose attitude errs as the position does; weights sum to one."""
    return tuple(
        ErrorModel(scale, family, time, (scale, family, time), weight=share)
        for (scale, family, time), share in _processes()
    )


def _processes():
    """Pairs of (scale, family, time) and prior weight."""
    scales = np.asarray(SETTINGS.pos_scales)
    share = np.exp(-0.5 * (np.log(scales) / SETTINGS.scale_spread) ** 2)
    for family, time, weight in SETTINGS.shapes:
        for scale, part in zip(scales, share / share.sum(), strict=True):
            yield (float(scale), family, time), float(part * weight)


def shaped_models(scale: float = 1.0, fixes: float = 0.0) -> list[ErrorModel]:
    """One of each shape.

    Parameters
    ----------
    scale : float
        On the POS's sigmas.
    fixes : float
        Sigma of noise of GNSS fixes. Units: m.
    """
    return [
        ErrorModel(scale, family, time, (scale, family, time), fixes=fixes, weight=weight)
        for family, time, weight in SETTINGS.shapes
    ]


def varied_models(stretches: int) -> Iterator[Callable]:
    """Functions that vary a model: its attitude, its noise, each stretch of raised sigma, and last
    what lies between the steps of scales and shapes, wider than data may leave.

    Each takes the best model so far and returns models to be tried.

    Parameters
    ----------
    stretches : int
        Number of those in which sigma is raised.
    """
    yield lambda best: [
        replace(best, attitude=process, weight=best.weight * share)
        for process, share in _processes()
    ]
    yield lambda best: [
        replace(best, noise=noise, weight=best.weight * share)
        for noise, share in SETTINGS.noise_scales
    ]
    for number in range(stretches):
        yield lambda best, number=number: [
            replace(
                best,
                raised=(
                    *(*best.raised, *[1.0] * number)[:number],
                    factor,
                    *best.raised[number + 1 :],
                ),
                weight=best.weight * share,
            )
            for factor, share in SETTINGS.raised
        ]
    yield nearby_models


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
