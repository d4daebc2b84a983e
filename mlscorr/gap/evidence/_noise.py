"""Noise classes: errors that are noisier, or otherwise correlated, than in the simulator.

They affect the covariance of the metric rows, the roughness of patches and the share of returning
pulses, and are tried before any systematic effect. Noise is detectable if its expected log evidence
is at least d^2 / 2, like that of a bias of d sigmas, allowing for other drift, noisier rows, and
common offsets of roughness and return rates.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from threadpoolctl import threadpool_limits

from mlscorr.effects import PositionNoise
from mlscorr.gap.evidence.evidence import BlockEvidence
from mlscorr.gap.evidence.observations import (
    ErrorModel,
    Observations,
    error_models,
    model_likelihood,
    shaped_models,
)
from mlscorr.gap.evidence.settings import SETTINGS
from mlscorr.gap.evidence.tails import MixtureFit, fit_mixture
from mlscorr.gap.residuals import Rows, with_loss_variance
from mlscorr.gap.signatures import Signature

CHANNELS = ("roughness", "return_rate")
DRAWS = 8  # of noisy residuals: evidence of 4 sigmas scatters by 4, the mean of 8 by 1/6
DOUBLINGS = 12  # of the usual size, up and down: 1 um of range noise to 20 m


@dataclass(frozen=True)
class NoiseEvidence:
    """Log evidence over none of one noise class, by size.

    Parameters
    ----------
    label : str
    member : int
        Index of the signature; -1 for a POS with more drift than its sigmas.
    size : (x,) array
        Size of the effect; for such a drift the factor on the sigmas.
    metric : (x, k) array
        Log evidence of k residual columns with that noise, over that of none.
    channels : (x, k) array
        The same for k columns of roughness and return rate.
    """

    label: str
    member: int
    size: np.ndarray
    metric: np.ndarray
    channels: np.ndarray

    @property
    def by_size(self) -> np.ndarray:
        """Log evidence (x, k). Independent noise of rows may already be in their stated
        variance, which comes from the scatter of their points; then only the channels show it.
        """
        metric = self.metric
        if self.member >= 0 and self.channels.any():
            metric = np.logaddexp(np.log(0.5), np.log(0.5) + metric)
        return metric + self.channels

    @property
    def gain(self) -> np.ndarray:
        """Log evidence (k,), averaged over the sizes."""
        return np.logaddexp.reduce(self.by_size, axis=0) - np.log(len(self.size))


def weigh_noise(
    observations: Observations,
    rows: Rows,
    signatures: Sequence[Signature],
    evidence: BlockEvidence,
    residual: np.ndarray,
    channels: np.ndarray,
) -> tuple[NoiseEvidence, ...]:
    """Weigh the evidence of each noise class.

    Parameters
    ----------
    observations, rows, signatures
        All of one survey.
    evidence : BlockEvidence
        Of the same residuals.
    residual : (n, k) array
        Residuals of the observations.
    channels : (q, k) array
        Residuals of the rows without a length unit.
    """
    results = []
    rate = rows.channel == "return_rate"
    for number, signature in enumerate(signatures):
        if not (signature.is_noise or signature.jacobian[rate].any()):
            continue
        coarse = signature.typical[0] * np.asarray(SETTINGS.noise_sizes)
        size = _between(SETTINGS.noise_steps, coarse)
        metric = np.zeros((len(size), residual.shape[1]))
        if signature.is_common:
            size = signature.typical[0] * np.asarray(SETTINGS.fix_sizes)
            models = [shaped_models(1.0, fixes) for fixes in size]
            metric = _by_models(observations, residual, models) - evidence.total
        elif signature.variance[rows.metric].any():
            metric = _own(observations, signature, evidence, residual, coarse)
            metric = np.array([np.interp(np.log(size), np.log(coarse), v) for v in metric.T]).T
        by_channel = channel_evidence(rows, signature, size, channels)
        results.append(NoiseEvidence(signature.name, number, size, metric, by_channel))
    if any(signature.is_common for signature in signatures):
        size = np.asarray(SETTINGS.drift_sizes)
        models = [shaped_models(scale) for scale in size]
        metric = _by_models(observations, residual, models) - evidence.total
        nothing = np.zeros_like(metric)
        results.append(NoiseEvidence(PositionNoise.name, -1, size, metric, nothing))
    return tuple(results)


def noisy_pos_models() -> list[ErrorModel]:
    """Models of a POS that is noisier, or drifts more, than its sigmas."""
    usual = PositionNoise.quantities()["magnitude"].typical
    drift = [model for scale in SETTINGS.drift_sizes for model in shaped_models(scale)]
    fixes = [model for size in SETTINGS.fix_sizes for model in shaped_models(1.0, usual * size)]
    return drift + fixes


def draw_channels(rows: Rows, rng: np.random.Generator | None, number: int) -> np.ndarray:
    """Residuals of the rows without a length unit, and replicas without any effect.

    The replicas have the same scatter and share of outliers as the residuals.

    Parameters
    ----------
    rows : Rows
    rng : numpy.random.Generator
    number : int
        Of replicas.

    Returns
    -------
    channels : (q, 1 + number) array
    """
    here = np.isin(rows.channel, CHANNELS)
    values = rows.residual[here][:, None]
    rough = rows.channel[here] == "roughness"
    if not number:
        return values
    variance = rows.noise[here]
    share = np.zeros(len(values))
    if rough.any():
        fits = _roughness(values[rough], np.zeros(rough.sum()), variance[rough])
        _, variance[rough], best = max(fits, key=lambda fit: fit[2].best[0])
        share[rough] = best.share[0]
    replicas = np.sqrt(variance)[:, None] * rng.standard_normal((len(values), number))
    is_odd = rng.random(replicas.shape) < share[:, None]
    replicas[is_odd] = SETTINGS.odd_span * rng.random(is_odd.sum())
    return np.hstack([values, replicas])


def _between(steps, size):
    """Geometric sequence of sizes with a number of steps between given ones."""
    n = len(size) - 1
    return np.exp(np.interp(np.arange(n * steps + 1) / steps, np.arange(n + 1), np.log(size)))


def _by_models(observations, residual, models):
    """Log evidence (x, k) averaged over each of x lists of models."""
    parts = [[model_likelihood(observations, m, residual) for m in shapes] for shapes in models]
    return np.logaddexp.reduce(parts, axis=1)


def _own(observations, signature, evidence, residual, size):
    """Log evidence (x, k) over none, with the model that explains the first column best."""
    best = int(np.argmax(evidence.none[:, 0]))
    calm = replace(evidence.models[best], noise=1.0)
    variance = signature.variance[observations.row] * observations.half
    return (
        np.array([model_likelihood(observations, calm, residual, x**2 * variance) for x in size])
        - evidence.none[best]
    )


def _channel_means(rows: Rows, signature: Signature, size: np.ndarray) -> np.ndarray:
    """Mean change of the q rows without a length unit by noise of x sizes: (x, q).

    Parameters
    ----------
    rows : Rows
    signature : Signature
        Of the noise.
    size : (x,) array
    """
    here = np.isin(rows.channel, CHANNELS)
    x = np.asarray(size)[:, None]
    growth = signature.growth[here]
    shift = signature.jacobian[here, 0]
    return np.where(rows.channel[here] == "roughness", np.log1p(growth * x**2), x * shift)


def channel_evidence(
    rows: Rows, signature: Signature, size: np.ndarray, values: np.ndarray
) -> np.ndarray:
    """Log evidence (x, k) over none of the rows without a length unit.

    Parameters
    ----------
    rows, signature, size
        See ``channel_means``.
    values : (q, k) array
        Residuals of these rows.
    """
    means = _channel_means(rows, signature, np.append(0.0, size))
    if not means.any():
        return np.zeros((len(size), values.shape[1]))
    here = np.isin(rows.channel, CHANNELS)
    rough = rows.channel[here] == "roughness"
    noise = rows.noise[here]
    likelihood = np.array([_channel_likelihood(values, mean, rough, noise) for mean in means])
    return likelihood[1:] - likelihood[0]


def _channel_likelihood(values, mean, rough, noise):
    """Log likelihood (k,) of roughness and return rates."""
    total = np.zeros(values.shape[1])
    if rough.any():
        parts = [
            np.log(weight * share) + fit.log_likelihood(sigma)
            for weight, _, fit in _roughness(values[rough], mean[rough], noise[rough])
            for sigma, share in SETTINGS.roughness_common
        ]
        total = total + np.logaddexp.reduce(parts, axis=0)
    if (~rough).any():
        fit = fit_mixture(values[~rough], mean[~rough], noise[~rough], 1.0)
        total = total + fit.log_likelihood(SETTINGS.lost)
    return total


def _roughness(values, mean, noise) -> list[tuple[float, np.ndarray, MixtureFit]]:
    """Yield weight, variance (q,) and fit for each scatter between patches."""
    density = 1 / SETTINGS.odd_span
    fits = []
    for sigma, weight in SETTINGS.roughness:
        variance = noise + sigma**2
        fits.append((weight, variance, fit_mixture(values, mean, variance, density)))
    return fits


# Hundreds of products of small matrices, as in weigh_labels.
@threadpool_limits.wrap(limits=1, user_api="blas")
def detectable_size(
    rows: Rows, observations: Observations, kind: Signature, mdb: float = 1.0
) -> float:
    """Size of a random effect that is as detectable as a number of minimal detectable biases.

    Parameters
    ----------
    rows : Rows
        Their residuals give the other scatter.
    observations : Observations
        Of these.
    kind : Signature
        Of the random effect.
    mdb : float
        Number of minimal detectable biases.

    Returns
    -------
    size : float
        In the effect's unit, to 20 %; NaN if there is none up to 4 000 times the usual size.
    """
    if _channel_means(rows, kind, kind.typical).any():
        shown = _channels
    else:
        shown = _metric
    bias_evidence = 0.5 * (mdb * SETTINGS.detectable) ** 2

    def excess(doublings):
        evidence = shown(rows, observations, kind, kind.typical[0] * 2.0**doublings)
        return np.log(max(evidence / bias_evidence, np.finfo(float).tiny))

    at = excess(doublings := 0)
    direction = -1 if at > 0 else 1
    while ((after := excess(doublings + direction)) > 0) == (at > 0):
        at = after
        doublings = doublings + direction
        if abs(doublings) == DOUBLINGS:
            return np.nan
    return float(kind.typical[0] * 2.0 ** (doublings + direction * at / (at - after)))


def _channels(rows, _observations, kind, size):
    """Expected log evidence from roughness and return rate.

    Residuals are used with both signs, so that their random product with the mean cancels.
    """
    mean = np.zeros(len(rows))
    residual = draw_channels(rows, None, 0)
    here = np.isin(rows.channel, CHANNELS)
    mean[here] = _channel_means(rows, kind, np.array([size]))[0]
    values = np.hstack([mean[here, None] + residual, mean[here, None] - residual])
    acted = with_loss_variance(replace(rows, residual=rows.residual + mean))
    return channel_evidence(acted, kind, np.array([size]), values).mean()


def _metric(rows, observations, kind, size):
    """Expected log evidence from the scatter of residuals in m, over random draws."""
    rng = np.random.default_rng(0)  # the same draws at each size, so that the evidence is smooth
    residual = observations.columns(rows.residual[:, None])
    calm = _best(observations, residual)
    own = size**2 * kind.variance[observations.row] * observations.half
    acting = calm
    extra = own
    if kind.is_common:
        acting = replace(calm, fixes=size)
        extra = 0.0
    drawn = observations.whitener(acting, extra).draw(rng, DRAWS)
    other = _best(observations, drawn)
    with_it = model_likelihood(observations, acting, drawn, extra)
    without = [
        model_likelihood(observations, replace(other, noise=noise), drawn) + np.log(share)
        for noise, share in SETTINGS.noise_scales
    ]
    return float(np.mean(with_it - np.logaddexp.reduce(without, axis=0)))


def _best(observations, residual):
    """ErrorModel that explains all columns of residuals best."""
    models = error_models()
    return max(models, key=lambda m: model_likelihood(observations, m, residual).sum())
