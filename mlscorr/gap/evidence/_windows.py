"""Intervals in which the POS is worse than stated, as in a GNSS outage.

Within an interval (window), the position has an additional error. Windows and sizes come from a
bank, over which the evidence is averaged to account for multiple tests. A significant window is
refined, and further ones are then searched.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import NamedTuple

import numpy as np

from mlscorr.effects import PositionNoise
from mlscorr.gap.evidence._noise import NoiseEvidence
from mlscorr.gap.evidence.evidence import BlockEvidence
from mlscorr.gap.evidence.observations import (
    ErrorModel,
    Observations,
    error_models,
    model_likelihood,
    window_growth,
)
from mlscorr.gap.evidence.settings import SETTINGS
from mlscorr.gap.signatures import Signature
from mlscorr.pos import EXCURSIONS, HUMP, RISE

# A single HUMP is position_bump, an effect: as noise it counts only together with other windows


class Window(NamedTuple):
    """Interval of a worse POS: start and length (s), factor on sigma, shape."""

    start: float
    length: float
    factor: float
    shape: str

    @property
    def end(self) -> float:
        """End of the window. Units: s."""
        return self.start + self.length

    def overlaps(self, others: Iterable[Window]) -> bool:
        """Return True if the window overlaps any of the others."""
        return any(self.start < other.end and other.start < self.end for other in others)


@dataclass(frozen=True)
class WindowEvidence(NoiseEvidence):
    """Log evidence over none of a POS that is worse in windows; size is the factor.

    Parameters
    ----------
    windows : tuple of Window
        Most probable windows.
    """

    windows: tuple[Window, ...] = ()


def models_with_windows(noise: Iterable[NoiseEvidence]) -> list[ErrorModel]:
    """Make all ErrorModels with the significant windows of noise classes."""
    windows = [each.windows for each in noise if isinstance(each, WindowEvidence)]
    return [replace(model, windows=group) for group in windows for model in error_models()]


def weigh_windows(
    observations: Observations,
    signatures: Sequence[Signature],
    evidence: BlockEvidence,
    residual: np.ndarray,
    accepted: np.ndarray,
) -> tuple[WindowEvidence, ...]:
    """Weigh the evidence of windows of a worse POS; empty if none can be tested.

    Parameters
    ----------
    observations : Observations
    signatures : sequence of Signature
    evidence : BlockEvidence
        Of the same residuals.
    residual : (n, k) array
        Units: m.
    accepted : (n, q) array
        Columns of ``observations.shared`` that are a cause, whose signal needs no window.
    """
    bank = _bank(observations.errors.gps_time)
    if not bank or not any(signature.is_common for signature in signatures):
        return ()
    base = evidence.models[int(np.argmax(evidence.none[:, 0]))]
    whitener = observations.whitener(base)
    size = whitener.whiten(accepted).product(whitener.whiten(residual))
    left = residual - accepted @ size
    score = _excess(observations, left, (), bank)
    largest = np.argsort(-score[:, 0], kind="stable")[: SETTINGS.shortlist]
    chosen = np.append(largest, np.setdiff1d(np.argmax(score, axis=0), largest))
    likelihood = np.array(
        [
            [
                _score(observations, residual, base, (bank[i]._replace(factor=factor),))
                for i in chosen
            ]
            for factor in SETTINGS.window_factors
        ]
    )
    factor, place = np.unravel_index(np.argmax(likelihood[:, :, 0]), likelihood.shape[:2])
    windows = (bank[chosen[place]]._replace(factor=SETTINGS.window_factors[factor]),)
    metric = np.logaddexp.reduce(likelihood - evidence.total, axis=1)
    metric -= np.log(len(bank) * len(EXCURSIONS))
    if metric[:, 0].max() > SETTINGS.refinement:
        windows, metric[:, 0] = _Search(observations, residual[:, :1], left[:, :1], bank).best()
        metric[:, 0] -= evidence.total[0]
    nothing = np.zeros_like(metric)
    size = np.asarray(SETTINGS.window_factors)
    return (WindowEvidence(PositionNoise.name, -1, size, metric, nothing, windows),)


def _bank(gps_time):
    """Windows that contain some but not all of the moments (n,), with a factor to be chosen."""
    moment = np.unique(gps_time)
    windows = [
        Window(float(start), length, SETTINGS.window_factors[1], RISE)
        for length in SETTINGS.window_lengths
        for start in np.arange(moment[0] - length / 2, moment[-1], length / 2)
    ]
    count = [np.diff(np.searchsorted(moment, [w.start, w.end]))[0] for w in windows]
    # three moments inside and three outside separate a window from a single outlier
    return [w for w, inside in zip(windows, count, strict=True) if 3 <= inside <= len(moment) - 3]


def _excess(observations, residual, windows, bank):
    """Excess of squared residuals (n, k) over their variance in each window: (w, k).

    Innovations are not used, because after re-acquisition these are largest after the window.
    """
    errors = observations.errors
    row = observations.row
    growth = np.hypot(window_growth(windows, errors.gps_time), errors.growth)
    signal = errors.position**2 * (1 + growth**2) + errors.attitude**2
    variance = np.bincount(row, signal.sum(axis=1) + errors.own, observations.rows)[row]
    over = (residual / observations.half[:, None]) ** 2 / variance[:, None] - 1
    total = np.vstack([np.zeros(over.shape[1]), np.cumsum(over, axis=0)])
    first = np.searchsorted(errors.gps_time, [window.start for window in bank])
    last = np.searchsorted(errors.gps_time, [window.end for window in bank])
    return (total[last] - total[first]) / np.sqrt(np.maximum(last - first, 1))[:, None]


def _score(observations, residual, base, windows):
    """Log of weight times likelihood (k,) with windows."""
    return model_likelihood(observations, replace(base, windows=tuple(windows)), residual)


@dataclass(frozen=True)
class _Search:
    """Search for windows that explain one residual column (n, 1), where its rest (n, 1) is
    large.
    """

    observations: Observations
    residual: np.ndarray
    left: np.ndarray
    bank: list[Window]

    def score(self, base, windows):
        return _score(self.observations, self.residual, base, windows)[0]

    def best(self):
        """Refine windows one by one; return them and the log evidence of all."""
        factors = SETTINGS.window_factors
        prior = -np.log(SETTINGS.event_cell * len(self.bank) * len(factors) * len(EXCURSIONS))
        base, windows = self._first(EXCURSIONS)
        first = windows
        evidence = self.score(base, windows) + prior
        while True:
            score = _excess(self.observations, self.left, windows, self.bank)[:, 0]
            candidates = [self.bank[i] for i in np.argsort(-score, kind="stable")]
            candidates = [w for w in candidates if not w.overlaps(windows)][: SETTINGS.shortlist]
            tries = [
                (*windows, window._replace(factor=factor, shape=shape))
                for window, factor, shape in product(candidates, factors, EXCURSIONS)
            ]
            if not tries:
                break
            more = self._refined(base, max(tries, key=lambda group: self.score(base, group)))
            # one more is as probable as not
            value = self.score(base, more) + prior * len(more) - np.log(2) * len(windows)
            if value <= evidence:
                break
            windows = more
            evidence = value
        if windows == first and first[0].shape == HUMP:
            base, windows = self._first((RISE,))
            evidence = self.score(base, windows) + prior
        return tuple(sorted(windows)), evidence

    def _base(self, windows):
        """Model that explains the column best with windows. Only its own share of the evidence
        counts, to the disadvantage of windows.
        """
        return max(error_models(), key=lambda model: self.score(model, windows))

    def _first(self, shapes):
        """Model and window that explain the column best, from the best of each length and
        shape, because refinement may not change these.
        """
        excess = _excess(self.observations, self.left, (), self.bank)[:, 0]
        results = []
        for length in SETTINGS.window_lengths:
            of_length = [i for i, window in enumerate(self.bank) if window.length == length]
            for shape in shapes if of_length else ():
                windows = (
                    self.bank[max(of_length, key=lambda i: excess[i])]._replace(shape=shape),
                )
                base = self._base(windows)
                windows = self._refined(base, windows)
                results.append((self.score(base, windows), base, windows))
        _, base, windows = max(results, key=lambda result: result[0])
        base = self._base(windows)  # a better window may suit another model
        return base, self._refined(base, windows)

    def _refined(self, base, windows):
        """Last window with the start, end and factor of largest likelihood."""
        *others, window = windows
        time = self.observations.errors.gps_time
        least = SETTINGS.window_lengths[0]
        first = time[0] - least
        last = time[-1] + least
        best = (window.start, window.end, window.factor)

        def score(edges):
            start, end, factor = edges
            moved = Window(start, end - start, factor, window.shape)
            if moved.length < least / 2 or factor < 1 or moved.overlaps(others):
                return -np.inf
            if edges != best and (start < first or end > last):
                return -np.inf  # unobserved errors cannot be extrapolated
            return self.score(base, (*others, moved))

        top = score(best)
        # three times each, because a new start may need another factor
        for step in np.repeat(SETTINGS.window_steps, 3):
            for key, change in product(range(3), (-step, step)):
                edges = _moved(best, key, change)
                if (value := score(edges)) > top:
                    best = edges
                    top = value
        start, end, factor = (float(v) for v in best)
        return (*others, Window(start, end - start, factor, window.shape))


def _moved(edges, key, change):
    """Start, end and factor, one of them changed by a share of the length, or twice that in log."""
    moved = list(edges)
    if key == 2:
        moved[key] *= np.exp(2 * change)
    else:
        moved[key] += change * (edges[1] - edges[0])
    return tuple(moved)
