"""Center of an outline from beams that each fell on a known side of it.

The center is the mean of its posterior under a uniform prior: each beam gives the side of the
outline on which it fell, blurred by footprint and angle noise. The mean of the bright points would
be biased toward dense areas. The spread of the posterior is the covariance.
"""

from dataclasses import dataclass

import numpy as np

from mlscorr.targets import shapes
from mlscorr.targets._sequence import quasi_normal, quasi_random
from mlscorr.targets.settings import SETTINGS


@dataclass(frozen=True)
class Size:
    """Prior of a size before the fit.

    Parameters
    ----------
    mean, sigma, low, high : float
        Normal distribution within limits. Units: m.
    """

    mean: float
    sigma: float
    low: float
    high: float


@dataclass(frozen=True)
class Outline:
    """Fitted outline in its plane.

    Parameters
    ----------
    centre : (2,) array
        Units: m.
    covariance : (2, 2) array
        Of the center. Units: m^2.
    turn, size, inner : float
        See ``shapes``: rad, m, share.
    size_sigma : float
        Units: m.
    overlap : float
        Beams inside by both outline and state, as a share of those inside by either.
    """

    centre: np.ndarray
    covariance: np.ndarray
    turn: float
    size: float
    inner: float
    size_sigma: float
    overlap: float

    @property
    def row(self) -> np.ndarray:
        """Outline as a row of trial outlines."""
        return np.array([*self.centre, self.turn, self.size, self.inner])


