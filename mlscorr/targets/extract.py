"""Points of a cloud -> pieces by pass and visit -> targets as fitted -> observations.

Near control the kind and size of a target are known; without it a whole cloud is searched for
whatever looks like one, while it streams.
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

PassTarget = tuple[int, FittedTarget]  # number of a pass, or of its segment, and a target of it


def fit_near_control(
    index: int, cloud: PointCloud, survey: Survey, rng: np.random.Generator
) -> list[PassTarget]:
    """Fit targets of the surveyed kind and size near a control or check point.

    Parameters
    ----------
    index : int
        Of the surveyed point, which says where to look and for what.
    cloud : PointCloud
        Within its search radius, its places from there. Units: m.
    survey : Survey
        Its scanner's noise blurs the outline, and its lever arm tells where the beams came from.
    rng : numpy.random.Generator
        For the random samples of the flat patches.

    Returns
    -------
    list of (segment, FittedTarget)
        Of one target several fits, by what was looked at.
    """
    surveyed = survey.surveyed
    place = surveyed.position[index]
    shape = surveyed.kind[index], float(surveyed.size[index])
    seed = rng.integers(2**63)  # alike for each look: none needs another
    by_edges = shape[0] in BY_EDGES or why_useless(cloud.intensity) is not None
    whole = search_radius(survey, surveyed)[index]
    radii = [whole]
    if by_edges:  # of a small plate, flat patches of streets and walls farther off come first
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
    """FittedTargets that a search of the whole cloud finds in a visit of a place."""
    visit = replace(visit, xyz=visit.xyz + place)
    return [
        target
        for piece, path, region in pieces(visit, survey)
        for target in fit_piece(piece, path, region, [shape], survey.scanner, rng, known)
    ]


def _with_motion(targets, survey):
    """The targets with the motion of the POS error in their covariances."""
    time, duration = [[getattr(t, name) for _, t in targets] for name in ("gps_time", "duration")]
    motion = PosErrors.stated(survey.trajectory, survey.pos).motion_covariance(time, duration)
    return [
        (number, replace(target, covariance=target.covariance + moved))
        for (number, target), moved in zip(targets, motion, strict=True)
    ]


def as_observations(targets: Sequence[PassTarget]) -> TargetObservations:
    """Targets as observations without names, in their order.

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
    """Fit target-like objects in the chunks of one cloud file, while they pass through.

    Memory is one chunk and a quarter, whatever the intensities are. Where points come in order of
    time, the last second of a chunk is searched again with the next.

    Parameters
    ----------
    chunks : iterable of PointCloud
    survey : Survey
        Its trajectory, lever arm and scanner.
    shapes : sequence of (kind, size or None)
        As fit_targets takes them.
    rng : numpy.random.Generator

    Yields
    ------
    chunk : PointCloud
    targets : list of FittedTarget
        One may be in the lists of two chunks.
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
    """The end of a chunk, at most a quarter of it: a scanner passes a target within a second."""
    first = int((1.0 - SETTINGS.largest_carry) * len(chunk))
    return chunk[first:][chunk.gps_time[first:] > chunk.gps_time.max() - MATCHING.visit_gap / 2]


def pieces(
    cloud: PointCloud, survey: Survey
) -> Iterator[tuple[PointCloud, ScannerPath, BrightRegion]]:
    """What lies about each bright region, by pass and visit.

    Parameters
    ----------
    cloud : PointCloud
    survey : Survey
        Its trajectory and lever arm.
    """
    regions = bright_regions(cloud.xyz, cloud.intensity)[: SETTINGS.largest_fits]
    centre = np.array([region.centre for region in regions]).reshape(-1, 3)
    radius = 2 * np.array([region.radius for region in regions])  # what lies behind its edges
    for region, rows in zip(regions, Neighbourhoods(centre, radius).each(cloud.xyz), strict=True):
        for _, visit in split_visits(cloud[rows], survey):
            surplus = max(0, len(visit) - SETTINGS.piece_points)  # of a stop in front of it
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
    """The FittedTarget of the shape that fits a region best, each fitted to the end, in a list.

    Parameters
    ----------
    cloud, path, region
        A piece as of ``pieces``.
    shapes, scanner, rng, known
        As fit_targets takes them.
    """
    targets = [
        target
        for shape in shapes
        for target in fit_targets(cloud, path, [shape], scanner, rng, region, known=known)
        if target.size <= SETTINGS.largest_size
    ]
    return distinct(targets)
