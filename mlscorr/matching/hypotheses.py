"""Hypotheses of who is who, followed along the drive with a Kalman filter each.

A hypothesis names a control point, or none, for each observation so far; its weight is its
probability density, and its state what the named ones say of the misclosure. Unlikely hypotheses
are dropped, and those that differ only long ago are merged (multiple hypothesis tracking, Reid
1979).
"""

from dataclasses import dataclass

import numpy as np

VISIT = 2.0  # s: one control point is seen once within it, as the extraction splits visits
MOVED = 0.05  # of the surveyed points lie elsewhere than their targets: marks kicked, numbers mixed
MOVED_BY = 1.0  # m, one sigma per axis of that
EXCHANGED = 0.03  # of them have another's kind or size: names exchanged, or taken down wrong
MOST = 40  # hypotheses per belief
LEAST = -16.0  # log weight against the best: 1e-7
REMEMBERED = 4  # matches back; hypotheses that agree in them are merged
RESTARTS = 200.0  # s from one to the next: outages of GNSS end and signals are lost minutes apart
LEAST_STEP = 0.1  # s, so that every belief stays among the hypotheses
RESTARTED = 3  # hypotheses, the best ones, for which a restart is followed
KEPT = 12  # of each side, when past and future are joined
HASH = np.random.default_rng(0).integers(1, 2**62, 64)  # to compare rows of numbers at once


@dataclass(frozen=True)
class Hypotheses:
    """b hypotheses of several beliefs at one observation, before it is used.

    Parameters
    ----------
    belief : (b,) int array
    weight : (b,) array
        Logarithms.
    mean : (b, 3, 3) array
        Of c, s and its rate (last axis) per map axis.
    covariance : (b, 3, 3, 3) array
        Of these per map axis.
    used : (b, w) int array
        Control points of the observations in ``window`` (w,), those of the last two seconds; -1
        for none.
    history : (b, REMEMBERED) int array
        The last pairs.
    """

    belief: np.ndarray
    weight: np.ndarray
    mean: np.ndarray
    covariance: np.ndarray
    used: np.ndarray
    window: np.ndarray
    history: np.ndarray

    def __len__(self):
        return len(self.weight)

    def __getitem__(self, rows):
        return Hypotheses(
            self.belief[rows],
            self.weight[rows],
            self.mean[rows],
            self.covariance[rows],
            self.used[rows],
            self.window,
            self.history[rows],
        )


def walk(chain, order):
    """Hypotheses before each observation in an order of rows.

    Yields (row, Hypotheses) for each, and at last (None, Hypotheses) after all of them.
    """
    now = _start(chain)
    last = None
    for row in order:
        if last is not None:
            now = _predict(now, chain, last, row)
        yield row, now
        now = _use(now, chain, row)
        last = row
    yield None, now


def log_likelihoods(now, chain, row):
    """Log densities (b, 2 k + 1) of what an observation is, by the misclosures of its k pairs.

    First its being each pair's target, then its being a target whose surveyed point lies elsewhere,
    at last its being none of them. A pair that isn't alike may be a target taken down wrong.
    """
    pairs = chain.pairs.of(row)
    gain = chain.gain[now.belief, row]
    value, variance = displacement(now.mean, now.covariance, gain)
    variance = (variance + chain.noise[now.belief, row])[:, None] + chain.pair_variance[pairs]
    square = (chain.pairs.misclosure[pairs] - value[:, None]) ** 2
    alike = chain.pairs.alike[pairs]
    share = np.where(alike, 1.0 - MOVED - EXCHANGED, EXCHANGED)
    sound = _log_normal(square, variance) + np.log(share)
    moved = _log_normal(square, variance + MOVED_BY**2) + np.log(MOVED)
    moved[:, ~alike] = -np.inf
    used = taken(now, chain, row)
    sound[used], moved[used] = -np.inf, -np.inf
    return np.column_stack([sound, moved, np.full(len(now), chain.otherwise[row])])


def _log_normal(square, variance):
    return -0.5 * (square / variance + np.log(2 * np.pi * variance)).sum(axis=2)


def displacement(mean, covariance, gain):
    """Misclosure (b, 3) by the states, and its variance without noise. Units: m, m^2."""
    value = mean[..., 0] + gain * mean[..., 1]
    both = covariance[..., 0, 0] + 2 * gain * covariance[..., 0, 1]
    return value, both + gain**2 * covariance[..., 1, 1]


def taken(now, chain, row):
    """Which pairs of an observation name a point that its hypothesis uses already: (b, k)."""
    control = chain.pairs.control[chain.pairs.of(row)]
    same_pass = chain.pass_number[now.window] == chain.pass_number[row]
    used = now.used[:, same_pass]
    return (used[:, None, :] == control[:, None]).any(axis=2)


def best_of_each(belief, weight, most):
    """Rows with the largest weights of each belief, at most so many, that aren't negligible."""
    order = np.lexsort((-weight, belief))
    first = np.searchsorted(belief[order], belief[order])
    rank = np.arange(len(order)) - first
    near = weight[order] - weight.max() >= LEAST
    return order[(rank < most) & near]


