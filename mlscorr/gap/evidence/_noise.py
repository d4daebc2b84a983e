"""Evidence of noise classes: what is noisier, or otherwise correlated, than the simulator says.

They show in the covariance of the metric rows, in the roughness of patches and in the share of
pulses that return, and are tried before any systematic effect.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from mlscorr.effects import PositionNoise
from mlscorr.gap.evidence._error_models import ErrorModel, shaped_models
from mlscorr.gap.evidence.evidence import BlockEvidence
from mlscorr.gap.evidence.observations import Observations, model_likelihood
from mlscorr.gap.evidence.settings import SETTINGS
from mlscorr.gap.evidence.tails import MixtureFit, fit_mixture
from mlscorr.gap.residuals import Rows
from mlscorr.gap.signatures import Signature

CHANNELS = ("roughness", "return_rate")


@dataclass(frozen=True)
class NoiseEvidence:
    """Log evidence over none of one noise class, by size.

    Parameters
    ----------
    label : str
    member : int
        Which of the signatures; -1 for a POS whose drift is larger than its sigmas say.
    size : (x,) array
        Of the effect; of such a drift the factor on the sigmas.
    metric : (x, k) array
        Of k residual columns: log evidence with that much noise, over that of none.
    channels : (x, k) array
        Of the k columns of roughness and return rate, likewise.
    """

    label: str
    member: int
    size: np.ndarray
    metric: np.ndarray
    channels: np.ndarray

    @property
    def by_size(self) -> np.ndarray:
        """Log evidence (x, k). Noise of a row's own may be in its stated variance already, which
        is taken from the scatter of its points: then only the channels show it.
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
    """Evidence of each noise class.

    Parameters
    ----------
    observations, rows, signatures
        Of one survey.
    evidence : BlockEvidence
        Of the same residuals.
    residual : (n, k) array
        Of the observations.
    channels : (q, k) array
        Residuals of the rows without a metre.
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
    """Of a POS that is noisier, or has larger drift, than its sigmas say."""
    usual = PositionNoise.quantities()["magnitude"].typical
    drift = [model for scale in SETTINGS.drift_sizes for model in shaped_models(scale)]
    fixes = [model for size in SETTINGS.fix_sizes for model in shaped_models(1.0, usual * size)]
    return drift + fixes


def draw_channels(rows: Rows, rng: np.random.Generator | None, number: int) -> np.ndarray:
    """Residuals of the rows without a metre, and replicas without any effect.

    These are as scattered as the residuals are, and as many of them odd.

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
    """Sizes with so many steps from each to the next, evenly by their logs."""
    n = len(size) - 1
    return np.exp(np.interp(np.arange(n * steps + 1) / steps, np.arange(n + 1), np.log(size)))


def _by_models(observations, residual, models):
    """Log evidence (x, k) averaged over each of x lists of models."""
    parts = [[model_likelihood(observations, m, residual) for m in shapes] for shapes in models]
    return np.logaddexp.reduce(parts, axis=1)


def _own(observations, signature, evidence, residual, size):
    """Log evidence (x, k) over none, under the model that explains the first column best."""
    best = int(np.argmax(evidence.none[:, 0]))
    calm = replace(evidence.models[best], noise=1.0)
    variance = signature.variance[observations.row] * observations.half
    return (
        np.array([model_likelihood(observations, calm, residual, x**2 * variance) for x in size])
        - evidence.none[best]
    )


def channel_means(rows: Rows, signature: Signature, size: np.ndarray) -> np.ndarray:
    """What noise of x sizes makes of the q rows without a metre on average: (x, q).

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
    """Log evidence (x, k) over none of the rows without a metre.

    Parameters
    ----------
    rows, signature, size
        As in ``channel_means``.
    values : (q, k) array
        Residuals of these rows.
    """
    means = channel_means(rows, signature, np.append(0.0, size))
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
    """Weight, variance (q,) and fit under each scatter between patches."""
    density = 1 / SETTINGS.odd_span
    fits = []
    for sigma, weight in SETTINGS.roughness:
        variance = noise + sigma**2
        fits.append((weight, variance, fit_mixture(values, mean, variance, density)))
    return fits
