"""How target-like a fit is: what a surveyor's eye would ask before trusting its centre."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from mlscorr.targets._echoes import Echoes
from mlscorr.targets._outline import Outline
from mlscorr.targets._seeds import Seed
from mlscorr.targets._sequence import quasi_random
from mlscorr.targets.settings import SETTINGS
from mlscorr.targets.shapes import (
    BRIGHT,
    CHECKERED,
    MISS,
    ROUND,
    WHITE,
    distance_inside,
    form_of,
    sides,
)


@dataclass(frozen=True)
class Assessment:
    """How target-like a fit is.

    Parameters
    ----------
    score : float
        0 to 1.
    rank : float
        Among fits at one place.
    plausible, accepted : bool
        Whether a rough or an exact fit passes.
    """

    score: float
    rank: float
    plausible: bool
    accepted: bool


def assess(
    beams: tuple[np.ndarray, np.ndarray, np.ndarray],
    outline: Outline,
    kind: str,
    seed: Seed,
    echoes: Echoes,
    blur: float,
    hidden: bool = False,
) -> Assessment:
    """Assess an outline.

    Parameters
    ----------
    beams : (n, 2), (n,) and (n,) arrays
        Crossings (m), state, and rows of the echoes.
    outline : Outline
    kind : str
    seed : Seed
    echoes : Echoes
    blur : float
        One sigma of a beam's place. Units: m.
    hidden : bool
        Whether something out of sight is thought to hide a part: then all the rest must fit.

    Returns
    -------
    Assessment
    """
    points, state, rows = beams
    form = form_of(kind, seed.by_edges)
    side = sides(state, kind, seed.by_edges)
    marked = side >= 0 if kind == "checkerboard" else side == 1
    inside = distance_inside(points, outline.row, form) > 0
    support = _support(points, marked, outline, form, kind, blur)
    if kind == "hole":
        smallest = SETTINGS.hole_support
    else:
        smallest = SETTINGS.smallest_support
    overlap = outline.overlap
    if kind == "hole" and marked.sum() < 5:  # nothing behind it: all that counts is the board
        overlap = 1.0 - (inside & ~marked).sum() / max(len(points), 1)
    contrast = 1.0
    if not seed.by_edges:
        if kind == "checkerboard":
            overlap = min(overlap, _share_of_right_colour(points, state, outline))
        returned = echoes.intensity[rows[state != MISS]], state[state != MISS] == BRIGHT
        contrast = _contrast(*returned)
    thick = seed.plane.sigma / echoes.tolerance
    flat = np.clip((SETTINGS.bush - thick) / (SETTINGS.bush - 1 / 3), 0.0, 1.0)
    quality = flat * min(1.0, support / SETTINGS.good_support)
    quality *= min(1.0, contrast / SETTINGS.good_contrast)
    sigma = np.sqrt(np.linalg.eigvalsh(outline.covariance)[-1]) / outline.size
    if kind != "hole":
        count = (inside & marked).sum()
    else:
        count = SETTINGS.rim_places * support
    play = SETTINGS.rough_play
    return Assessment(
        score=float(overlap * quality),
        rank=float(overlap * support * np.sqrt(count)),
        plausible=bool(overlap >= SETTINGS.smallest_overlap - play and support >= smallest - play),
        accepted=bool(
            len(points) >= SETTINGS.smallest_count
            and overlap >= (SETTINGS.close_overlap if hidden else SETTINGS.smallest_overlap)
            and support >= smallest
            and sigma <= SETTINGS.largest_sigma
            and flat > 0
        ),
    )


def _support(points, marked, outline, form, kind, blur):
    """Share of the outline with beams on either side of it near by; of a hole's, on the board."""
    within = points[marked]
    beyond = points[~marked]
    if kind == "hole":
        within = beyond
    if len(within) < 3 or len(beyond) == 0:
        return 0.0
    rim = _rim(outline, form)
    near = max(6 * _spacing(within, outline, form, kind), 4 * blur)
    supported = cKDTree(within).query(rim)[0] < near
    if kind != "hole":
        supported &= cKDTree(beyond).query(rim)[0] < near
    return float(supported.mean())


def _rim(outline, form):
    """Places (k, 2) along an outline."""
    angle = 2 * np.pi * (np.arange(SETTINGS.rim_places) + 0.5) / SETTINGS.rim_places
    ring = np.column_stack([np.cos(angle), np.sin(angle)])
    if form == ROUND:
        return outline.centre + outline.size / 2 * ring
    square = ring / np.abs(ring).max(axis=1, keepdims=True)
    cos = np.cos(outline.turn)
    sin = np.sin(outline.turn)
    return outline.centre + outline.size / 2 * square @ np.array([[cos, sin], [-sin, cos]])


def _spacing(within, outline, form, kind):
    """Distance (m) from a place on the target to the nearest beam, where it is seen best."""
    wide = 1.8 if kind == "hole" else 1.0  # sizes, with the board about a hole
    places = quasi_random(4 * SETTINGS.rim_places, 2) - 0.5
    places = outline.centre + wide * outline.size * places
    on_target = (distance_inside(places, outline.row, form) > 0) == (kind != "hole")
    return float(np.percentile(cKDTree(within).query(places[on_target])[0], 40))


def _share_of_right_colour(points, state, outline):
    """Share of the beams on a checkerboard whose colour is right, of the worse colour."""
    on_board = (distance_inside(points, outline.row, CHECKERED) > 0) & (state != MISS)
    white = distance_inside(points[on_board], outline.row, WHITE) > 0
    bright = state[on_board] == BRIGHT
    if white.all() or not white.any():
        return 0.0
    return float(min(bright[white].mean(), 1.0 - bright[~white].mean()))


def _contrast(intensity, bright):
    """Difference over sum of typical intensities, bright and dark; 1 where nothing is dark."""
    if not bright.any() or (~bright).sum() < 5:
        return float(bright.any())
    light = np.median(intensity[bright])
    dark = np.median(intensity[~bright])
    return float((light - dark) / max(light + dark, 1e-9))
