"""From misclosures to the calibrated mounting, by collocation and by plain least squares."""

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation
from scipy.stats import chi2
from threadpoolctl import threadpool_limits

from mlscorr.calibration.equations import (
    WEAK,
    Equations,
    Parameters,
    build_equations,
    corrected_mounting,
    stated_sigmas,
)
from mlscorr.calibration.likelihood import weigh_parameters
from mlscorr.georeference import Correction, georeference, to_scanner
from mlscorr.survey import Mounting, Pos, Trajectory

COMPONENTS = (
    "lever arm right",
    "lever arm forward",
    "lever arm up",
    "boresight about right",
    "boresight about forward",
    "boresight about up",
)
LEAST_TARGETS = 3  # two don't hold a rotation about the line between them
SAME_EPOCH = 1.0  # s; closer together, two targets say the same of the POS
SIGNIFICANCE = 0.001  # Baarda (1968), over all targets together
TESTED_TARGETS = 5  # four can't tell a wrong one from a POS that is worse than stated
ROUNDS = 10  # of Gauss-Newton; a boresight wrong by degrees needs four
CONVERGED = 1e-6  # m and rad
# A site determines what it tells better than a tape: 2 cm, or as much at a point 10 m away
TAPE = 0.02  # m
LIMIT = np.repeat([TAPE, TAPE / 10.0], 3)  # m, rad


@dataclass(frozen=True)
class Outlier:
    """A target that the others contradict: chi-squared statistic and its critical value."""

    name: str
    statistic: float
    critical: float


@dataclass(frozen=True)
class MountingEstimate:
    """What the recorded mounting lacks, by one method.

    Parameters
    ----------
    mounting : Mounting
        The calibrated one.
    correction : (6,) array
        Lever arm (m) and boresight (rad) about right, forward, up: lever_arm_true = recorded + c,
        R_L^P true = Exp(c) R_L^P recorded.
    covariance : (6, 6) array
    sigma0 : float
        Of weight one; one if the model is right.
    """

    mounting: Mounting
    correction: np.ndarray
    covariance: np.ndarray
    sigma0: float

    @property
    def sigma(self):
        """One sigma (6,) of the correction: m and rad."""
        return np.sqrt(np.diag(self.covariance))

    @property
    def correlation(self):
        """Correlation matrix (6, 6) of the correction."""
        return self.covariance / np.outer(self.sigma, self.sigma)


@dataclass(frozen=True)
class Calibration:
    """The calibrated mounting by collocation (lsc) and by plain least squares (ls).

    ``determined`` (6,) says which components this geometry can tell, whatever constant difference
    there is between the coordinates of control and trajectory; ``parameters`` are those of the POS
    error with their probabilities; ``used`` (n,) says which observations took part.
    """

    trajectory: Trajectory
    recorded: Mounting
    lsc: MountingEstimate
    ls: MountingEstimate
    determined: np.ndarray
    parameters: tuple[tuple[Parameters, float], ...]
    outliers: tuple[Outlier, ...]
    used: np.ndarray
    warnings: tuple[str, ...]
    pos: Pos
    equations: Equations

    def correction(self, method="lsc"):
        """The Correction that brings points from the recorded to the calibrated mounting."""
        mounting = getattr(self, method).mounting
        return Correction(self.trajectory, self.trajectory, self.recorded, mounting)

    @threadpool_limits.wrap(limits=1, user_api="blas")
    def correction_with_drift(self):
        """The Correction of the mounting and of the POS error at each epoch  (Eq. 14-15).

        The POS error is predicted under the most probable parameters. It is zero on average, so
        the farther from a control point, the less of it is corrected.
        """
        parameters = self.parameters[0][0]
        solved = self.equations.solve(self.equations.signals(parameters))
        n = len(self.trajectory)
        position, attitude = stated_sigmas(self.trajectory, self.pos)
        mixings = [np.zeros((n, 6, 3)), np.zeros((n, 6, 3))]
        mixings[0][:, :3] = parameters.position_scale * position
        mixings[1][:, 3:] = parameters.attitude_scale * attitude
        pose, covariance = solved.predict(self.trajectory.gps_time, np.zeros((n, 6, 6)), mixings)
        variance = np.maximum(np.einsum("qii->qi", covariance), 0.0)
        to_body = self.trajectory.attitude.inv().as_matrix()
        about_body = np.einsum("qij,qjk,qik->qi", to_body, covariance[:, 3:, 3:], to_body)
        corrected = Trajectory(
            gps_time=self.trajectory.gps_time,
            position=self.trajectory.position + pose[:, :3],
            attitude=Rotation.from_rotvec(pose[:, 3:]) * self.trajectory.attitude,
            position_sigma=np.sqrt(variance[:, :3]),
            attitude_sigma=np.sqrt(np.maximum(about_body[:, [1, 0, 2]], 0.0)),
        )
        return Correction(self.trajectory, corrected, self.recorded, self.lsc.mounting, covariance)


