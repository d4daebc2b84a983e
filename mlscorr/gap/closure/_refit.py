"""Targets of a simulated survey, fitted anew by the extraction."""

import numpy as np

from mlscorr.gap.closure._settings import SETTINGS
from mlscorr.gap.closure.beams import Beams
from mlscorr.gap.residuals import Rows
from mlscorr.survey import PointCloud, Survey
from mlscorr.targets import BY_EDGES, BrightRegion, ScannerPath, diameter, fit_targets
from mlscorr.targets import SETTINGS as TARGETS


def refit_targets(
    residual: np.ndarray,
    rows: Rows,
    survey: Survey,
    beams: Beams,
    views: np.ndarray,
    simulated: tuple,
    rng: np.random.Generator,
) -> None:
    """Fill the residuals of target rows: where the extraction finds the simulated targets.

    Parameters
    ----------
    residual : (m,) array
        Left as it is where a target can't be compared. Units: m.
    rows : Rows
    survey : Survey
    beams : Beams
    views : (m, 2) int array
        Numbers of the views of each row.
    simulated : tuple
        Points (n, 3) on the map and whether they are kept (n,), Met, the true beams, and Boards
        where the targets truly are.
    rng : numpy.random.Generator
        Of the extraction.
    """
    xyz, kept, met, (start, direction), boards = simulated
    seed = rng.integers(2**63)
    fitted = {}
    for row in np.flatnonzero((rows.channel == "target") & (views[:, 0] >= 0)):
        view = views[row, 0]
        if view not in fitted:
            first, last = np.searchsorted(beams.view, [view, view + 1])
            points = first + np.flatnonzero(kept[first:last])
            true = start[points] + met.range[points, None] * direction[points]
            if len(points):
                moved = (xyz[points] - beams.origin - true).mean(axis=0)
            else:
                moved = 0.0
            expected = boards.centre[beams.target[view]] + moved + beams.origin
            cloud = PointCloud(xyz[points], beams.pulses.gps_time[points], met.intensity[points])
            number = rows.survey_item[row]
            shape = rows.targets.kind[number], float(rows.targets.size[number])
            bright = boards.bright[beams.target[view]]
            same_rng = np.random.default_rng(seed)  # of each target alike
            fitted[view] = _fitted(cloud, shape, survey, expected, bright, same_rng)
        target = fitted[view]
        along = rows.direction[row]
        # a plate whose edges lie along the scan lines is known well at one place, not beside it
        worst = max(SETTINGS.worst**2 * rows.noise[row], SETTINGS.least_worst**2)
        if target is None or along @ target.covariance @ along > worst:
            continue
        residual[row] = along @ (target.position - rows.targets.position[rows.survey_item[row]])


def _fitted(cloud, shape, survey, expected, bright, rng):
    """The FittedTarget near its expected place, or None.

    What is brighter than half way from what lies beside it to its paint is looked at first, which
    spares looking at all else.
    """
    kind, size = shape
    apart = np.linalg.norm(cloud.xyz - expected, axis=1)
    if (apart <= SETTINGS.largest_offset * size).sum() < TARGETS.smallest_count:
        return None
    path = ScannerPath.of(survey, cloud.gps_time)
    beside = cloud.intensity[apart > SETTINGS.background * size]
    dark = np.percentile(beside, 90) if len(beside) else 0.0
    spot = BrightRegion(expected, SETTINGS.extent * diameter(kind, size), (bright + dark) / 2)
    lit = (cloud.intensity >= spot.threshold) & (apart <= spot.radius)
    if kind in BY_EDGES or lit.sum() < TARGETS.smallest_count:
        spots = [None]
    else:
        spots = [spot, None]
    for spot in spots:
        targets = fit_targets(cloud, path, [shape], survey.scanner, rng, spot)
        away = [np.linalg.norm(target.position - expected) for target in targets]
        if away and min(away) <= SETTINGS.largest_offset * size:
            return targets[int(np.argmin(away))]
    return None
