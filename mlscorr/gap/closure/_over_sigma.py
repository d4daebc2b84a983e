"""Errors over the sigma that the simulator gives them: one when it is right, whatever its size."""

from dataclasses import dataclass

import numpy as np

from mlscorr.gap.closure.folds import Folds
from mlscorr.gap.evidence import (
    AXES,
    SETTINGS,
    Observations,
    Predicted,
    simulated_variance,
    window_growth,
)
from mlscorr.gap.residuals import Rows


@dataclass(frozen=True)
class OverSigma:
    """RMS of errors over their simulated sigma, by axis, before and after a cause is added.

    Parameters
    ----------
    axes : tuple of str
        E, N, H; those that rows have. Where the cause is a POS that is worse in windows, in these.
    before, after : tuple of float
    largest : tuple of float
        What 97.5 % of surveys stay below in which nothing else is wrong.
    """

    axes: tuple[str, ...]
    before: tuple[float, ...]
    after: tuple[float, ...]
    largest: tuple[float, ...]

    @property
    def beyond(self) -> tuple[str, ...]:
        """Axes whose errors after it are larger than chance makes them, and than 1.96 sigma."""
        pairs = zip(self.axes, self.after, self.largest, strict=True)
        usual = SETTINGS.quantile
        return tuple(axis for axis, after, chance in pairs if after > max(chance, usual))


def errors_over_sigma(
    rows: Rows, observations: Observations, folds: Folds, rng: np.random.Generator
) -> OverSigma:
    """OverSigma of the rows along an axis of the map, by sizes found without them.

    Not of planes of two passes: where they are is free, which outweighs all that passes differ by.

    Parameters
    ----------
    rows : Rows
    observations : Observations
        Of these.
    folds : Folds
    rng : numpy.random.Generator
        Draws replicas.
    """
    o = observations
    after = folds.whole
    residual = rows.residual[:, None]
    shift = folds.held("shift")[:, None]
    nothing = Predicted.nothing(rows)
    scaled = [
        o.columns(values) / _sigma(o, predicted)[:, None]
        for values, predicted in ((residual, nothing), (residual - shift, after))
    ]
    scaled.append(o.whitener(after.model).draw(rng, SETTINGS.replicas) / _sigma(o, after)[:, None])
    axis = rows.covariates["axis"][o.row]
    inside = window_growth(after.model.windows, o.errors.gps_time)[:, 0] > 0
    here = ~rows.two_times[o.row] & (inside | (not after.model.windows))
    parts = [(name, here & (axis == number)) for number, name in enumerate(AXES)]
    parts = [(name, part) for name, part in parts if part.any()]
    values = [[np.sqrt((v[part] ** 2).mean(axis=0)) for v in scaled] for _, part in parts]
    return OverSigma(
        tuple(name for name, _ in parts),
        tuple(float(before[0]) for before, _, _ in values),
        tuple(float(after[0]) for _, after, _ in values),
        tuple(float(np.percentile(v, SETTINGS.band[1])) for *_, v in values),
    )


def _sigma(observations, predicted):
    """Simulated sigma (n,) of observations. Units: m."""
    return np.sqrt(simulated_variance(observations, predicted.model, predicted.extra))
