"""What recorded mountings lack, by one method, and how a correction changes a mounting (Eq. 2)."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from mlscorr.estimate.settings import SETTINGS
from mlscorr.survey import Mounting, Trajectory

MOUNTING_COMPONENTS = (
    "lever arm right",
    "lever arm forward",
    "lever arm up",
    "boresight about right",
    "boresight about forward",
    "boresight about up",
)


@dataclass(frozen=True)
class MountingEstimate:
    """What the recorded mountings of k scanners lack, by one method.

    Parameters
    ----------
    mountings : tuple of Mounting
        The calibrated ones.
    correction : (6 k,) array
        Lever arm (m) and boresight (rad) about right, forward, up: lever_arm_true = recorded + c,
        R_L^P true = Exp(c) R_L^P recorded.
    covariance : (6 k, 6 k) array
    sigma0 : float
        Of weight one; one if the model is right.
    """

    mountings: tuple[Mounting, ...]
    correction: np.ndarray
    covariance: np.ndarray
    sigma0: float

    @property
    def mounting(self) -> Mounting:
        """The calibrated one of the first scanner."""
        return self.mountings[0]

    @property
    def sigma(self) -> np.ndarray:
        """One sigma (6 k,) of the correction: m and rad."""
        return np.sqrt(np.diag(self.covariance))

    @property
    def correlation(self) -> np.ndarray:
        """Correlation matrix (6 k, 6 k) of the correction."""
        return self.covariance / np.outer(self.sigma, self.sigma)

    @classmethod
    def about(
        cls,
        recorded: Sequence[Mounting],
        correction: np.ndarray,
        covariance: np.ndarray,
        sigma0: float,
    ) -> MountingEstimate:
        """The estimate by corrections of recorded mountings; the calibrated ones know their sigmas.

        Parameters
        ----------
        recorded : sequence of Mounting
        correction, covariance, sigma0
            As of the estimate.
        """
        mountings = tuple(
            replace(mounting, covariance=covariance[6 * i : 6 * i + 6, 6 * i : 6 * i + 6])
            for i, mounting in enumerate(corrected_mountings(recorded, correction))
        )
        return cls(mountings, correction, covariance, sigma0)

    def of(self, number: int) -> MountingEstimate:
        """The estimate of a scanner's mounting.

        Parameters
        ----------
        number : int
            From 0.
        """
        rows = slice(6 * number, 6 * number + 6)
        mountings = self.mountings[number : number + 1]
        covariance = self.covariance[rows, rows]
        return MountingEstimate(mountings, self.correction[rows], covariance, self.sigma0)

    def beside_first(self, number: int) -> tuple[np.ndarray, np.ndarray]:
        """What a mounting lacks beside the first, and one sigma of it: (6,) each, m and rad.

        Both scanners of a vehicle put what they see together in one place where this is known,
        whatever both mountings have in common.

        Parameters
        ----------
        number : int
            Of the scanner, from 1.
        """
        first, other = self.correction.reshape(-1, 6)[[0, number]]
        turn = Rotation.from_rotvec(other[3:]) * Rotation.from_rotvec(first[3:]).inv()
        difference = np.zeros((6, len(self.correction)))
        difference[:, 6 * number : 6 * number + 6] = np.eye(6)
        difference[:, :6] -= np.eye(6)
        variance = np.diag(difference @ self.covariance @ difference.T)
        return np.append(other[:3] - first[:3], turn.as_rotvec()), np.sqrt(variance)


def corrected_mounting(mounting: Mounting, correction: np.ndarray) -> Mounting:
    """The mounting that lacked a correction  (Eq. 2).

    Parameters
    ----------
    mounting : Mounting
    correction : (6,) array
        Lever arm and rotation. Units: m and rad.
    """
    turn = Rotation.from_rotvec(correction[3:])
    return Mounting(mounting.lever_arm + correction[:3], turn * mounting.boresight)


def corrected_mountings(
    mountings: Sequence[Mounting], correction: np.ndarray
) -> tuple[Mounting, ...]:
    """The mountings that lacked a correction  (Eq. 2).

    Parameters
    ----------
    mountings : sequence of Mounting
    correction : (6 k,) array
        Lever arm and rotation of each. Units: m and rad.
    """
    return tuple(map(corrected_mounting, mountings, correction.reshape(-1, 6)))


def combined_correction(correction: np.ndarray, more: np.ndarray) -> np.ndarray:
    """The correction (6 k,) of one after another: Exp(more) Exp(correction) of each mounting.

    Parameters
    ----------
    correction, more : (6 k,) array
        Lever arm and rotation of each. Units: m and rad.
    """
    first = correction.reshape(-1, 6)
    second = more.reshape(-1, 6)
    turn = Rotation.from_rotvec(second[:, 3:]) * Rotation.from_rotvec(first[:, 3:])
    return np.hstack([first[:, :3] + second[:, :3], turn.as_rotvec()]).ravel()


def clock_warnings(estimate: MountingEstimate, trajectory: Trajectory) -> Iterator[str]:
    """A sentence on the clock offset that a lever arm's lack forward may be as well.

    Parameters
    ----------
    estimate : MountingEstimate
        Of a scanner.
    trajectory : Trajectory
    """
    lack = estimate.correction[1]
    if abs(lack) > SETTINGS.setup_sigmas * estimate.sigma[1]:
        way = np.linalg.norm(np.diff(trajectory.position, axis=0), axis=1)
        speeds = way / np.diff(trajectory.gps_time)
        speed = np.average(speeds, weights=way)  # where it drives, no halts
        spread = np.sqrt(np.average((speeds - speed) ** 2, weights=way))
        yield (
            f"The lever arm lacks {1e3 * lack:.0f} mm forward. A clock offset of "
            f"{1e3 * abs(lack) / speed:.0f} ms at this survey's speed ({speed:.1f} ± {spread:.1f} "
            "m/s) looks the same but where speeds differ: by those mlscorr diagnose tells which."
        )
