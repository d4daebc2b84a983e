"""Targets of one piece of cloud: what extraction near control and search without it both call."""

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import cKDTree

from mlscorr.survey import PointCloud
from mlscorr.targets.beams import Pulses, beams_at_plane, missed_points
from mlscorr.targets.clusters import FEWEST_POINTS
from mlscorr.targets.intensity import why_useless
from mlscorr.targets.judge import Verdict, judge
from mlscorr.targets.outline import Outline, Size, fit_outline
from mlscorr.targets.plane import aligned, centre_of, fit_plane
from mlscorr.targets.seeds import (
    BLOOMED,
    Seed,
    bright_seeds,
    hole_seeds,
    plate_seeds,
    spot_seeds,
)
from mlscorr.targets.shapes import (
    BRIGHT,
    BY_EDGES,
    DARK,
    PASSED,
    diameter,
    distance_inside,
    form_of,
    sides,
)

THICKNESS = 0.03  # m off a plane: less than a post's or a frame's depth
FEWEST_DARK = 5  # points that tell how dark it is beside a target
ALIKE = 0.7  # dark over bright, from which on they may be the same surface
BEAM_DIVERGENCE = 0.35e-3  # rad, RIEGL VQ-250 data sheet: four sigmas of its width
ROUNDING = 0.0003  # m, one sigma of a coordinate at the usual LAS scale of 1 mm
MADE = 0.0005  # m, one sigma of a target's size as made and measured
REACH = 1.0  # sizes about the centre, within which beams are looked at
SETTLED = 0.93  # overlap of a rough fit that needs no second
ROUGH_BLUR = 40.0  # the size over the blur of a rough fit
CONTRADICTED = 0.05  # share of the beams that met nothing, found well inside the outline


@dataclass(frozen=True)
class TargetView:
    """What a figure of one target shows, in its plane; (u, v) from an arbitrary origin, in m.

    Parameters
    ----------
    points : (k, 2) array
        Where the beams near the target crossed its plane.
    state : (k,) int array
        1 bright, 0 dark, -1 went by it.
    bright : (k,) bool array
        Whether each tells that it is inside: bright, or on a plate, or through a hole.
    centre : (2,) array
    covariance : (2, 2) array
        Of the centre in the plane. Units: m^2.
    turn : float
        Of a square's edges against u. Units: rad.
    inner : float
        Diameter of a ring's inner disc over the outer one's, 0 for none.
    outline : float
        Fitted diameter or edge, larger than the size where the disc blooms. Units: m.
    axes : (2, 3) array
        Map directions of u and v.
    """

    points: np.ndarray
    state: np.ndarray
    bright: np.ndarray
    centre: np.ndarray
    covariance: np.ndarray
    turn: float
    inner: float
    outline: float
    axes: np.ndarray


@dataclass(frozen=True)
class FittedTarget:
    """One target in one piece of cloud: what a row of TargetObservations holds, and more.

    Parameters
    ----------
    gps_time : float
        When the scanner passed the centre. Units: s.
    duration : float
        Standard deviation of its points' times. Units: s.
    position, normal : (3,) array
        Centre (m), and unit normal towards the scanner.
    covariance : (3, 3) array
        Of the centre, without the motion of the POS error. Units: m^2.
    kind : str
    size, size_sigma : float
        As given (sigma 0), or estimated. Units: m.
    points : int
        Number of points on the target; about a hole, on the board around it.
    score : float
        How target-like it is, 0 to 1: overlap, support of the outline, contrast and flatness.
    cloud : PointCloud
        These points.
    view : TargetView
    """

    gps_time: float
    duration: float
    position: np.ndarray
    covariance: np.ndarray
    normal: np.ndarray
    kind: str
    size: float
    size_sigma: float
    points: int
    score: float
    cloud: PointCloud
    view: TargetView


@dataclass(frozen=True)
class _Fit:
    """A shape fitted at a seed, with the beams that tell it."""

    seed: Seed
    kind: str
    size: float | None
    beams: tuple
    outline: Outline
    verdict: Verdict

    @property
    def position(self):
        return self.seed.plane.origin + self.outline.centre @ self.seed.plane.axes[:2]


