"""Search of a whole cloud for whatever looks like a target, without control, while it streams."""

from collections.abc import Iterable, Iterator, Sequence

import numpy as np

from mlscorr.matching import SETTINGS as MATCHING
from mlscorr.survey import PointCloud, Scanner, Survey
from mlscorr.targets._visits import split_visits
from mlscorr.targets.balls import Neighbourhoods
from mlscorr.targets.fit import FittedTarget, distinct, fit_targets
from mlscorr.targets.regions import BrightRegion, bright_regions
from mlscorr.targets.scanner_path import ScannerPath
from mlscorr.targets.settings import SETTINGS


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
