"""Misclosures of targets -> the POS error over time -> Correction (Mao et al. 2015, section 2.4.2).

The POS error is a polynomial trend of the position (Eq. 11) plus random signals:

- drift: 3 of the position, with the part of sigma(t) that grows where GNSS is missing;
- jitter: 3 of the position, with the part of sigma(t) that stays while GNSS holds the POS;
- attitude: 3 small rotations about the map axes.

Where the POS states no sigma(t), or a constant one, there is only drift. Without the split the
centimetres of good GNSS would set the correlation time of the metres of an outage.
"""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize
from scipy.spatial.transform import Rotation
from scipy.stats import chi2

from mlscorr.collocation import Collocation, Signal, collocate
from mlscorr.covariance import FAMILIES, Covariance
from mlscorr.georeference import Correction, pose_partials
from mlscorr.survey import Pos, Trajectory

ORDER = 1  # of the trend: a datum difference and its slow change; the signal carries the rest
HELD_PERCENTILE = 5.0  # the sigma that the POS states at its best, free of single epochs
START_RATIO = 4.0  # correlation time over control interval: 3 to 5 in the paper, section 3.1.4
PRIOR_SPREAD = np.log(3.0)  # one sigma of a factor of three about each start value
SIGNIFICANCE = 0.001  # of the outlier test, over all targets together (Baarda 1968)


@dataclass(frozen=True)
class Parameters:
    """What is chosen by likelihood: factors on the stated sigmas, and correlation times in s."""

    family: str
    drift_scale: float
    drift_time: float
    jitter_scale: float
    jitter_time: float


@dataclass(frozen=True)
class Outlier:
    """A target that its neighbours contradict: chi-squared statistic and its critical value."""

    name: str
    statistic: float
    critical: float


@dataclass(frozen=True)
class Estimate:
    """The estimated POS error.

    ``correction`` moves points; ``used`` (n,) says which observations took part; ``left_out``
    (n, 3) are the misclosures that remain at each used one when its target takes no part (m).
    """

    correction: Correction
    order: int
    parameters: Parameters
    alternatives: tuple[tuple[Parameters, float], ...]
    log_likelihood: float
    sigma0: float
    outliers: tuple[Outlier, ...]
    used: np.ndarray
    left_out: np.ndarray
    span: tuple[float, float]
    warnings: tuple[str, ...]


def estimate_correction(trajectory, observations, control, pos=None, order=ORDER):
    """Estimate the POS error from matched targets.

    Parameters
    ----------
    trajectory : Trajectory
        As recorded.
    observations : TargetObservations
        Each with the name of a control point.
    control : ControlPoints
    pos : Pos, optional
        Beliefs, used where the trajectory has no sigmas.
    order : int
        Of the polynomial trend; lowered where there are too few control points.

    Returns an Estimate. Raises ValueError without any observation.
    """
    if len(observations) == 0:
        raise ValueError(
            "There is no observation of a control point to estimate a correction from."
        )
    pos = Pos() if pos is None else pos
    model = _Model.build(trajectory, observations, control, pos)
    used = np.ones(len(observations), dtype=bool)
    outliers = []
    while True:
        fitted_order, warnings = _affordable_order(order, observations[used])
        parameters, alternatives = _choose_parameters(model.select(used), fitted_order)
        solved = model.select(used).solve(parameters, fitted_order)
        worst = _worst_outlier(model.select(used), solved)
        if worst is None or used.sum() <= 4:  # three targets can't tell which of them is wrong
            break
        outliers.append(worst)
        used &= np.array([name != worst.name for name in observations.name])
    kept = model.select(used)
    left_out = np.full((len(observations), 3), np.nan)
    left_out[used] = _leave_targets_out(kept, solved)
    return Estimate(
        correction=_predict(kept, solved, parameters, fitted_order, trajectory),
        order=fitted_order,
        parameters=parameters,
        alternatives=alternatives,
        log_likelihood=solved.log_likelihood,
        sigma0=solved.sigma0,
        outliers=tuple(outliers),
        used=used,
        left_out=left_out,
        span=kept.span,
        warnings=warnings,
    )


@dataclass(frozen=True)
class _Sigmas:
    """Square roots of the stated covariances, (n, 3, 3) each: drift, jitter, attitude."""

    drift: np.ndarray
    jitter: np.ndarray
    attitude: np.ndarray


