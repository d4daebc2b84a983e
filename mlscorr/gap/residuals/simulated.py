"""Comparison of a survey with clouds from its simulator: by beams, targets and patches.

Beams are paired by time. If the simulated cloud lacks the times of a patch, or has them for other
beams, as with another clock, the patch is compared with the simulated patch at its position.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import cKDTree

from mlscorr.correction import Correction
from mlscorr.gap.residuals._surfaces import (
    OnReference,
    compare_planes,
    consistent,
    gate,
    moved_by,
    places,
    plane_noise,
    spread,
)
from mlscorr.gap.residuals.channels import return_rate, roughness
from mlscorr.gap.residuals.pairing import patch_rows, target_rows
from mlscorr.gap.residuals.patches import Patches
from mlscorr.gap.residuals.rows import Rows
from mlscorr.gap.residuals.settings import SETTINGS
from mlscorr.survey import Matched, PointCloud, Survey, TargetObservations
from mlscorr.targets import Candidates


class SimulatedBeams:
    """Simulated points of the pulses behind a survey's patches, from chunks.

    Parameters
    ----------
    patches : Patches
        Of the survey.
    correction : Correction, optional
        Of the survey; the simulator may or may not include its error.
    """

    def __init__(self, patches: Patches, correction: Correction | None = None):
        clouds = list(patches.cloud)
        time = np.concatenate([np.zeros(0), *(cloud.gps_time for cloud in clouds)])
        order = np.argsort(time, kind="stable")
        self._time = time[order]
        self._place = order
        self._observed = np.vstack([np.zeros((0, 3)), *(cloud.xyz for cloud in clouds)])
        self._moved = moved_by(correction, self._observed, time)
        self.patch = np.repeat(np.arange(len(clouds)), [len(cloud) for cloud in clouds])
        self.xyz = np.full((len(time), 3), np.nan)

    def add(self, chunk: PointCloud) -> None:
        """Add the points of the same pulses; the nearest one of several with one time."""
        if len(self._time) == 0 or len(chunk) == 0:
            return
        after = np.searchsorted(self._time, chunk.gps_time)
        near = np.clip(np.stack([after - 1, after]), 0, len(self._time) - 1)
        lag = np.abs(self._time[near] - chunk.gps_time)
        row = near[lag.argmin(axis=0), np.arange(len(chunk))]
        same = np.flatnonzero(lag.min(axis=0) <= SETTINGS.same_time)
        place = self._place[row[same]]
        xyz = chunk.xyz[same]
        distance = self._distance(xyz, place)
        known = self._distance(self.xyz[place], place)
        closer = np.flatnonzero((distance <= SETTINGS.cell) & ~(distance >= known))
        closer = closer[np.argsort(-distance[closer], kind="stable")]  # the nearest comes last
        self.xyz[place[closer]] = xyz[closer]

    def _distance(self, xyz, place):
        """Distance of points (n, 3) from the observed, or corrected, ones at a position."""
        offset = xyz - self._observed[place]
        moved = self._moved[place]
        return np.minimum(*(np.linalg.norm(each, axis=1) for each in (offset, offset - moved)))

    @property
    def offset(self) -> np.ndarray:
        """Offset of simulated points from the observed ones (n, 3); NaN without one. m."""
        return self._observed - self.xyz


@dataclass(frozen=True)
class SimulatedClouds:
    """Results of reading simulated clouds once.

    Parameters
    ----------
    name : str
        Name of their folder.
    matched : TargetObservations
        Observations matched with the surveyed points.
    patches : Patches or None
    beams : SimulatedBeams or None
        None if the survey has no patches.
    correction : Correction, optional
        From the same control points: the error included in the simulation.
    """

    name: str
    matched: TargetObservations
    patches: Patches | None
    beams: SimulatedBeams | None
    correction: Correction | None = None


def rows_against(
    survey: Survey,
    matched: TargetObservations,
    candidates: Candidates,
    patches: Patches | None,
    simulated: SimulatedClouds,
    correction: Correction | None = None,
) -> tuple[Rows, str]:
    """Rows of observed minus simulated, NaN without a pair, and a sentence on the pairs.

    Parameters
    ----------
    survey : Survey
    matched : TargetObservations
        Of the survey.
    candidates : Candidates
        Points near its targets.
    patches : Patches or None
        Of the survey, for which the SimulatedBeams were collected.
    simulated : SimulatedClouds
    correction : Correction, optional
        Of the survey, for pairing of patches. Recorded positions are compared.

    Raises
    ------
    ValueError
        If the clouds belong to another survey, location or CRS.
    """
    parts = [_against_targets(survey, matched, candidates, simulated)]
    targets = int(np.isfinite(parts[0].residual).sum()) // 3
    by_beams = by_place = 0
    if patches is not None:
        corrected, near = places(survey, patches, correction)[-1]
        moved = moved_by(simulated.correction, patches.centre, patches.gps_time)
        near = replace(near, centre=near.centre - moved)
        direction, residual, noise = _by_beams(corrected, patches, near, simulated.beams)
        known = np.isfinite(residual)
        by_beams = int(known.sum())
        other = None
        if simulated.patches is not None:
            other = _nearest(near, simulated.patches)
            also = _by_place(corrected, patches, near, simulated.patches, other)
            direction[~known], residual[~known], noise[~known] = (v[~known] for v in also)
            by_place = int(np.isfinite(residual).sum()) - by_beams
        surface = OnReference(np.arange(len(patches)), direction, residual, noise)
        part = patch_rows(survey, patches, surface)
        parts.append(_against_channels(part, survey, simulated.patches, other))
    rows = Rows.concatenate(parts)
    if not np.isfinite(rows.residual[rows.metric]).any():
        raise ValueError(_elsewhere(survey, patches, simulated))
    number = 0 if patches is None else len(patches)
    elsewhere = (
        f" No simulated pulse of the same time is within {SETTINGS.cell:g} m of the real point: "
        "another clock, other beams or another place was simulated."
    )
    is_elsewhere = number > 0 and not np.isfinite(simulated.beams.xyz).any()
    is_whole = targets == len(matched) and by_beams + by_place == number
    return rows, (
        f"{simulated.name}: {targets} of {len(matched)} observed targets were paired, and "
        f"{by_beams + by_place} of {number} patches ({by_beams} by pulses of the same time, "
        f"{by_place} by position){'.' if is_whole else '; the rest is not compared.'}"
        f"{elsewhere * is_elsewhere}{_shifted(survey, simulated.matched) if targets else ''}"
    )


def spread_patches(patches: Patches) -> Patches:
    """Choose the patches to compare, spread over time and directions.

    Parameters
    ----------
    patches : Patches
    """
    columns = [patches.gps_time, *patches.normal.T]
    rng = np.random.default_rng(0)
    return patches[spread(columns, SETTINGS.patches, rng)]


def without_unpaired(compared: Sequence[Rows]) -> list[Rows]:
    """Rows against several simulated clouds, limited to those paired in all.

    Parameters
    ----------
    compared : sequence of Rows
        Rows of the same items, from rows_against.
    """
    keep = np.all([np.isfinite(rows.residual) for rows in compared], axis=0)
    return [rows.select(keep) for rows in compared]


def _against_targets(survey, matched, candidates, simulated):
    """Target rows with the same name at about the same time."""
    rows = target_rows(survey, matched, candidates)
    other = simulated.matched
    residual = np.full(len(rows), np.nan)
    noise = rows.noise.copy()
    for i in range(len(matched)):
        same = np.flatnonzero(np.array(other.name, dtype=object) == matched.name[i])
        lag = np.abs(other.gps_time[same] - matched.gps_time[i])
        if len(same) == 0 or lag.min() > SETTINGS.pause:
            continue
        j = same[np.argmin(lag)]
        on = np.flatnonzero(rows.item == i)
        axes = rows.direction[on]
        residual[on] = axes @ (matched.position[i] - other.position[j])
        noise[on] += np.einsum("ai,ij,aj->a", axes, other.covariance[j], axes)
    return replace(rows, residual=residual, noise=noise)


def _by_beams(survey, patches, near, beams):
    """Direction (p, 3), residual and its variance (p,) from pulses of the same times, otherwise
    NaN.
    """
    normal = patches.normal
    p = len(patches)
    along = np.einsum("ni,ni->n", beams.offset, normal[beams.patch])
    residual = np.full(p, np.nan)
    noise = np.ones(p)
    ends = np.searchsorted(beams.patch, np.arange(p + 1))
    for i in range(p):
        values = along[ends[i] : ends[i + 1]]
        count = len(values)
        values = values[np.isfinite(values)]
        if len(values) < max(SETTINGS.plane_points, SETTINGS.facet_share * count):
            continue
        off = np.abs(values - np.median(values))
        scatter = max(1.4826 * np.median(off), SETTINGS.file_step)
        values = values[off <= SETTINGS.trims[-1] * scatter]
        if len(values) >= SETTINGS.facet_share * count:
            residual[i] = values.mean()
            noise[i] = values.var(ddof=1) / len(values) + SETTINGS.surface_sigma**2
    return normal.copy(), _credible(survey, patches, near, normal, residual), noise


def _credible(survey, patches, near, direction, residual):
    """Residuals (p,), with NaN for those on another surface, judged at the true positions."""
    left = residual + np.einsum("pi,pi->p", direction, near.centre - patches.centre)
    residual = np.where(np.abs(left) <= gate(survey, patches.gps_time), residual, np.nan)
    known = np.flatnonzero(np.isfinite(residual))
    agree = consistent(patches.gps_time[known], direction[known], left[known])
    residual[known[~agree]] = np.nan
    return residual


def _nearest(patches, simulated):
    """Simulated patch (p,) at each patch's position and time, parallel to it; -1 without one."""
    radius = SETTINGS.pair_distance * SETTINGS.cell
    near = cKDTree(simulated.centre).query_ball_point(patches.centre, radius)
    other = np.full(len(patches), -1)
    for i, rows in enumerate(near):
        j = np.array(rows, dtype=int)
        cosine = simulated.normal[j] @ patches.normal[i]
        later = np.abs(simulated.gps_time[j] - patches.gps_time[i])
        j = j[(cosine >= np.cos(SETTINGS.parallel / 2)) & (later <= SETTINGS.pause)]
        if len(j):
            other[i] = j[np.argmin(np.linalg.norm(simulated.centre[j] - patches.centre[i], axis=1))]
    return other


