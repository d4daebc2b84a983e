"""Extraction: points of a cloud -> pieces by pass and visit -> fitted targets -> observations.

Near control, the kind and size of a target are known. Without control, the whole cloud is searched
for target-like objects while it streams.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace

import numpy as np

from mlscorr.matching import SETTINGS as MATCHING
from mlscorr.pos import PosErrors
from mlscorr.survey import PointCloud, Scanner, Survey, TargetObservations
from mlscorr.targets.candidates import Neighbourhoods, search_radius
from mlscorr.targets.fit import FittedTarget, distinct, fit_targets, why_useless
from mlscorr.targets.regions import BrightRegion, bright_regions
from mlscorr.targets.scanner_path import ScannerPath, split_visits
from mlscorr.targets.settings import SETTINGS
from mlscorr.targets.shapes import BY_EDGES

PassTarget = tuple[int, FittedTarget]  # number of a pass, or of its segment, and a target in it


def fit_near_control(
    index: int, cloud: PointCloud, survey: Survey, rng: np.random.Generator
) -> list[PassTarget]:
    """Fit targets of the surveyed kind and size near a control or check point.

    Parameters
    ----------
    index : int
        Index of the surveyed point, which gives position, kind and size.
    cloud : PointCloud
        Points within its search radius, relative to it. Units: m.
    survey : Survey
        Scanner noise blurs the outline, and the lever arm gives the origin of the beams.
    rng : numpy.random.Generator
        For the random samples of the flat patches.

    Returns
    -------
    list of (segment, FittedTarget)
        May contain several fits of one target.
    """
    surveyed = survey.surveyed
    place = surveyed.position[index]
    shape = surveyed.kind[index], float(surveyed.size[index])
    seed = rng.integers(2**63)  # the same for each search, so that they are independent
    by_edges = shape[0] in BY_EDGES or why_useless(cloud.intensity) is not None
    whole = search_radius(survey, surveyed)[index]
    radii = [whole]
    if by_edges:  # flat patches of distant streets and walls have more points than a small plate
        radii.insert(0, min(SETTINGS.near_radius + shape[1] * np.sqrt(2), whole))
    targets: list[PassTarget] = []
    for radius in dict.fromkeys(radii):
        ball = Neighbourhoods(np.zeros((1, 3)), np.array([radius]))
        if radius == whole:
            some = cloud
        else:
            some = cloud[ball.contains(cloud.xyz)]
        for segment, visit in split_visits(some, survey):
            path = ScannerPath.of(survey, visit.gps_time)
            known = [f for _, f in targets if visit.gps_time[0] <= f.gps_time <= visit.gps_time[-1]]
            generator = np.random.default_rng(seed)
            fits = fit_targets(
                visit, path, [shape], survey.scanner, generator, origin=place, known=known
            )
            if not by_edges:
                fits += _as_without_control(visit, place, survey, shape, generator, fits)
            targets += [(segment, fit) for fit in fits]
    return _with_motion(targets, survey)


def _as_without_control(visit, place, survey, shape, rng, known):
    """FittedTargets that a search of the whole cloud finds in a visit of a position."""
    visit = replace(visit, xyz=visit.xyz + place)
    return [
        target
        for piece, path, region in pieces(visit, survey)
        for target in fit_piece(piece, path, region, [shape], survey.scanner, rng, known)
    ]


def _with_motion(targets, survey):
    """Add the motion of the POS error to the covariances of targets."""
    time, duration = [[getattr(t, name) for _, t in targets] for name in ("gps_time", "duration")]
    motion = PosErrors.stated(survey.trajectory, survey.pos).motion_covariance(time, duration)
    return [
        (number, replace(target, covariance=target.covariance + moved))
        for (number, target), moved in zip(targets, motion, strict=True)
    ]


def as_observations(targets: Sequence[PassTarget]) -> TargetObservations:
    """Convert targets to observations without names, in their order.

    Parameters
    ----------
    targets : sequence of (pass number, FittedTarget)
    """
    n = len(targets)
    fitted = [target for _, target in targets]
    return TargetObservations(
        name=(None,) * n,
        pass_number=np.array([number for number, _ in targets], dtype=int),
        gps_time=np.array([target.gps_time for target in fitted], dtype=float),
        position=np.array([target.position for target in fitted]).reshape(n, 3),
        covariance=np.array([target.covariance for target in fitted]).reshape(n, 3, 3),
        normal=np.array([target.normal for target in fitted]).reshape(n, 3),
        kind=tuple(target.kind for target in fitted),
        size=np.array([target.size for target in fitted], dtype=float),
        points=np.array([target.points for target in fitted], dtype=int),
    )


def search_targets(
    chunks: Iterable[PointCloud],
    survey: Survey,
    shapes: Sequence[tuple[str, float | None]],
    rng: np.random.Generator,
) -> Iterator[tuple[PointCloud, list[FittedTarget]]]:
    """Fit target-like objects in the chunks of one cloud file while it streams.

    Memory is one and a quarter chunks, regardless of the intensities. If points are in order of
    time, the last second of a chunk is searched again with the next.

    Parameters
    ----------
    chunks : iterable of PointCloud
    survey : Survey
        Trajectory, lever arm and scanner are used.
    shapes : sequence of (kind, size or None)
        See fit_targets.
    rng : numpy.random.Generator

    Yields
    ------
    chunk : PointCloud
    targets : list of FittedTarget
        A target may be in the lists of two chunks.
    """
    carried = None
    for chunk in chunks:
        if carried is None:
            whole = chunk
        else:
            whole = PointCloud.concatenate([carried, chunk])
        targets = []
        for piece in pieces(whole, survey):
            targets += fit_piece(*piece, shapes, survey.scanner, rng)
        yield chunk, targets
        carried = _end_of(chunk)


def _end_of(chunk):
    """End of a chunk, at most a quarter of it: a scanner passes a target within a second."""
    first = int((1.0 - SETTINGS.largest_carry) * len(chunk))
    return chunk[first:][chunk.gps_time[first:] > chunk.gps_time.max() - MATCHING.visit_gap / 2]


def pieces(
    cloud: PointCloud, survey: Survey
) -> Iterator[tuple[PointCloud, ScannerPath, BrightRegion]]:
    """Yield the surroundings of each bright region, by pass and visit.

    Parameters
    ----------
    cloud : PointCloud
    survey : Survey
        Trajectory and lever arm are used.
    """
    regions = bright_regions(cloud.xyz, cloud.intensity)[: SETTINGS.largest_fits]
    centre = np.array([region.centre for region in regions]).reshape(-1, 3)
    radius = 2 * np.array([region.radius for region in regions])  # with the area behind its edges
    for region, rows in zip(regions, Neighbourhoods(centre, radius).each(cloud.xyz), strict=True):
        for _, visit in split_visits(cloud[rows], survey):
            surplus = max(0, len(visit) - SETTINGS.piece_points)  # from a stop in front of it
            piece = visit[surplus // 2 : len(visit) - (surplus + 1) // 2]
            yield piece, ScannerPath.of(survey, piece.gps_time), region


def fit_piece(
    cloud: PointCloud,
    path: ScannerPath,
    region: BrightRegion,
    shapes: Sequence[tuple[str, float | None]],
    scanner: Scanner,
    rng: np.random.Generator,
    known: Sequence[FittedTarget] = (),
) -> list[FittedTarget]:
    """Return the FittedTarget of the best shape for a region, as a list.

    Parameters
    ----------
    cloud, path, region
        A piece from ``pieces``.
    shapes, scanner, rng, known
        See fit_targets.
    """
    targets = [
        target
        for shape in shapes
        for target in fit_targets(cloud, path, [shape], scanner, rng, region, known=known)
        if target.size <= SETTINGS.largest_size
    ]
    return distinct(targets)