def _stated_sigmas(trajectory, pos, reference):
    """Split sigma(t) of a trajectory into drift and jitter; attitude sigmas about map axes.

    reference is the whole recorded trajectory: it says how small sigma gets.
    """
    n = len(trajectory.gps_time)
    sigma = trajectory.position_sigma
    if sigma is None:
        sigma = np.full((n, 3), pos.position_sigma)
        held = np.zeros(3)
    else:
        held = np.percentile(reference.position_sigma, HELD_PERCENTILE, axis=0)
        constant = reference.position_sigma.max(axis=0) <= 2 * held
        held = np.where(constant, 0.0, held)
    angles = trajectory.attitude_sigma
    angles = np.broadcast_to(pos.attitude_sigma, (n, 3)) if angles is None else angles
    # roll turns about Y, pitch about X, heading about -Z; R diag(s) R^T carries them to the map
    body = angles[:, [1, 0, 2]]
    rotation = trajectory.attitude.as_matrix()
    diagonal = np.eye(3)
    return _Sigmas(
        drift=np.sqrt(np.maximum(sigma**2 - held**2, 0.0))[:, :, None] * diagonal,
        jitter=np.minimum(sigma, held)[:, :, None] * diagonal,
        attitude=(rotation * body[:, None, :]) @ rotation.swapaxes(1, 2),
    )


@dataclass(frozen=True)
class _Model:
    """The observation equations of n targets, three rows each."""

    names: np.ndarray
    gps_time: np.ndarray
    misclosure: np.ndarray  # (n, 3)
    noise: np.ndarray  # (3n, 3n)
    partials: np.ndarray  # (n, 3, 6)
    sigmas: _Sigmas
    trajectory: Trajectory
    pos: Pos

    @classmethod
    def build(cls, trajectory, observations, control, pos):
        row = [control.name.index(name) for name in observations.name]
        at_targets = trajectory.at(observations.gps_time)
        return cls(
            names=np.array(observations.name),
            gps_time=observations.gps_time,
            misclosure=control.position[row] - observations.position,
            noise=_noise(observations, control.sigma[row]),
            partials=pose_partials(trajectory, observations.position, observations.gps_time),
            sigmas=_stated_sigmas(at_targets, pos, trajectory),
            trajectory=trajectory,
            pos=pos,
        )

    def select(self, rows):
        wide = np.repeat(rows, 3)
        parts = (self.sigmas.drift[rows], self.sigmas.jitter[rows], self.sigmas.attitude[rows])
        return _Model(
            self.names[rows],
            self.gps_time[rows],
            self.misclosure[rows],
            self.noise[np.ix_(wide, wide)],
            self.partials[rows],
            _Sigmas(*parts),
            self.trajectory,
            self.pos,
        )

    @property
    def span(self):
        return float(self.gps_time.min()), float(self.gps_time.max())

    @property
    def interval(self):
        """Mean interval of the control epochs, s; the whole trajectory's length where there is
        only one."""
        first, last = self.span
        epochs = len(np.unique(self.gps_time))
        if epochs > 1:
            return (last - first) / (epochs - 1)
        return float(np.ptp(self.trajectory.gps_time))

    def design(self, gps_time, order):
        """Legendre trend per axis on the control span (Eq. 11), (q, 3, 3 (order + 1)).

        Outside the span it keeps its end value: a polynomial would run away there.
        """
        first, last = self.span
        middle, half = (first + last) / 2, max((last - first) / 2, 1.0)
        argument = np.clip((np.asarray(gps_time) - middle) / half, -1, 1)
        basis = np.polynomial.legendre.legvander(argument, order)
        return np.einsum("qi,jk->qjik", basis, np.eye(3)).reshape(len(basis), 3, -1)

    def solve(self, parameters, order):
        """Collocation of these targets under given parameters."""
        signals = _signals(self.sigmas, parameters, self.partials)
        return collocate(
            np.repeat(self.gps_time, 3),
            self.misclosure.ravel(),
            self.noise,
            self.design(self.gps_time, order).reshape(self.misclosure.size, -1),
            [Signal(s.mixing.reshape(self.misclosure.size, -1), s.covariance) for s in signals],
        )


def _noise(observations, survey_sigma):
    """Survey + extraction covariance (Eq. 19); passes share the survey error of a target."""
    n = len(observations)
    names = np.array(observations.name)
    same = names[:, None] == names
    noise = np.einsum("ij,ik,kl->ikjl", same, survey_sigma**2, np.eye(3))
    noise[np.arange(n), :, np.arange(n), :] += observations.covariance
    return noise.reshape(3 * n, 3 * n)


def _signals(sigmas, parameters, partials):
    """Signals as they enter three axes of n points; partials (n, 3, 6) by position and attitude."""
    position, rotation = partials[:, :, :3], partials[:, :, 3:]
    drift = Covariance(parameters.family, parameters.drift_time)
    jitter = Covariance("exponential", parameters.jitter_time)
    return (
        Signal(parameters.drift_scale * position @ sigmas.drift, drift),
        Signal(parameters.jitter_scale * position @ sigmas.jitter, jitter),
        Signal(rotation @ sigmas.attitude, drift),
    )