def _start(chain):
    b = len(chain.rate)
    return Hypotheses(
        belief=np.arange(b),
        weight=np.zeros(b),
        mean=np.zeros((b, 3, 3)),
        covariance=np.tile((chain.prior[:, :, None] * np.eye(3))[:, None], (1, 3, 1, 1)),
        used=np.empty((b, 0), int),
        window=np.empty(0, int),
        history=np.full((b, REMEMBERED), -1),
    )


def _predict(now, chain, last, row):
    """The hypotheses at the next observation: the drift went on, or started anew in any belief."""
    dt = max(abs(chain.gps_time[row] - chain.gps_time[last]), LEAST_STEP)
    stays = np.exp(-dt / RESTARTS)
    on = _go_on(now, chain, last, row)
    best = np.argsort(-on.weight)[:RESTARTED]
    m = len(chain.rate)
    parent, belief = np.repeat(best, m), np.tile(np.arange(m), len(best))
    mean, covariance = np.zeros((len(parent), 3, 3)), np.zeros((len(parent), 3, 3, 3))
    mean[..., 0] = on.mean[parent, :, 0]
    covariance[..., 0, 0] = on.covariance[parent, :, 0, 0]
    covariance[..., 1:, 1:] = (chain.prior[belief, :, None] * np.eye(3))[:, None, 1:, 1:]
    anew = on.weight[parent] + np.log((1.0 - stays) / m)
    return Hypotheses(
        np.append(on.belief, belief),
        np.append(on.weight + np.log(stays), anew),
        np.concatenate([on.mean, mean]),
        np.concatenate([on.covariance, covariance]),
        np.vstack([on.used, on.used[parent]]),
        on.window,
        np.vstack([on.history, np.full((len(parent), REMEMBERED), -2)]),
    )


def _go_on(now, chain, last, row):
    matrix, noise = (part[now.belief][:, None] for part in chain.transition(last, row))
    recent = np.abs(chain.gps_time[now.window] - chain.gps_time[row]) <= VISIT
    return Hypotheses(
        now.belief,
        now.weight,
        (matrix @ now.mean[..., None])[..., 0],
        matrix @ now.covariance @ matrix.swapaxes(-1, -2) + noise,
        now.used[:, recent],
        now.window[recent],
        now.history,
    )


def _use(now, chain, row):
    """The hypotheses after an observation: each branches into its pairs and none."""
    pairs = chain.pairs.of(row)
    k = pairs.stop - pairs.start
    weight = now.weight[:, None] + log_likelihoods(now, chain, row)
    kept = best_of_each(np.repeat(now.belief, 2 * k + 1), weight.ravel(), 4 * MOST)
    parent, choice = np.divmod(kept, 2 * k + 1)
    known = choice < 2 * k
    pair = np.where(known, pairs.start + choice % max(k, 1), -1)
    control = np.append(chain.pairs.control, -1)[pair]
    before = now[parent]
    mean, covariance = before.mean.copy(), before.covariance.copy()
    extra = np.where(choice < k, 0.0, MOVED_BY**2)[known]
    mean[known], covariance[known] = _update(before[known], chain, row, pair[known], extra)
    shifted = np.column_stack([before.history[:, 1:], pair])
    after = Hypotheses(
        before.belief,
        weight.ravel()[kept],
        mean,
        covariance,
        np.column_stack([before.used, control]),
        np.append(before.window, row),
        np.where((choice < k)[:, None], shifted, before.history),
    )
    merged = _merge(after)
    return merged[best_of_each(merged.belief, merged.weight, MOST)]


def _update(before, chain, row, pair, extra):
    """States after their hypotheses' pairs were used, with extra variances (m^2)."""
    gain = chain.gain[before.belief, row]
    value, variance = displacement(before.mean, before.covariance, gain)
    variance = variance + chain.noise[before.belief, row] + chain.pair_variance[pair]
    variance = variance + extra[:, None]
    cross = before.covariance[..., 0] + gain[..., None] * before.covariance[..., 1]
    weight = cross / variance[..., None]
    away = chain.pairs.misclosure[pair] - value
    covariance = before.covariance - weight[..., :, None] * cross[..., None, :]
    return before.mean + weight * away[..., None], covariance


def _merge(after):
    """One of those that agree in the last pairs and the last seconds, with their weights' sum."""
    if len(after) < 2:
        return after
    key = np.column_stack([after.belief, after.history, after.used])
    numbers = np.resize(HASH, key.shape[1]) * np.arange(1, key.shape[1] + 1)
    _, first, of = np.unique((key + 3) @ numbers, return_index=True, return_inverse=True)
    if len(first) == len(after):
        return after
    best = np.full(len(first), -np.inf)
    np.maximum.at(best, of, after.weight)
    total = best + np.log(np.bincount(of, np.exp(after.weight - best[of])))
    order = np.lexsort((-after.weight, of))
    heaviest = order[np.searchsorted(of[order], np.arange(len(first)))]
    merged = after[heaviest]
    return Hypotheses(
        merged.belief,
        total,
        merged.mean,
        merged.covariance,
        merged.used,
        merged.window,
        merged.history,
    )