def fit_outline(
    points: np.ndarray,
    state: np.ndarray,
    kind: str,
    size: Size,
    blur: float,
    start: np.ndarray,
    by_edges: bool = False,
    ring: bool = False,
    rough: bool = False,
) -> Outline:
    """Fit an outline to beams that crossed its plane.

    Parameters
    ----------
    points : (n, 2) array
        Crossings with the plane. Units: m.
    state : (n,) int array
        State of each beam: BRIGHT, DARK or PASSED.
    kind : str
    size : Size
    blur : float
        One sigma of a beam's position across the outline. Units: m.
    start : (2,) array
        Start position. Units: m.
    by_edges : bool
        True if intensity gives no information.
    ring : bool
        True if a circle has a dark inner disc.
    rough : bool
        True to stop early.

    Source: population Monte Carlo (Cappe et al. 2004) on quasi-random trials; the blur starts wide
    and halves, so that the posterior's mode is not lost.
    """
    form = shapes.form_of(kind, by_edges)
    side = shapes.sides(state, kind, by_edges)
    period = shapes.PERIOD.get(kind, 0.0)
    count = SETTINGS.trials // (1 + rough)
    trials, free = _first_trials(start, size, period, ring, count)
    spent = np.zeros(count)  # minus log of the density they were drawn from
    width = size.mean / SETTINGS.first_blur
    mean = trials.mean(axis=0)
    spread = np.ptp(trials, axis=0) / 2
    rounds = SETTINGS.rough_rounds
    if not rough:
        rounds *= 5
    elif form == shapes.CHECKERED:
        rounds *= 2
    for number in range(1, rounds + 1):
        near = _informative(points, mean, spread, form, max(width, blur))
        if width > blur:
            near = _thinned(near, side, count // 5)
        value = shapes.log_likelihood(points[near], side[near], trials, form, max(width, blur))
        value += spent + _log_prior(trials, size, start, ring)
        weight, effective = _weights(value)
        mean, covariance = _moments(trials, weight, period)
        spread = 4 * np.sqrt(np.diag(covariance))
        if width <= blur and effective > 3 * SETTINGS.least_effective_share * count:
            break
        if effective > SETTINGS.least_effective_share * count:
            width /= 2
        drawn = SETTINGS.proposal_width**2 * covariance[np.ix_(free, free)]
        trials, spent = _next_trials(mean, drawn, free, number, count)
    inside = shapes.distance_inside(points, mean, form) > 0
    marked = side == 1
    if form == shapes.CHECKERED:
        marked &= inside
        inside &= shapes.distance_inside(points, mean, shapes.WHITE) > 0
    return Outline(
        mean[:2],
        covariance[:2, :2],
        *map(float, mean[2:]),
        float(np.sqrt(covariance[3, 3])),
        float((inside & marked).sum() / max((inside | marked).sum(), 1)),
    )


def _ring_limits():
    """Limits of inner over outer diameter: a ring's dark disc is neither a speck nor all of it."""
    return np.array([SETTINGS.core / 2, 1.0 - SETTINGS.core / 4])


def _first_trials(middle, size, period, ring, count):
    """First outlines (c, 5) around the middle, and their free columns."""
    play = SETTINGS.hidden_share * size.mean
    inner = _ring_limits() * ring
    low = np.array([*(middle - play), 0.0, size.low, inner[0]])
    high = np.array([*(middle + play), period, size.high, inner[1]])
    return low + (high - low) * quasi_random(count, 5), np.flatnonzero(high > low)


def _next_trials(mean, covariance, free, number, count):
    """Draw outlines from a normal distribution, with minus the log of its density."""
    scale = np.sqrt(np.diag(covariance)) + 1e-9
    correlation = covariance / np.outer(scale, scale) + 1e-6 * np.eye(len(free))
    root = np.linalg.cholesky(correlation) * scale[:, None]
    normal = quasi_normal(count, len(free), number)
    trials = np.tile(mean, (count, 1))
    trials[:, free] += normal @ root.T
    return trials, 0.5 * np.sum(normal**2, axis=1)


def _log_prior(trials, size, middle, ring):
    """Log prior (c,) of trial outlines: uniform around the middle except for the size."""
    within = (np.abs(trials[:, :2] - middle) <= SETTINGS.hidden_share * size.mean).all(axis=1)
    within &= (trials[:, 3] >= size.low) & (trials[:, 3] <= size.high)
    if ring:
        low, high = _ring_limits()
        within &= (trials[:, 4] >= low) & (trials[:, 4] <= high)
    return np.where(within, -0.5 * ((trials[:, 3] - size.mean) / size.sigma) ** 2, -1e9)


def _weights(value):
    """Weight (c,) of trials by their log posterior, and the effective number of them.

    If too few carry all the weight, the posterior is raised to a power below one.
    """
    power = 1.0
    while True:
        weight = np.exp(power * (value - value.max()))
        weight /= weight.sum()
        effective = 1 / (weight @ weight)
        if effective >= SETTINGS.least_effective_share * len(value) or power < 1e-6:
            break
        power *= 0.7
    if power < 1.0:
        effective = 0.0
    return weight, effective


def _moments(trials, weight, period):
    """Weighted mean (5,) and covariance (5, 5) of outlines; turns are periodic."""
    trials = trials.copy()
    if period:
        angle = np.angle(weight @ np.exp(2j * np.pi / period * trials[:, 2])) * period / 2 / np.pi
        trials[:, 2] = angle + (trials[:, 2] - angle + period / 2) % period - period / 2
    mean = weight @ trials
    deviation = trials - mean
    return mean, (weight[:, None] * deviation).T @ deviation


def _informative(points, mean, spread, form, width):
    """Rows of the points near the outline; all others are equally likely in every trial."""
    turned = mean[3] * spread[2] * (form != shapes.ROUND)
    play = np.hypot(spread[0], spread[1]) + turned + spread[3] / 2 + spread[4] + 6 * width
    distance = np.abs(shapes.distance_inside(points, mean, form))
    if form == shapes.CHECKERED:
        distance = np.minimum(distance, np.abs(shapes.distance_inside(points, mean, shapes.WHITE)))
    return np.flatnonzero(distance < play)


def _thinned(rows, side, count):
    """Select at most a given number of rows on each side, evenly spaced."""
    parts = [rows[side[rows] == value] for value in (-1, 0, 1)]
    return np.concatenate([part[:: len(part) // count + 1] for part in parts])
