"""Patches compared with each other in overlaps, and with a reference surface.

Views are paired within a gate of the stated sigma; those that disagree with all others close in
time belong to something else.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import cKDTree

from mlscorr.correction import Correction
from mlscorr.gap.residuals.patches import Patches
from mlscorr.gap.residuals.rows import (
    Rows,
    SamplePulses,
    assemble,
    sample_pulses,
    scanner_origin,
)
from mlscorr.gap.residuals.settings import SETTINGS
from mlscorr.pos import PosErrors
from mlscorr.simulate import SceneScenario
from mlscorr.simulate.scene import read_mesh
from mlscorr.survey import SEARCH_RADIUS, Columns, Survey


def moved_by(correction: Correction | None, xyz: np.ndarray, gps_time: np.ndarray) -> np.ndarray:
    """Return the increments of points (n, 3) by a correction; zero without one. Units: m.

    Parameters
    ----------
    correction : Correction or None
    xyz, gps_time : (n, 3), (n,) array
        Units: m, s.
    """
    if correction is None:
        return np.zeros(xyz.shape)
    return correction.increments(xyz, gps_time)[0]


def places(
    survey: Survey, patches: Patches, correction: Correction | None
) -> list[tuple[Survey, Patches]]:
    """Yield the survey and its patches as recorded, and after a correction.

    Parameters
    ----------
    survey : Survey
    patches : Patches
    correction : Correction or None
    """
    if correction is None:
        return [(survey, patches)]
    samples = patches.xyz.reshape(-1, 3)
    moved = moved_by(correction, samples, patches.time.ravel()).reshape(patches.xyz.shape)
    centre = patches.centre + moved_by(correction, patches.centre, patches.gps_time)
    near = replace(patches, centre=centre, xyz=patches.xyz + moved)
    return [(survey, patches), (replace(survey, trajectory=correction.corrected), near)]


def support(residual: np.ndarray) -> float:
    """Support for the positions that leave residuals (n,) in m: larger for smaller residuals.

    Parameters
    ----------
    residual : (n,) array
        Units: m.
    """
    return float(np.maximum(1.0 - (residual / SETTINGS.least_surface_gate) ** 2, 0.0).sum())


def gate(survey: Survey, gps_time: np.ndarray) -> np.ndarray:
    """Largest credible distance of a surface from its expected position.

    Parameters
    ----------
    survey : Survey
    gps_time : (n,) array
        Units: s.

    Returns
    -------
    (n,) array
        Units: m.
    """
    sigma = PosErrors.stated(survey.trajectory, survey.pos).at(gps_time)
    size = SETTINGS.surface_gate_sigmas * np.linalg.norm(sigma.drift + sigma.known_gnss, axis=1)
    return np.clip(size, SETTINGS.least_surface_gate, SEARCH_RADIUS)


def consistent(gps_time: np.ndarray, direction: np.ndarray, residual: np.ndarray) -> np.ndarray:
    """Flag of differences that agree with one shift within their interval of time.

    Others belong to another surface: a car, or a curb missing in the reference. The shift minimizes
    absolute differences, by reweighting; in intervals with few data, all agree.

    Parameters
    ----------
    gps_time : (n,) array
        Units: s.
    direction : (n, 3) array
        Direction of each difference.
    residual : (n,) array
        Units: m.

    Returns
    -------
    (n,) bool array
    """
    order = np.argsort(gps_time, kind="stable")
    size = SETTINGS.plane_points  # in a street they come within a second
    group = np.arange(len(order)) // size
    moment = np.floor(gps_time[order] / SETTINGS.outlier_interval)
    begins = np.flatnonzero((np.diff(group) != 0) | (np.diff(moment) != 0)) + 1
    agree = np.ones(len(gps_time), dtype=bool)
    for rows in np.split(order, begins):
        if len(rows) >= size // 3:  # three unknowns: fewer do not show which of them is wrong
            left = residual[rows] - _shift(direction[rows], residual[rows])
            scatter = 1.4826 * np.median(np.abs(left))  # a normal distribution's sigma
            agree[rows] = np.abs(left) <= max(SETTINGS.odd_distance, SETTINGS.odd_sigmas * scatter)
    return agree


def _shift(direction, residual):
    """Fit of a shift of least absolute differences to each of the directions (n,). m."""
    weight = np.ones(len(residual))
    for _ in range(15):
        normal = (direction * weight[:, None]).T @ direction + 1e-3 * np.eye(3) * weight.sum()
        fitted = direction @ np.linalg.solve(normal, direction.T @ (weight * residual))
        weight = 1 / np.maximum(np.abs(residual - fitted), 1e-3)
    return fitted


def spread(columns: list[np.ndarray], limit: int, rng: np.random.Generator) -> np.ndarray:
    """Choose at most `limit` of n items, evenly spread over the values of each column.

    Each column is split into equal bins; an item in emptier bins is more likely.

    Parameters
    ----------
    columns : list of (n,) arrays
    limit : int
    rng : numpy.random.Generator

    Returns
    -------
    (k,) int array
        Sorted rows.

    >>> spread([np.arange(5.0)], 10, np.random.default_rng(0))
    array([0, 1, 2, 3, 4])
    """
    n = len(columns[0])
    if n <= limit:
        return np.arange(n)
    chance = np.zeros(n)
    for values in columns:
        span = np.ptp(values) or 1.0
        number = ((values - values.min()) / span * SETTINGS.spread_bins).astype(int)
        chance += 1 / np.bincount(number)[number]
    keys = rng.exponential(size=n) / chance  # the smallest are a sample without replacement
    return np.sort(np.argpartition(keys, limit)[:limit])


def shared_rows(
    survey: Survey,
    patches: Patches,
    rng: np.random.Generator,
    limit: int = SETTINGS.patches // 2,
    correction: Correction | None = None,
) -> Rows | None:
    """Make rows of the planes in overlaps, or None if there are none.

    The residual is the offset of the earlier view from the later one, along their mean normal.

    Parameters
    ----------
    survey : Survey
    patches : Patches
    rng : numpy.random.Generator
        For the selection if there are more pairs than the limit.
    limit : int
    correction : Correction, optional
        Used to pair two views of one plane, if it gives more pairs than the recorded positions.
    """
    tried = [(there, *_pairs(near)) for there, near in places(survey, patches, correction)]
    there, early, late, normal, between, residual = max(tried, key=lambda pair: support(pair[-1]))
    first = patches[early]
    second = patches[late]
    separation = np.linalg.norm(between, axis=1)
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
    separation = separation[kept]
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
        plane_noise(first, second, separation**2),
        np.minimum(first.points, second.points),
        SamplePulses.concatenate(pulses),
        first.pass_number,
        gps_time_2=second.gps_time,
    )


def compare_planes(first: Patches, second: Patches) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Mean normal (n, 3), vector between the middles (n, 3), and its normal component (n,).

    Parameters
    ----------
    first, second : Patches
        Two views of n planes.

    Returns
    -------
    three arrays
        Units of the last two: m.
    """
    normal = first.normal + second.normal
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)
    between = first.centre - second.centre
    return normal, between, np.einsum("ni,ni->n", normal, between)


