"""Targets in one piece of cloud, for extraction near control and for search without it."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import chain

import numpy as np

from mlscorr.matching import SETTINGS as MATCHING
from mlscorr.survey import PointCloud, Scanner
from mlscorr.targets._echoes import Echoes
from mlscorr.targets._outline import Outline
from mlscorr.targets._plane import Plane
from mlscorr.targets._seeds import Seed, bright_seeds, hole_seeds, plate_seeds, region_seeds
from mlscorr.targets._shape_fit import ShapeFit, exact_fit, rough_fit
from mlscorr.targets.regions import BrightRegion
from mlscorr.targets.scanner_path import ScannerPath
from mlscorr.targets.settings import SETTINGS
from mlscorr.targets.shapes import BY_EDGES


@dataclass(frozen=True)
class TargetView:
    """Data for a figure of one target, in its plane; (u, v) from an arbitrary origin, in m.

    Parameters
    ----------
    points : (k, 2) array
        Crossings of the beams near the target with its plane.
    state : (k,) int array
        1 bright, 0 dark, -1 passed by.
    outline : Outline
        Fitted outline, larger than the size if the disc blooms.
    axes : (2, 3) array
        Map directions of u and v.
    """

    points: np.ndarray
    state: np.ndarray
    outline: Outline
    axes: np.ndarray


@dataclass(frozen=True)
class Centre:
    """Position and time at which a beam meets the center of an outline in a plane.

    Parameters
    ----------
    position : (3,) array
        Units: m.
    covariance : (3, 3) array
        Units: m^2.
    gps_time : float
        Units: s.
    duration : float
        Standard deviation of the points' times. Units: s.
    normal : (3,) array
        Toward the scanner.
    """

    position: np.ndarray
    covariance: np.ndarray
    gps_time: float
    duration: float
    normal: np.ndarray


@dataclass(frozen=True)
class FittedTarget(Centre):
    """One target in one piece of cloud: the data of a row of TargetObservations, and more.

    The position is in map coordinates; the covariance does not include the motion of the POS error.

    Parameters
    ----------
    kind : str
    size, size_sigma : float
        As given (sigma 0), or estimated. Units: m.
    points : int
        Number of points on the target; for a hole, on the board around it.
    score : float
        Likeness to a target, 0 to 1, from overlap, support of the outline, contrast and flatness.
    cloud : PointCloud
        Points on the target.
    view : TargetView
    """

    kind: str
    size: float
    size_sigma: float
    points: int
    score: float
    cloud: PointCloud
    view: TargetView

    @property
    def outline(self) -> Outline:
        """Fitted outline."""
        return self.view.outline

    def overlaps(self, other: "FittedTarget") -> bool:
        """True if two fits are one target at one visit: less than half a target apart.

        Parameters
        ----------
        other : FittedTarget
        """
        near = np.linalg.norm(self.position - other.position) < max(self.size, other.size) / 2
        return bool(near and abs(self.gps_time - other.gps_time) < MATCHING.visit_gap)


def fit_targets(
    cloud: PointCloud,
    path: ScannerPath,
    shapes: Sequence[tuple[str, float | None]],
    scanner: Scanner,
    rng: np.random.Generator,
    region: BrightRegion | None = None,
    origin: np.ndarray | None = None,
    known: Sequence[FittedTarget] = (),
) -> list[FittedTarget]:
    """Fit targets of the given shapes in one piece of cloud of one pass and visit.

    Parameters
    ----------
    cloud : PointCloud
        A few meters of cloud.
    path : ScannerPath
        Path while the points were measured.
    shapes : sequence of (kind, size or None)
        Shapes to search for; a size (m) of None is estimated.
    scanner : Scanner
        Its noise blurs the outline.
    rng : numpy.random.Generator
        For the random samples of the flat patches.
    region : BrightRegion, optional
        Restricts the search to this region.
    origin : (3,) array, optional
        Origin of the cloud's coordinates; 0 by default. Units: m.
    known : sequence of FittedTarget
        Targets already found in this visit; no new fit is made where one of them is good.

    Returns
    -------
    list of FittedTarget
        Sorted by decreasing score, without two at the same position. If the intensity is useless,
        free-standing plates are found by their edges.
    """
    if len(cloud) < SETTINGS.smallest_count:
        return []
    if not (np.diff(cloud.gps_time) >= 0).all():
        cloud = cloud[np.argsort(cloud.gps_time, kind="stable")]
    if origin is None:
        origin = cloud.xyz.mean(axis=0)
        cloud = replace(cloud, xyz=cloud.xyz - origin)
    intensity = cloud.intensity
    tolerance = max(SETTINGS.thickness, 4 * scanner.range_noise)
    path = path.seen_from(origin)
    echoes = Echoes(cloud.xyz, cloud.gps_time, intensity, path, tolerance)
    blind = why_useless(intensity) is not None
    near = [replace(target, position=target.position - origin) for target in known]
    seeds: list[tuple[Seed, str, float | None]] = []
    for kind, size in shapes:
        if kind == "hole":
            of_shape = hole_seeds(echoes, size, rng)
        elif kind in BY_EDGES or blind:
            of_shape = plate_seeds(echoes, kind, size, rng)
        elif region is not None:
            of_shape = region_seeds(echoes, region, origin, kind, size)
        else:
            of_shape = bright_seeds(echoes, kind, size)
        seeds += [(seed, kind, size) for seed in of_shape]
    return [
        _as_target(echoes, fit, origin) for fit in _best(fit_seeds(echoes, seeds, near, scanner))
    ]


def why_useless(intensity: np.ndarray) -> str | None:
    """Sentence for intensities that do not show bright targets; None if they do.

    Parameters
    ----------
    intensity : (n,) array
        8 bits stored in 16 are no reason, because only ratios count.

    >>> import numpy as np
    >>> why_useless(np.zeros(1000))
    'The intensity of all points is 0.'
    >>> why_useless(np.r_[np.full(900, 20), np.arange(50, 150)]) is None
    True
    """
    values = np.unique(intensity)
    if len(values) == 0:
        return "No point has an intensity."
    if len(values) == 1:
        return f"The intensity of all points is {values[0]:g}."
    if len(values) < SETTINGS.smallest_levels:
        return f"The intensity has only {len(values)} different values."
    return None


def fit_seeds(
    echoes: Echoes,
    seeds: Sequence[tuple[Seed, str, float | None]],
    known: Sequence[FittedTarget],
    scanner: Scanner,
) -> list[ShapeFit]:
    """Exact fits of seeds, without those that a good fit already covers.

    If the exact fit refuses a rough fit, such as one of a single scan line, the seeds that waited
    for it are tried again.

    Parameters
    ----------
    echoes : Echoes
    seeds : sequence of (Seed, kind, size or None)
    known : sequence of FittedTarget
    scanner : Scanner
    """
    fits: list[ShapeFit] = []
    while seeds:
        rough: list[ShapeFit] = []
        waiting = []
        for seed in seeds:
            if any(_is_settled(fit, *seed) for fit in (*known, *fits)):
                continue
            if any(_is_settled(fit, *seed) for fit in rough):
                waiting.append(seed)
                continue
            fit = rough_fit(echoes, *seed)
            if fit is not None:
                rough.append(fit)
        best = _best(rough)
        exact = [exact_fit(echoes, fit, scanner) for fit in best]
        fits += [fit for fit in exact if fit is not None]
        if all(fit is not None for fit in exact):
            break
        others = [fit for fit in rough if not any(fit is tried for tried in best)]
        seeds = [*waiting, *((fit.seed, fit.kind, fit.size) for fit in others)]
    return fits


def distinct(targets: Iterable[FittedTarget]) -> list[FittedTarget]:
    """Best target of each position and visit, in order of time.

    Of two fits of the same target, the one with more points is kept, because the edge of a piece
    cut the other.

    Parameters
    ----------
    targets : iterable of FittedTarget
    """
    kept: dict[int, list[FittedTarget]] = {}  # by the pause in time, as only these overlap
    for target in sorted(targets, key=lambda target: -target.score * np.sqrt(target.points)):
        slot = int(target.gps_time / MATCHING.visit_gap)
        near = chain(*(kept.get(number, []) for number in (slot - 1, slot, slot + 1)))
        if not any(target.overlaps(other) for other in near):
            kept.setdefault(slot, []).append(target)
    return sorted(chain(*kept.values()), key=lambda target: target.gps_time)


def _is_settled(fit, seed, kind, size):
    """True if a good fit of the same shape covers a seed, so that another level gives nothing
    new.
    """
    if (fit.kind, fit.size) != (kind, size) or fit.outline.overlap < SETTINGS.close_overlap:
        return False
    middle = seed.plane.origin + seed.middle @ seed.plane.axes[:2]
    return np.linalg.norm(fit.position - middle) < SETTINGS.rough_play * fit.outline.size


def _best(fits):
    """Best fit at each position, sorted by score; up to half a target apart is one position."""
    best: list[ShapeFit] = []
    for fit in sorted(fits, key=lambda fit: -fit.assessment.rank):
        distances = [np.linalg.norm(fit.position - other.position) for other in best]
        sizes = [max(fit.outline.size, other.outline.size) for other in best]
        if all(distance >= size / 2 for distance, size in zip(distances, sizes, strict=True)):
            best.append(fit)
    return best


def _as_target(echoes, fit, origin):
    """Convert a fit to the map: center, covariance, normal toward the scanner, time at the
    center.
    """
    points, state, rows = fit.beams
    plane = fit.seed.plane
    outline = fit.outline
    met = rows[fit.on_target & (rows >= 0)]
    intensity = echoes.intensity[met].astype(float)
    centre = vars(centre_of(echoes, plane, outline, met))
    size = fit.size
    sigma = 0.0
    if size is None:
        size = outline.size
        sigma = outline.size_sigma
    return FittedTarget(
        **centre | {"position": centre["position"] + origin},
        kind=fit.kind,
        size=float(size),
        size_sigma=float(sigma),
        points=len(met),
        score=fit.assessment.score,
        cloud=PointCloud(echoes.xyz[met] + origin, echoes.gps_time[met], intensity),
        view=TargetView(points, state, outline, plane.axes[:2]),
    )


def centre_of(echoes: Echoes, plane: Plane, outline: Outline, rows: np.ndarray) -> Centre:
    """Center of an outline in space from the points on the target.

    Parameters
    ----------
    echoes : Echoes
    plane : Plane
    outline : Outline
    rows : (k,) int array
        Points on the target.

    Height and time at the center follow by regression, because the points may be on one side of it.
    A plane that is too far moves the center along the beam. Range noise may be correlated from
    point to point, which simple sigmas of a fit ignore; the residuals show by how much.
    """
    crossing = plane.crossing(echoes.xyz[rows], echoes.sight(rows))
    weights = np.linalg.pinv(np.column_stack([np.ones(len(rows)), crossing - outline.centre]))[0]
    height = plane.coordinates(echoes.xyz[rows])[:, 2]
    free = max(len(rows) - 3, 1)
    variance = plane.sigma**2 * (free + 2) / free * _correlation_factor(height)
    beam = plane.axes @ echoes.sight(rows).mean(axis=0)
    covariance = variance * (weights @ weights) * np.outer(beam, beam) / beam[2] ** 2
    covariance[:2, :2] += outline.covariance
    time = echoes.gps_time[rows] - echoes.gps_time[0]
    span = echoes.gps_time[[0, -1]] - echoes.gps_time[0]
    normal = plane.axes[2]
    if beam[2] > 0:
        normal = -normal
    floor = (SETTINGS.rounding / 3) ** 2  # rounding that remains in a mean of many points
    return Centre(
        position=plane.origin + outline.centre @ plane.axes[:2],
        covariance=plane.axes.T @ covariance @ plane.axes + floor * np.eye(3),
        gps_time=float(echoes.gps_time[0] + np.clip(weights @ time, *span)),
        duration=float(time.std()),
        normal=normal,
    )


def _correlation_factor(residual):
    """Factor by which correlation from point to point increases the variance of a mean, at least 1.

    It is 1 + 2 times the sum of the autocorrelation, up to the lag where noise dominates.
    """
    n = len(residual)
    centred = residual - residual.mean()
    total = centred @ centred
    factor = 1.0
    for lag in range(1, n // 4):
        correlation = centred[lag:] @ centred[:-lag] / max(total, 1e-30)
        if correlation < 2 / np.sqrt(n):
            break
        factor += 2 * correlation
    return factor
