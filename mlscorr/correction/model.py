"""The observation equations of the POS error, and its signals at any epoch (Eq. 7-12)."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from mlscorr.collocation import Noise, Signal, collocate
from mlscorr.covariance import Covariance
from mlscorr.georeference import pose_partials
from mlscorr.survey import Pos, Trajectory

HELD_PERCENTILE = 5.0  # the sigma that the POS states at its best, free of single epochs
SAME_EPOCH = 1.0  # s; closer together, two targets say the same of the POS


@dataclass(frozen=True)
class Parameters:
    """What is chosen by likelihood: factors on the stated sigmas, and correlation times in s.

    The attitude's correlation time is that of the drift.
    """

    family: str
    drift_scale: float
    drift_time: float
    jitter_scale: float
    jitter_time: float
    bias_scale: float
    bias_time: float
    attitude_scale: float


@dataclass(frozen=True)
class Sigmas:
    """Square roots of the stated covariances, (n, 3, 3) each: drift, jitter, attitude."""

    drift: np.ndarray
    jitter: np.ndarray
    attitude: np.ndarray

    def at(self, rows):
        """Those of some epochs."""
        return Sigmas(self.drift[rows], self.jitter[rows], self.attitude[rows])


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
    noise: Noise
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
            noise=Noise(observations.covariance, np.array(row), control.sigma),  # Eq. 19
            partials=pose_partials(trajectory, observations.position, observations.gps_time),
            sigmas=stated_sigmas(at_targets, pos, trajectory),
            trajectory=trajectory,
            pos=pos,
        )

    def select(self, rows):
        """The observation equations of some targets: (n,) bool, or their numbers."""
        rows = np.flatnonzero(rows) if rows.dtype == bool else rows
        return Model(
            self.names[rows],
            self.gps_time[rows],
            self.misclosure[rows],
            self.noise.select(rows),
            self.partials[rows],
            self.sigmas.at(rows),
            self.trajectory,
            self.pos,
        )

    def without(self, names):
        """The observation equations of all targets but some."""
        return self.select(~np.isin(self.names, list(names))) if names else self

    @cached_property
    def stated(self):
        """Sigmas at every epoch of the trajectory."""
        return stated_sigmas(self.trajectory, self.pos, self.trajectory)

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
        design = self.design(self.gps_time, order)
        return collocate(self.gps_time, self.misclosure, self.noise, design, signals)


def pose_signals(sigmas, parameters, partials):
    """Signals as they enter three axes of n points; partials (n, 3, 6) by position and attitude."""
    position, rotation = partials[:, :, :3], partials[:, :, 3:]
    drift = Covariance(parameters.family, parameters.drift_time)
    attitude = Signal(parameters.attitude_scale * rotation @ sigmas.attitude, drift)
    moved = Signal(parameters.drift_scale * position @ sigmas.drift, drift)
    if not np.any(sigmas.jitter):
        return moved, attitude
    jitter = Covariance("exponential", parameters.jitter_time)
    bias = Covariance(parameters.family, parameters.bias_time)
    held = position @ sigmas.jitter
    return (
        moved,
        Signal(parameters.jitter_scale * held, jitter),
        Signal(parameters.bias_scale * held, bias),
        attitude,
    )
