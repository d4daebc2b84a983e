"""Surveys of the same geometry in which nothing acts, and how often they look as this one does."""

import numpy as np

from mlscorr.gap.evidence import TRUST
from mlscorr.gap.weighing import likelihood
from mlscorr.gap.whitening import whitener


def replicate(observed, choice, residual, rng, number):
    """Residuals (n, number) in which nothing acts, under Settings as probable as they are, with
    tails as these have. Their evidence counts by TRUST here too: the drift has another shape."""
    factors = [whitener(observed, setting) for setting in choice]
    score = TRUST * np.array([likelihood(observed, setting, residual) for setting in choice])
    share = np.exp(score - np.logaddexp.reduce(score))
    count = rng.multinomial(number, share / share.sum())
    tails = factors[np.argmax(score)].innovations(residual)[0][:, 0]
    drawn = [f.draw(rng, c, tails) for f, c in zip(factors, count, strict=True)]
    return np.hstack(drawn)


def p_value(score):
    """Probability of scores against none as high as the first column's when nothing acts.

    By replicas; beyond the highest ones by the exponential tail that the upper fifth of them has.
    """
    against = np.logaddexp.reduce([v for k, v in score.items() if k != "none"], axis=0)
    mine, replicas = against[0], np.sort(against[1:])
    if len(replicas) == 0:
        return float("nan")
    upper = replicas[int(0.8 * len(replicas)) :]
    if mine <= upper[0] or len(upper) < 3:
        return float((1 + (replicas >= mine).sum()) / (1 + len(replicas)))
    scale = max(upper.mean() - upper[0], 0.5)
    return float(len(upper) / len(replicas) * np.exp(-(mine - upper[0]) / scale))
