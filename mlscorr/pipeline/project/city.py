"""All drives of a project: those that saw the same things together, area by area if too many."""

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
    """What is recorded in an area and its margin, and how it is estimated.

    Parameters
    ----------
    area : Area
    pieces : list of Piece
        Of the drives that come there.
    order, origin
        As of project_drives.
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
        """What it tells of each drive."""
        pieces = {piece.drive.survey.name: piece for piece in self.pieces}
        results = []
        for group in near_drives([piece.drive for piece in self.pieces]):
            for part in estimate_group(group, min(self.order, 0), self.origin, True):
                for corrected, state in corrected_drives(part, self.area):
                    assert isinstance(corrected, CorrectedDrive)
                    results.append(AreaResult.of(self.area, pieces[state.name], corrected, state))
        return results


def stored_results(folder: Path, key: str) -> list[AreaResult]:
    """The results of an AreaInput that lies in a store.

    Parameters
    ----------
    folder : Path
        Of the store.
    key : str
    """
    inputs: AreaInput = TaskStore(folder).get("pieces", key)
    return inputs.results()


def in_turn(inputs: Iterable[AreaInput]) -> list[list[AreaResult]]:
    """The results of areas, one after the other.

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
    """The results of all drives.

    Parameters
    ----------
    drives : sequence of FoundDrive
    order : int
        Of the trend of a drive by itself; drives together have a shift in common.
    origin : (3,) array
        Of planes and poles. Units: m.
    with_ties : bool
        Else each drive is by itself.
    work : function of AreaInputs
        Gives the results of each.
    limit : int
        Of the time that drives spend in an area and its margin. Units: s.
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
    """The results of drives, each merged of those of its pieces.

    Parameters
    ----------
    drives : sequence of FoundDrive
    areas : sequence of Area
    order, origin, work
        As of project_drives.
    """
    inputs = (AreaInput(area, pieces_of(drives, area), order, origin) for area in areas)
    results: dict[str, list[AreaResult]] = {drive.survey.name: [] for drive in drives}
    for of_area in work(inputs):
        for result in of_area:
            results[result.state.name].append(result)
    yield from (merged_drive(drive, results.pop(drive.survey.name)) for drive in drives)