def _by_place(survey, patches, near, simulated, other):
    """Same as _by_beams, from patches at the same positions."""
    pair = simulated[np.maximum(other, 0)]
    normal, between, _ = compare_planes(near, pair)
    noise = plane_noise(patches, pair, (between**2).sum(axis=1))
    residual = np.einsum("pi,pi->p", normal, patches.centre - pair.centre)
    residual = np.where(other >= 0, residual, np.nan)
    return normal, _credible(survey, patches, near, normal, residual), noise


def _against_channels(rows, survey, simulated, other):
    """Roughness and return rates minus those of the simulated patches; NaN without one."""
    residual = rows.residual.copy()
    noise = rows.noise.copy()
    assumed = rows.assumed.copy()
    channels = np.isin(rows.channel, ("roughness", "return_rate"))
    if simulated is None:
        return replace(rows, residual=np.where(channels, np.nan, residual))
    ratio, ratio_noise, _, flat = roughness(survey, simulated)
    share, share_noise, counted = return_rate(simulated)
    for channel, value, variance, known in (
        ("roughness", ratio, ratio_noise, flat),
        ("return_rate", share, share_noise, counted),
    ):
        on = np.flatnonzero(rows.channel == channel)
        pair = other[rows.item[on]]
        has = (pair >= 0) & known[pair]
        residual[on] = np.where(has, residual[on] - value[pair], np.nan)
        noise[on] += np.where(has, variance[pair], 0.0)
        if channel == "roughness" and has.any():
            # a patch's own rate would be correlated with the residual, which would then indicate
            # noise
            assumed[on] *= np.exp(np.median(value[pair[has]]))
    return replace(rows, residual=residual, noise=noise, assumed=assumed)


def _shifted(survey, matched):
    """Sentence on the offset of simulated targets from their surveyed positions."""
    misclosure = Matched.by_name(matched, survey.surveyed).misclosure
    middle = "/".join(f"{v:+.3f}" for v in -np.median(misclosure, axis=0))
    return (
        f" Median offset of its targets from their surveyed positions: {middle} m (E/N/H). A "
        "wrong datum of this size can't be detected."
    )


def _elsewhere(survey, patches, simulated):
    """Sentence on clouds that do not overlap the survey."""
    where = "has neither a flat patch nor a matched target"
    if patches is not None and simulated.patches is not None:
        away, _ = cKDTree(simulated.patches.centre).query(patches.centre)
        where = f"has its surfaces {np.median(away):.1f} m away (median)"
    return (
        f"Nothing in {simulated.name} can be paired with {survey.path}: it {where}. It is of "
        "another survey or place, or in another CRS; simulate the trajectory of this survey."
    )
