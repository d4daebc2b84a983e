"""All drives of a project: overlapping ones together, split into areas if there are too many."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from mlscorr.io.store import TaskStore
from mlscorr.pipeline.corrected_survey import CorrectedSurvey
from mlscorr.pipeline.project.areas import Area, Piece, drive_areas, pieces_of
from mlscorr.pipeline.project.corrected import DriveState, corrected_drives
from mlscorr.pipeline.project.drive_estimate import CorrectedDrive
from mlscorr.pipeline.project.joint import FoundDrive, estimate_group, near_drives
from mlscorr.pipeline.project.merged import AreaResult, merged_drive
from mlscorr.pipeline.project.settings import SETTINGS


@dataclass(frozen=True)
class AreaInput:
    """Recorded data of an area and its margin, and estimation parameters.

    Parameters
    ----------
    area : Area
    pieces : list of Piece
        Pieces of the drives in it.
    order, origin
        See project_drives.
    """

    area: Area
    pieces: list[Piece]
    order: int
    origin: np.ndarray

    @property
    def features(self) -> int:
        """Number of its planes and poles."""
        return sum(len(piece.drive.features) for piece in self.pieces)

    def results(self) -> list[AreaResult]:
        """Return its results for each drive."""
        pieces = {piece.drive.survey.name: piece for piece in self.pieces}
        results = []
        for group in near_drives([piece.drive for piece in self.pieces]):
            for part in estimate_group(group, min(self.order, 0), self.origin, True):
                for corrected, state in corrected_drives(part, self.area):
                    assert isinstance(corrected, CorrectedDrive)
                    results.append(AreaResult.of(self.area, pieces[state.name], corrected, state))
        return results


def stored_results(folder: Path, key: str) -> list[AreaResult]:
    """Results of an AreaInput in a store.

    Parameters
    ----------
    folder : Path
        Folder of the store.
    key : str
    """
    inputs: AreaInput = TaskStore(folder).get("pieces", key)
    return inputs.results()


def in_turn(inputs: Iterable[AreaInput]) -> list[list[AreaResult]]:
    """Results of areas, one after the other.

    Parameters
    ----------
    inputs : iterable of AreaInput
    """
    return [each.results() for each in inputs]


def project_drives(
    drives: Sequence[FoundDrive],
    order: int,
    origin: np.ndarray,
    with_ties: bool,
    work: Callable[[Iterable[AreaInput]], list[list[AreaResult]]] = in_turn,
    limit: int = SETTINGS.area_seconds,
) -> Iterator[tuple[CorrectedSurvey, DriveState]]:
    """Yield the results of all drives.

    Parameters
    ----------
    drives : sequence of FoundDrive
    order : int
        Order of the trend of a single drive; several drives have a common shift.
    origin : (3,) array
        Origin of planes and poles. Units: m.
    with_ties : bool
        False to estimate each drive separately.
    work : function of AreaInputs
        Returns the results of each.
    limit : int
        Limit of the driving time in an area and its margin. Units: s.
    """
    if with_ties:
        groups = near_drives(drives)
    else:
        groups = [[drive] for drive in drives]
    for group in groups:
        areas = drive_areas(group, limit)
        if with_ties and len(areas) > 1:
            yield from drives_by_areas(group, areas, order, origin, work)
            continue
        for part in estimate_group(group, order, origin, with_ties):
            yield from corrected_drives(part)


def drives_by_areas(
    drives: Sequence[FoundDrive],
    areas: Sequence[Area],
    order: int,
    origin: np.ndarray,
    work: Callable[[Iterable[AreaInput]], list[list[AreaResult]]] = in_turn,
) -> Iterator[tuple[CorrectedDrive, DriveState]]:
    """Yield the results of drives, each merged from those of its pieces.

    Parameters
    ----------
    drives : sequence of FoundDrive
    areas : sequence of Area
    order, origin, work
        See project_drives.
    """
    inputs = (AreaInput(area, pieces_of(drives, area), order, origin) for area in areas)
    results: dict[str, list[AreaResult]] = {drive.survey.name: [] for drive in drives}
    for of_area in work(inputs):
        for result in of_area:
            results[result.state.name].append(result)
    yield from (merged_drive(drive, results.pop(drive.survey.name)) for drive in drives)
