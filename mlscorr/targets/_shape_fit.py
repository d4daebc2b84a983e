"""Fit of a target at a seed: a rough fit, which rejects most seeds, then an exact one.

Each fit is assessed by the criteria that a surveyor would apply before trusting its center.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import cKDTree

from mlscorr.survey import Scanner
from mlscorr.targets._echoes import Echoes, beams_at_plane, missed_points
from mlscorr.targets._outline import Outline, Size, fit_outline
from mlscorr.targets._plane import fit_plane
from mlscorr.targets._seeds import Seed
from mlscorr.targets._sequence import quasi_random
from mlscorr.targets.settings import SETTINGS
from mlscorr.targets.shapes import (
    BRIGHT,
    CHECKERED,
    DARK,
    MISS,
    ROUND,
    WHITE,
    diameter,
    distance_inside,
    form_of,
    sides,
)


@dataclass(frozen=True)
class Assessment:
    """Assessment of the likeness of a fit to a target.

    Parameters
    ----------
    score : float
        0 to 1.
    rank : float
        Rank among fits at one position.
    plausible, accepted : bool
        True if a rough or an exact fit passes.
    """

    score: float
    rank: float
    plausible: bool
    accepted: bool


@dataclass(frozen=True)
class ShapeFit:
    """Shape fitted at a seed, with the beams behind it.

    Parameters
    ----------
    seed : Seed
    kind : str
    size : float or None
        Surveyed size. Units: m.
    beams : (n, 2), (n,) and (n,) arrays
        Crossings (m), state, and rows of the echoes; -1 without a return.
    outline : Outline
    assessment : Assessment
    """

    seed: Seed
    kind: str
    size: float | None
    beams: tuple[np.ndarray, np.ndarray, np.ndarray]
    outline: Outline
    assessment: Assessment

    @property
    def position(self) -> np.ndarray:
        """Center (3,) in the coordinates of the echoes. Units: m."""
        return self.seed.plane.origin + self.outline.centre @ self.seed.plane.axes[:2]

    @property
    def on_target(self) -> np.ndarray:
        """Flag (n,) of beams that met the target; for a hole, the board within one more radius."""
        points, state, _ = self.beams
        row = self.outline.row
        row[4] = 0.0
        inside = distance_inside(points, row, form_of(self.kind, self.seed.by_edges))
        if self.kind == "hole":
            inside = np.where(inside < 0, inside + self.outline.size / 2, -1.0)
        if self.kind in ("circle", "square") and not self.seed.by_edges:
            return (state == BRIGHT) & (inside > 0)
        return (state != MISS) & (inside > 0)


def rough_fit(echoes: Echoes, seed: Seed, kind: str, size: float | None) -> ShapeFit | None:
    """Fit a shape at a seed quickly; None if it is not a target.

    Parameters
    ----------
    echoes : Echoes
    seed : Seed
    kind : str
    size : float or None
        Units: m.
    """
    known = _size(seed, size, 0.0)
    beams = _beams(echoes, seed, kind, known.high)
    if not seed.by_edges:
        away = np.linalg.norm(beams[0] - seed.middle, axis=1)
        beyond = away > SETTINGS.outside_middle * diameter(kind, known.mean)
        bright = echoes.intensity[seed.rows]
        beams, seed = _with_threshold(echoes.intensity, beams, bright, beyond, seed)
    points, state, _ = beams
    blur = SETTINGS.rough_blur * known.mean
    start = seed.middle
    outline = fit_outline(points, state, kind, known, blur, start, seed.by_edges, rough=True)
    if kind == "circle" and not seed.by_edges and _dark_inside(points, state, outline):
        outline = fit_outline(points, state, kind, known, blur, start, ring=True, rough=True)
    assessment = assess(beams, outline, kind, seed, echoes, blur)
    if assessment.plausible:
        return ShapeFit(seed, kind, size, beams, outline, assessment)
    return None


def exact_fit(echoes: Echoes, fit: ShapeFit, scanner: Scanner) -> ShapeFit | None:
    """Fit the outline exactly; None if it does not fit or does not determine the center.

    Parameters
    ----------
    echoes : Echoes
    fit : ShapeFit
        Rough fit.
    scanner : Scanner
        Its noise blurs the outline.
    """
    if 2 * fit.on_target.sum() < SETTINGS.smallest_count:
        return None
    fit = _refined(echoes, fit)
    if not fit.on_target.any() or _sight(echoes, fit)[1] < SETTINGS.least_crossing_sine:
        return None  # or a single line of points, whose plane may contain the beams
    seed = fit.seed
    kind = fit.kind
    ring = fit.outline.inner > 0
    points, state, rows = fit.beams
    blur, footprint = _blur(echoes, fit, scanner)
    known = _size(seed, fit.size, footprint)
    start = seed.middle
    outline = fit_outline(points, state, kind, known, blur, start, seed.by_edges, ring)
    hidden = _contradicted(points[rows < 0], outline, form_of(kind, seed.by_edges), blur)
    if hidden:
        points = points[rows >= 0]
        state = state[rows >= 0]
        rows = rows[rows >= 0]
        outline = fit_outline(points, state, kind, known, blur, start, seed.by_edges, ring)
    beams = points, state, rows
    assessment = assess(beams, outline, kind, seed, echoes, blur, hidden)
    fit = replace(fit, beams=beams, outline=outline, assessment=assessment)
    kept = 2 * fit.on_target.sum() >= SETTINGS.smallest_count
    if assessment.accepted and kept:
        return fit
    return None


def _beams(echoes, seed, kind, size):
    """Crossings, state and rows of the beams near a seed; row -1 without a return."""
    beams = beams_at_plane(echoes, seed.plane, seed.middle, size, seed.threshold)
    if kind == "hole":
        return beams
    missed = missed_points(echoes, seed.rows, seed.plane)
    passed = np.full(len(missed), MISS), np.full(len(missed), -1)
    return tuple(map(np.concatenate, zip(beams, (missed, *passed), strict=True)))


def _refined(echoes, fit):
    """Recompute plane and beams of a rough fit from all points on the target."""
    seed = fit.seed
    on_target = fit.beams[2][fit.on_target]
    plane = fit_plane(echoes.xyz[on_target], echoes.tolerance).turned_like(seed.plane)
    shift = (fit.position - plane.origin) @ plane.axes[:2].T
    seed = replace(seed, rows=on_target, plane=plane, middle=shift)
    points, state, rows = beams = _beams(echoes, seed, fit.kind, fit.outline.size)
    fit = replace(fit, seed=seed, outline=replace(fit.outline, centre=shift))
    if not seed.by_edges and fit.kind != "checkerboard":  # one threshold applies to both
        inside = distance_inside(points, fit.outline.row, form_of(fit.kind, False))
        beyond = inside < -2 * SETTINGS.rough_blur * fit.outline.size
        bright = echoes.intensity[rows[(state != MISS) & (inside > 0)]]
        if len(bright):
            beams, seed = _with_threshold(echoes.intensity, beams, bright, beyond, seed)
    return replace(fit, seed=seed, beams=beams)


def _contradicted(missed, outline, form, blur):
    """True if beams without a return are well inside the outline: an unseen obstacle hides it."""
    inside = (
        distance_inside(missed, outline.row, form) > 3 * blur + SETTINGS.rough_blur * outline.size
    )
    return inside.sum() > max(2, SETTINGS.contradiction * len(missed))


def _size(seed, size, footprint):
    """Prior of the outline's size, which the beam's width makes larger or smaller."""
    if size is None and seed.mesh:  # a hole is smaller than the gap by less than the spacing
        low = max(seed.extent - 2 * seed.mesh, seed.extent / 2)
        return Size((low + seed.extent) / 2, np.inf, low, seed.extent + seed.mesh / 2)
    if size is None:
        return Size(0.85 * seed.extent, np.inf, 0.55 * seed.extent, 1.2 * seed.extent)
    sigma = np.hypot(2 * SETTINGS.rounding, footprint)
    if seed.bloomed:
        return Size(1.1 * size, np.inf, size - 4 * sigma, SETTINGS.bloom * size)
    return Size(size, sigma, size - 4 * sigma, size + 4 * sigma)


def _dark_inside(points, state, outline):
    """True if the center of a disc is dark, so that it is a ring."""
    about = np.linalg.norm(points - outline.centre, axis=1) < SETTINGS.core * outline.size
    return (about & (state == DARK)).sum() > max(3, 0.5 * about.sum())


def _with_threshold(intensity, beams, bright, outside, seed):
    """Set the state of beams, and the seed, by a threshold half way between bright and dark.

    bright are intensities on the target, outside flags beams that are certainly not on it. If none
    of these returned from the plane, dark is half of bright. If they are nearly as bright, the
    threshold of the seed is used.
    """
    points, state, rows = beams
    dark = intensity[rows[outside & (state != MISS)]]
    # the brighter surface outside: next to a dark board, the wall behind it
    if len(dark) >= SETTINGS.smallest_count / 4:
        dark = np.percentile(dark, 90)
    else:
        dark = 0.0
    bright = np.median(bright)
    is_separate = dark < SETTINGS.same_surface * bright
    threshold = (bright + dark) / 2 if is_separate else seed.threshold
    returned = np.where(intensity[rows] >= threshold, BRIGHT, DARK)
    beams = points, np.where(state == MISS, MISS, returned), rows
    return beams, replace(seed, threshold=float(threshold))


def _sight(echoes, fit):
    """Distance (m) of the visible part of the target, and cosine of the angle of incidence."""
    sight = echoes.sight(fit.beams[2][fit.on_target]).mean(axis=0)
    distance = np.linalg.norm(sight)
    return distance, abs(sight @ fit.seed.plane.axes[2]) / distance


def _blur(echoes, fit, scanner):
    """One sigma (m) of a beam's position across the outline, and of the outline's size.

    They follow from angle noise and beam width. A beam counts as bright from half of its width, and
    the accuracy of this half is the repeatability of intensities. At edges of plates the returning
    share is unknown, but it is the same all around.
    """
    _, state, rows = fit.beams
    on_target = fit.on_target
    distance, cosine = _sight(echoes, fit)
    slant = np.sqrt((1 + 1 / cosine**2) / 2)  # both directions in the plane, on average
    beam = distance * SETTINGS.divergence / 4 * slant
    intensity = echoes.intensity[rows[on_target & (state == BRIGHT)]].astype(float)
    speckle = SETTINGS.intensity_spread
    if len(intensity) > 5 and not fit.seed.by_edges:
        spread = 0.74 * np.subtract(*np.percentile(intensity, [75, 25]))
        speckle = float(np.clip(spread / max(np.median(intensity), 1e-9), speckle / 4, 0.5))
    half = np.sqrt(np.pi / 2)  # sigmas of a beam per unit of speckle, from its slope at half power
    angle = distance * scanner.angle_noise * slant
    blur = np.linalg.norm([angle, half * speckle * beam, SETTINGS.rounding])
    return float(blur), float(beam)


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
        One sigma of a beam's position. Units: m.
    hidden : bool
        True if an unseen obstacle is assumed to hide a part; then all the rest must fit.

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
    least_overlap = SETTINGS.smallest_overlap
    if hidden:
        least_overlap = SETTINGS.close_overlap
    overlap = outline.overlap
    if kind == "hole" and marked.sum() < 5:  # nothing behind it: only the board counts
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
            and overlap >= least_overlap
            and support >= smallest
            and sigma <= SETTINGS.largest_sigma
            and flat > 0
        ),
    )


def _support(points, marked, outline, form, kind, blur):
    """Share of the outline with nearby beams on both sides; for a hole, on the board."""
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
    """Positions (k, 2) along an outline."""
    angle = 2 * np.pi * (np.arange(SETTINGS.rim_places) + 0.5) / SETTINGS.rim_places
    ring = np.column_stack([np.cos(angle), np.sin(angle)])
    if form == ROUND:
        return outline.centre + outline.size / 2 * ring
    square = ring / np.abs(ring).max(axis=1, keepdims=True)
    cos = np.cos(outline.turn)
    sin = np.sin(outline.turn)
    return outline.centre + outline.size / 2 * square @ np.array([[cos, sin], [-sin, cos]])


def _spacing(within, outline, form, kind):
    """Distance (m) from a position on the target to the nearest beam, in its best visible part."""
    wide = 1.8 if kind == "hole" else 1.0  # sizes, with the board around a hole
    places = quasi_random(4 * SETTINGS.rim_places, 2) - 0.5
    places = outline.centre + wide * outline.size * places
    on_target = (distance_inside(places, outline.row, form) > 0) == (kind != "hole")
    return float(np.percentile(cKDTree(within).query(places[on_target])[0], 40))


def _share_of_right_colour(points, state, outline):
    """Share of the beams on a checkerboard with the right color, for the worse color."""
    on_board = (distance_inside(points, outline.row, CHECKERED) > 0) & (state != MISS)
    white = distance_inside(points[on_board], outline.row, WHITE) > 0
    bright = state[on_board] == BRIGHT
    if white.all() or not white.any():
        return 0.0
    return float(min(bright[white].mean(), 1.0 - bright[~white].mean()))


def _contrast(intensity, bright):
    """Difference over sum of typical intensities, bright and dark; 1 if nothing is dark."""
    if not bright.any() or (~bright).sum() < 5:
        return float(bright.any())
    light = np.median(intensity[bright])
    dark = np.median(intensity[~bright])
    return float((light - dark) / max(light + dark, 1e-9))
