"""The observation equations of the mounting: l = A x + B s + n  (Mao et al. 2015, Eq. 16-18)."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from mlscorr.collocation import Noise, Signal, collocate
from mlscorr.covariance import Covariance
from mlscorr.georeference import mounting_partials, pose_partials
from mlscorr.survey import Mounting

# What is known of a mounting without any measurement, one sigma: a vehicle's size, and a drawing
WEAK_LEVER_ARM = 1.0  # m
WEAK_BORESIGHT = np.radians(5.0)
WEAK = np.repeat([WEAK_LEVER_ARM, WEAK_BORESIGHT], 3)


@dataclass(frozen=True)
class Parameters:
    """Family of the signals' covariance, factors on the stated sigmas, correlation times in s."""

    family: str
    position_scale: float
    position_time: float
    attitude_scale: float
    attitude_time: float


@dataclass(frozen=True)
class Equations:
    """n observed targets, three rows each, and below them two epochs of three rows that hold the
    mounting weakly, so that what a site doesn't determine stays as it was recorded.

    Parameters
    ----------
    names : (n,) array of str
    gps_time : (n + 2,) array
        Units: s.
    misclosure : (n + 2, 3) array
        Units: m; the last row rad.
    noise : Noise
        Survey and extraction (Eq. 19).
    design : (n + 2, 3, 6) array
        A: by lever arm and boresight.
    position, attitude : (n + 2, 3, 3) array
        B times the stated sigmas.
    """

    names: np.ndarray
    gps_time: np.ndarray
    misclosure: np.ndarray
    noise: Noise
    design: np.ndarray
    position: np.ndarray
    attitude: np.ndarray

    def thinned(self, most):
        """The equations of targets evenly chosen in time, of at most so many observations."""
        names = list(dict.fromkeys(self.names[np.argsort(self.gps_time[:-2], kind="stable")]))
        every = -(-len(self.names) // most)
        rows = np.append(np.isin(self.names, names[::every]), [True, True])
        return Equations(
            self.names[rows[:-2]],
            self.gps_time[rows],
            self.misclosure[rows],
            self.noise.select(rows),
            self.design[rows],
            self.position[rows],
            self.attitude[rows],
        )

    @property
    def target_rows(self):
        """Rows of the observation equations of each target, all its passes together."""
        names = np.repeat(self.names, 3)
        return {str(name): np.flatnonzero(names == name) for name in dict.fromkeys(self.names)}

    def signals(self, parameters):
        """Position and attitude error of the POS, under given parameters."""
        return (
            Signal(
                parameters.position_scale * self.position,
                Covariance(parameters.family, parameters.position_time),
            ),
            Signal(
                parameters.attitude_scale * self.attitude,
                Covariance(parameters.family, parameters.attitude_time),
            ),
        )

    def solve(self, signals=(), shift=False):
        """Collocation under some signals; with shift, also of a constant difference (3,) between
        the coordinates of control and trajectory."""
        design = self.design
        if shift:
            constant = np.tile(np.eye(3), (len(design), 1, 1))
            constant[-2:] = 0.0  # the mounting's own rows
            design = np.concatenate([design, constant], axis=2)
        return collocate(self.gps_time, self.misclosure, self.noise, design, signals)


def build_equations(trajectory, mounting, corrected, observations, control, pos):
    """Equations about a mounting that is ``corrected`` (6,) already: m and rad.

    observations are as georeferenced with that mounting; what is estimated adds to it.
    """
    row = [control.name.index(name) for name in observations.name]
    times, position = observations.gps_time, observations.position
    pose = trajectory.at(times)
    position_sigma, attitude_sigma = stated_sigmas(pose, pos)
    partials = pose_partials(trajectory, position, times)
    nothing = np.zeros((2, 3, 3))
    return Equations(
        names=np.array(observations.name),
        gps_time=np.append(times, [times[0], times[0]]),
        misclosure=np.vstack([control.position[row] - position, -corrected.reshape(2, 3)]),
        noise=_noise(observations, row, control.sigma),
        design=np.vstack(
            [mounting_partials(trajectory, mounting, position, times), np.eye(6).reshape(2, 3, 6)]
        ),
        position=np.vstack([partials[:, :, :3] @ position_sigma, nothing]),
        attitude=np.vstack([partials[:, :, 3:] @ attitude_sigma, nothing]),
    )


def stated_sigmas(pose, pos):
    """Square roots (n, 3, 3) of the stated covariances of position (m) and attitude (rad), both
    about the map axes."""
    n = len(pose.gps_time)
    position, angles = pose.position_sigma, pose.attitude_sigma
    if position is None:
        position = np.full((n, 3), pos.position_sigma)
    if angles is None:
        angles = np.broadcast_to(pos.attitude_sigma, (n, 3))
    # roll turns about Y, pitch about X, heading about -Z; R diag(s) R^T carries them to the map
    rotation = pose.attitude.as_matrix()
    body = angles[:, [1, 0, 2]]
    attitude = (rotation * body[:, None, :]) @ rotation.swapaxes(1, 2)
    return position[:, :, None] * np.eye(3), attitude


def _noise(observations, row, survey_sigma):
    """Extraction, and the survey error (Eq. 19), which all passes of a target share; then the weak
    hold of the mounting."""
    weak = np.array([np.diag(part**2) for part in WEAK.reshape(2, 3)])
    nobody = [len(survey_sigma), len(survey_sigma) + 1]
    return Noise(
        own=np.vstack([observations.covariance, weak]),
        group=np.append(row, nobody),
        shared=np.vstack([survey_sigma, np.zeros((2, 3))]),
    )


def corrected_mounting(mounting, correction):
    """The mounting that lacked a correction (6,): lever arm in m, rotation in rad  (Eq. 2)."""
    turn = Rotation.from_rotvec(correction[3:])
    return Mounting(mounting.lever_arm + correction[:3], turn * mounting.boresight)
