"""Sizes from which on noise is detected: where its expected evidence is that of a detectable bias.

A bias of d sigmas has a log evidence of d^2 / 2 at its best. Noise is measured by the same, with
all that its evidence allows for: another drift, rows that are noisier, roughness and return rates
that are off everywhere. It is large where it can't be taken for these.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from threadpoolctl import threadpool_limits

from mlscorr.gap.evidence._error_models import error_models
from mlscorr.gap.evidence._noise import CHANNELS, channel_evidence, channel_means, draw_channels
from mlscorr.gap.evidence.observations import Observations, model_likelihood
from mlscorr.gap.evidence.settings import SETTINGS
from mlscorr.gap.residuals import Rows, with_loss_variance
from mlscorr.gap.signatures import Signature

DRAWS = 8  # of noisy residuals: the evidence of 4 sigmas scatters by 4, the mean of 8 by a sixth
DOUBLINGS = 12  # of the usual size, up and down: 1 um of range noise to 20 m


# Hundreds of products of small matrices, as in weigh_labels.
@threadpool_limits.wrap(limits=1, user_api="blas")
def detectable_size(
    rows: Rows, observations: Observations, kind: Signature, mdb: float = 1.0
) -> float:
    """Size of a random effect that shows as a bias of so many minimal detectable ones would.

    Parameters
    ----------
    rows : Rows
        Their residuals say what else scatters.
    observations : Observations
        Of these.
    kind : Signature
        Of the random effect.
    mdb : float
        In minimal detectable biases.

    Returns
    -------
    size : float
        In the effect's unit, within a fifth; nan where none within 4 000 times the usual one is.
    """
    if channel_means(rows, kind, kind.typical).any():
        shown = _channels
    else:
        shown = _metric
    bias_evidence = 0.5 * (mdb * SETTINGS.detectable) ** 2

    def excess(doublings):
        evidence = shown(rows, observations, kind, kind.typical[0] * 2.0**doublings)
        return np.log(max(evidence / bias_evidence, np.finfo(float).tiny))

    at = excess(doublings := 0)
    way = -1 if at > 0 else 1
    while ((after := excess(doublings + way)) > 0) == (at > 0):
        at = after
        doublings = doublings + way
        if abs(doublings) == DOUBLINGS:
            return np.nan
    return float(kind.typical[0] * 2.0 ** (doublings + way * at / (at - after)))


def _channels(rows, _observations, kind, size):
    """Expected log evidence by roughness and return rate.

    What the residuals scatter by is taken with both signs: their product with the mean, which is
    chance, falls out of the sum of the two.
    """
    mean = np.zeros(len(rows))
    residual = draw_channels(rows, None, 0)
    here = np.isin(rows.channel, CHANNELS)
    mean[here] = channel_means(rows, kind, np.array([size]))[0]
    values = np.hstack([mean[here, None] + residual, mean[here, None] - residual])
    acted = with_loss_variance(replace(rows, residual=rows.residual + mean))
    return channel_evidence(acted, kind, np.array([size]), values).mean()


def _metric(rows, observations, kind, size):
    """Expected log evidence by the scatter of residuals in m, over draws of such."""
    rng = np.random.default_rng(0)  # the same draws at each size, so that the evidence is smooth
    residual = observations.columns(rows.residual[:, None])
    calm = _best(observations, residual)
    own = size**2 * kind.variance[observations.row] * observations.half
    acting, extra = (replace(calm, fixes=size), 0.0) if kind.is_common else (calm, own)
    drawn = observations.whitener(acting, extra).draw(rng, DRAWS)
    other = _best(observations, drawn)
    with_it = model_likelihood(observations, acting, drawn, extra)
    without = [
        model_likelihood(observations, replace(other, noise=noise), drawn) + np.log(share)
        for noise, share in SETTINGS.noise_scales
    ]
    return float(np.mean(with_it - np.logaddexp.reduce(without, axis=0)))


def _best(observations, residual):
    """The ErrorModel that explains all columns of residuals best."""
    models = error_models()
    return max(models, key=lambda m: model_likelihood(observations, m, residual).sum())
