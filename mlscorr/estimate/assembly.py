"""From matched targets, steps and a mounting to the observation equations (Eq. 7-12, 16-19)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from mlscorr.collocation import Noise
from mlscorr.estimate.equations import NO_TREND, Equations
from mlscorr.frames import mounting_partials, partials_by_scanner, pose_partials
from mlscorr.pos import Steps, stated_sigma
from mlscorr.survey import SEARCH_RADIUS, Matched, Mounting, Pos, Trajectory

PLACE = np.full(3, SEARCH_RADIUS)  # m; sigma of where the POS is, but for what control says of it


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
    position = matched.observations.position
    times = matched.gps_time
    stated = stated_sigma(trajectory, pos, times)
    return Equations(
        names=np.array(matched.name),
        gps_time=times,
        misclosure=matched.misclosure,
        noise=_noise(matched, stated.history.steps),
        partials=pose_partials(trajectory, position, times),
        stated=stated,
        order=order,
        prior=prior,
        trajectory=trajectory,
        pos=pos,
    )


def with_fallbacks(equations: Equations, steps: Steps) -> Equations:
    """The equations, and below them two epochs for each fall-back of the POS.

    The recorded position steps by as much as its error does, whatever parts the error has. So the
    epochs before and after a step are two views of one place that nobody surveyed: what each says
    of the error by itself is unknown, by how much it differs is the step.

    Parameters
    ----------
    equations : Equations
        Without fall-backs.
    steps : Steps
    """
    steps = steps[np.linalg.norm(steps.size, axis=1) < SEARCH_RADIUS]
    if len(steps) == 0:
        return equations
    number = np.repeat(np.arange(len(steps)), 2)
    times = np.column_stack([steps.before, steps.after]).ravel()
    misclosure = np.stack([steps.size, np.zeros_like(steps.size)], axis=1).reshape(-1, 3)
    variance = steps.sigma[number, None, None] ** 2 / 2 * np.eye(3)
    partials = np.tile(np.eye(3, 6), (len(times), 1, 1))
    inserted = times, misclosure, variance, partials
    complete = _insert(equations, len(equations.gps_time), *inserted)
    noise = complete.noise.share(len(equations.gps_time) + np.arange(len(times)), number, PLACE)
    return replace(complete, noise=noise, fallbacks=len(steps))


def mounting_equations(
    equations: Equations,
    matched: Matched,
    mountings: Sequence[Mounting],
    corrected: np.ndarray,
    weak: np.ndarray,
) -> Equations:
    """The equations of what k mountings lack  (Eq. 16-18), from those of the POS error.

    Below the targets two epochs of three rows hold each mounting weakly.

    Parameters
    ----------
    equations : Equations
    matched : Matched
        As georeferenced with the mountings.
    mountings : sequence of Mounting
        Corrected by ``corrected`` already; what is estimated adds to them.
    corrected : (6 k,) array
        Units: m and rad.
    weak : (6 k,) array
        One sigma of what is known of the mountings without the survey. Units: m and rad.
    """
    times = matched.gps_time
    position = matched.observations.position
    bare = replace(
        equations,
        gps_time=times,
        misclosure=matched.misclosure,
        noise=_noise(matched, equations.stated.history.steps),
        partials=pose_partials(equations.trajectory, position, times),
        order=NO_TREND,
    )
    columns = partials_by_scanner(
        mounting_partials,
        equations.trajectory,
        dict(enumerate(mountings)),
        position,
        times,
        matched.scanner,
    )
    return with_mountings(bare, columns, -corrected, weak)


def with_mountings(
    equations: Equations, columns: np.ndarray, lacking: np.ndarray, sigma: np.ndarray
) -> Equations:
    """The equations with mountings beside the trend, and below the targets what is known of them.

    Parameters
    ----------
    equations : Equations
        Of n targets, and of fall-backs.
    columns : (n, 3, 6 k) array
        Partial derivatives of the targets by k mountings (Eq. 16-18).
    lacking, sigma : (6 k,) array
        What is believed to be missing in each lever arm and boresight, and how well. Units: m, rad.
    """
    n = len(equations.names)
    number = len(sigma) // 3
    if n:
        held = equations.gps_time[0]
    else:
        held = equations.trajectory.gps_time[0]
    mounting = np.zeros((len(equations.gps_time) + number, 3, len(sigma)))
    mounting[:n] = columns
    mounting[n : n + number] = np.eye(len(sigma)).reshape(number, 3, -1)
    variance = sigma.reshape(-1, 3, 1) ** 2 * np.eye(3)
    inserted = np.full(number, held), lacking.reshape(-1, 3), variance, np.zeros((number, 3, 6))
    return replace(_insert(equations, n, *inserted), mounting=mounting)


def _insert(equations, place, gps_time, misclosure, variance, partials):
    """The equations with epochs (k,), their misclosures and noise before the epoch of a number."""
    times = np.insert(equations.gps_time, place, gps_time)
    return replace(
        equations,
        gps_time=times,
        misclosure=np.insert(equations.misclosure, place, misclosure, axis=0),
        noise=equations.noise.insert(place, variance),
        partials=np.insert(equations.partials, place, partials, axis=0),
        stated=_stated(equations, times),
    )


def _stated(equations, gps_time):
    stated = stated_sigma(equations.trajectory, equations.pos, gps_time, equations.stated.starts)
    return replace(stated, history=equations.stated.history)


def _noise(matched, steps):
    """Extraction, the step inside which it was seen, and the survey error, which all passes of a
    target share  (Eq. 19).
    """
    number = matched.point_number
    times = matched.gps_time[:, None]
    shared = matched.surveyed.sigma[np.unique(number, return_index=True)[1]]
    inside = ((times >= steps.before) & (times <= steps.after)).astype(float)
    stepped = np.einsum("ns,si,sj->nij", inside, steps.size, steps.size)
    return Noise(matched.observations.covariance + stepped, number, shared)