def fit_targets(cloud, sight, shapes, scanner, rng, spot=None):
    """Fit targets of the given shapes in one piece of cloud of one pass and visit.

    Parameters
    ----------
    cloud : PointCloud
        A few metres of cloud.
    sight : (n, 3) array
        Scanner to point. Units: m.
    shapes : sequence of (kind, size or None)
        What to look for; where the size (m) is None it is estimated.
    scanner : Scanner
        Noise that blurs the outline.
    rng : numpy.random.Generator
        For the random samples of the plane fit.
    spot : Spot, optional
        The one bright blob to look at.

    Returns a list of FittedTarget, best first; no two at the same place. Where the intensity is
    of no use, plates that stand free are found by their edges.
    """
    if len(cloud) < FEWEST_POINTS:
        return []
    order = np.argsort(cloud.gps_time, kind="stable")
    origin = cloud.xyz.mean(axis=0)
    xyz = cloud.xyz[order] - origin
    time, intensity = cloud.gps_time[order], cloud.intensity[order].astype(float)
    tolerance = max(THICKNESS, 4 * scanner.range_noise)
    pulses = Pulses(xyz, time, intensity, sight[order], cKDTree(xyz), tolerance)
    blind = why_useless(intensity) is not None
    roughly = []
    for kind, size in shapes:
        if spot is None or blind:
            seeds = _seeds(pulses, kind, size, blind, rng)
        else:
            seeds = spot_seeds(pulses, spot, origin, kind, size, rng)
        for seed in seeds:
            if not any(_settled(fit, seed, kind, size) for fit in roughly):
                fit = _rough_fit(pulses, seed, kind, size)
                roughly += [fit] if fit is not None else []
    exact = [_exact_fit(pulses, fit, scanner, rng) for fit in _best(roughly)]
    exact = _best([fit for fit in exact if fit is not None])
    return [_as_target(pulses, fit, origin) for fit in exact]


def _seeds(pulses, kind, size, blind, rng):
    if kind == "hole":
        return hole_seeds(pulses, size, rng)
    if kind in BY_EDGES or blind:
        return plate_seeds(pulses, kind, size, rng)
    return bright_seeds(pulses, kind, size, rng)


def _settled(fit, seed, kind, size):
    """Whether a good fit of the same shape is where a seed is: another level tells nothing new."""
    if (fit.kind, fit.size) != (kind, size) or fit.outline.overlap < SETTLED:
        return False
    middle = seed.plane.origin + seed.middle @ seed.plane.axes[:2]
    return np.linalg.norm(fit.position - middle) < 0.1 * fit.outline.size


def _best(fits):
    """The best fit at each place, best first: half a target apart or less is one place."""
    best = []
    for one in sorted(fits, key=lambda fit: -fit.verdict.rank):
        for other in best:
            apart = np.linalg.norm(one.position - other.position)
            if apart < max(one.outline.size, other.outline.size) / 2:
                break
        else:
            best.append(one)
    return best


def _rough_fit(pulses, seed, kind, size):
    """A quick fit of the shape at a seed, or None where it can't be one."""
    known = _size(seed, size, 0.0)
    beams = _beams(pulses, seed, kind, known.high)
    if not seed.by_edges:
        beyond = np.linalg.norm(beams[0] - seed.middle, axis=1) > 0.65 * diameter(kind, known.mean)
        bright = pulses.intensity[seed.rows]
        beams, level = _with_threshold(pulses.intensity, beams, bright, beyond, seed.threshold)
        seed = replace(seed, threshold=float(level))
    points, state, _ = beams
    blur = known.mean / ROUGH_BLUR
    start = seed.middle
    outline = fit_outline(points, state, kind, known, blur, start, seed.by_edges, rough=True)
    if kind == "circle" and not seed.by_edges and _dark_inside(points, state, outline):
        outline = fit_outline(points, state, kind, known, blur, start, ring=True, rough=True)
    verdict = judge(beams, outline, kind, seed, pulses, blur)
    return _Fit(seed, kind, size, beams, outline, verdict) if verdict.plausible else None


