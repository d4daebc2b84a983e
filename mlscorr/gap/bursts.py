"""Windows of time in which the POS is worse than it says, as it is without GNSS.

Inside a window its position has a further error. Windows and sizes come from a bank, over which
the evidence is averaged: the price of having looked often. Where one stands out it is refined, and
others are looked for beside it.
"""

from dataclasses import dataclass, replace

import numpy as np

from mlscorr.effects.vehicle import PositionNoise
from mlscorr.gap.background import BELIEVED, Setting, settings
from mlscorr.gap.evidence import log_likelihood
from mlscorr.gap.noise import NoiseEvidence
from mlscorr.gap.whitening import whitener

LENGTHS = (10.0, 20.0, 40.0, 80.0)  # s: from an underpass to a tunnel or a street of high houses
FACTORS = (4.0, 12.0, 36.0)  # on sigma: more than a belief's scale, up to metres of a cheap IMU
# In real time an error grows until GNSS is back; smoothed, to the middle. A single one of the
# latter is position_bump, an effect: as a cause of noise it counts beside other windows alone.
RISE, HUMP = SHAPES = ("rise", "hump")
FEWEST = 3  # moments at which something was seen, in a window and outside of it
TRIED = 8  # windows in which the residuals are largest; each replica adds its largest
WORTH = 5.0  # least log evidence of a window that is refined
AGAIN = 0.5  # prior probability of one more window, given some
MOST = 12  # windows
CELL = 3.0  # refined, a window fills a third of its cell of the bank, as events do
START, END, FACTOR = range(3)  # of a window
STEPS = (0.25, 0.12, 0.06)  # of a window's start and end, in its length
ROUNDS = 3  # with each: what suits the start may not suit the factor any more


@dataclass(frozen=True)
class BurstEvidence(NoiseEvidence):
    """Log evidence over none of a POS that is worse in windows; size is the factor.

    Parameters
    ----------
    bursts : tuple of (start, length, factor, shape)
        The most probable windows. Units: s, s, ratio.
    """

    bursts: tuple[tuple[float, float, float, str], ...] = ()


def with_bursts(noise):
    """Settings with the windows that were found, a list."""
    found = [one.bursts for one in noise if isinstance(one, BurstEvidence)]
    return [replace(one, bursts=bursts) for bursts in found for one in settings()]


def burst_evidence(epochs, found, residual):
    """Tuple of the BurstEvidence of residual columns (n, k); empty where nothing can hold windows.

    Parameters
    ----------
    epochs : Epochs
    found : Evidence
        Of the same residuals.
    residual : (n, k) array
    """
    bank = _bank(epochs.gps_time)
    if not bank:
        return ()
    score = _excess(epochs, residual, (), bank)
    base = found.settings[int(np.argmax(found.none[:, 0]))]
    mine = np.argsort(-score[:, 0], kind="stable")[:TRIED]
    chosen = np.append(mine, np.setdiff1d(np.argmax(score, axis=0), mine))
    told = np.array(
        [
            [_score(epochs, residual, base, ((*bank[i], factor, RISE),)) for i in chosen]
            for factor in FACTORS
        ]
    )
    best = np.unravel_index(np.argmax(told[:, :, 0]), told.shape[:2])
    bursts = ((*bank[chosen[best[1]]], FACTORS[best[0]], RISE),)
    metric = np.logaddexp.reduce(told - found.total, axis=1) - np.log(len(bank) * len(SHAPES))
    if metric[:, 0].max() > WORTH:
        bursts, metric[:, 0] = _several(epochs, residual[:, :1], bank)
        metric[:, 0] -= found.total[0]
    nothing, size = np.zeros_like(metric), np.asarray(FACTORS)
    return (BurstEvidence(PositionNoise.name, -1, size, metric, nothing, bursts),)


def _bank(gps_time):
    """Windows (start, length) that hold some of the moments (n,) and not all, a list."""
    moment = np.unique(gps_time)

    def held(start, length):
        first, last = np.searchsorted(moment, [start, start + length])
        return FEWEST <= last - first <= len(moment) - FEWEST

    return [
        (float(start), length)
        for length in LENGTHS
        for start in np.arange(moment[0] - length / 2, moment[-1], length / 2)
        if held(start, length)
    ]


def _excess(epochs, residual, bursts, bank):
    """How far squared residuals (n, k) are above their variance in each window: (w, k).

    Not of innovations: where GNSS is back, these are largest after the window.
    """
    place = epochs.drift + epochs.jitter
    burst = np.hypot(Setting(bursts=bursts).growth(epochs.gps_time), epochs.growth) * place
    signal = (epochs.drift**2 + epochs.jitter**2 + epochs.attitude**2 + burst**2).sum(axis=1)
    variance = np.bincount(epochs.row, signal + epochs.own, epochs.rows)[epochs.row]
    over = (residual / epochs.half[:, None]) ** 2 / variance[:, None] - 1
    total = np.vstack([np.zeros(over.shape[1]), np.cumsum(over, axis=0)])
    first, last = (
        np.searchsorted(epochs.gps_time, [start + part * length for start, length in bank])
        for part in (0, 1)
    )
    return (total[last] - total[first]) / np.sqrt(np.maximum(last - first, 1))[:, None]


