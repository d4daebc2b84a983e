"""Evidence of noise classes: what is noisier, or otherwise correlated, than the simulator says.

They show in the covariance of the metric rows, in the roughness of patches and in the share of
pulses that return, and are tried before any systematic effect.
"""

from dataclasses import dataclass, replace

import numpy as np

from mlscorr.effects.vehicle import PositionNoise
from mlscorr.gap.background import SHAPES, Setting
from mlscorr.gap.contaminated import contaminated
from mlscorr.gap.evidence import DRIFT_TRUST, log_likelihood
from mlscorr.gap.whitening import whitener

SIZES = (0.25, 0.5, 1.0, 2.0, 5.0, 12.0)  # of a random effect, times its usual size
BETWEEN = 4  # steps between two of them, in which channels are looked at
BEYOND = (3.3, 5.0, 8.0)  # factors on the POS's sigma that are no belief any more
FIXES = (0.5, 1.0, 2.0, 4.0)  # sigma of noise of GNSS fixes, times position_noise's usual size
SCATTER = ((0.0, 0.5), (0.1, 0.3), (0.3, 0.2))  # of roughness between patches: sigma, weight
COMMON = ((0.05, 0.5), (0.3, 0.5))  # of all patches together: surfaces are no planes
ODD_SPAN = 6.0  # of log variance ratios: from a flat patch's to that of 5 cm about the plane
LOST = 0.005  # share: by which the believed return rate may be off everywhere
FEW = 1  # settings under which noise of the rows' own is tried

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
    def by_size(self):
        """Log evidence (x, k). Noise of a row's own may be in its stated variance already, which
        is taken from the scatter of its points: then only the channels show it."""
        metric = self.metric
        if self.member >= 0 and self.channels.any():
            metric = np.logaddexp(np.log(0.5), np.log(0.5) + metric)
        return metric + self.channels

    @property
    def gain(self):
        """Log evidence (k,), averaged over the sizes; that of drift counts as an event's does."""
        mean = np.logaddexp.reduce(self.by_size, axis=0) - np.log(len(self.size))
        trusted = DRIFT_TRUST if self.label == PositionNoise.name else 1.0
        return np.where(mean > 0, trusted * mean, mean)


def noise_evidence(epochs, rows, signatures, found, residual, channels):
    """Evidence of each noise class, as a tuple of NoiseEvidence.

    Parameters
    ----------
    epochs, rows, signatures
        Of one survey.
    found : Evidence
        Of the same residuals.
    residual : (n, k) array
        Of the Epochs.
    channels : (q, k) array
        Residuals of the rows without a metre.
    """
    total, results = found.total, []
    for number, one in enumerate(signatures):
        shown = _shift(one, rows)
        if not (one.is_noise or shown is not None):
            continue
        size = one.typical[0] * np.asarray(SIZES)
        if one.is_common:
            size = one.typical[0] * np.asarray(FIXES)
            metric = _common(epochs, residual, size) - total
        elif one.variance[rows.metric].any():
            size, coarse = _finer(size), size
            metric = _between(size, coarse, _own(epochs, one, found, residual, coarse))
        else:
            size = _finer(size)
            metric = np.zeros((len(size), residual.shape[1]))
        told = _channels(rows, one, size, channels)
        results.append(NoiseEvidence(one.name, number, size, metric, told))
    if any(one.is_common for one in signatures):
        size = np.asarray(BEYOND)
        metric = np.array([_mean(epochs, residual, _shaped(scale)) for scale in BEYOND]) - total
        results.append(NoiseEvidence("position_noise", -1, size, metric, np.zeros_like(metric)))
    return tuple(results)


def position_settings():
    """Settings of a POS that is noisier, or has larger drift, than its sigmas say."""
    usual = PositionNoise.quantities()["magnitude"].typical
    larger = [one for scale in BEYOND for one in _shaped(scale)]
    return larger + [one for fixes in FIXES for one in _shaped(1.0, usual * fixes)]


