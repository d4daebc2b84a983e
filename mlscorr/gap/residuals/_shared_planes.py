"""Planes that were seen twice, by two passes or by one that came back: whether both agree."""

import numpy as np
from scipy.spatial import cKDTree

from mlscorr.correction import Correction
from mlscorr.gap.residuals._assemble import assemble, patch_pulses
from mlscorr.gap.residuals.patches import Patches
from mlscorr.gap.residuals.rows import Rows, SamplePulses
from mlscorr.gap.residuals.selection import consistent, gate, places, spread, support
from mlscorr.gap.residuals.settings import SETTINGS
from mlscorr.survey import Survey


def shared_rows(
    survey: Survey,
    patches: Patches,
    rng: np.random.Generator,
    limit: int = SETTINGS.patches // 2,
    correction: Correction | None = None,
) -> Rows | None:
    """Rows of the planes that were seen twice, or None where there are none.

    The residual is how far the earlier look lies from the later one, along their mean normal.

    Parameters
    ----------
    survey : Survey
    patches : Patches
    rng : numpy.random.Generator
        Chooses where there are more pairs than the limit.
    limit : int
    correction : Correction, optional
        By which two looks at one plane find each other, where more do than as recorded.
    """
    tried = [(there, *_pairs(near)) for there, near in places(survey, patches, correction)]
    there, early, late, normal, between, residual = max(tried, key=lambda pair: support(pair[-1]))
    first = patches[early]
    second = patches[late]
    apart = np.linalg.norm(between, axis=1)
    kept = np.flatnonzero(np.abs(residual) <= gate(there, first.gps_time))
    kept = kept[consistent(first.gps_time[kept], normal[kept], residual[kept])]
    residual = np.einsum("ni,ni->n", normal, first.centre - second.centre)
    if len(kept) == 0:
        return None
    columns = [first.gps_time[kept], second.gps_time[kept], *np.abs(normal[kept].T)]
    kept = kept[spread(columns, limit, rng)]
    first = first[kept]
    second = second[kept]
    normal = normal[kept]
    apart = apart[kept]
    residual = residual[kept]
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
        plane_noise(first, second, apart**2),
        np.minimum(first.points, second.points),
        SamplePulses.concatenate(pulses),
        first.pass_number,
        gps_time_2=second.gps_time,
    )


def compare_planes(first: Patches, second: Patches) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Mean normal (n, 3), way between the middles (n, 3), and its part along the normal (n,).

    Parameters
    ----------
    first, second : Patches
        Of n planes each, looked at twice.

    Returns
    -------
    three arrays
        Units of the way and its part: m.
    """
    normal = first.normal + second.normal
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)
    between = first.centre - second.centre
    return normal, between, np.einsum("ni,ni->n", normal, between)


def _pairs(patches):
    """Rows (n,), (n,) of two looks at one plane, the earlier one first, and compare_planes of
    them; each is in one pair at most with any other pass.
    """
    radius = SETTINGS.pair_distance * SETTINGS.cell
    pairs = cKDTree(patches.centre).query_pairs(radius, output_type="ndarray")
    time = patches.gps_time[pairs]
    pairs = np.where((time[:, 0] <= time[:, 1])[:, None], pairs, pairs[:, ::-1])
    early, late = pairs.T
    cosine = np.einsum("ni,ni->n", patches.normal[early], patches.normal[late])
    other = patches.pass_number[early] != patches.pass_number[late]
    other |= np.abs(patches.gps_time[early] - patches.gps_time[late]) > SETTINGS.pause
    pair = (cosine >= np.cos(SETTINGS.parallel / 2)) & other
    early = early[pair]
    late = late[pair]
    order = np.argsort(np.linalg.norm(patches.centre[early] - patches.centre[late], axis=1))
    early = early[order]
    late = late[order]
    for forward in (True, False):  # the nearest partner in each pass, of both
        a, b = (early, late) if forward else (late, early)
        key = a * (patches.pass_number.max(initial=0) + 1) + patches.pass_number[b]
        nearest = np.sort(np.unique(key, return_index=True)[1])
        early = early[nearest]
        late = late[nearest]
    return early, late, *compare_planes(patches[early], patches[late])


def plane_noise(first: Patches, second: Patches, square: np.ndarray) -> np.ndarray:
    """Variance (n,) of the difference: of both means, of the normal over the way between them,
    and of the surface, which is no plane.

    Parameters
    ----------
    first, second : Patches
        Of n planes each.
    square : (n,) array
        Of the distance between their middles. Units: m^2.
    """
    mean = [patches.variance / patches.points for patches in (first, second)]
    tilt = [m / patches.spread**2 for m, patches in zip(mean, (first, second), strict=True)]
    return mean[0] + mean[1] + square * (tilt[0] + tilt[1]) / 4 + SETTINGS.surface_sigma**2
