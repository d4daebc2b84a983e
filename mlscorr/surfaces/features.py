"""Planes, poles and paint in a survey's clouds, found while these are read."""

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from mlscorr.surfaces._paint import Crossings, find_crossings, find_markings, interval_of
from mlscorr.surfaces._shapes import find_shapes
from mlscorr.surfaces._thinning import thin
from mlscorr.surfaces.cells import CellTable
from mlscorr.surfaces.settings import SETTINGS
from mlscorr.surfaces.stream import pass_numbers
from mlscorr.survey import CloudFile, PointCloud, Survey, TieFeatures, Trajectory


class FeatureCollector:
    """Collector of planes, poles and paint from chunks of clouds in any order.

    Its memory grows neither with the points nor with the file. It stores the cells and paint
    crossings of the last moments, which may still receive points, and a limited number of features
    per second for earlier ones (see thin).

    Parameters
    ----------
    survey : Survey
    cells_in_memory : int, optional
        With more cells, those of past moments are converted to features and removed.
    origin : (3,) array, optional
        Whole meters, near the survey; by default from its trajectory. Units: m.
    """

    def __init__(
        self,
        survey: Survey,
        cells_in_memory: int = SETTINGS.cells_in_memory,
        origin: np.ndarray | None = None,
    ):
        self._survey = survey
        self._cells_in_memory = cells_in_memory
        self._segments = survey.trajectory.passes
        start = np.floor(survey.trajectory.gps_time[0])
        if origin is None:
            self._origin = np.floor(survey.trajectory.position[0])
        else:
            self._origin = origin
        self._cells = CellTable(self._origin, start)
        self._starts = np.full((len(survey.clouds), len(self._segments)), np.inf)
        self._start = start
        self._crossings: list[Crossings] = []
        self._kept: list[TieFeatures] = []
        self._kept_in_order = 0
        self._loose = 0

    def add(self, file: CloudFile, chunk: PointCloud) -> None:
        """Add a chunk of a file.

        Parameters
        ----------
        file : CloudFile
            Of the survey.
        chunk : PointCloud
        """
        source = self._survey.clouds.index(file)
        group = source * len(self._segments)
        self._cells.add(chunk, self._segments, group, self._starts[source])
        self._crossings.append(find_crossings(chunk, self._segments, group))
        if self._cells.count > self._cells_in_memory:
            # alternating beams are slightly late
            self._close(self._cells.moment.max() - 1)

    def _close(self, moment):
        """Find the features of the moments before one, and thin all features if there are many."""
        rows = self._cells.moment < moment
        self._kept.append(self._shapes(rows))
        self._cells.remove(rows)
        crossings = Crossings.concatenate(self._crossings)
        later = interval_of(crossings.gps_time - self._start) >= interval_of(
            moment * SETTINGS.moment
        )
        self._kept.append(find_markings(crossings[~later], self._start))
        self._crossings = [crossings[later]]
        self._loose += len(self._kept[-1]) + len(self._kept[-2])
        if self._loose > max(self._cells_in_memory, self._kept_in_order):
            features = TieFeatures.concatenate(self._kept)
            rows = thin(features, self._origin, self._survey.trajectory)
            self._kept = [features[rows]]
            self._kept_in_order = len(self._kept[0])
            self._loose = 0

    def _shapes(self, rows):
        """Find features of some cells, each with the scanner of its file."""
        cells = self._cells.of(rows)
        scanner = self._scanner(cells.group)
        return TieFeatures.concatenate(
            find_shapes(part, cells[inside])
            for part, inside in self._survey.rows_by_scanner(scanner)
        )

    def _scanner(self, group):
        """Index of the scanner of groups."""
        return self._survey.scanner_numbers[group // len(self._segments)]

    def features(self) -> TieFeatures:
        """Features of all chunks so far, by pass and time; further chunks may follow."""
        rest = [self._shapes(slice(None))]
        if self._crossings:
            rest.append(find_markings(Crossings.concatenate(self._crossings), self._start))
        features = TieFeatures.concatenate([*self._kept, *rest])
        group = features.pass_number
        number = pass_numbers(self._starts)[group]
        features = replace(features, pass_number=number, scanner=self._scanner(group))
        return join_features([features], self._origin, self._survey.trajectory)


def join_features(
    parts: Iterable[TieFeatures], origin: np.ndarray, trajectory: Trajectory | None = None
) -> TieFeatures:
    """Join features of some passes and thin them, sorted by pass and time.

    Parameters
    ----------
    parts : iterable of TieFeatures
    origin : (3,) array
        See FeatureCollector. Units: m.
    trajectory : Trajectory, optional
        Shows the standstills of the scanner.
    """
    features = TieFeatures.concatenate(parts)
    features = features[thin(features, origin, trajectory)]
    keys = (*features.centre.T, features.gps_time, features.pass_number)
    return features[np.lexsort(keys)]
