"""Heavy tails: single odd rows are given the variance that they show, so that no effect is found
to explain them. A surveyed target that is odd as a whole is left for target_outlier to name."""

import numpy as np

from mlscorr.gap.background import Setting
from mlscorr.gap.whitening import whitener

ODD = 3.5  # sigmas from what all other rows say, under a drift that follows them closely
LIMIT = 3.0  # sigmas that an odd row keeps
MOST = 0.05  # of the rows; more are no tail but an effect
FLEXIBLE = Setting(2.2, "matern32", 0.3, 1.0)


def without_tails(epochs, rows, nuisance):
    """Epochs in which odd observations have more noise, and which rows those are.

    nuisance (n, q) may act: what an effect makes of a row is not odd.
    """
    residual = epochs.columns(rows.residual[:, None])
    weighted, precision = whitener(epochs.with_shared(nuisance), FLEXIBLE).single(residual)
    score = weighted[:, 0] / np.sqrt(precision)
    score /= max(1.0, 1.4826 * np.median(np.abs(score)))  # all of them are off: not single ones
    odd = (np.abs(score) > ODD) & ~_named(epochs, rows, score)
    if odd.sum() > MOST * len(odd):
        odd &= np.abs(score) >= np.sort(np.abs(score[odd]))[-max(1, int(MOST * len(odd)))]
    expected = 1 / precision
    extra = np.where(odd, expected * ((score / LIMIT) ** 2 - 1), 0.0)
    return epochs.with_own(epochs.own + extra), np.unique(epochs.row[odd])


def _named(epochs, rows, score):
    """Which observations (n,) belong to the oddest target, if all passes agree that it is odd."""
    target = rows.survey_item[epochs.row]
    odd = (target >= 0) & (np.abs(score) > ODD)
    if not odd.any():
        return odd
    worst = target[odd][np.argmax(np.abs(score[odd]))]
    mine = target == worst
    axis = np.argmax(np.abs(rows.direction[epochs.row]), axis=1)
    passes = np.unique(rows.item[epochs.row[mine]])
    for one in np.unique(axis[mine & odd]):
        same = mine & (axis == one)
        agree = np.abs(score[same]) > ODD
        if agree.sum() == len(passes) and len(np.unique(np.sign(score[same]))) == 1:
            return mine
    return np.zeros_like(mine)