def _beams(pulses, seed, kind, size):
    """Crossings, state and rows of the beams about a seed; row -1 where nothing returned."""
    points, state, rows = beams_at_plane(
        pulses, seed.plane, seed.middle, REACH * size, seed.threshold
    )
    if kind == "hole":
        return points, state, rows
    missed = missed_points(pulses, seed.rows, seed.plane)
    unreturned = np.full(len(missed), -1)
    return (
        np.vstack([points, missed]),
        np.append(state, np.full(len(missed), PASSED)),
        np.append(rows, unreturned),
    )


def _exact_fit(pulses, fit, scanner, rng):
    """The fit with its exact outline, or None where that doesn't fit or hold the centre."""
    if _on_target(fit).sum() < FEWEST_POINTS / 2:
        return None
    fit = _refined(pulses, fit, rng)
    seed, kind, ring = fit.seed, fit.kind, fit.outline.inner > 0
    points, state, rows = fit.beams
    blur, footprint = _blur(pulses, fit, scanner)
    known, start = _size(seed, fit.size, footprint), seed.middle
    outline = fit_outline(points, state, kind, known, blur, start, seed.by_edges, ring)
    hidden = _contradicted(points[rows < 0], outline, form_of(kind, seed.by_edges), blur)
    if hidden:
        points, state, rows = points[rows >= 0], state[rows >= 0], rows[rows >= 0]
        outline = fit_outline(points, state, kind, known, blur, start, seed.by_edges, ring)
    beams = points, state, rows
    verdict = judge(beams, outline, kind, seed, pulses, blur, hidden)
    fit = replace(fit, beams=beams, outline=outline, verdict=verdict)
    seen = _on_target(fit).sum() >= FEWEST_POINTS / 2
    return fit if verdict.accepted and seen else None


def _refined(pulses, fit, rng):
    """The fit with plane and beams anew from all points that are on the target by the rough one."""
    seed = fit.seed
    on_target = fit.beams[2][_on_target(fit)]
    plane = aligned(fit_plane(pulses.xyz[on_target], pulses.tolerance, rng), seed.plane)
    shift = (fit.position - plane.origin) @ plane.axes[:2].T
    seed = replace(seed, rows=on_target, plane=plane, middle=shift)
    points, state, rows = beams = _beams(pulses, seed, fit.kind, fit.outline.size)
    fit = replace(fit, seed=seed, outline=replace(fit.outline, centre=shift))
    if not seed.by_edges and fit.kind != "checkerboard":  # whose threshold holds for both
        inside = distance_inside(points, fit.outline.row, form_of(fit.kind, False))
        beyond = inside < -0.05 * fit.outline.size
        bright = pulses.intensity[rows[(state != PASSED) & (inside > 0)]]
        beams, level = _with_threshold(pulses.intensity, beams, bright, beyond, seed.threshold)
        seed = replace(seed, threshold=float(level))
    return replace(fit, seed=seed, beams=beams)


def _contradicted(missed, outline, form, blur):
    """Whether beams that met nothing lie well inside the outline: then something out of sight
    stood in front, and they say nothing."""
    inside = distance_inside(missed, outline.row, form) > 3 * blur + 0.02 * outline.size
    return inside.sum() > max(2, CONTRADICTED * len(missed))


def _size(seed, size, footprint):
    """What is known of the outline's size: the beam's width moves it to and fro."""
    if size is None and seed.mesh:  # a hole is smaller than the gap by less than the mesh
        low = max(seed.extent - 2 * seed.mesh, seed.extent / 2)
        return Size((low + seed.extent) / 2, np.inf, low, seed.extent + seed.mesh / 2)
    if size is None:
        return Size(0.85 * seed.extent, np.inf, 0.55 * seed.extent, 1.2 * seed.extent)
    sigma = np.hypot(MADE, footprint)
    if seed.bloomed:
        return Size(1.1 * size, np.inf, size - 4 * sigma, BLOOMED * size)
    return Size(size, sigma, size - 4 * sigma, size + 4 * sigma)


