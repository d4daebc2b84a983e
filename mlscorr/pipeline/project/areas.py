"""Areas of a city, each estimated by itself with a margin about it.

Ties may join the drives of a whole city, and what solves them together grows faster than they do.
What a place far away tells of a drive here has faded on the way. So a city is cut where as much
was driven on both sides, until no part holds more than a machine takes at once; what that costs
goes with the time of the drives, however much they saw. Areas share no estimate: each uses what was
recorded in it and in its margin, and no more.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from mlscorr.pipeline.project.joint import FoundDrive
from mlscorr.ties import SETTINGS as TIES


@dataclass(frozen=True)
class Area:
    """A rectangle of the map; areas cover it, and don't overlap.

    Parameters
    ----------
    low, high : (2,) array
        Its corners, infinite where the city ends. Units: m.
    margin : float
        How far it is estimated beyond them. Units: m.
    """

    low: np.ndarray
    high: np.ndarray
    margin: float

    def contains(self, position: np.ndarray) -> np.ndarray:
        """Which positions (n,) are its own.

        Parameters
        ----------
        position : (n, 3) array
            Units: m.
        """
        plan = position[:, :2]
        return np.all((plan >= self.low) & (plan < self.high), axis=1)

    def weight(self, position: np.ndarray) -> np.ndarray:
        """How much (n,) its estimate counts beside its neighbours': from one inside to zero.

        A half at its edge, with which that of the area beyond sums up to one.

        Parameters
        ----------
        position : (n, 3) array
            Units: m.
        """
        plan = position[:, :2]
        inside = np.minimum(plan - self.low, self.high - plan).min(axis=1)
        return np.clip((1.0 + inside / self.margin) / 2, 0.0, 1.0)

    def parted(self, axis: int, at: float) -> tuple[Area, Area]:
        """Both sides of a cut.

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
    """How far drives come, on average, while the POS error is about one. Units: m.

    Parameters
    ----------
    drives : sequence of FoundDrive
    """
    recorded = [drive.survey.trajectory for drive in drives]
    way = sum(np.linalg.norm(np.diff(t.position, axis=0), axis=1).sum() for t in recorded)
    seconds = sum(float(np.ptp(t.gps_time)) for t in recorded)
    return max(TIES.pause * float(way) / seconds, drives[0].survey.search_radius)


def places_each_second(drives: Sequence[FoundDrive]) -> np.ndarray:
    """A place (n, 3) of what drives saw in each second of them. Units: m.

    Parameters
    ----------
    drives : sequence of FoundDrive
    """
    features = [drive.features for drive in drives]
    first = [np.unique(np.floor(part.gps_time), return_index=True)[1] for part in features]
    return np.vstack([part.centre[rows] for part, rows in zip(features, first, strict=True)])


def areas_of(places: np.ndarray, limit: int, margin: float) -> list[Area]:
    """Areas that hold so many of some places at most, those in their margins too.

    None is cut that is less than four margins wide.

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
    """Areas in which drives spend so many seconds at most, those in their margins too.

    Parameters
    ----------
    drives : sequence of FoundDrive
    limit : int
        Units: s.
    """
    return areas_of(places_each_second(drives), limit, margin_of(drives))


@dataclass(frozen=True)
class Piece:
    """What of a drive lies in an area and its margin.

    Parameters
    ----------
    drive : FoundDrive
        Of these epochs alone.
    rows : (n,) bool array
        Which epochs of the whole drive.
    control : (m,) bool array
        Which of its observations of control points.
    """

    drive: FoundDrive
    rows: np.ndarray
    control: np.ndarray


def pieces_of(drives: Sequence[FoundDrive], area: Area) -> list[Piece]:
    """The Pieces of drives that come into an area or its margin.

    Parameters
    ----------
    drives : sequence of FoundDrive
    area : Area
    """
    rows = [_epochs_in(drive, area) for drive in drives]
    return [_piece(*pair) for pair in zip(drives, rows, strict=True) if pair[1].any()]


def _epochs_in(drive, area):
    """Which epochs (n,) of a drive lie there, those beside them and short excursions included."""
    trajectory = drive.survey.trajectory
    inside = area.weight(trajectory.position) > 0.0
    there = np.flatnonzero(inside)
    times = trajectory.gps_time[there]
    for gap in np.flatnonzero(np.diff(times) <= TIES.pause):
        inside[there[gap] : there[gap + 1]] = True
    beside = inside.copy()
    beside[1:] |= inside[:-1]
    beside[:-1] |= inside[1:]
    return beside


def _piece(drive, rows):
    """The Piece of some epochs of a drive."""
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
