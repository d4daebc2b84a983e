"""Areas of a city, each estimated separately with a margin.

Ties may join the drives of a whole city, and the cost of a common solution grows faster than their
number. The influence of distant data on a drive decays along the path. A city is therefore split
where both sides have equal driving time, until every part fits a machine; the cost depends on the
duration of the drives, not on the number of their points. Areas share no estimate: each uses only
the data recorded in it and in its margin.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from mlscorr.pipeline.project.joint import FoundDrive
from mlscorr.ties import SETTINGS as TIES


@dataclass(frozen=True)
class Area:
    """Rectangle of the map; areas cover it without overlap.

    Parameters
    ----------
    low, high : (2,) array
        Its corners, infinite at the edge of the city. Units: m.
    margin : float
        Width of the estimated margin. Units: m.
    """

    low: np.ndarray
    high: np.ndarray
    margin: float

    def contains(self, position: np.ndarray) -> np.ndarray:
        """Flag (n,) of positions within the area.

        Parameters
        ----------
        position : (n, 3) array
            Units: m.
        """
        plan = position[:, :2]
        return np.all((plan >= self.low) & (plan < self.high), axis=1)

    def weight(self, position: np.ndarray) -> np.ndarray:
        """Weight (n,) of its estimate relative to its neighbors': from one inside to zero.

        At its edge it is one half; the weights of both areas sum to one.

        Parameters
        ----------
        position : (n, 3) array
            Units: m.
        """
        plan = position[:, :2]
        inside = np.minimum(plan - self.low, self.high - plan).min(axis=1)
        return np.clip((1.0 + inside / self.margin) / 2, 0.0, 1.0)

    def parted(self, axis: int, at: float) -> tuple[Area, Area]:
        """Return both sides of a cut.

        Parameters
        ----------
        axis : int
        at : float
            Units: m.
        """
        edge = np.where(np.arange(2) == axis, at, np.nan)
        low, high = (np.where(np.isnan(edge), corner, edge) for corner in (self.low, self.high))
        return replace(self, high=high), replace(self, low=low)


def margin_of(drives: Sequence[FoundDrive]) -> float:
    """Mean distance that drives cover within the correlation time of the POS error. Units: m.

    Parameters
    ----------
    drives : sequence of FoundDrive
    """
    recorded = [drive.survey.trajectory for drive in drives]
    length = sum(np.linalg.norm(np.diff(t.position, axis=0), axis=1).sum() for t in recorded)
    seconds = sum(float(np.ptp(t.gps_time)) for t in recorded)
    return max(TIES.pause * float(length) / seconds, drives[0].survey.search_radius)


def places_each_second(drives: Sequence[FoundDrive]) -> np.ndarray:
    """One position (n, 3) of features for each second of drives. Units: m.

    Parameters
    ----------
    drives : sequence of FoundDrive
    """
    features = [drive.features for drive in drives]
    first = [np.unique(np.floor(part.gps_time), return_index=True)[1] for part in features]
    return np.vstack([part.centre[rows] for part, rows in zip(features, first, strict=True)])


def areas_of(places: np.ndarray, limit: int, margin: float) -> list[Area]:
    """Areas with at most a given number of positions, including those in their margins.

    Areas less than four margins wide are not split.

    Parameters
    ----------
    places : (n, 3) array
        Units: m.
    limit : int
    margin : float
        Units: m.
    """
    waiting = [(Area(np.full(2, -np.inf), np.full(2, np.inf), margin), places)]
    areas = []
    while waiting:
        area, near = waiting.pop()
        inside = near[area.contains(near), :2]
        size = np.ptp(inside, axis=0) if len(inside) else np.zeros(2)
        axis = int(np.argmax(size))
        if len(near) <= limit or size[axis] < 4 * margin:
            areas.append(area)
            continue
        halves = area.parted(axis, float(np.median(inside[:, axis])))
        waiting += [(half, near[half.weight(near) > 0.0]) for half in halves[::-1]]
    return areas


def drive_areas(drives: Sequence[FoundDrive], limit: int) -> list[Area]:
    """Areas with at most a given number of seconds of drives, including their margins.

    Parameters
    ----------
    drives : sequence of FoundDrive
    limit : int
        Units: s.
    """
    return areas_of(places_each_second(drives), limit, margin_of(drives))


@dataclass(frozen=True)
class Piece:
    """Part of a drive within an area and its margin.

    Parameters
    ----------
    drive : FoundDrive
        Drive with only these epochs.
    rows : (n,) bool array
        Selected epochs of the whole drive.
    control : (m,) bool array
        Selected observations of control points.
    """

    drive: FoundDrive
    rows: np.ndarray
    control: np.ndarray


def pieces_of(drives: Sequence[FoundDrive], area: Area) -> list[Piece]:
    """Pieces of drives that enter an area or its margin.

    Parameters
    ----------
    drives : sequence of FoundDrive
    area : Area
    """
    rows = [_epochs_in(drive, area) for drive in drives]
    return [_piece(*pair) for pair in zip(drives, rows, strict=True) if pair[1].any()]


def _epochs_in(drive, area):
    """Flag (n,) of a drive's epochs there, including adjacent ones and short excursions."""
    trajectory = drive.survey.trajectory
    inside = area.weight(trajectory.position) > 0.0
    there = np.flatnonzero(inside)
    times = trajectory.gps_time[there]
    for gap in np.flatnonzero(np.diff(times) <= TIES.pause):
        inside[there[gap] : there[gap + 1]] = True
    widened = inside.copy()
    widened[1:] |= inside[:-1]
    widened[:-1] |= inside[1:]
    return widened


def _piece(drive, rows):
    """Piece of some epochs of a drive."""
    recorded = drive.survey.trajectory
    features = drive.features
    last = len(recorded) - 1

    def within(gps_time):
        after = np.clip(np.searchsorted(recorded.gps_time, gps_time), 1, last)
        return rows[after] & rows[after - 1]

    control = within(drive.control.gps_time)
    part = FoundDrive(
        replace(drive.survey, trajectory=recorded.select(rows)),
        drive.finding,
        features[within(features.gps_time)],
        drive.control[control],
        drive.check[within(drive.check.gps_time)],
    )
    return Piece(part, rows, control)
