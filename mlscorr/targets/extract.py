"""Candidates -> pieces of cloud by control point, pass and visit -> targets as fitted."""

import warnings
from dataclasses import replace

import numpy as np

from mlscorr.survey import Survey, TargetObservations
from mlscorr.targets.balls import Neighbourhoods
from mlscorr.targets.candidates import Candidates, search_radius
from mlscorr.targets.fit import FittedTarget, distinct, fit_targets
from mlscorr.targets.intensity import why_useless
from mlscorr.targets.settings import SETTINGS
from mlscorr.targets.shapes import BY_EDGES
from mlscorr.targets.visits import motion_covariance, scanner_path, split_visits

PassTarget = tuple[int, FittedTarget]  # a pass number, and a target of that pass


def fit_near_control(
    candidates: Candidates, survey: Survey, rng: np.random.Generator
) -> list[PassTarget]:
    """Fit targets of the surveyed kinds and sizes near control and check points.

    Parameters
    ----------
    candidates : Candidates
    survey : Survey
        Its points say where to look and for what, its scanner's noise blurs the outline, and its
        lever arm tells where the beams came from.
    rng : numpy.random.Generator
        For the random samples of the flat patches.

    Returns
    -------
    list of (pass number, FittedTarget)
        In this order, and of time. Of fits that overlap, the best: the order of the surveyed points
        decides nothing.

    Warns where the intensity tells nothing.
    """
    cloud, passes, surveyed = candidates.cloud, candidates.pass_number, survey.surveyed
    if len(cloud) == 0:
        return []
    _warn_of_intensity(cloud.intensity, surveyed.kind)
    seed = rng.integers(2**63)  # of each piece alike: no target depends on another
    targets: dict[int, list[FittedTarget]] = {}
    for index, rows in _balls(survey, cloud.xyz):
        shape = surveyed.kind[index], float(surveyed.size[index])
        for number in np.unique(passes[rows]).tolist():
            generator = np.random.default_rng(seed)
            for piece in _visits(cloud.gps_time, rows[passes[rows] == number], survey):
                fits = _fit_piece(cloud[piece], shape, survey, generator)
                targets.setdefault(number, []).extend(fits)
    best = [(number, target) for number in sorted(targets) for target in distinct(targets[number])]
    return _with_motion(best, survey)


def _visits(gps_time, rows, survey):
    """Rows of each visit, of the rows of a pass."""
    scanned_from = scanner_path(gps_time[rows], survey.trajectory, survey.lever_arm)
    return [rows[visit] for visit in split_visits(gps_time[rows], scanned_from)]


def _fit_piece(cloud, shape, survey, rng):
    """FittedTargets of one visit; of dense clouds its path is large, and made anew for each."""
    sight = cloud.xyz - scanner_path(cloud.gps_time, survey.trajectory, survey.lever_arm)
    return fit_targets(cloud, sight, [shape], survey.scanner, rng)


def _balls(survey, xyz):
    """Numbers of surveyed points, and the rows where each should stand and where it may."""
    surveyed = survey.surveyed
    balls = [
        (index, min(ball, whole))
        for index, whole in enumerate(search_radius(survey, surveyed))
        for ball in (SETTINGS.near_radius + surveyed.size[index] / np.sqrt(2), whole)
    ]
    for index, radius in dict.fromkeys(balls):  # apart: dense points are in many balls at once
        yield index, Neighbourhoods(surveyed.position[[index]], np.array([radius])).each(xyz)[0]


def _with_motion(targets, survey):
    """The targets with the motion of the POS error in their covariances."""
    time, duration = [[getattr(t, name) for _, t in targets] for name in ("gps_time", "duration")]
    motion = motion_covariance(survey.trajectory, survey.pos, time, duration)
    return [
        (number, replace(target, covariance=target.covariance + moved))
        for (number, target), moved in zip(targets, motion, strict=True)
    ]


def _warn_of_intensity(intensity, kinds):
    """Warn where bright targets are surveyed and the intensity can't tell them."""
    reason = why_useless(intensity)
    if reason is not None and not set(kinds) <= set(BY_EDGES):
        warnings.warn(
            f"{reason} Bright targets can't be told by it: only plates that stand free are found, "
            "by their edges, and painted ones are not. Export the cloud with its intensity.",
            stacklevel=3,
        )


def as_observations(targets: list[PassTarget]) -> TargetObservations:
    """Targets as observations without names, in their order.

    Parameters
    ----------
    targets : list of (pass number, FittedTarget)
    """
    n = len(targets)
    fitted = [target for _, target in targets]
    return TargetObservations(
        name=(None,) * n,
        pass_number=np.array([number for number, _ in targets], dtype=int),
        gps_time=np.array([target.gps_time for target in fitted], dtype=float),
        position=np.array([target.position for target in fitted]).reshape(n, 3),
        covariance=np.array([target.covariance for target in fitted]).reshape(n, 3, 3),
        normal=np.array([target.normal for target in fitted]).reshape(n, 3),
        kind=tuple(target.kind for target in fitted),
        size=np.array([target.size for target in fitted], dtype=float),
        points=np.array([target.points for target in fitted], dtype=int),
    )
