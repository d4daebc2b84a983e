"""How target-like a fit is: what a surveyor's eye would ask before trusting its centre."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from mlscorr.targets.clusters import FEWEST_POINTS
from mlscorr.targets.shapes import (
    BRIGHT,
    DARK,
    ROUND,
    distance_inside,
    distance_on_white,
    form_of,
    sides,
)

LEAST_OVERLAP = 0.8  # of the outline with what the beams tell
HIDDEN_OVERLAP = 0.93  # where that is excused by something that nobody sees
LEAST_SUPPORT = 0.35  # of the outline seen from both sides: a target may be half hidden
HOLE_SUPPORT = 0.75  # of a hole's rim: other gaps are open or have corners
LARGEST_SIGMA = 0.08  # of the size: beyond it the outline holds the centre in one direction only
GOOD_SUPPORT = 0.6  # of the outline, from which on a target is beyond doubt
GOOD_CONTRAST = 0.3  # of bright to dark, difference over sum
FLAT = 1 / 3, 0.8  # tolerances, sigma about the plane: as flat as noise; as thick as a bush
RIM = 48  # places along an outline
INSIDE = 200  # places within it
ROUGHLY = 0.1  # by which a rough fit may miss the limits


@dataclass(frozen=True)
class Verdict:
    """Score 0 to 1, rank among fits at one place, and whether a rough or an exact fit passes."""

    score: float
    rank: float
    plausible: bool
    accepted: bool


def judge(beams, outline, kind, seed, pulses, blur, hidden=False):
    """Verdict on an outline.

    Parameters
    ----------
    beams : (n, 2), (n,) and (n,) arrays
        Crossings (m), state, and rows of the pulses.
    outline : Outline
    kind : str
    seed : Seed
    pulses : Pulses
    blur : float
        One sigma of a beam's place. Units: m.
    hidden : bool
        Whether something out of sight is thought to hide a part: then all the rest must fit.
    """
    points, state, rows = beams
    intensity = pulses.intensity
    by_edges = seed.by_edges
    form, side = form_of(kind, by_edges), sides(state, kind, by_edges)
    told = side >= 0 if kind == "checkerboard" else side == 1
    inside = distance_inside(points, outline.row, form) > 0
    support = _support(points, told, outline, form, kind, blur)
    least = HOLE_SUPPORT if kind == "hole" else LEAST_SUPPORT
    overlap = outline.overlap
    if kind == "hole" and told.sum() < 5:
        overlap = 1.0 - (inside & ~told).sum() / max(
            len(points), 1
        )  # nothing behind it: all that counts is the board
    if kind == "checkerboard" and not by_edges:
        overlap = min(overlap, _agreement(points, state, outline))
    contrast = 1.0
    if not by_edges:
        contrast = _contrast(intensity[rows[state == BRIGHT]], intensity[rows[state == DARK]])
    thick = seed.plane.sigma / pulses.tolerance
    flat = np.clip((FLAT[1] - thick) / (FLAT[1] - FLAT[0]), 0.0, 1.0)
    quality = min(1.0, support / GOOD_SUPPORT) * min(1.0, contrast / GOOD_CONTRAST) * flat
    sigma = np.sqrt(np.linalg.eigvalsh(outline.covariance)[-1]) / outline.size
    count = (inside & told).sum() if kind != "hole" else RIM * support
    return Verdict(
        score=float(overlap * quality),
        rank=float(overlap * support * np.sqrt(count)),
        plausible=bool(overlap >= LEAST_OVERLAP - ROUGHLY and support >= least - ROUGHLY),
        accepted=bool(
            len(points) >= FEWEST_POINTS
            and overlap >= (HIDDEN_OVERLAP if hidden else LEAST_OVERLAP)
            and support >= least
            and sigma <= LARGEST_SIGMA
            and flat > 0
        ),
    )


def _support(points, told, outline, form, kind, blur):
    """Share of the outline with beams on either side of it near by; of a hole's, on the board."""
    rim = _rim(outline, form)
    within, beyond = points[told], points[~told]
    if kind == "hole":
        within, beyond = points[~told], points[~told]
    if len(within) < 3:
        return 0.0
    near = _spacing(within, outline, form, kind)
    reach = max(6 * near, 4 * blur)
    tree = cKDTree(within)
    supported = tree.query(rim)[0] < reach
    if kind != "hole":
        if len(beyond) == 0:
            return 0.0
        supported &= cKDTree(beyond).query(rim)[0] < reach
    return float(supported.mean())


def _rim(outline, form):
    """Places (k, 2) along an outline."""
    angle = 2 * np.pi * (np.arange(RIM) + 0.5) / RIM
    ring = np.column_stack([np.cos(angle), np.sin(angle)])
    if form == ROUND:
        return outline.centre + outline.size / 2 * ring
    square = ring / np.abs(ring).max(axis=1, keepdims=True)
    cos, sin = np.cos(outline.turn), np.sin(outline.turn)
    return outline.centre + outline.size / 2 * square @ np.array([[cos, sin], [-sin, cos]])


def _spacing(within, outline, form, kind):
    """Distance (m) from a place on the target to the nearest beam, where it is seen best."""
    golden = (np.arange(INSIDE) * np.array([[0.7548777], [0.5698403]])).T % 1.0 - 0.5
    places = outline.centre + outline.size * golden
    inside = distance_inside(places, outline.row, form) > 0
    if kind == "hole":
        places = outline.centre + 1.8 * outline.size * golden
        inside = distance_inside(places, outline.row, form) < 0
    return float(np.percentile(cKDTree(within).query(places[inside])[0], 40))


def _agreement(points, state, outline):
    """Share of the beams on a checkerboard whose colour is right, of the worse colour."""
    on_board = (distance_inside(points, outline.row, 2) > 0) & (state >= 0)
    white = distance_on_white(points[on_board], outline.row) > 0
    bright = state[on_board] == BRIGHT
    if white.all() or not white.any():
        return 0.0
    return float(min(bright[white].mean(), 1.0 - bright[~white].mean()))


def _contrast(bright, dark):
    """Difference over sum of typical intensities, bright and dark; 1 where nothing is dark."""
    if len(bright) == 0 or len(dark) < 5:
        return float(len(bright) > 0)
    one, other = np.median(bright), np.median(dark)
    return float((one - other) / max(one + other, 1e-9))
