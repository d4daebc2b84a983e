"""Location of differences beyond those that the simulator itself predicts.

With u the innovations of the residuals in the order of time and sigma_i their predicted sigmas,

    G^2 = mean of sigma_i^2 (u_i^2 - 1)

is the part that the simulator does not explain: zero on average if it is correct, and negative as
often as positive. Each row has one term, so G^2 is additive over any split of the rows. Lengths are
printed as sign(G^2) |G^2|^(1/2), in mm.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from mlscorr.gap.evidence.measure import signed_root, simulated_variance
from mlscorr.gap.evidence.observations import STATED, ErrorModel, Observations
from mlscorr.gap.evidence.settings import SETTINGS
from mlscorr.gap.residuals import Background, Rows

CUTS = 400  # largest number in a search for an interval: a pass to half a second
SPLITS = (
    *("time", "location", "range", "incidence", "scan_angle", "intensity"),
    *("speed", "turn_rate", "pass", "axis", "channel"),
)
NAMES = {  # name and unit of a number of a split
    "time": ("time", "s"),
    "location": ("location", "m"),
    "range": ("range", "m"),
    "incidence": ("incidence angle", "deg"),
    "scan_angle": ("scan angle", "deg"),
    "intensity": ("log intensity", "decades"),
    "speed": ("speed", "m/s"),
    "turn_rate": ("turn rate", "deg/s"),
}
CHANNELS = {
    "target": "on the targets",
    "surface": "on the reference surface",
    "shared": "on planes scanned in two passes",
}
DEGREES = ("incidence", "scan_angle", "turn_rate")
AXES = ("E", "N", "H")


@dataclass(frozen=True)
class Split:
    """Gap by one covariate.

    Parameters
    ----------
    by : str
        One of SPLITS.
    edges : (b + 1,) array or None
        For continuous ones; angles in degrees.
    bins : tuple of str
        For discrete ones.
    count : (b,) int array
        Rows in each.
    before, after : (b,) array
        Signed gap of the rows of each bin. Units: mm.
    share : (b,) array
        Share of the squared shifts by the cause and of its added variance; without a cause, of the
        squared gap of all rows. Sums to one.
    band : (b, 2) array
        95 % interval of each bin's gap if nothing is wrong. Units: mm.
    extent : Extent or None
        For a continuous covariate: the interval in which the cause acts.
    """

    by: str
    edges: np.ndarray | None
    bins: tuple[str, ...]
    count: np.ndarray
    before: np.ndarray
    after: np.ndarray
    share: np.ndarray
    band: np.ndarray
    extent: Extent | None = None


@dataclass(frozen=True)
class Where:
    """Gap and its splits.

    Parameters
    ----------
    before, after : float
        Signed; after removal of the cause. Units: mm.
    null_band : (float, float)
        95 % interval if nothing is wrong. Units: mm.
    splits : tuple of Split
    row : (n,) int array
        Row of each innovation.
    gps_time : (n,) array
        Units: s.
    innovation : (n, 2) array
        u before and after.
    sigma : (n,) array
        Of the innovations. Units: m.
    """

    before: float
    after: float
    null_band: tuple[float, float]
    splits: tuple[Split, ...]
    row: np.ndarray
    gps_time: np.ndarray
    innovation: np.ndarray
    sigma: np.ndarray


def locate(
    rows: Rows,
    background: Background,
    shift: np.ndarray,
    rng: np.random.Generator,
    replicas: Sequence[ErrorModel],
    model: ErrorModel = STATED,
    extra: np.ndarray | None = None,
    acts: tuple[float, float] | None = None,
) -> Where:
    """Locate the gap, before and after a cause is removed.

    Parameters
    ----------
    rows : Rows
    background : Background
    shift : (m,) array
        Shift of the residuals by the cause; zero for none.
    rng : numpy.random.Generator
    replicas : sequence of ErrorModel
        Model of each replica for the null band: a survey without effects, with the POS errors and
        noise tails of this one after removal of the cause.
    model : ErrorModel
        Model of V after; it differs from the stated one if the cause is noise of the POS.
    extra : (m,) array, optional
        Variance added by noise of the rows' own, after.
    acts : (float, float), optional
        Interval in which the cause acts, if known better than from the rows. Units: s.
    """
    observed = Observations.of(rows, background)
    columns = observed.columns(np.column_stack([rows.residual, rows.residual - shift]))
    best = replace(max(replicas, key=replicas.count), windows=model.windows)
    tails = observed.whitener(best).innovations(columns[:, 1:])[0][:, 0]
    drawn = [
        observed.whitener(each).draw(rng, replicas.count(each), tails)
        for each in dict.fromkeys(replicas)
    ]
    u, sigma = observed.whitener().innovations(np.hstack([columns, *drawn]))
    terms = sigma[:, None] ** 2 * (u**2 - 1)
    has_cause = bool(shift.any()) or model != STATED or extra is not None
    if model != STATED or extra is not None:
        if extra is None:
            more = 0.0
        else:
            more = extra[observed.row] * observed.half
        after, wider = observed.whitener(model, more).innovations(columns[:, 1:])
        u[:, 1] = after[:, 0]
        terms[:, 1] = wider**2 * (after[:, 0] ** 2 - 1)
    keep = observed.second
    terms = terms[keep]
    row = observed.row[keep]
    if has_cause:
        square = _moved(observed, shift, model, extra)[keep]
    else:
        square = np.zeros(len(row))
    is_moved = bool(square.any())
    explained = square if is_moved else terms[:, 0]
    mean = terms.mean(axis=0)
    low, high = (float(v) for v in np.percentile(signed_root(mean[2:]), SETTINGS.band))
    band = low, high
    splits = [_split(rows, row, by, terms, explained, is_moved) for by in SPLITS]
    splits = tuple(split for split in splits if split is not None)
    if acts is not None:
        splits = _timed(splits, rows, row, square, acts)
    before, after = (float(v) for v in signed_root(mean[:2]))
    return Where(
        before,
        after,
        band,
        splits,
        row,
        observed.errors.gps_time[keep],
        u[keep, :2],
        sigma[keep],
    )


def _moved(observed, shift, model, extra):
    """Squared shift (n,) of observations by a cause, and its added variance. m^2."""
    stated = simulated_variance(observed, STATED)
    more = simulated_variance(observed, model, extra) - stated
    return shift[observed.row] ** 2 + np.maximum(more, 0.0)


def _timed(splits, rows, row, square, acts):
    """Splits with the known extent in time."""
    first = rows.reference.start
    time = rows.gps_time[row]
    inside = (time >= acts[0]) & (time <= acts[1])
    share = float(square[inside].sum() / (square.sum() or 1.0))
    extent = Extent(acts[0] - first, acts[1] - first, share, float(inside.mean()))
    return tuple(replace(s, extent=extent) if s.by == "time" else s for s in splits)


def _split(rows, row, by, terms, explained, is_moved):
    """Gap by one covariate, or None if that is unknown or equal for all rows."""
    edges, bins, number = _bins(rows, row, by)
    if number is None:
        return None
    count = np.bincount(number, minlength=len(bins))
    sums = np.array([np.bincount(number, column, len(bins)) for column in terms.T]).T
    mean = signed_root(sums / np.maximum(count, 1)[:, None])
    return Split(
        by,
        edges,
        bins,
        count,
        mean[:, 0],
        mean[:, 1],
        np.bincount(number, explained, len(bins)) / (explained.sum() or 1.0),
        np.percentile(mean[:, 2:], SETTINGS.band, axis=1).T,
        _extent(rows, row, by, explained) if is_moved and edges is not None else None,
    )


def _extent(rows, row, by, square):
    """Extent of a cause in a covariate."""
    values = rows.covariates[by][row]
    if by in DEGREES:
        values = np.degrees(values)
    turn = 360.0 if by == "scan_angle" else None
    return extent_of(values, square, turn)


def _bins(rows, row, by):
    """Edges or None, names, and the bin of each row."""
    if by == "channel":
        names, number = np.unique(rows.channel[row], return_inverse=True)
        return None, tuple(str(name) for name in names), number
    values = rows.covariates[by][row]
    if not np.isfinite(values).all():
        return None, (), None
    if by in ("pass", "axis"):
        known, number = np.unique(values.astype(int), return_inverse=True)
        names = [AXES[k] if by == "axis" and k >= 0 else str(k) for k in known]
        return None, tuple(names), number
    values = np.degrees(values) if by in DEGREES else values
    edges = np.unique(np.quantile(values, np.linspace(0, 1, SETTINGS.bins + 1)))
    if len(edges) < 2:
        return None, (), None
    number = np.clip(np.searchsorted(edges, values, side="right") - 1, 0, len(edges) - 2)
    return edges, tuple(f"{a:.4g} to {b:.4g}" for a, b in pairwise(edges)), number


@dataclass(frozen=True)
class Extent:
    """Interval of a covariate.

    Parameters
    ----------
    low, high : float
        In the covariate's unit; an angle may pass 180 deg.
    share : float
        Share of the squared shifts within it.
    rows : float
        Share of the rows within it.
    """

    low: float
    high: float
    share: float
    rows: float

    @property
    def excess(self) -> float:
        """Excess of the share over that of the rows: zero for a cause that acts everywhere."""
        return self.share - self.rows


def extent_of(values: np.ndarray, square: np.ndarray, turn: float | None = None) -> Extent | None:
    """Interval in which a cause acts most; None if it acts uniformly or not at all.

    Parameters
    ----------
    values : (n,) array
        Of the covariate.
    square : (n,) array
        Squared shift of each row by the cause, or its added variance.
    turn : float, optional
        Period of the values.

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
    """Periodic values, cut at their widest interval without rows."""
    if turn is None or len(values) < 2:
        return values
    known = np.sort(values)
    steps = np.diff(known, append=known[0] + turn)
    cut = known[int(np.argmax(steps))]
    if steps[-1] < steps.max():
        return np.where(values <= cut, values + turn, values)
    return values