def _base(epochs, residual, bursts):
    """Setting that explains a column best with windows. Only its own share of the evidence counts:
    what others would add is left out, to the disadvantage of windows."""
    tried = [one for one in settings() if one.noise == BELIEVED.noise]
    return max(tried, key=lambda one: _score(epochs, residual, one, bursts)[0])


def _score(epochs, residual, base, bursts):
    """Log of weight times likelihood (k,) with windows."""
    factor = whitener(epochs, replace(base, bursts=tuple(bursts)))
    return np.log(base.weight) + log_likelihood(factor.whiten(residual), factor)


def _first(epochs, residual, bank, shapes):
    """Setting and window that explain a column best: of several, as each may stay where it is."""
    score, found = _excess(epochs, residual, (), bank)[:, 0], []
    for length in LENGTHS:
        mine = [i for i, window in enumerate(bank) if window[1] == length]
        if not mine:
            continue
        window = bank[max(mine, key=lambda i: score[i])]
        for shape in shapes:
            bursts = ((*window, FACTORS[1], shape),)
            base = _base(epochs, residual, bursts)
            bursts = _refined(epochs, residual, base, bursts)
            found.append((_score(epochs, residual, base, bursts)[0], base, bursts))
    _, base, bursts = max(found, key=lambda one: one[0])
    base = _base(epochs, residual, bursts)  # a better window may suit another Setting
    return base, _refined(epochs, residual, base, bursts)


def _several(epochs, residual, bank):
    """Windows refined one after the other, and the log evidence of all."""
    prior = -np.log(CELL * len(bank) * len(FACTORS) * len(SHAPES))
    base, bursts = _first(epochs, residual, bank, SHAPES)
    first = bursts
    evidence = _score(epochs, residual, base, bursts)[0] + prior
    while len(bursts) < MOST:
        score = _excess(epochs, residual, bursts, bank)[:, 0]
        several = [bank[i] for i in np.argsort(-score, kind="stable")]
        several = [one for one in several if not _overlap(one, bursts)][:TRIED]
        tried = [(*bursts, (*one, f, s)) for one in several for f in FACTORS for s in SHAPES]
        if not tried:
            break
        best = max(tried, key=lambda one: _score(epochs, residual, base, one)[0])
        best = _refined(epochs, residual, base, best)
        now = _score(epochs, residual, base, best)[0] + prior * len(best)
        now += np.log(AGAIN) * len(bursts)
        if now <= evidence:
            break
        bursts, evidence = best, now
    if bursts == first and first[0][3] == HUMP:
        base, bursts = _first(epochs, residual, bank, (RISE,))
        evidence = _score(epochs, residual, base, bursts)[0] + prior
    return tuple(sorted(bursts)), evidence


def _overlap(one, bursts):
    return any(one[0] < b[0] + b[1] and b[0] < one[0] + one[1] for b in bursts)


def _refined(epochs, residual, base, bursts):
    """The last window with its start, end and factor where the likelihood is largest."""
    *others, (start, length, factor, shape) = bursts
    others, best = tuple(others), (start, start + length, factor)
    seen = epochs.gps_time[0] - LENGTHS[0], epochs.gps_time[-1] + LENGTHS[0]

    def score(window):
        burst = (window[START], window[END] - window[START], window[FACTOR], shape)
        if burst[1] < LENGTHS[0] / 2 or window[FACTOR] < 1 or _overlap(burst, others):
            return -np.inf
        if window != best and (window[START] < seen[0] or window[END] > seen[1]):
            return -np.inf  # nothing says how an error goes on that nobody sees
        return _score(epochs, residual, base, (*others, burst))[0]

    top = score(best)
    for step in np.repeat(STEPS, ROUNDS):
        for key in (START, END, FACTOR):
            for change in (-step, step):
                if (value := score(tried := _moved(best, key, change))) > top:
                    best, top = tried, value
    start, end, factor = (float(v) for v in best)
    return (*others, (start, end - start, factor, shape))


def _moved(window, key, change):
    """Start, end and factor, one of them moved by a share of the length, or twice of its log."""
    moved = list(window)
    if key == FACTOR:
        moved[key] *= np.exp(2 * change)
    else:
        moved[key] += change * (window[END] - window[START])
    return tuple(moved)
