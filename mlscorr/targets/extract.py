"""Candidates -> bright components -> plane -> circle or square -> TargetObservations."""

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import cKDTree

from mlscorr.survey import TargetObservations
from mlscorr.targets.candidates import search_radius
from mlscorr.targets.clusters import FEWEST_POINTS, bright_components, split_by_time
from mlscorr.targets.outside import Pulses, missed_points
from mlscorr.targets.plane import Plane, fit_plane
from mlscorr.targets.shapes import ROUGH_STAGES, Outline, fit_outline

PLANE_TOLERANCE = 0.03  # m: several sigmas of range noise, less than a post's or a frame's depth
PAUSE = 2.0  # s without a point: the vehicle came by twice
LEAST_EXTENT = 0.7, 0.4  # of the size, along and across: a target may be partly hidden
LEAST_OVERLAP = 0.8  # of the fitted outline with the bright points
LARGEST_SIGMA = 0.10  # of the size: beyond it the outline holds the centre in one direction only
FLOOR = 0.0005  # m, one sigma: half of the usual LAS scale of 1 mm
BEAM_DIVERGENCE = 0.35e-3  # rad, RIEGL VQ-250 data sheet


@dataclass(frozen=True)
class _Candidate:
    """A bright component on a plane, its points marked inside or outside, and a rough outline."""

    pulses: Pulses
    rows: np.ndarray
    plane: Plane
    marked: tuple[np.ndarray, np.ndarray]
    kind: str
    size: float
    outline: Outline

    @property
    def position(self):
        return self.plane.origin + self.outline.centre @ self.plane.axes[:2]


@dataclass(frozen=True)
class _Target:
    """One fitted target: a row of TargetObservations."""

    gps_time: float
    position: np.ndarray
    covariance: np.ndarray
    normal: np.ndarray
    kind: str
    size: float
    points: int


def extract_targets(candidates, control, trajectory, scanner, rng, mounting=None):
    """Find circles and squares of the surveyed kinds and sizes near control points.

    Parameters
    ----------
    candidates : Candidates
    control : ControlPoints
        Control and check points together: they say where to look and for what.
    trajectory : Trajectory
        As recorded.
    scanner : Scanner
        Noise that blurs the outline.
    rng : numpy.random.Generator
        For the random samples of the plane fit.
    mounting : Mounting, optional
        Its lever arm tells where the beams came from; else from the navigation centre.

    Returns TargetObservations without names, in order of pass and time.
    """
    if len(candidates.cloud) == 0:
        return _as_observations([])
    passes = candidates.pass_number
    lever_arm = np.zeros(3) if mounting is None else mounting.lever_arm
    tree = cKDTree(candidates.cloud.xyz)
    found = []
    for index, radius in enumerate(search_radius(trajectory, control)):
        rows = np.sort(np.array(tree.query_ball_point(control.position[index], radius), int))
        shape = control.kind[index], float(control.size[index])
        for number in np.unique(passes[rows]):
            cloud = candidates.cloud[rows[passes[rows] == number]]
            for target in _targets_of_pass(cloud, *shape, trajectory, lever_arm, scanner, rng):
                if not any(number == n and _same_place(target, other) for n, other in found):
                    found.append((int(number), target))
    found.sort(key=lambda pair: (pair[0], pair[1].gps_time))
    return _as_observations(found)


def _targets_of_pass(cloud, kind, size, trajectory, lever_arm, scanner, rng):
    """Targets of a kind and size near one control point in one pass; the best fit at each place."""
    roughly = []
    for visit in split_by_time(cloud.gps_time, PAUSE):
        part = cloud[visit]
        pose = trajectory.at(part.gps_time)
        sight = part.xyz - pose.position - pose.attitude.apply(lever_arm)
        pulses = Pulses(part.xyz, part.gps_time, part.intensity, sight, cKDTree(part.xyz))
        for level, rows in bright_components(part.xyz, part.intensity, size):
            candidate = _candidate(pulses, level, rows, kind, size, rng)
            if candidate is not None:
                roughly.append(candidate)
    best = []
    for one in sorted(roughly, key=lambda one: -one.outline.overlap * np.sqrt(len(one.rows))):
        if not any(_same_place(one, other) for other in best):
            best.append(one)
    return [target for one in best if (target := _fit_target(one, scanner)) is not None]


def _same_place(one, other):
    """Whether two targets are one: half a target apart or less."""
    return np.linalg.norm(one.position - other.position) < max(one.size, other.size) / 2