def _affordable_order(order, observations):
    """The order that leaves one control epoch more than the trend needs, with a warning."""
    targets = len(set(observations.name))
    epochs = len(np.unique(observations.gps_time))
    affordable = max(min(order, targets - 2, epochs - 2), 0)
    if affordable == order:
        return order, ()
    return affordable, (
        f"{targets} control points are too few for a trend of order {order}, which needs "
        f"{order + 2}: order {affordable} is used.",
    )


def _choose_parameters(model, order):
    """Maximise the restricted likelihood over each family, weakly held to the start values.

    The starts are the POS's stated sigmas and the paper's rule for the correlation time; jitter
    is correlated over one control interval. Returns the best and all others with their value.
    """
    interval = model.interval
    start = np.log([1.0, START_RATIO * interval, 1.0, interval])
    has_jitter = bool(np.any(model.sigmas.jitter))
    free = slice(0, 4 if has_jitter else 2)

    def parameters(family, logarithms):
        full = start.copy()
        full[free] = logarithms
        return Parameters(family, *(float(v) for v in np.exp(full)))

    def objective(logarithms, family):
        prior = 0.5 * np.sum(((logarithms - start[free]) / PRIOR_SPREAD) ** 2)
        return prior - model.solve(parameters(family, logarithms), order).log_likelihood

    corners = start[free] + np.vstack([np.zeros(free.stop), PRIOR_SPREAD * np.eye(free.stop)])
    options = {"xatol": 0.02, "fatol": 0.02, "maxfev": 600, "initial_simplex": corners}
    found = [
        (parameters(family, best.x), -float(best.fun))
        for family in FAMILIES
        for best in [minimize(objective, start[free], (family,), "Nelder-Mead", options=options)]
    ]
    found.sort(key=lambda pair: -pair[1])
    return found[0][0], tuple(found)


def _target_rows(model):
    """Rows of the observation equations of each target, all its passes together."""
    names = np.repeat(model.names, 3)
    return [(name, np.flatnonzero(names == name)) for name in dict.fromkeys(model.names)]


def _worst_outlier(model, solved):
    """The target that the others contradict most, or None where they agree with all."""
    targets = _target_rows(model)
    worst, excess = None, 1.0
    for name, rows in targets:
        if np.linalg.matrix_rank(np.delete(solved.design, rows, axis=0)) < len(solved.trend):
            continue  # without this target the trend isn't determined: nothing can test it
        residual, covariance = solved.leave_out(rows)
        statistic = float(residual @ np.linalg.solve(covariance, residual))
        critical = float(chi2.isf(SIGNIFICANCE / len(targets), len(rows)))
        if statistic / critical > excess:
            worst, excess = Outlier(str(name), statistic, critical), statistic / critical
    return worst


def _leave_targets_out(model, solved):
    """Misclosures (n, 3) that remain when each target in turn takes no part; NaN where the
    others don't determine the trend."""
    residuals = np.full(model.misclosure.size, np.nan)
    for _, rows in _target_rows(model):
        if np.linalg.matrix_rank(np.delete(solved.design, rows, axis=0)) == len(solved.trend):
            residuals[rows] = solved.leave_out(rows)[0]
    return residuals.reshape(-1, 3)


def _predict(model, solved: Collocation, parameters, order, trajectory):
    """The corrected trajectory with its sigmas, from trend and signals at every epoch (Eq. 15)."""
    n = len(trajectory)
    position, rotation = np.eye(6)[None, :, :3], np.eye(6)[None, :, 3:]
    sigmas = _stated_sigmas(trajectory, model.pos, trajectory)
    partials = np.broadcast_to(np.concatenate([position, rotation], axis=2), (n, 6, 6))
    mixings = [s.mixing for s in _signals(sigmas, parameters, partials)]
    design = np.zeros((n, 6, len(solved.trend)))
    design[:, :3] = model.design(trajectory.gps_time, order)
    pose, covariance = solved.predict(trajectory.gps_time, design, mixings)
    variance = np.maximum(np.einsum("qii->qi", covariance), 0.0)
    about_map = covariance[:, 3:, 3:]
    to_body = trajectory.attitude.inv().as_matrix()
    about_body = np.einsum("qij,qjk,qik->qi", to_body, about_map, to_body)
    corrected = Trajectory(
        gps_time=trajectory.gps_time,
        position=trajectory.position + pose[:, :3],
        attitude=Rotation.from_rotvec(pose[:, 3:]) * trajectory.attitude,
        position_sigma=np.sqrt(variance[:, :3]),
        attitude_sigma=np.sqrt(np.maximum(about_body[:, [1, 0, 2]], 0.0)),
    )
    return Correction(trajectory, corrected)
