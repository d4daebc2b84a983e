"""From matched targets, steps and a mounting to the observation equations (Eq. 7-12, 16-19)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from mlscorr.collocation import Noise
from mlscorr.estimate.equations import Equations
from mlscorr.frames import mounting_partials, pose_partials
from mlscorr.pos import SETTINGS as POS_SETTINGS
from mlscorr.pos import Steps, stated_sigma
from mlscorr.survey import Matched, Mounting, Pos, Trajectory


def position_equations(
    trajectory: Trajectory, matched: Matched, pos: Pos, order: int, prior: Callable
) -> Equations:
    """The equations of the POS error, with a polynomial trend of the position  (Eq. 7-12).

    A target that was seen in the middle of a step has the step in its noise.

    Parameters
    ----------
    trajectory : Trajectory
    matched : Matched
    pos : Pos
    order : int
    prior : function of Equations
    """
    position, times = matched.observations.position, matched.gps_time
    stated, noise = stated_sigma(trajectory, pos, times), _noise(matched)
    steps = stated.history.steps
    inside = (times[:, None] >= steps.before) & (times[:, None] <= steps.after)
    for row, step in np.argwhere(inside):
        noise.own[row] += np.outer(steps.size[step], steps.size[step])
    return Equations(
        names=np.array(matched.name),
        gps_time=times,
        misclosure=matched.misclosure,
        noise=noise,
        partials=pose_partials(trajectory, position, times),
        stated=stated,
        order=order,
        prior=prior,
        trajectory=trajectory,
        pos=pos,
    )


def with_fallbacks(equations: Equations, steps: Steps) -> Equations:
    """The equations, and below them three rows for each fall-back of the POS.

    After it the POS errs as GNSS lets it; so what the recorded position moves is the drift of the
    epoch before, but for jitter before and after. It tells nothing of bias, attitude and trend.

    Parameters
    ----------
    equations : Equations
        Without fall-backs.
    steps : Steps
    """
    steps = steps[np.linalg.norm(steps.size, axis=1) < POS_SETTINGS.largest_gate]
    if len(steps) == 0:
        return equations
    number, groups = len(steps), len(equations.noise.shared)
    times = np.append(equations.gps_time, steps.before)
    stated = stated_sigma(equations.trajectory, equations.pos, times, equations.stated.starts)
    stated = replace(stated, history=equations.stated.history)
    variance = steps.sigma[:, None] ** 2 + 2 * stated.gnss[-number:] ** 2
    own = [equations.noise.own, variance[:, :, None] * np.eye(3)]
    shared = [equations.noise.shared, np.zeros((number, 3))]
    group = np.append(equations.noise.group, groups + np.arange(number))
    position = np.tile(np.eye(3, 6), (number, 1, 1))
    return replace(
        equations,
        gps_time=times,
        misclosure=np.vstack([equations.misclosure, steps.size]),
        noise=Noise(np.vstack(own), group, np.vstack(shared)),
        partials=np.vstack([equations.partials, position]),
        stated=stated,
        fallbacks=number,
    )


def mounting_equations(
    equations: Equations,
    matched: Matched,
    mounting: Mounting,
    corrected: np.ndarray,
    weak: np.ndarray,
) -> Equations:
    """The equations of what a mounting lacks  (Eq. 16-18), from those of the POS error.

    Below the targets two epochs of three rows hold the mounting weakly.

    Parameters
    ----------
    equations : Equations
    matched : Matched
        As georeferenced with the mounting.
    mounting : Mounting
        Corrected by ``corrected`` already; what is estimated adds to it.
    corrected : (6,) array
        Units: m and rad.
    weak : (6,) array
        One sigma of what is known of the mounting without the survey. Units: m and rad.
    """
    n, times = len(matched), matched.gps_time
    trajectory, position = equations.trajectory, matched.observations.position
    held = times[0] if n else trajectory.gps_time[0]
    with_holds = np.append(times, [held, held])
    stated = stated_sigma(trajectory, equations.pos, with_holds, equations.stated.starts)
    partials = mounting_partials(trajectory, mounting, position, times)
    noise, blocks = _noise(matched), [np.diag(part**2) for part in weak.reshape(2, 3)]
    groups = len(noise.shared)
    return replace(
        equations,
        gps_time=with_holds,
        misclosure=np.vstack([matched.misclosure, -corrected.reshape(2, 3)]),
        noise=Noise(
            np.vstack([noise.own, blocks]),
            np.append(noise.group, [groups, groups + 1]),
            np.vstack([noise.shared, np.zeros((2, 3))]),
        ),
        partials=np.vstack([pose_partials(trajectory, position, times), np.zeros((2, 3, 6))]),
        stated=replace(stated, history=equations.stated.history),
        mounting=np.vstack([partials, np.eye(6).reshape(2, 3, 6)]),
    )


def _noise(matched):
    """Extraction, and the survey error, which all passes of a target share  (Eq. 19)."""
    number = matched.point_number
    shared = matched.surveyed.sigma[np.unique(number, return_index=True)[1]]
    return Noise(matched.observations.covariance, number, shared)
