"""Patches of a survey's clouds, found while these are read.

The cloud is streamed; of each patch only its moments and some points stay in memory.
"""

from collections.abc import Callable, Iterable
from dataclasses import replace

import numpy as np

from mlscorr.gap.observe.patches import Patches
from mlscorr.gap.observe.plane_fit import fit_patches
from mlscorr.gap.observe.settings import SETTINGS
from mlscorr.io.las import read_chunks
from mlscorr.survey import CloudFile, PointCloud, Survey


class PatchCollector:
    """Keeps at most `pool` flat patches of the chunks that it is given, spread over the place.

    Which blocks of the ground are kept is told by a hash of their place: the same in all passes.

    Parameters
    ----------
    survey : Survey
    pool : int, optional
    """

    def __init__(self, survey: Survey, pool: int | None = None):
        self._survey, self._pool = survey, SETTINGS.pool if pool is None else pool
        self._parts, self._starts, self._share, self._read = [], {}, 1.0, 0

    def add(self, file: CloudFile, chunk: PointCloud) -> None:
        """Take the patches of a chunk of a file."""
        segment = self._survey.trajectory.segment(chunk.gps_time)
        for number in np.unique(segment[segment >= 0]):
            inside, key = segment == number, (file, int(number))
            self._starts[key] = min(self._starts.get(key, np.inf), chunk.gps_time[inside].min())
            patches = fit_patches(self._survey, chunk, inside, self._share)
            if patches is not None:
                self._parts.append((key, patches))
        self._read += len(chunk)
        while self._in_the_end() > self._pool:
            self._share /= 2
            self._parts = [(key, p[p.block < self._share]) for key, p in self._parts]

    def _in_the_end(self):
        """How many patches there will be, going on like this: the fewer kept, the less to do."""
        whole = sum(file.points for file in self._survey.clouds)
        return sum(len(p) for _, p in self._parts) * max(1.0, whole / max(self._read, 1))

    def patches(self) -> Patches | None:
        """Patches of all chunks so far with the numbers of their passes; None where none is."""
        order = {key: i for i, key in enumerate(sorted(self._starts, key=self._starts.get), 1)}
        parts = [
            replace(patches, pass_number=np.full(len(patches), order[key]))
            for key, patches in self._parts
            if len(patches)
        ]
        return Patches.concatenate(parts) if parts else None


def find_patches(
    survey: Survey,
    pool: int | None = None,
    chunks: Callable[[CloudFile], Iterable[PointCloud]] = read_chunks,
) -> Patches | None:
    """Stream all clouds of a survey and keep at most `pool` flat patches: see PatchCollector.

    Parameters
    ----------
    survey : Survey
    pool : int, optional
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
