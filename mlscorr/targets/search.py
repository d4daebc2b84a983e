"""Search of a whole cloud for whatever looks like a target, without control, while it streams."""

import numpy as np

from mlscorr.survey import PointCloud
from mlscorr.targets.blobs import bright_blobs
from mlscorr.targets.candidates import PAUSE, Neighbourhoods
from mlscorr.targets.clusters import split_by_time
from mlscorr.targets.fit import fit_targets
from mlscorr.targets.seeds import Spot
from mlscorr.targets.visits import scanner_path

OVERLAP = 1.0  # s: the scanner passes a target in less than that
MOST_CARRIED = 0.25  # of a chunk: points that are looked at again, so that no target is cut in two
MOST_FITS = 150  # of a chunk's blobs, the most striking: bounds time and memory when all glitters
LARGEST = 1.5  # m: nobody carries a larger target
CONTEXT = 0.4  # m around a blob: a board's rim, and what lies behind its edges
MOST_POINTS = 50_000  # of a piece: a stop in front of a target tells no more with more of them


def search_targets(chunks, trajectory, shapes, scanner, rng, lever_arm):
    """Fit target-like objects in the chunks of one cloud file, while they pass through.

    Memory is one chunk and a quarter, whatever the intensities are. Where points come in order of
    time, the last second of a chunk is searched again with the next.

    Parameters
    ----------
    chunks : iterable of PointCloud
    trajectory : Trajectory
    shapes : sequence of (kind, size or None)
        As fit_targets takes them.
    scanner : Scanner
    rng : numpy.random.Generator
    lever_arm : (3,) array
        Of the scanner. Units: m.

    Yields (chunk, list of FittedTarget); an object may be in the lists of two chunks.
    """
    carried = None
    for chunk in chunks:
        whole = chunk if carried is None else PointCloud.concatenate([carried, chunk])
        pieces = _pieces(whole, trajectory, lever_arm)
        yield chunk, [t for piece in pieces for t in _fit_piece(*piece, shapes, scanner, rng)]
        carried = _end_of(chunk)


def _fit_piece(cloud, sight, spot, shapes, scanner, rng):
    """FittedTarget of the shape that fits a spot best, each fitted to the end, in a list."""
    found = [
        target
        for shape in shapes
        for target in fit_targets(cloud, sight, [shape], scanner, rng, spot)
        if target.size <= LARGEST
    ]
    return distinct(found)


def distinct(found):
    """The best FittedTarget of each place and visit, in order of time.

    Where two are the same, the one with more points is kept: the edge of a chunk cut the other.
    """
    kept = []
    for one in sorted(found, key=lambda target: -target.score * np.sqrt(target.points)):
        if not any(are_same(one, other) for other in kept):
            kept.append(one)
    return sorted(kept, key=lambda target: target.gps_time)


def are_same(one, other):
    """Whether two FittedTarget overlap, with less than two seconds between them."""
    apart = np.linalg.norm(one.position - other.position)
    near = apart < max(one.size, other.size) / 2
    return near and abs(one.gps_time - other.gps_time) < PAUSE


def _end_of(chunk):
    """The last second of a chunk, at most a quarter of it."""
    fewest = int((1.0 - MOST_CARRIED) * len(chunk))
    late = chunk.gps_time[fewest:] > chunk.gps_time.max() - OVERLAP
    return chunk[fewest:][late]


def _pieces(cloud, trajectory, lever_arm):
    """(PointCloud, sight (n, 3), Spot) about each striking blob, one for each pass and visit."""
    blobs = bright_blobs(cloud.xyz, cloud.intensity)
    if len(blobs) == 0:
        return
    spots = [Spot(*spot) for spot in zip(blobs.centre, blobs.reach, blobs.threshold, strict=True)][
        :MOST_FITS
    ]
    balls = Neighbourhoods(blobs.centre[:MOST_FITS], blobs.reach[:MOST_FITS] + CONTEXT).each(
        cloud.xyz
    )
    rows = np.unique(np.concatenate(balls))
    near = cloud[rows]
    segment = trajectory.segment(near.gps_time)
    sight = np.full((len(rows), 3), np.nan)
    placed = near[segment >= 0]
    sight[segment >= 0] = placed.xyz - scanner_path(placed.gps_time, trajectory, lever_arm)
    for ball, spot in zip(balls, spots, strict=True):
        inside = np.searchsorted(rows, ball)
        for number in np.unique(segment[inside][segment[inside] >= 0]):
            here = inside[segment[inside] == number]
            for visit in split_by_time(near.gps_time[here], PAUSE):
                surplus = max(0, len(visit) - MOST_POINTS)
                part = here[visit[surplus // 2 : len(visit) - (surplus + 1) // 2]]
                yield near[part], sight[part], spot
