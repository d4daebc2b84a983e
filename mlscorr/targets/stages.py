"""From a seed to a fitted target: roughly first, which most seeds don't survive, then exactly."""

from dataclasses import dataclass, replace

import numpy as np

from mlscorr.targets.beams import beams_at_plane, missed_points
from mlscorr.targets.clusters import FEWEST_POINTS
from mlscorr.targets.judge import Verdict, judge
from mlscorr.targets.outline import Outline, Size, fit_outline
from mlscorr.targets.plane import aligned, fit_plane
from mlscorr.targets.seeds import BLOOMED, Seed
from mlscorr.targets.shapes import BRIGHT, DARK, PASSED, diameter, distance_inside, form_of

FEWEST_DARK = 5  # points that tell how dark it is beside a target
ALIKE = 0.7  # dark over bright, from which on they may be the same surface
BEAM_DIVERGENCE = 0.35e-3  # rad, RIEGL VQ-250 data sheet: four sigmas of its width
ROUNDING = 0.0003  # m, one sigma of a coordinate at the usual LAS scale of 1 mm
MADE = 0.0005  # m, one sigma of a target's size as made and measured
REACH = 1.0  # sizes about the centre, within which beams are looked at
ROUGH_BLUR = 40.0  # the size over the blur of a rough fit
BESIDE = 0.65  # of the diameter from a seed's middle, which may be off by a seventh of it: outside
OUTSIDE = 0.05  # of the size off a rough outline, which is as uncertain (two rough blurs): outside
INSIDE = 0.02  # of the size, by which an exact outline may miss a beam's place, with 3 blurs
CONTRADICTED = 0.05  # share of the beams that met nothing, found well inside the outline
CORE = 0.2  # of the size about the centre: lies in the dark disc of a ring of at least 0.4
SPECKLE = 0.2, 0.05, 0.5  # relative spread of intensity: where unknown, least and most credible
HALF_POWER = 1.25  # sigmas of a beam per unit of speckle: half over the slope, sqrt(pi / 2)


@dataclass(frozen=True)
class Fit:
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


def rough_fit(pulses, seed, kind, size):
    """A quick fit of the shape at a seed, or None where it can't be one."""
    known = _size(seed, size, 0.0)
    beams = _beams(pulses, seed, kind, known.high)
    if not seed.by_edges:
        away = np.linalg.norm(beams[0] - seed.middle, axis=1)
        beyond = away > BESIDE * diameter(kind, known.mean)
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
    return Fit(seed, kind, size, beams, outline, verdict) if verdict.plausible else None


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


def exact_fit(pulses, fit, scanner):
    """The fit with its exact outline, or None where that doesn't fit or hold the centre."""
    if met_target(fit).sum() < FEWEST_POINTS / 2:
        return None
    fit = _refined(pulses, fit)
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
    seen = met_target(fit).sum() >= FEWEST_POINTS / 2
    return fit if verdict.accepted and seen else None


def _refined(pulses, fit):
    """The fit with plane and beams anew from all points that are on the target by the rough one."""
    seed = fit.seed
    on_target = fit.beams[2][met_target(fit)]
    plane = aligned(fit_plane(pulses.xyz[on_target], pulses.tolerance), seed.plane)
    shift = (fit.position - plane.origin) @ plane.axes[:2].T
    seed = replace(seed, rows=on_target, plane=plane, middle=shift)
    points, state, rows = beams = _beams(pulses, seed, fit.kind, fit.outline.size)
    fit = replace(fit, seed=seed, outline=replace(fit.outline, centre=shift))
    if not seed.by_edges and fit.kind != "checkerboard":  # whose threshold holds for both
        inside = distance_inside(points, fit.outline.row, form_of(fit.kind, False))
        beyond = inside < -OUTSIDE * fit.outline.size
        bright = pulses.intensity[rows[(state != PASSED) & (inside > 0)]]
        beams, level = _with_threshold(pulses.intensity, beams, bright, beyond, seed.threshold)
        seed = replace(seed, threshold=float(level))
    return replace(fit, seed=seed, beams=beams)


def _contradicted(missed, outline, form, blur):
    """Whether beams that met nothing lie well inside the outline: then something out of sight
    stood in front, and they say nothing."""
    inside = distance_inside(missed, outline.row, form) > 3 * blur + INSIDE * outline.size
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
    about = np.linalg.norm(points - outline.centre, axis=1) < CORE * outline.size
    return (about & (state == DARK)).sum() > max(3, 0.5 * about.sum())


def met_target(fit):
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
    on_target = met_target(fit)
    sight = pulses.sight[rows[on_target]].mean(axis=0)
    distance = np.linalg.norm(sight)
    cosine = abs(sight @ fit.seed.plane.axes[2]) / distance
    slant = np.sqrt((1 + 1 / cosine**2) / 2)  # both ways in the plane, on average
    beam = distance * BEAM_DIVERGENCE / 4 * slant
    intensity = pulses.intensity[rows[on_target & (state == BRIGHT)]].astype(float)
    speckle, least, most = SPECKLE
    if len(intensity) > 5 and not fit.seed.by_edges:
        spread = 0.74 * np.subtract(*np.percentile(intensity, [75, 25]))
        speckle = float(np.clip(spread / max(np.median(intensity), 1e-9), least, most))
    angle = distance * scanner.angle_noise * slant
    return float(np.sqrt(angle**2 + (HALF_POWER * speckle * beam) ** 2 + ROUNDING**2)), float(beam)
