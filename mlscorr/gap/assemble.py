"""From measured differences to Rows; which of many to keep, and which belong to something else."""

import numpy as np

from mlscorr.correction.model import stated_sigmas
from mlscorr.gap.covariates import covariates, to_scanner_or_nan
from mlscorr.gap.rows import Pulses, Rows, reference_of
from mlscorr.georeference import pose_partials

LEAST_GATE = 0.5  # m: boresight and lever arm are not in the POS's sigma; a car is farther off
SIGMAS = 4.0  # of the stated position sigma
WINDOW = 5.0  # s at most, over which a POS error is one shift
TOGETHER = 24  # differences in a window: in a street they come within a second
FEW = 8  # differences in a window, fewer don't tell which of them is odd
ODD = 0.03  # m from the shift of its window: more than attitude errors make within the window
ODD_SIGMAS = 6.0  # of the window's own scatter
BINS = 8  # of each covariate, over which a choice is spread


def assemble(
    survey,
    channel,
    item,
    gps_time,
    position,
    direction,
    residual,
    noise,
    points,
    pulses,
    pass_number,
    gps_time_2=None,
    survey_item=None,
    survey_factor=None,
    believed=None,
):
    """Rows of a survey from (m, ...) arrays, named as there, with partials and covariates.

    What isn't given is nothing: one time, no survey error, no belief.
    """
    m = len(item)
    gps_time_2 = np.full(m, np.nan) if gps_time_2 is None else gps_time_2
    survey_factor = np.zeros((m, 3)) if survey_factor is None else survey_factor
    second, partials_2 = np.isfinite(gps_time_2), np.zeros((m, 6))
    partials_2[second] = -_partials(survey, position[second], gps_time_2[second], direction[second])
    return Rows(
        channel=np.broadcast_to(np.asarray(channel, dtype="U11"), m).copy(),
        item=item,
        survey_item=np.full(m, -1) if survey_item is None else survey_item,
        gps_time=gps_time,
        gps_time_2=gps_time_2,
        position=position,
        direction=direction,
        residual=residual,
        noise=noise,
        survey=np.sum(survey_factor**2, axis=1),
        survey_factor=survey_factor,
        points=points,
        believed=np.full(m, np.nan) if believed is None else believed,
        partials=_partials(survey, position, gps_time, direction),
        partials_2=partials_2,
        covariates=covariates(survey, gps_time, position, pulses, item, pass_number, direction),
        pulses=pulses,
        targets=survey.control + survey.check,
        reference=reference_of(survey),
    )


def _partials(survey, position, gps_time, direction):
    """Partial derivatives (m, 6) along the directions by the pose."""
    if len(position) == 0:
        return np.zeros((0, 6))
    return np.einsum("mi,mij->mj", direction, pose_partials(survey.trajectory, position, gps_time))


def sample_pulses(survey, item, weight, xyz, gps_time, intensity, normal):
    """Pulses of points (k, ...) on surfaces with a normal (k, 3)."""
    pose = survey.trajectory.at(gps_time)
    arm = np.zeros(3) if survey.mounting is None else survey.mounting.lever_arm
    beam = xyz - pose.position - pose.attitude.apply(arm)
    beam /= np.linalg.norm(beam, axis=1, keepdims=True)
    return Pulses(
        item=item,
        weight=weight,
        gps_time=gps_time,
        xyz=xyz,
        scanner_xyz=to_scanner_or_nan(survey, xyz, gps_time),
        intensity=intensity.astype(float),
        normal=normal,
        incidence=np.abs(np.einsum("ki,ki->k", beam, normal)),
    )


def patch_pulses(survey, patches, item, sign=1.0):
    """Pulses of Patches, whose items (p,) are given; of second patches the sign is -1."""
    p, samples = patches.time.shape
    return sample_pulses(
        survey,
        np.repeat(item, samples),
        np.full(p * samples, sign / samples),
        patches.xyz.reshape(-1, 3),
        patches.time.ravel(),
        patches.intensity.ravel(),
        np.repeat(patches.normal, samples, axis=0),
    )


def gate(survey, gps_time):
    """Largest credible distance (n,) of a surface from where it should be. Units: m."""
    sigma = stated_sigmas(survey.trajectory.at(gps_time), survey.pos, survey.trajectory)
    variance = np.trace((sigma.drift + sigma.jitter) ** 2, axis1=1, axis2=2)
    return np.maximum(LEAST_GATE, SIGMAS * np.sqrt(variance))


def consistent(gps_time, direction, residual):
    """Which differences (n,) agree with a shift (3,) of their window of time: (n,) bool.

    What doesn't is another surface: a car, a curb that the reference lacks. The shift is the one
    of least absolute differences, by reweighting; where there are few, all agree.
    """
    order = np.argsort(gps_time, kind="stable")
    group, moment = np.arange(len(order)) // TOGETHER, np.floor(gps_time[order] / WINDOW)
    begins = np.flatnonzero((np.diff(group) != 0) | (np.diff(moment) != 0)) + 1
    agree = np.ones(len(gps_time), dtype=bool)
    for rows in np.split(order, begins):
        if len(rows) >= FEW:
            left = residual[rows] - _shift(direction[rows], residual[rows])
            scatter = 1.4826 * np.median(np.abs(left))  # a normal distribution's sigma
            agree[rows] = np.abs(left) <= max(ODD, ODD_SIGMAS * scatter)
    return agree


def _shift(direction, residual):
    """What a shift of least absolute differences makes of each of the directions (n,). m."""
    weight = np.ones(len(residual))
    for _ in range(15):
        normal = (direction * weight[:, None]).T @ direction + 1e-3 * np.eye(3) * weight.sum()
        fitted = direction @ np.linalg.solve(normal, direction.T @ (weight * residual))
        weight = 1 / np.maximum(np.abs(residual - fitted), 1e-3)
    return fitted


def spread(columns, limit, rng):
    """At most `limit` of n things, evenly spread over the values of each column (n,): sorted rows.

    Each column is cut into equal bins; a thing's chance grows with the emptiness of its bins.

    >>> spread([np.arange(5.0)], 10, np.random.default_rng(0))
    array([0, 1, 2, 3, 4])
    """
    n = len(columns[0])
    if n <= limit:
        return np.arange(n)
    chance = np.zeros(n)
    for values in columns:
        span = np.ptp(values)
        number = ((values - values.min()) / (span if span > 0 else 1.0) * BINS).astype(int)
        chance += 1 / np.bincount(number)[number]
    keys = rng.exponential(size=n) / chance  # the least of these are a sample without replacement
    return np.sort(np.argpartition(keys, limit)[:limit])
