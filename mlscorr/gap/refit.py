"""Targets of a simulated survey, fitted anew by the extraction."""

import numpy as np

from mlscorr.survey import PointCloud
from mlscorr.targets.clusters import FEWEST_POINTS
from mlscorr.targets.fit import fit_targets
from mlscorr.targets.seeds import Spot
from mlscorr.targets.shapes import BY_EDGES, diameter
from mlscorr.targets.visits import scanner_path

UNSURE, LEAST_UNSURE = 3.0, 0.003  # times the sigma of a row, and m, as in the simulation
NEAR = 0.6  # of a target's longest extent, from where it should be seen to its last point
BESIDE = 0.75  # of its size from its centre: off disc and plate
SAME = 0.5  # of a target's size, from where it should be seen to where it is found


def refit_targets(residual, rows, survey, beams, looks, simulated, rng):
    """Fill the residuals of target rows: where the extraction finds the simulated targets.

    Parameters
    ----------
    residual : (m,) array
        Left as it is where a target can't be compared. Units: m.
    rows : Rows
    survey : Survey
    beams : Beams
    looks : (m, 2) int array
        Numbers of the looks of each row.
    simulated : tuple
        Points (n, 3) on the map and whether they are kept (n,), Met, the true beams, and Boards
        where the targets truly are.
    rng : numpy.random.Generator
        Of the extraction.
    """
    xyz, kept, met, (start, direction), boards = simulated
    seed, found = rng.integers(2**63), {}
    on = np.flatnonzero((rows.channel == "target") & (looks[:, 0] >= 0))
    for row in on:
        look = looks[row, 0]
        if look not in found:
            first, last = np.searchsorted(beams.look, [look, look + 1])
            points = first + np.flatnonzero(kept[first:last])
            true = start[points] + met.range[points, None] * direction[points]
            moved = (xyz[points] - beams.origin - true).mean(axis=0) if len(points) else 0.0
            expected = boards.centre[beams.target[look]] + moved + beams.origin
            cloud = PointCloud(xyz[points], beams.pulses.gps_time[points], met.intensity[points])
            number = rows.survey_item[row]
            shape = rows.targets.kind[number], float(rows.targets.size[number])
            bright = boards.bright[beams.target[look]]
            again = np.random.default_rng(seed)
            found[look] = _fitted(cloud, shape, survey, expected, bright, again)
        target, along = found[look], rows.direction[row]
        if target is None or along @ target.covariance @ along > _worst(rows.noise[row]):
            continue
        residual[row] = along @ (target.position - rows.targets.position[rows.survey_item[row]])


def _worst(variance):
    """Variance of a simulated target from which on it can't be compared with an observed one: a
    plate whose edges lie along the scan lines is known well at one place, and not beside it."""
    return max(UNSURE**2 * variance, LEAST_UNSURE**2)


def _fitted(cloud, shape, survey, expected, bright, rng):
    """The FittedTarget near its expected place, or None.

    What is brighter than half way from what lies beside it to its paint is looked at first, which
    spares looking at all else.
    """
    kind, size = shape
    lever_arm = np.zeros(3) if survey.mounting is None else survey.mounting.lever_arm
    apart = np.linalg.norm(cloud.xyz - expected, axis=1)
    if (apart <= SAME * size).sum() < FEWEST_POINTS:
        return None
    sight = cloud.xyz - scanner_path(cloud.gps_time, survey.trajectory, lever_arm)
    beside = cloud.intensity[apart > BESIDE * size]
    dark = np.percentile(beside, 90) if len(beside) else 0.0
    spot = Spot(expected, NEAR * diameter(kind, size), (bright + dark) / 2)
    lit = (cloud.intensity >= spot.threshold) & (apart <= spot.reach)
    spots = [None] if kind in BY_EDGES or lit.sum() < FEWEST_POINTS else [spot, None]
    for one in spots:
        found = fit_targets(cloud, sight, [shape], survey.scanner, rng, one)
        away = [np.linalg.norm(target.position - expected) for target in found]
        if away and min(away) <= SAME * size:
            return found[int(np.argmin(away))]
    return None
