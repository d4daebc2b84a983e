"""Candidates -> pieces of cloud by control point, pass and visit -> TargetObservations."""

import warnings
from dataclasses import replace

import numpy as np
from scipy.spatial import cKDTree

from mlscorr.survey import TargetObservations
from mlscorr.targets.candidates import search_radius
from mlscorr.targets.fit import fit_targets
from mlscorr.targets.intensity import why_useless
from mlscorr.targets.shapes import BY_EDGES
from mlscorr.targets.visits import PAUSE, motion_covariance, scanner_path, split_visits


def extract_targets(candidates, control, trajectory, scanner, rng, mounting=None):
    """Find targets of the surveyed kinds and sizes near control points.

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
    return as_observations(
        fit_near_control(candidates, control, trajectory, scanner, rng, mounting)
    )


def fit_near_control(candidates, control, trajectory, scanner, rng, mounting=None):
    """Fit targets as extract_targets does: pairs (pass number, FittedTarget) in their order."""
    if len(candidates.cloud) == 0:
        return []
    _warn_of_intensity(candidates.cloud.intensity, control.kind)
    passes = candidates.pass_number
    lever_arm = np.zeros(3) if mounting is None else mounting.lever_arm
    scanned_from = scanner_path(candidates.cloud.gps_time, trajectory, lever_arm)
    seed = rng.integers(2**63)  # of each piece alike: no target depends on another
    tree = cKDTree(candidates.cloud.xyz)
    found = []
    for index, radius in enumerate(search_radius(trajectory, control)):
        rows = np.sort(np.array(tree.query_ball_point(control.position[index], radius), int))
        shape = control.kind[index], float(control.size[index])
        for number in np.unique(passes[rows]):
            here = rows[passes[rows] == number]
            piece = candidates.cloud[here], scanned_from[here]
            for target in _targets_of_pass(*piece, shape, scanner, np.random.default_rng(seed)):
                if not any(number == n and _same(target, other) for n, other in found):
                    found.append((int(number), target))
    found.sort(key=lambda pair: (pair[0], pair[1].gps_time))
    return _with_motion(found, trajectory)


def _targets_of_pass(cloud, scanned_from, shape, scanner, rng):
    """Targets of a kind and size near one control point in one pass, at each visit of it."""
    return [
        target
        for rows in split_visits(cloud.gps_time, scanned_from)
        for target in fit_targets(
            cloud[rows], cloud.xyz[rows] - scanned_from[rows], [shape], scanner, rng
        )
    ]


def _with_motion(found, trajectory):
    """The targets with the motion of the POS error in their covariances."""
    time, duration = [[getattr(t, name) for _, t in found] for name in ("gps_time", "duration")]
    motion = motion_covariance(trajectory, time, duration)
    return [
        (number, replace(target, covariance=target.covariance + moved))
        for (number, target), moved in zip(found, motion, strict=True)
    ]


def _same(one, other):
    """Whether two fits are one target at one visit: half a target and two seconds apart or less."""
    near = np.linalg.norm(one.position - other.position) < max(one.size, other.size) / 2
    return near and abs(one.gps_time - other.gps_time) < PAUSE


def _warn_of_intensity(intensity, kinds):
    """Warn where bright targets are surveyed and the intensity can't tell them."""
    reason = why_useless(intensity)
    if reason is not None and not set(kinds) <= set(BY_EDGES):
        warnings.warn(
            f"{reason} Bright targets can't be told by it: only plates that stand free are found, "
            "by their edges, and painted ones are not. Export the cloud with its intensity.",
            stacklevel=3,
        )


def as_observations(found):
    """TargetObservations without names of pairs (pass number, FittedTarget), in their order."""
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