def _dark_inside(points, state, outline):
    """Whether what lies about the centre of a disc is dark: then it is a ring."""
    about = np.linalg.norm(points - outline.centre, axis=1) < 0.2 * outline.size
    return (about & (state == DARK)).sum() > max(3, 0.5 * about.sum())


def _on_target(fit):
    """Which of the beams met the target: about a hole, the board within another radius."""
    points, state, _ = fit.beams
    row = fit.outline.row
    row[4] = 0.0
    inside = distance_inside(points, row, form_of(fit.kind, fit.seed.by_edges))
    if fit.kind == "hole":
        inside = np.where(inside < 0, inside + fit.outline.size / 2, -1.0)
    on_plane = state != PASSED
    if fit.kind in ("circle", "square") and not fit.seed.by_edges:
        on_plane = state == BRIGHT
    return on_plane & (inside > 0)


def _with_threshold(intensity, beams, bright, outside, otherwise):
    """The beams with their state by a threshold, and it: half way between bright and dark.

    bright are intensities on the target, outside tells which beams certainly aren't; where none
    of these returned from the plane, half as bright is dark, and where they are nearly as bright,
    the threshold is the one given.
    """
    points, state, rows = beams
    dark = intensity[rows[outside & (state != PASSED)]]
    # the brighter of what lies outside: beside a dark board, the wall that it hangs on
    dark = np.percentile(dark, 90) if len(dark) >= FEWEST_DARK else 0.0
    bright = np.median(bright)
    threshold = (bright + dark) / 2 if dark < ALIKE * bright else otherwise
    returned = np.where(intensity[rows] >= threshold, BRIGHT, DARK)
    return (points, np.where(state == PASSED, PASSED, returned), rows), threshold


def _blur(pulses, fit, scanner):
    """One sigma (m) of a beam's place across the outline, and that of the outline's size.

    From angle noise and the beam's own width. A beam counts as bright from half its width on, and
    how exactly half is as good as intensities repeat; at edges of plates nobody knows the share
    that returns, but it is the same all round.
    """
    _, state, rows = fit.beams
    on_target = _on_target(fit)
    sight = pulses.sight[rows[on_target]].mean(axis=0)
    distance = np.linalg.norm(sight)
    cosine = abs(sight @ fit.seed.plane.axes[2]) / distance
    slant = np.sqrt((1 + 1 / cosine**2) / 2)  # both ways in the plane, on average
    beam = distance * BEAM_DIVERGENCE / 4 * slant
    intensity = pulses.intensity[rows[on_target & (state == BRIGHT)]].astype(float)
    speckle = 0.2
    if len(intensity) > 5 and not fit.seed.by_edges:
        spread = 0.74 * np.subtract(*np.percentile(intensity, [75, 25]))
        speckle = float(np.clip(spread / max(np.median(intensity), 1e-9), 0.05, 0.5))
    angle = distance * scanner.angle_noise * slant
    return float(np.sqrt(angle**2 + (1.25 * speckle * beam) ** 2 + ROUNDING**2)), float(beam)


def _as_target(pulses, fit, origin):
    """The fit in the map: centre, covariance, normal towards the scanner, time at the centre."""
    points, state, rows = fit.beams
    plane, outline = fit.seed.plane, fit.outline
    met = rows[_on_target(fit) & (rows >= 0)]
    centre = centre_of(pulses, plane, outline, met)
    turned = -plane.axes[2] if centre.away else plane.axes[2]
    size = (outline.size, outline.size_sigma) if fit.size is None else (fit.size, 0.0)
    told = sides(state, fit.kind, fit.seed.by_edges) == 1
    view = TargetView(
        points,
        state,
        told,
        outline.centre,
        outline.covariance,
        outline.turn,
        outline.inner,
        outline.size,
        plane.axes[:2],
    )
    return FittedTarget(
        gps_time=centre.gps_time,
        duration=centre.duration,
        position=centre.position + origin,
        covariance=centre.covariance,
        normal=turned,
        kind=fit.kind,
        size=float(size[0]),
        size_sigma=float(size[1]),
        points=len(met),
        score=fit.verdict.score,
        cloud=PointCloud(pulses.xyz[met] + origin, pulses.gps_time[met], pulses.intensity[met]),
        view=view,
    )