# The matrices are small: on a busy machine threads would wait longer than they work
@threadpool_limits.wrap(limits=1, user_api="blas")
def estimate_mounting(trajectory, mounting, observations, control, pos=None):
    """Estimate what a recorded mounting lacks from matched targets.

    Parameters
    ----------
    trajectory : Trajectory
        As recorded.
    mounting : Mounting
        As recorded: the observations were georeferenced with it.
    observations : TargetObservations
        Each with the name of a control point.
    control : ControlPoints
    pos : Pos, optional
        Beliefs, used where the trajectory has no sigmas.

    Returns a Calibration. Raises ValueError for fewer than 3 targets, or where all of them were
    seen at one time.
    """
    _check(observations)
    pos = Pos() if pos is None else pos
    used = np.ones(len(observations), dtype=bool)
    outliers = []
    while True:
        equations, start, ls = _least_squares(
            trajectory, mounting, observations[used], control, pos
        )
        parameters = weigh_parameters(equations, pos)
        outlier = _find_outlier(equations, parameters[0][0])
        if outlier is None:
            break
        outliers.append(outlier)
        used &= np.array(observations.name) != outlier.name
    lsc, determined = _collocation(equations, parameters, mounting, start)
    return Calibration(
        trajectory=trajectory,
        recorded=mounting,
        lsc=lsc,
        ls=ls,
        determined=determined,
        parameters=parameters,
        outliers=tuple(outliers),
        used=used,
        warnings=_warnings(lsc, determined),
        pos=pos,
        equations=equations,
    )


def _check(observations):
    count = len(set(observations.name))
    if count < LEAST_TARGETS:
        raise ValueError(
            f"{count} control points were found in the cloud; a calibration of lever arm and "
            f"boresight needs {LEAST_TARGETS} at least, and 8 or more on both sides of the way, "
            "near and far, to be of use."
        )
    span = np.ptp(observations.gps_time)
    if span < SAME_EPOCH:
        raise ValueError(
            f"All {count} control points were seen within {span:.2f} s (at least "
            f"{SAME_EPOCH:.0f} s are needed): at one time the error of the POS can't be told from "
            "that of the mounting. Drive past control points in both directions."
        )


def _least_squares(trajectory, recorded, observations, control, pos):
    """Equations about the mounting of plain least squares, its correction (6,), and the estimate.

    Iterated, as a rotation is not linear; the targets are georeferenced anew each time.
    """
    times = observations.gps_time
    seen = to_scanner(trajectory, recorded, observations.position, times)
    correction = np.zeros(6)
    for _ in range(ROUNDS):
        mounting = corrected_mounting(recorded, correction)
        moved = replace(observations, position=georeference(trajectory, mounting, seen, times))
        equations = build_equations(trajectory, mounting, correction, moved, control, pos)
        solved = equations.solve()
        step = _combined(correction, solved.trend) - correction
        if np.abs(step).max() < CONVERGED:
            break
        correction = correction + step
    covariance = solved.trend_covariance
    # What the weak hold of the mounting adds to the redundancy is what it adds to the estimate
    observed = len(equations.misclosure) * 3 - 6
    redundancy = observed - 6 + np.sum(np.diag(covariance) / WEAK**2)
    sigma0 = solved.sigma0 * np.sqrt(observed / redundancy)
    estimate = MountingEstimate(mounting, correction, sigma0**2 * covariance, float(sigma0))
    return equations, correction, estimate


def _combined(correction, more):
    """The correction (6,) of one after another: Exp(more) Exp(correction)."""
    turn = Rotation.from_rotvec(more[3:]) * Rotation.from_rotvec(correction[3:])
    return np.append(correction[:3] + more[:3], turn.as_rotvec())


def _collocation(equations, parameters, recorded, start):
    """The estimate by collocation, averaged over the parameters, and what is determined (6,)."""
    mean, square, shifted, sigma0 = 0.0, 0.0, 0.0, 0.0
    for chosen, probability in parameters:
        signals = equations.signals(chosen)
        solved = equations.solve(signals)
        mean += probability * solved.trend
        square += probability * (solved.trend_covariance + np.outer(solved.trend, solved.trend))
        sigma0 += probability * solved.sigma0
        with_shift = equations.solve(signals, shift=True)
        shifted += probability * np.diag(with_shift.trend_covariance)[:6]
    correction = _combined(start, mean)
    covariance = square - np.outer(mean, mean)
    mounting = replace(corrected_mounting(recorded, correction), covariance=covariance)
    estimate = MountingEstimate(mounting, correction, covariance, float(sigma0))
    return estimate, np.sqrt(shifted) < LIMIT


def _find_outlier(equations, parameters):
    """The target that the others contradict most, or None where they agree with all.

    The statistic is e^T Q^-1 e of its misclosures e as the others predict them, Q their
    covariance.
    """
    targets = equations.target_rows
    if len(targets) < TESTED_TARGETS:
        return None
    solved = equations.solve(equations.signals(parameters))
    worst, excess = None, 1.0
    for name, rows in targets.items():
        residual, covariance = solved.leave_out(rows)
        statistic = float(residual @ np.linalg.solve(covariance, residual))
        critical = float(chi2.isf(SIGNIFICANCE / len(targets), len(rows)))
        if statistic / critical > excess:
            worst, excess = Outlier(name, statistic, critical), statistic / critical
    return worst


def _warnings(estimate, determined):
    """Sentences on what this geometry can't tell, with the sigma that the POS's belief gives."""
    if determined.all():
        return ()
    sigma = [f"{s:.3f} m" for s in estimate.sigma[:3]]
    sigma += [f"{s:.3f} deg" for s in np.degrees(estimate.sigma[3:])]
    told = ", ".join(f"{COMPONENTS[i]} (sigma {sigma[i]})" for i in np.flatnonzero(~determined))
    return (
        f"This geometry does not determine {told}: a constant difference between the coordinates "
        "of control and trajectory, or another component, looks the same, and the sigma holds "
        "only as far as the POS's own do. Targets on both sides, near and far, high and low, "
        "passed in both directions tell more; no level street tells lever arm up from a height "
        "difference.",
    )
