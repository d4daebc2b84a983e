"""The observation equations of the POS error, and its signals at any epoch (Eq. 7-12)."""

from dataclasses import dataclass

import numpy as np

from mlscorr.collocation import Signal, collocate
from mlscorr.covariance import Covariance
from mlscorr.georeference import pose_partials
from mlscorr.survey import Pos, Trajectory

HELD_PERCENTILE = 5.0  # the sigma that the POS states at its best, free of single epochs
SAME_EPOCH = 1.0  # s; closer together, two targets say the same of the POS


@dataclass(frozen=True)
class Parameters:
    """What is chosen by likelihood: factors on the stated sigmas, and correlation times in s."""

    family: str
    drift_scale: float
    drift_time: float
    jitter_scale: float
    jitter_time: float


@dataclass(frozen=True)
class Sigmas:
    """Square roots of the stated covariances, (n, 3, 3) each: drift, jitter, attitude."""

    drift: np.ndarray
    jitter: np.ndarray
    attitude: np.ndarray


def stated_sigmas(trajectory, pos, reference):
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
    return Sigmas(
        drift=np.sqrt(np.maximum(sigma**2 - held**2, 0.0))[:, :, None] * diagonal,
        jitter=np.minimum(sigma, held)[:, :, None] * diagonal,
        attitude=(rotation * body[:, None, :]) @ rotation.swapaxes(1, 2),
    )


@dataclass(frozen=True)
class Model:
    """The observation equations of n observed targets, three rows each."""

    names: np.ndarray
    gps_time: np.ndarray
    misclosure: np.ndarray  # (n, 3)
    noise: np.ndarray  # (3n, 3n)
    partials: np.ndarray  # (n, 3, 6)
    sigmas: Sigmas
    trajectory: Trajectory
    pos: Pos

    @classmethod
    def build(cls, trajectory, observations, control, pos):
        """The observation equations of matched targets (see estimate_correction)."""
        row = [control.name.index(name) for name in observations.name]
        at_targets = trajectory.at(observations.gps_time)
        return cls(
            names=np.array(observations.name),
            gps_time=observations.gps_time,
            misclosure=control.position[row] - observations.position,
            noise=_noise(observations, control.sigma[row]),
            partials=pose_partials(trajectory, observations.position, observations.gps_time),
            sigmas=stated_sigmas(at_targets, pos, trajectory),
            trajectory=trajectory,
            pos=pos,
        )

    def select(self, rows):
        """The observation equations of some targets: (n,) bool, or their numbers."""
        rows = np.flatnonzero(rows) if rows.dtype == bool else rows
        wide = (3 * rows[:, None] + np.arange(3)).ravel()
        parts = (self.sigmas.drift[rows], self.sigmas.jitter[rows], self.sigmas.attitude[rows])
        return Model(
            self.names[rows],
            self.gps_time[rows],
            self.misclosure[rows],
            self.noise[np.ix_(wide, wide)],
            self.partials[rows],
            Sigmas(*parts),
            self.trajectory,
            self.pos,
        )

    @property
    def span(self):
        """First and last control epoch. Units: s."""
        return float(self.gps_time.min()), float(self.gps_time.max())

    @property
    def epochs(self):
        """Number of control epochs; targets within a second share one."""
        number, last = 0, -np.inf
        for time in np.sort(self.gps_time):
            if time - last > SAME_EPOCH:
                number, last = number + 1, time
        return number

    @property
    def interval(self):
        """Mean interval of the control epochs without the trajectory's gaps between them, s; the
        whole trajectory's length where there is only one epoch."""
        epochs = self.epochs
        if epochs == 1:
            return float(np.ptp(self.trajectory.gps_time))
        first, last = self.span
        starts, ends = self.trajectory.gaps.T
        lost = (ends - starts)[(starts >= first) & (ends <= last)].sum()
        return float(last - first - lost) / (epochs - 1)

    def design(self, gps_time, order):
        """Legendre trend per axis on the control span (Eq. 11), (q, 3, 3 (order + 1)).

        Outside the span it keeps its end value: a polynomial would run away there.
        """
        first, last = self.span
        middle, half = (first + last) / 2, max((last - first) / 2, 1.0)
        argument = np.clip((np.asarray(gps_time) - middle) / half, -1, 1)
        basis = np.polynomial.legendre.legvander(argument, order)
        return np.einsum("qi,jk->qjik", basis, np.eye(3)).reshape(len(basis), 3, -1)

    @property
    def target_rows(self):
        """Rows of the observation equations of each target, all its passes together."""
        names = np.repeat(self.names, 3)
        return {str(name): np.flatnonzero(names == name) for name in dict.fromkeys(self.names)}

    def solve(self, parameters, order):
        """Collocation of these targets under given parameters."""
        signals = pose_signals(self.sigmas, parameters, self.partials)
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


def pose_signals(sigmas, parameters, partials):
    """Signals as they enter three axes of n points; partials (n, 3, 6) by position and attitude."""
    position, rotation = partials[:, :, :3], partials[:, :, 3:]
    drift = Covariance(parameters.family, parameters.drift_time)
    jitter = Covariance("exponential", parameters.jitter_time)
    return (
        Signal(parameters.drift_scale * position @ sigmas.drift, drift),
        Signal(parameters.jitter_scale * position @ sigmas.jitter, jitter),
        Signal(rotation @ sigmas.attitude, drift),
    )