def draw_channels(rows, rng, number):
    """Residuals (q, 1 + number) of the rows without a metre, and replicas without any effect:
    as scattered as these residuals are, and as many of them odd."""
    here = np.isin(rows.channel, CHANNELS)
    values, rough = rows.residual[here][:, None], rows.channel[here] == "roughness"
    if not number:
        return values
    variance, share = rows.noise[here], np.zeros(len(values))
    if rough.any():
        several = _roughness(values[rough], np.zeros(rough.sum()), variance[rough])
        _, variance[rough], best = max(several, key=lambda each: each[2].best[0])
        share[rough] = best.share[0]
    drawn = np.sqrt(variance)[:, None] * rng.standard_normal((len(values), number))
    odd = rng.random(drawn.shape) < share[:, None]
    drawn[odd] = ODD_SPAN * rng.random(odd.sum())
    return np.hstack([values, drawn])


def _finer(size):
    """Sizes with BETWEEN steps from each to the next."""
    n = (len(size) - 1) * BETWEEN
    return np.exp(np.interp(np.arange(n + 1) / BETWEEN, np.arange(len(size)), np.log(size)))


def _between(size, coarse, values):
    """Values (c, k) at coarse sizes, at finer ones."""
    at = np.log(size), np.log(coarse)
    return np.array([np.interp(*at, column) for column in values.T]).T


def _shaped(scale=1.0, fixes=0.0):
    """Settings of all shapes."""
    return [Setting(scale, *shape[:3], 1.0, fixes, shape[3]) for shape in SHAPES]


def _common(epochs, residual, size):
    return np.array([_mean(epochs, residual, _shaped(1.0, fixes)) for fixes in size])


def _mean(epochs, residual, settings, extra=0.0):
    """Log evidence (k,) averaged over settings."""
    parts = []
    for setting in settings:
        factor = whitener(epochs, setting, extra)
        parts.append(np.log(setting.weight) + log_likelihood(factor.whiten(residual), factor))
    return np.logaddexp.reduce(parts, axis=0)


def _own(epochs, one, found, residual, size):
    """Log evidence (x, k) over none, each under the settings that explain the first column best."""
    best = np.argsort(-found.none[:, 0])[:FEW]
    settings = [found.settings[s] for s in best]
    calm = [replace(s, noise=1.0) for s in settings]
    base = np.logaddexp.reduce(found.none[best], axis=0)
    variance = one.variance[epochs.row] * epochs.half
    return np.array([_mean(epochs, residual, calm, x**2 * variance) - base for x in size])


def _shift(one, rows):
    """Derivative (m,) of the return rate, or None."""
    rate = rows.channel == "return_rate"
    return one.jacobian[:, 0] if one.jacobian[rate].any() else None


def _channels(rows, one, size, values):
    """Log evidence (x, k) of the rows without a metre, over none."""
    here = np.isin(rows.channel, CHANNELS)
    if not (one.growth[here].any() or one.jacobian[here].any()):
        return np.zeros((len(size), values.shape[1]))
    rough = rows.channel[here] == "roughness"
    noise, growth, shift = rows.noise[here], one.growth[here], one.jacobian[here, 0]
    told = []
    for x in (0.0, *size):
        mean = np.where(rough, np.log1p(growth * x**2), x * shift)
        told.append(_channel_likelihood(values, mean, rough, noise))
    return np.array(told[1:]) - told[0]


def _channel_likelihood(values, mean, rough, noise):
    """Log likelihood (k,) of roughness and return rates."""
    total = np.zeros(values.shape[1])
    if rough.any():
        parts = [
            np.log(weight * v) + fitted.log_likelihood(common)
            for weight, _, fitted in _roughness(values[rough], mean[rough], noise[rough])
            for common, v in COMMON
        ]
        total = total + np.logaddexp.reduce(parts, axis=0)
    if (~rough).any():
        told = contaminated(values[~rough], mean[~rough], noise[~rough], 1.0)
        total = total + told.log_likelihood(LOST)
    return total


def _roughness(values, mean, noise):
    """Weight, variance (q,) and Fitted under each SCATTER."""
    for scatter, weight in SCATTER:
        variance = noise + scatter**2
        yield weight, variance, contaminated(values, mean, variance, 1 / ODD_SPAN)