def _pairs(patches):
    """Rows (n,), (n,) of two views of one plane, the earlier one first, and their
    compare_planes; each is in at most one pair with any other pass.
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
    for forward in (True, False):  # mutual nearest partners in each pass
        a = early
        b = late
        if not forward:
            a = late
            b = early
        key = a * (patches.pass_number.max(initial=0) + 1) + patches.pass_number[b]
        nearest = np.sort(np.unique(key, return_index=True)[1])
        early = early[nearest]
        late = late[nearest]
    return early, late, *compare_planes(patches[early], patches[late])


def plane_noise(first: Patches, second: Patches, square: np.ndarray) -> np.ndarray:
    """Variance (n,) of the difference, from both means, the normal and surface roughness.

    Parameters
    ----------
    first, second : Patches
        Of n planes each.
    square : (n,) array
        Squared distance between their middles. Units: m^2.
    """
    mean = [patches.variance / patches.points for patches in (first, second)]
    tilt = [m / patches.spread**2 for m, patches in zip(mean, (first, second), strict=True)]
    return mean[0] + mean[1] + square * (tilt[0] + tilt[1]) / 4 + SETTINGS.surface_sigma**2


@dataclass(frozen=True, repr=False)
class OnReference(Columns):
    """Patches that also exist in the reference surface.

    Parameters
    ----------
    patch : (m,) int array
        Their indices.
    direction : (m, 3) array
        Normal of the reference, toward the scanner.
    residual : (m,) array
        Offset from it along the direction. Units: m.
    noise : (m,) array
        Variance of the residual. Units: m^2.
    """

    patch: np.ndarray
    direction: np.ndarray
    residual: np.ndarray
    noise: np.ndarray


def on_reference(
    survey: Survey, patches: Patches, correction: Correction | None = None
) -> OnReference:
    """Compare patches with [scene] reference.

    Each patch's beams are cast into the reference from the recorded position of the scanner. The
    residual is the mean distance of the patch's plane from the facets at the beams. Patches without
    a parallel facet within the gate are missing in the reference, and so are those that disagree
    with all others close in time.

    Parameters
    ----------
    survey : Survey
        With a reference.
    patches : Patches
    correction : Correction, optional
        Used to find patches in the mesh, if it finds more than the recorded positions; control
        points may be wrong.

    Raises
    ------
    ValueError
        If the mesh is unusable, or in other coordinates.
    """
    origin = np.round(patches.centre.mean(axis=0))
    mesh = read_mesh(SceneScenario(kind="mesh", file=survey.reference), origin)
    both = places(survey, patches, correction)
    tried = [(near, *_compare(there, near, mesh, origin)) for there, near in both]
    near, direction, residual, met = max(tried, key=lambda place: support(place[2][place[3]]))
    if met.sum() < max(1, SETTINGS.overlap * len(patches)):
        raise ValueError(_elsewhere(survey, patches, mesh, origin))
    met[met] = consistent(patches.gps_time[met], direction[met], residual[met])
    residual += np.einsum("pi,pi->p", direction, patches.centre - near.centre)
    noise = patches.variance / patches.points + SETTINGS.surface_sigma**2
    return OnReference(np.flatnonzero(met), direction[met], residual[met], noise[met])


def _compare(survey, patches, mesh, origin):
    """Direction (p, 3), residual (p,) and flag (p,) of patches that exist in the mesh."""
    p, samples = patches.time.shape
    start = scanner_origin(survey, patches.time.ravel()) - origin
    end = patches.xyz.reshape(-1, 3) - origin
    rays = np.hstack([start, end - start]).astype(np.float32)
    triangle = mesh.caster.cast_rays(rays)["primitive_ids"].numpy()
    hit = triangle < len(mesh)
    triangle = np.where(hit, triangle, 0)
    own = np.repeat(patches.normal, samples, axis=0)
    normal = mesh.normal[triangle]
    offset = mesh.offset[triangle]
    cosine = np.einsum("ni,ni->n", normal, own)
    facing = normal * np.sign(cosine)[:, None]
    off = np.einsum("ni,ni->n", own, end - np.repeat(patches.centre - origin, samples, axis=0))
    distance = np.einsum("ni,ni->n", normal, end - own * off[:, None]) - offset
    distance *= np.sign(cosine)
    limit = np.repeat(gate(survey, patches.gps_time), samples)
    used = hit & (np.abs(cosine) >= np.cos(SETTINGS.parallel)) & (np.abs(distance) <= limit)
    used = used.reshape(p, samples)
    count = np.maximum(used.sum(axis=1), 1)
    residual = (used * distance.reshape(p, samples)).sum(axis=1) / count
    direction = (used[..., None] * facing.reshape(p, samples, 3)).sum(axis=1)
    length = np.linalg.norm(direction, axis=1, keepdims=True)
    met = (used.sum(axis=1) >= SETTINGS.facet_share * samples) & (length[:, 0] > 0)
    return direction / np.where(length > 0, length, 1.0), residual, met


def _elsewhere(survey, patches, mesh, origin):
    """Sentence on a reference surface away from the cloud."""
    centre = (patches.centre - origin).astype(np.float32)
    nearest_offset = mesh.caster.compute_closest_points(centre)["points"].numpy() - centre
    distance = np.median(np.linalg.norm(nearest_offset, axis=1))
    up = np.median(nearest_offset[:, 2])
    if abs(up) > 0.9 * distance:
        what = "in another height datum"
    else:
        what = "in another CRS or place"
    limit = float(np.median(gate(survey, patches.gps_time)))
    return (
        f"Hardly any of {len(patches)} flat patches of the cloud is within {limit:.2f} m of the "
        f"reference surface {survey.reference}: the median distance is {distance:.1f} m "
        f"({up:+.1f} m in height). It seems to be {what}; give it in the coordinates of the "
        "cloud."
    )


def patch_pulses(
    survey: Survey, patches: Patches, item: np.ndarray, sign: float = 1.0
) -> SamplePulses:
    """Make the pulses of patches.

    Parameters
    ----------
    survey : Survey
    patches : Patches
    item : (p,) int array
        Of each patch.
    sign : float
        -1 for the second patches of pairs.
    """
    p, samples = patches.time.shape
    return sample_pulses(
        survey,
        np.repeat(item, samples),
        np.full(p * samples, sign / samples),
        patches.xyz.reshape(-1, 3),
        patches.time.ravel(),
        patches.intensity.ravel(),
        np.repeat(patches.normal, samples, axis=0),
    )
