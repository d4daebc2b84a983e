"""How misclosures are believed to change along a drive.

Per map axis the misclosure of an observation at time t is

    l(t) = c + g(t) s(t) + noise,   g(t)^2 = (k sigma(t))^2 + u^2.

c is what datum and mounting do, constant but for its turning with the vehicle. s is a smooth
process of unit variance (Matern 3/2: position and rate), sigma(t) what the POS states, k how far
that is from the truth, and u an error that it doesn't know of. The noise is that of survey and
extraction, of the stated attitude across the range, and a part of g and u that isn't smooth. k and
u are not known: several pairs compete, and the observations decide.
"""

from dataclasses import dataclass

import numpy as np

from mlscorr.matching.pairs import Pairs

SCALES = 0.5, 1.0, 2.0  # k: stated sigmas are seldom wrong by more
UNSTATED = 0.02, 0.1, 0.3  # u, m: a good mounting; calibration due; multipath, attitude, clock
SHORTER = 1.0, 0.3  # times the POS's correlation time: drift ends abruptly when satellites return
CONSTANT = 0.5  # m, one sigma of c: with it the least gate is two sigmas
TURNING = 0.3  # m of it, the part that is fixed to the vehicle
SEEN = 0.8  # of the surveyed points, in a pass: some are hidden
OTHERS = 0.25  # look-alikes for each target
STREET = 30.0, 5.0  # m, width and height in which they stand
LEAST_LENGTH = 50.0  # m of street
ROUGH = 0.1  # of g(t), one sigma: steps when satellites come and go


@dataclass(frozen=True)
class Chain:
    """n observations in order of time, under m beliefs.

    Parameters
    ----------
    gps_time, pass_number : (n,) array
    forward : (n, 2) array
        Unit vector of the vehicle's heading, E and N.
    gain : (m, n, 3) array
        g(t) per axis. Units: m.
    noise : (m, n, 3) array
        Variance per axis, without the control point's. Units: m^2.
    otherwise : (n,) array
        Logarithm of the density of what is none of the surveyed points (1/m^3), over the odds of
        a surveyed point's being seen.
    rate : (m,) array
        sqrt(3) over the correlation time. Units: 1/s.
    pairs : Pairs
    pair_variance : (p, 3) array
        Of the control points' positions. Units: m^2.
    """

    gps_time: np.ndarray
    pass_number: np.ndarray
    forward: np.ndarray
    gain: np.ndarray
    noise: np.ndarray
    otherwise: np.ndarray
    rate: np.ndarray
    pairs: Pairs
    pair_variance: np.ndarray

    def __len__(self):
        return len(self.gps_time)

    @property
    def prior(self):
        """Variances (m, 3) of c, s and its rate before any observation."""
        m = len(self.rate)
        return np.column_stack([np.full(m, CONSTANT**2), np.ones(m), self.rate**2])

    def transition(self, start, end):
        """Transition (m, 3, 3) of c, s and rate from one observation to another, and its noise."""
        dt = abs(self.gps_time[end] - self.gps_time[start])
        decay, step = np.exp(-self.rate * dt), self.rate * dt
        turned = 1.0 - float(self.forward[start] @ self.forward[end])
        matrix = np.zeros((len(self.rate), 3, 3))
        matrix[:, 0, 0] = 1.0 - TURNING**2 / CONSTANT**2 * turned
        matrix[:, 1, 1], matrix[:, 1, 2] = (1 + step) * decay, dt * decay
        matrix[:, 2, 1], matrix[:, 2, 2] = -self.rate * step * decay, (1 - step) * decay
        before = matrix * self.prior[:, None, :]
        noise = self.prior[:, :, None] * np.eye(3) - before @ matrix.swapaxes(1, 2)
        return matrix, noise


def build_chain(observations, control, pose, pairs, pos):
    """Chain of observations in order of time.

    pose is the trajectory at them; pos holds the sigmas where it has none.
    """
    n = len(observations)
    sigma, angles = pose.position_sigma, pose.attitude_sigma
    sigma = np.full((n, 3), pos.position_sigma) if sigma is None else sigma
    angles = np.broadcast_to(pos.attitude_sigma, (n, 3)) if angles is None else angles
    distance = np.linalg.norm(observations.position - pose.position, axis=1)
    known = np.einsum("nii->ni", observations.covariance)
    known = known + ((angles.max(axis=1) * distance) ** 2)[:, None]
    grid = np.meshgrid(SCALES, UNSTATED, SHORTER)
    scale, unstated, shorter = (values.ravel()[:, None, None] for values in grid)
    gain = np.hypot(scale * sigma, unstated)
    ahead = pose.attitude.apply([0.0, 1.0, 0.0])[:, :2]
    return Chain(
        gps_time=observations.gps_time,
        pass_number=observations.pass_number,
        forward=ahead / np.maximum(np.linalg.norm(ahead, axis=1, keepdims=True), 1e-12),
        gain=gain,
        noise=known + (ROUGH * gain) ** 2 + (unstated / 2) ** 2,
        otherwise=np.log(_others(observations, pose) * (1.0 - SEEN) / SEEN),
        rate=np.sqrt(3.0) / (shorter[:, 0, 0] * pos.correlation_time),
        pairs=pairs,
        pair_variance=control.sigma[pairs.control] ** 2,
    )


def _others(observations, pose):
    """Density (n,) of look-alikes of each observation's kind and size. Units: 1/m^3."""
    looks = list(zip(observations.kind, observations.size.round(2), strict=True))
    count = np.array([looks.count(look) for look in dict.fromkeys(looks)])
    number = {look: i for i, look in enumerate(dict.fromkeys(looks))}
    length = 0.0
    for one in np.unique(observations.pass_number):
        steps = np.diff(pose.position[observations.pass_number == one], axis=0)
        length += max(LEAST_LENGTH, np.linalg.norm(steps, axis=1).sum())
    rows = np.array([number[look] for look in looks], dtype=int)
    return OTHERS * count[rows] / (max(length, LEAST_LENGTH) * STREET[0] * STREET[1])