def _candidate(pulses, level, rows, kind, size, rng):
    """The component as a target of this kind and size, or None where it can't be one."""
    longest = size * (1.0 if kind == "circle" else np.sqrt(2))
    if np.ptp(pulses.xyz[rows], axis=0).max() > 1.3 * longest:
        return None
    plane = fit_plane(pulses.xyz[rows], PLANE_TOLERANCE, rng)
    if plane.inliers.sum() < max(FEWEST_POINTS, 0.7 * len(rows)):
        return None
    rows = rows[plane.inliers]
    extent = np.ptp(plane.coordinates(pulses.xyz[rows])[:, :2], axis=0)
    if extent.max() < LEAST_EXTENT[0] * size or extent.min() < LEAST_EXTENT[1] * size:
        return None
    marked = _marked_points(pulses, rows, plane, level, size)
    outline = fit_outline(*marked, kind, size, blur=size / 30, stages=ROUGH_STAGES)
    if outline.overlap < LEAST_OVERLAP - 0.05:
        return None
    return _Candidate(pulses, rows, plane, marked, kind, size, outline)


def _fit_target(candidate, scanner):
    """The candidate with its exact outline, or None where that doesn't fit or hold the centre."""
    blur = _blur(candidate, scanner)
    outline = fit_outline(*candidate.marked, candidate.kind, candidate.size, blur)
    largest = np.sqrt(np.linalg.eigvalsh(outline.covariance)[-1])
    if outline.overlap < LEAST_OVERLAP or largest > LARGEST_SIGMA * candidate.size:
        return None
    return _as_target(replace(candidate, outline=outline))


def _marked_points(pulses, rows, plane, level, size):
    """Points (n, 2) in the plane near the target, and whether each is bright: real returns and
    the places where pulses missed it."""
    close = np.array(pulses.tree.query_ball_point(pulses.xyz[rows].mean(axis=0), 1.2 * size))
    close = close[np.abs(plane.coordinates(pulses.xyz[close])[:, 2]) <= PLANE_TOLERANCE]
    missed = missed_points(pulses, rows, plane, PLANE_TOLERANCE)
    points = np.vstack([plane.crossing(pulses.xyz[close], pulses.sight[close]), missed])
    returned = pulses.intensity[close] >= level
    bright = np.append(returned, np.zeros(len(missed), bool))
    return points, bright


def _blur(candidate, scanner):
    """One sigma of a beam's place across the outline, from angle noise and its own width (m)."""
    distance = np.linalg.norm(candidate.pulses.sight[candidate.rows].mean(axis=0))
    return float(distance * np.hypot(scanner.angle_noise, BEAM_DIVERGENCE / 4))  # 4 sigmas wide


def _as_target(candidate):
    """Centre in the map, its covariance, normal towards the vehicle, and time of the centre."""
    plane, outline, pulses = candidate.plane, candidate.outline, candidate.pulses
    rows = candidate.rows
    crossing = plane.crossing(pulses.xyz[rows], pulses.sight[rows])
    # time and height at the centre, by regression: the points may lie on one side of it
    basis = np.column_stack([np.ones(len(rows)), crossing - outline.centre])
    weights = np.linalg.pinv(basis)[0]
    time = pulses.gps_time[rows] - pulses.gps_time[0]
    at_centre = np.clip(weights @ time, 0.0, pulses.gps_time[-1] - pulses.gps_time[0])
    # a plane too far moves the centre along the beam
    beam = plane.axes @ pulses.sight[rows].mean(axis=0)
    covariance = plane.sigma**2 * (weights @ weights) * np.outer(beam, beam) / beam[2] ** 2
    covariance[:2, :2] += outline.covariance
    away = beam[2] > 0
    return _Target(
        gps_time=float(pulses.gps_time[0] + at_centre),
        position=candidate.position,
        covariance=plane.axes.T @ covariance @ plane.axes + FLOOR**2 * np.eye(3),
        normal=-plane.axes[2] if away else plane.axes[2],
        kind=candidate.kind,
        size=candidate.size,
        points=len(rows),
    )


def _as_observations(found):
    n = len(found)
    targets = [target for _, target in found]
    return TargetObservations(
        name=(None,) * n,
        pass_number=np.array([number for number, _ in found], dtype=int),
        gps_time=np.array([target.gps_time for target in targets], dtype=float),
        position=np.array([target.position for target in targets]).reshape(n, 3),
        covariance=np.array([target.covariance for target in targets]).reshape(n, 3, 3),
        normal=np.array([target.normal for target in targets]).reshape(n, 3),
        kind=tuple(target.kind for target in targets),
        size=np.array([target.size for target in targets], dtype=float),
        points=np.array([target.points for target in targets], dtype=int),
    )
