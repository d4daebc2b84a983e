"""Observed targets that rows are of, with the pulses about them."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from mlscorr.gap.closure._settings import SETTINGS
from mlscorr.gap.residuals import Rows
from mlscorr.simulate import SETTINGS as SIMULATION
from mlscorr.simulate.scan import FORMS, HOLE, Boards, RecordedPulses, paints
from mlscorr.targets import FittedTarget


@dataclass(frozen=True)
class Sighting:
    """An observed target that rows are of: their item, and where it was surveyed (3,) in m."""

    item: int
    fitted: FittedTarget
    surveyed: np.ndarray


@dataclass(frozen=True)
class SightedTarget:
    """Pulses about a target as observed, its Boards of one; see Beams."""

    pulses: RecordedPulses
    board: Boards
    beyond: np.ndarray
    behind: np.ndarray

    @classmethod
    def join(cls, sighting: Sighting, parts: list) -> "SightedTarget":
        """The view of a Sighting from the pulses about it, as Surroundings gives them.

        Parameters
        ----------
        sighting : Sighting
        parts : list of (RecordedPulses, (n,) array, (n,) array, (n, 2) array)
        """
        recorded, *arrays = zip(*parts, strict=True)
        pulses = RecordedPulses.concatenate(recorded)
        distance, slant, place = map(np.concatenate, arrays)
        away = np.abs(pulses.gps_time - sighting.fitted.gps_time)
        near = np.argsort(away, kind="stable")[: SETTINGS.target_pulses]
        near = near[np.argsort(pulses.gps_time[near], kind="stable")]
        pulses = pulses[near]
        place = place[near]
        beyond = pulses.range - distance[near]
        off = beyond * slant[near]
        form = FORMS.index(sighting.fitted.kind)
        shape = np.zeros(len(near), int), place / (1.0 if form == HOLE else SETTINGS.edge)
        board = board_of(sighting.fitted, np.zeros(3))
        own = (np.abs(off) <= SIMULATION.hiding_depth) & np.isfinite(board.paint(*shape))
        lit = (np.abs(off) <= SIMULATION.hiding_depth) & (board.paint(shape[0], place) == 1.0)
        if sighting.fitted.kind == "checkerboard":
            lit = own
        bright, dark, speckle = paints(sighting.fitted.kind, pulses.intensity[lit])
        board = board_of(sighting.fitted, np.zeros(3), bright, dark, speckle)
        others = np.flatnonzero(~own & ~(off < -SIMULATION.hiding_depth))
        beyond = beyond.copy()
        behind = pulses.intensity.copy()
        beyond[own] = np.nan
        behind[own] = 0.0
        if own.any() and len(others):
            nearest = others[cKDTree(place[others]).query(place[own])[1]]
            beyond[own] = beyond[nearest]
            behind[own] = behind[nearest]
        return cls(pulses, board, beyond, behind)


def sightings_of(rows: Rows, finding: Any) -> list[Sighting]:
    """Sightings of the target rows.

    Parameters
    ----------
    rows : Rows
    finding : Finding
        Of the same survey.
    """
    on = rows.channel == "target"
    sightings = []
    matched = finding.matches.matched
    sights = zip(matched.name, matched.gps_time, strict=True)
    passes = dict(zip(sights, matched.pass_number, strict=True))
    items, first = np.unique(rows.item[on], return_index=True)
    for item, row in zip(items, np.flatnonzero(on)[first], strict=True):
        name = rows.targets.name[rows.survey_item[row]]
        time = rows.gps_time[row]
        target = finding.fitted.get((passes.get((name, time)), time))
        if target is not None:
            surveyed = rows.targets.position[rows.survey_item[row]]
            sightings.append(Sighting(int(item), target, surveyed))
    return sightings


def board_of(
    target: FittedTarget,
    origin: np.ndarray,
    bright: float = 1.0,
    dark: float = 0.0,
    speckle: float = 0.0,
) -> Boards:
    """Boards of one FittedTarget.

    Parameters
    ----------
    target : FittedTarget
    origin : (3,) array
        About which it is built. Units: m.
    bright, dark, speckle : float
        Intensity of its paints, and their relative noise.
    """
    outline, (u, v) = target.view.outline, target.view.axes
    cos = np.cos(outline.turn)
    sin = np.sin(outline.turn)
    if target.kind == "circle":  # nobody knows how its board is turned: upright
        normal = np.cross(u, v)
        if abs(normal[2]) < 0.99:
            side = np.array([0.0, 0.0, 1.0])
        else:
            side = np.array([1.0, 0.0, 0.0])
        u = np.cross(side, normal)
        u /= np.linalg.norm(u)
        v = np.cross(normal, u)
        cos = 1.0
        sin = 0.0
    edges = np.array([cos * u + sin * v, cos * v - sin * u])
    return Boards(
        centre=(target.position - origin)[None],
        axes=np.vstack([edges, np.cross(*edges)])[None],
        form=np.array([FORMS.index(target.kind)]),
        size=np.array([target.size]),
        inner=np.array([outline.inner]),
        bright=np.array([bright]),
        dark=np.array([dark]),
        speckle=np.array([speckle]),
    )
