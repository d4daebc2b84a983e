"""Planes that were seen twice, by two passes or by one that came back: do both agree?"""

import numpy as np
from scipy.spatial import cKDTree

from mlscorr.gap.assemble import assemble, consistent, gate, patch_pulses, spread
from mlscorr.gap.patches import CELL
from mlscorr.gap.rows import Pulses

LATER = 10.0  # s between two looks of one pass: the POS error is another one
NEAR = 0.7 * CELL  # m between the middles of two patches of one plane
PARALLEL = np.cos(np.radians(4.0))
UNEVEN = 0.002  # m, one sigma: two looks sample a wall or road at different points
LIMIT = 500  # pairs


def shared_rows(survey, patches, rng, limit=LIMIT):
    """Rows of the planes that were seen twice, or None where there are none.

    The residual is how far the earlier look lies from the later one, along their mean normal.

    Parameters
    ----------
    survey : Survey
    patches : Patches
    rng : numpy.random.Generator
        Chooses where there are more pairs than the limit.
    limit : int
    """
    first, second = (patches[rows] for rows in _pairs(patches))
    normal, apart, residual = _compare(first, second)
    kept = np.flatnonzero(np.abs(residual) <= gate(survey, first.gps_time))
    kept = kept[consistent(first.gps_time[kept], normal[kept], residual[kept])]
    if len(kept) == 0:
        return None
    columns = [first.gps_time[kept], second.gps_time[kept], *np.abs(normal[kept].T)]
    kept = kept[spread(columns, limit, rng)]
    first, second, normal, apart, residual = (
        values[kept] for values in (first, second, normal, apart, residual)
    )
    item = np.arange(len(kept))
    pulses = [patch_pulses(survey, first, item), patch_pulses(survey, second, item, -1.0)]
    return assemble(
        survey,
        "shared",
        item,
        first.gps_time,
        (first.centre + second.centre) / 2,
        normal,
        residual,
        _noise(first, second, apart),
        np.minimum(first.points, second.points),
        Pulses.concatenate(pulses),
        first.pass_number,
        gps_time_2=second.gps_time,
    )


def _compare(first, second):
    """Mean normal (n, 3), distance of the middles (n,) and that along the normal (n,). Units: m."""
    normal = first.normal + second.normal
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    between = first.centre - second.centre
    return normal, np.linalg.norm(between, axis=1), np.einsum("ni,ni->n", normal, between)


def _pairs(patches):
    """Rows (n,), (n,) of two looks at one plane, the earlier one first; each is in one pair at
    most with any other pass."""
    pairs = cKDTree(patches.centre).query_pairs(NEAR, output_type="ndarray")
    time = patches.gps_time[pairs]
    pairs = np.where((time[:, 0] <= time[:, 1])[:, None], pairs, pairs[:, ::-1])
    one, two = pairs.T
    alike = np.einsum("ni,ni->n", patches.normal[one], patches.normal[two]) >= PARALLEL
    other = patches.pass_number[one] != patches.pass_number[two]
    other |= np.abs(patches.gps_time[one] - patches.gps_time[two]) > LATER
    one, two = one[alike & other], two[alike & other]
    distance = np.linalg.norm(patches.centre[one] - patches.centre[two], axis=1)
    order = np.argsort(distance)
    one, two = one[order], two[order]
    for left in (True, False):  # the nearest partner in each pass, of the one and of the other
        a, b = (one, two) if left else (two, one)
        key = a * (patches.pass_number.max(initial=0) + 1) + patches.pass_number[b]
        nearest = np.sort(np.unique(key, return_index=True)[1])
        one, two = one[nearest], two[nearest]
    return one, two


def _noise(first, second, apart):
    """Variance (n,) of the difference: of both means, of the normal over the way between them,
    and of the surface, which is no plane."""
    mean = [patches.variance / patches.points for patches in (first, second)]
    tilt = [m / patches.spread**2 for m, patches in zip(mean, (first, second), strict=True)]
    return mean[0] + mean[1] + apart**2 * (tilt[0] + tilt[1]) / 4 + UNEVEN**2
