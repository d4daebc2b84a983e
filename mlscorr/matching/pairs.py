"""Which observations and surveyed points could belong together, each pair by itself."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

SIGMAS = 4.0  # of the stated position sigma
LEAST_GATE = 1.0  # m: datum and mounting errors are not in the POS's sigma
LARGEST_GATE = 10.0  # m: a lone GNSS receiver errs by 8 m (GPS SPS 2020, 95 %); a POS, no more
SIZE_TOLERANCE = 0.01  # m


@dataclass(frozen=True)
class Pairs:
    """Pairs of observation and control point within the gate.

    Pairs first[i] to first[i + 1] are those of observation i. control (p,) are rows of the
    control points, misclosure (p, 3) is surveyed - observed in m; alike (p,) tells those that
    agree in kind and size.
    """

    first: np.ndarray
    control: np.ndarray
    misclosure: np.ndarray
    alike: np.ndarray

    def of(self, row):
        """Slice of an observation's pairs."""
        return slice(self.first[row], self.first[row + 1])


def gates(sigma, n):
    """Largest credible misclosure (n,) by stated sigmas (n, 3), or None of them. Units: m."""
    if sigma is None:
        return np.full(n, LEAST_GATE)
    return np.clip(SIGMAS * np.linalg.norm(sigma, axis=1), LEAST_GATE, LARGEST_GATE)


def same_appearance(observations, row, control, columns):
    """Whether an observation has the kind and size of control points (k,): bool (k,)."""
    kinds = np.array([control.kind[column] == observations.kind[row] for column in columns], bool)
    return kinds & (np.abs(control.size[columns] - observations.size[row]) <= SIZE_TOLERANCE)


def find_pairs(observations, control, gate):
    """Pairs within the gates (n,), with the observations' rows in order."""
    if len(observations) == 0 or len(control) == 0:
        first = np.zeros(len(observations) + 1, int)
        return Pairs(first, np.empty(0, int), np.empty((0, 3)), np.empty(0, bool))
    near = cKDTree(control.position).query_ball_point(observations.position, gate)
    near = [np.sort(np.array(several, dtype=int)) for several in near]
    alike = [same_appearance(observations, row, control, c) for row, c in enumerate(near)]
    column = np.concatenate(near)
    row = np.repeat(np.arange(len(near)), [len(several) for several in near])
    return Pairs(
        first=np.searchsorted(row, np.arange(len(near) + 1)),
        control=column,
        misclosure=control.position[column] - observations.position[row],
        alike=np.concatenate(alike),
    )
