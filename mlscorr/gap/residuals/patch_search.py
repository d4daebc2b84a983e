"""Patches of a survey's clouds, found while these are read.

The cloud is streamed; of each patch only its moments and some points stay in memory.
"""

from collections.abc import Callable, Iterable
from dataclasses import replace

import numpy as np

from mlscorr.gap.residuals.patches import Patches
from mlscorr.gap.residuals.plane_fit import block_chance, fit_patches, place_key
from mlscorr.gap.residuals.settings import SETTINGS
from mlscorr.io.clouds import read_chunks
from mlscorr.survey import CloudFile, PointCloud, Survey
from mlscorr.targets import NO_POINTS, number_passes


class PatchCollector:
    """Keeps at most `pool` flat patches of the chunks that it is given, spread over the place.

    Which blocks of the ground are kept is told by a hash of their place: the same in all passes.
    Points of the moments about the end of a chunk are held until those that follow have come. So
    patches do not depend on chunks, where points come about in order of time, up or down.

    Parameters
    ----------
    survey : Survey
    pool : int
    """

    def __init__(self, survey: Survey, pool: int = SETTINGS.pool):
        self._survey = survey
        self._pool = pool
        self._parts = []
        self._starts = {}
        self._share = 1.0
        self._read = 0
        self._file: CloudFile | None = None
        self._held, self._number = NO_POINTS, np.empty(0, int)

    def add(self, file: CloudFile, chunk: PointCloud) -> None:
        """Take a chunk of a file; the chunks of a file follow each other."""
        if file != self._file:
            self._close(np.inf)
            self._file = file
            self._read = 0
        segment = self._survey.trajectory.segment(chunk.gps_time)
        for number in np.unique(segment[segment >= 0]).tolist():
            start = chunk.gps_time[segment == number].min()
            self._starts[file, number] = min(self._starts.get((file, number), np.inf), start)
        rows = np.flatnonzero((segment >= 0) & (block_chance(chunk.xyz) < self._share))
        self._held = PointCloud.concatenate([self._held, chunk[rows]])
        self._number = np.append(self._number, self._read + rows)
        self._read += len(chunk)
        self._close(chunk.gps_time[-1] if len(chunk) else np.inf)

    def _close(self, time):
        """Keep the patches of held points, but those of the moments about a time (s)."""
        segment = self._survey.trajectory.segment(self._held.gps_time)
        moments, is_open = moments_before(time, self._held.gps_time, segment)
        for part in moments:  # memory follows the largest
            patches = fit_patches(self._survey, self._held, self._number, part)
            if patches is not None:
                key = self._file, int(segment[part[0]])
                self._parts.append((key, patches[patches.block < self._share]))
            while sum(len(patches) for _, patches in self._parts) > self._pool:
                self._share /= 2
                self._parts = [(key, p[p.block < self._share]) for key, p in self._parts]
        self._held = self._held[is_open]
        self._number = self._number[is_open]

    def patches(self) -> Patches | None:
        """Patches of all chunks, of which none follows, by pass and place; None where none is."""
        self._close(np.inf)
        if not any(len(patches) for _, patches in self._parts):
            return None
        order = number_passes(self._starts)
        patches = Patches.concatenate(patches for _, patches in self._parts)
        number = np.repeat([order[key] for key, _ in self._parts], [len(p) for _, p in self._parts])
        rows = np.lexsort((place_key(patches.xyz[:, 0], patches.time[:, 0]), number))
        return replace(patches, pass_number=number)[rows]


def moments_before(
    time: float, gps_time: np.ndarray, segment: np.ndarray
) -> tuple[list[np.ndarray], np.ndarray]:
    """Rows of the points of each moment and segment, but of those about a time.

    Parameters
    ----------
    time : float
        About which points are still to come. Units: s.
    gps_time : (n,) array
        Units: s.
    segment : (n,) int array
        Of the trajectory.

    Returns
    -------
    moments : list of (k,) int array
    is_open : (n,) bool array
        Which points are of the moments about the time.
    """
    moment = np.floor(gps_time / SETTINGS.moment)
    # beams that take turns come a little late
    is_open = np.abs(moment - np.floor(time / SETTINGS.moment)) <= 1
    rows = np.lexsort((moment, segment))
    rows = rows[~is_open[rows]]
    is_next = (np.diff(segment[rows]) != 0) | (np.diff(moment[rows]) != 0)
    return [part for part in np.split(rows, np.flatnonzero(is_next) + 1) if len(part)], is_open


def find_patches(
    survey: Survey,
    pool: int = SETTINGS.pool,
    chunks: Callable[[CloudFile], Iterable[PointCloud]] = read_chunks,
) -> Patches | None:
    """Stream all clouds of a survey and keep at most `pool` flat patches: see PatchCollector.

    Parameters
    ----------
    survey : Survey
    pool : int
    chunks : function of a CloudFile
        Gives an iterator of PointCloud.

    Returns
    -------
    Patches or None
        None where the clouds hold no flat patch.
    """
    collector = PatchCollector(survey, pool)
    for file in survey.clouds:
        for chunk in chunks(file):
            collector.add(file, chunk)
    return collector.patches()
