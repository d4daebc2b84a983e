"""Which covariances count: Settings that explain the residuals, whatever may act on them."""

import numpy as np

from mlscorr.gap.background import nearby
from mlscorr.gap.evidence import log_likelihood
from mlscorr.gap.whitening import Whitener, whitener

KEPT = 1e-3  # share of the best Setting's weight below which a Setting doesn't count
MOST = 8  # Settings kept
FREE = 0.3  # m: prior sigma of what is accepted or absorbed


def relevant(epochs, choice, residual, nuisances):
    """Those Settings, and some near the best, that count.

    Parameters
    ----------
    epochs : Epochs
    choice : tuple of Setting
    residual : (n, 1) array
    nuisances : list of (n, q) arrays
        What may act: a Setting counts if it does so with any of them.
    """
    tried = [epochs.with_shared(FREE * nuisance) for nuisance in nuisances]
    known = {setting: _likelihoods(tried, setting, residual) for setting in choice}
    for number, one in enumerate(tried):
        for setting in nearby(max(known, key=lambda s: known[s][number])):
            told = np.full(len(tried), -np.inf)
            told[number] = _likelihoods([one], setting, residual)[0]
            known[setting] = np.maximum(told, known.get(setting, -np.inf))
    score = np.array(list(known.values()))
    below = (score - score.max(axis=0)).max(axis=1)
    order = np.argsort(-below, kind="stable")[:MOST]
    several = tuple(known)
    return tuple(several[i] for i in order if below[i] > np.log(KEPT))


def _likelihoods(several, setting, residual):
    """`likelihood` for Epochs that differ in their shared errors alone."""
    solver = whitener(several[0], setting).solver
    factors = [Whitener(epochs, solver) for epochs in several]
    told = [log_likelihood(factor.whiten(residual), factor)[0] for factor in factors]
    return np.log(setting.weight) + np.array(told)


def likelihood(epochs, setting, residual):
    """Log of a Setting's weight times the likelihood of a residual (n, 1)."""
    factor = whitener(epochs, setting)
    return float(np.log(setting.weight) + log_likelihood(factor.whiten(residual), factor)[0])


def nuisance(observed, columns):
    """Columns of all effects that are no events, and of what changes slowly with time."""
    many = {}
    for block in columns.blocks:
        many.setdefault(block.label, set()).add(block.member)
    use = [b.columns for b in columns.blocks if len(many[b.label]) == 1]
    use = np.unique(np.concatenate([np.zeros(0, dtype=int), *use]))
    time = observed.gps_time - observed.gps_time[0]
    wave = np.arange(12) * np.pi * time[:, None] / max(time[-1], 1e-9)
    slow = (np.cos(wave)[:, :, None] * observed.place[:, None]).reshape(len(observed), -1)
    return observed.columns(columns.columns[:, use]), slow
