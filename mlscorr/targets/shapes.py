"""Centre of a circle or square of known size from points marked inside or outside of it.

The centre is the mean of its posterior under a uniform prior: each point says on which side of
the outline it lies, blurred by footprint and angle noise. The mean of the bright points would be
drawn to where they are denser. The spread of the posterior is the covariance.
"""

from dataclasses import dataclass

import numpy as np
from scipy.special import expit

WRONG_SIDE = 0.01  # share of points marked wrong whatever their distance (mixed returns)
AT_ONCE = 500  # points, which bounds the memory on dense targets
STEPS = 13  # of the grid, along each axis
ANGLES = 9  # of the grid of a square's turn
STAGES = 12
ROUGH_STAGES = 3  # the first of them
ROUGH_POINTS = 150  # of either side, enough to place the outline roughly


@dataclass(frozen=True)
class Outline:
    """A fitted outline: centre (2,) and its covariance (2, 2) in the plane, turn (rad), overlap.

    overlap is the share of points inside among those inside or marked bright: 1 is a perfect fit.
    """

    centre: np.ndarray
    covariance: np.ndarray
    turn: float
    overlap: float


def distance_inside(points, outlines, kind, size):
    """Distance (c, n) in m of points (n, 2) to outlines (c, 3: u, v, turn), positive inside."""
    u = points[:, 0] - outlines[:, :1]
    v = points[:, 1] - outlines[:, 1:2]
    if kind == "circle":
        return size / 2 - np.sqrt(u * u + v * v)
    cos, sin = np.cos(outlines[:, 2:]), np.sin(outlines[:, 2:])
    along, across = np.abs(cos * u + sin * v), np.abs(cos * v - sin * u)
    return size / 2 - np.maximum(along, across)


def fit_outline(points, bright, kind, size, blur, stages=STAGES):
    """Fit an outline of known kind and size (m) to points (n, 2) marked bright or not (n,).

    blur is the one-sigma position error of a point across the outline. Units: m. The grid starts
    wide, blurred and with few points. Each stage halves the blur, so that the posterior's mode is
    not lost, until the grid resolves the posterior; three stages tell roughly whether it is one.
    """
    mean = np.array([*points[bright].mean(axis=0), np.pi / 4])
    half = np.array([0.35 * size, 0.35 * size, np.pi / 4])
    for stage in range(stages):
        width = max(blur, size / 8 / 2**stage)
        telling = _telling(points, bright, mean, half, kind, size, width)
        if stage < ROUGH_STAGES:
            telling = _thinned(telling, bright)
        grid = _grid(mean, half, kind)
        weight = _posterior(points[telling], bright[telling], grid, kind, size, width)
        mean = weight @ grid
        deviation = grid - mean
        covariance = (weight[:, None] * deviation).T @ deviation
        closer = np.maximum(4 * np.sqrt(np.diag(covariance)), 3 * half / (STEPS - 1))
        resolved = (closer > half / 2)[: 3 if kind == "square" else 2].all()
        half = closer
        if width == blur and resolved:
            break
    inside = distance_inside(points, mean[None], kind, size)[0] > 0
    overlap = (inside & bright).sum() / max((inside | bright).sum(), 1)
    return Outline(mean[:2], covariance[:2, :2], float(mean[2]), float(overlap))


def _telling(points, bright, mean, half, kind, size, width):
    """Rows of the points that can lie near the outline: all others say the same of every trial."""
    play = np.hypot(half[0], half[1]) + size * half[2] * (kind == "square") + 8 * width
    return np.flatnonzero(np.abs(distance_inside(points, mean[None], kind, size)[0]) < play)


def _thinned(rows, bright):
    """At most ROUGH_POINTS of the rows on either side, evenly among them."""
    sides = rows[bright[rows]], rows[~bright[rows]]
    return np.concatenate([side[:: len(side) // ROUGH_POINTS + 1] for side in sides])


def _grid(mean, half, kind):
    """Trial outlines about the present one: (c, 3) of u, v and turn."""
    steps = np.linspace(-1, 1, STEPS)
    turns = np.linspace(-1, 1, ANGLES) if kind == "square" else np.zeros(1)
    mesh = np.stack(np.meshgrid(steps, steps, turns, indexing="ij"), axis=-1).reshape(-1, 3)
    return mean + mesh * half


def _posterior(points, bright, grid, kind, size, width):
    """Probability of each trial outline (c,)."""
    likelihood = np.zeros(len(grid))
    for part in (slice(i, i + AT_ONCE) for i in range(0, len(points), AT_ONCE)):
        distance = distance_inside(points[part], grid, kind, size)
        side = np.where(bright[part], distance, -distance) * (np.pi / np.sqrt(3) / width)
        likelihood += np.log(WRONG_SIDE + (1 - 2 * WRONG_SIDE) * expit(side)).sum(axis=1)
    weight = np.exp(likelihood - likelihood.max())
    return weight / weight.sum()
