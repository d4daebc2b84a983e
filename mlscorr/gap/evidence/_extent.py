"""The stretch of a covariate in which a cause acts: where rows are moved, not where they surprise.

Of a cause that comes and goes with the drift innovations show its start alone, so the stretch is
told by the fitted signature: the interval inside and outside of which its amplitudes are best
described by one mean each (the cut of largest variance between two classes, Otsu 1979).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

CUTS = 400  # of a covariate at most between which a stretch is looked for: a pass to half a second


@dataclass(frozen=True)
class Extent:
    """A stretch of a covariate.

    Parameters
    ----------
    low, high : float
        In the covariate's unit; an angle may pass 180 deg.
    share : float
        Of the squares of what the cause moves, that lie in it.
    rows : float
        Share of the rows that lie in it.
    """

    low: float
    high: float
    share: float
    rows: float

    @property
    def excess(self) -> float:
        """By how much the share is more than that of the rows: zero of what acts everywhere."""
        return self.share - self.rows


def extent_of(values: np.ndarray, square: np.ndarray, turn: float | None = None) -> Extent | None:
    """The stretch in which a cause acts most; None where it acts everywhere or nowhere alike.

    Parameters
    ----------
    values : (n,) array
        Of the covariate.
    square : (n,) array
        Of what the cause moves each row by, or adds to its variance.
    turn : float, optional
        After which values repeat.

    >>> time = np.arange(100.0)
    >>> moved = np.exp(-0.5 * ((time - 40.0) / 6.0) ** 2)
    >>> extent = extent_of(time, moved**2)
    >>> extent.low, extent.high
    (31.5, 48.5)
    """
    values = _opened(values, turn)
    places, number = np.unique(values, return_inverse=True)
    count = np.bincount(number)
    amplitude = np.bincount(number, np.sqrt(square))
    if len(places) < 3 or not square.any():
        return None
    cuts = np.unique(np.linspace(0, len(places), min(len(places), CUTS) + 1).astype(int))
    rows, sums = (np.append(0, np.cumsum(v))[cuts] for v in (count, amplitude))
    n = rows[-1]
    total = sums[-1]
    inside = rows[None, :] - rows[:, None]
    moved = sums[None, :] - sums[:, None]
    outside = n - inside
    with np.errstate(divide="ignore", invalid="ignore"):
        difference = moved / inside - (total - moved) / outside
    known = (inside > 0) & (outside > 0) & (difference > 0)
    score = np.where(known, inside * outside * difference**2, -1.0)
    first, last = np.unravel_index(np.argmax(score), score.shape)
    if score[first, last] <= 0:
        return None
    a = cuts[first]
    b = cuts[last]
    here = (number >= a) & (number < b)
    share = float(square[here].sum() / square.sum())
    half = 0.5 * np.diff(places)
    half = np.concatenate([[0.0], np.where(half > 10 * np.median(half), 0.0, half), [0.0]])
    # no farther into a gap
    low = places[a] - half[a]
    high = places[b - 1] + half[b]
    return Extent(float(low), float(high), share, float(here.mean()))


def _opened(values, turn):
    """Values that repeat, cut where the widest stretch of them is without rows."""
    if turn is None or len(values) < 2:
        return values
    known = np.sort(values)
    steps = np.diff(known, append=known[0] + turn)
    cut = known[int(np.argmax(steps))]
    if steps[-1] < steps.max():
        return np.where(values <= cut, values + turn, values)
    return values
