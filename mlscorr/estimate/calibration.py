"""Calibrated mountings: corrections of recorded ones (Eq. 2), and components left undetermined."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import compress

import numpy as np
from scipy.spatial.transform import Rotation

from mlscorr.correction import Correction
from mlscorr.estimate._wording import sentences_of
from mlscorr.estimate.adjustment import Adjustment
from mlscorr.estimate.guards import Guards, few_targets, global_test_warnings
from mlscorr.estimate.posterior import Posterior
from mlscorr.estimate.settings import SETTINGS
from mlscorr.estimate.target_tests import Screening, TargetTest
from mlscorr.estimate.tied import TieResiduals
from mlscorr.pos import SignalParameters
from mlscorr.survey import Mounting, Statement, Summary, Ties, Trajectory

MOUNTING_COMPONENTS = (
    "lever arm right",
    "lever arm forward",
    "lever arm up",
    "boresight about right",
    "boresight about forward",
    "boresight about up",
)
SCANNER_COMPONENTS = ("range offset", "encoder scale")


@dataclass(frozen=True)
class MountingEstimate:
    """Corrections of the recorded mountings of k scanners, by one method.

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
        """Return the estimate for corrections of recorded mountings, with sigmas.

        Parameters
        ----------
        recorded : sequence of Mounting
        correction, covariance, sigma0
            See the attributes of the estimate.
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

    def relative_to_first(self, number: int) -> tuple[np.ndarray, np.ndarray]:
        """Correction of a mounting relative to the first, and its sigma: (6,) each, m and rad.

        If this is known, both scanners of a vehicle agree on objects seen at one time, whatever
        error both mountings have in common.

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
    """Return the mounting after a correction  (Eq. 2).

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
    """Return the mountings after a correction  (Eq. 2).

    Parameters
    ----------
    mountings : sequence of Mounting
    correction : (6 k,) array
        Lever arm and rotation of each. Units: m and rad.
    """
    return tuple(map(corrected_mounting, mountings, correction.reshape(-1, 6)))


def combined_correction(correction: np.ndarray, more: np.ndarray) -> np.ndarray:
    """Correction (6 k,) of one after another: Exp(more) Exp(correction) of each mounting.

    Parameters
    ----------
    correction, more : (6 k,) array
        Lever arm and rotation of each. Units: m and rad.
    """
    first = correction.reshape(-1, 6)
    second = more.reshape(-1, 6)
    turn = Rotation.from_rotvec(second[:, 3:]) * Rotation.from_rotvec(first[:, 3:])
    return np.hstack([first[:, :3] + second[:, :3], turn.as_rotvec()]).ravel()


@dataclass(frozen=True)
class ScannerErrors:
    """Errors of the ranges and encoders of k scanners.

    Parameters
    ----------
    correction, sigma : (2 k,) array
        To be added to each range (m), and to each scan angle by its size (ratio). Constrained by
        prior knowledge if it is not significant.
    determined, significant : (2 k,) bool array
        Masks of values determined by this geometry, and of those removed from the mounting.
    """

    correction: np.ndarray
    sigma: np.ndarray
    determined: np.ndarray
    significant: np.ndarray

    def of(self, number: int) -> ScannerErrors:
        """The errors of one scanner.

        Parameters
        ----------
        number : int
            From 0.
        """
        rows = slice(2 * number, 2 * number + 2)
        return ScannerErrors(*(values[rows] for values in vars(self).values()))

    @property
    def statements(self) -> tuple[Statement, ...]:
        """A warning if an error of one scanner is significant."""
        if not self.significant.any():
            return ()
        values = {
            "components": tuple(compress(SCANNER_COMPONENTS, self.significant)),
            "corrections": tuple(self.correction[self.significant].tolist()),
            "sigmas": tuple(self.sigma[self.significant].tolist()),
            "determined": tuple(self.determined[self.significant].tolist()),
        }
        return (Statement("scanner errors", "warning", values),)


@dataclass(frozen=True, repr=False)
class Calibration(Summary):
    """The calibrated mountings of k scanners by collocation and by plain least squares.

    Parameters
    ----------
    trajectory, recorded : Trajectory, tuple of Mounting
        As recorded.
    lsc, ls : MountingEstimate
        By collocation and by least squares; the latter by the control points alone.
    determined : (6 k,) bool array
        Mask of components determined by this geometry, whatever constant difference there is
        between the coordinates of control and trajectory.
    screening : Screening
        Of the control points, and the posterior of the parameters of the POS error.
    used : (n,) bool array
        Mask of observations in use.
    guards : Guards
    adjustment : Adjustment
        Of the observations in use.
    drift : Correction
        Of the POS error apart from the mountings, common to all scanners (Eq. 14-15). It is zero on
        average, so the farther from a control point, the less of it is corrected.
    notes : tuple of Statement
        Warnings about the inputs.
    ties, ties_with_drift : TieResiduals, optional
        Ties between passes with their residuals after correction of the mountings, alone and with
        the POS error.
    scanner : ScannerErrors, optional
        Errors of ranges and encoder.
    """

    trajectory: Trajectory
    recorded: tuple[Mounting, ...]
    lsc: MountingEstimate
    ls: MountingEstimate
    determined: np.ndarray
    screening: Screening
    used: np.ndarray
    guards: Guards
    adjustment: Adjustment
    drift: Correction
    notes: tuple[Statement, ...] = ()
    ties: TieResiduals | None = None
    ties_with_drift: TieResiduals | None = None
    scanner: ScannerErrors | None = None

    @property
    def sigma_note(self) -> str:
        """Note on the basis of sigmas of the one mounting's undetermined components; else empty."""
        return sigma_note(self.determined)

    @property
    def posterior(self) -> Posterior:
        """Posterior of the parameters of the POS error."""
        return self.screening.posterior

    @property
    def outliers(self) -> tuple[TargetTest, ...]:
        """Targets that contradict the others."""
        return self.screening.outliers

    @property
    def warnings(self) -> tuple[str, ...]:
        """Sentences on doubts, and on undetermined components of the one scanner.

        Each of several scanners has its own, returned by ``of``.
        """
        if len(self.recorded) == 1:
            return self.shared_warnings + self.own_warnings
        return self.shared_warnings

    @property
    def own_warnings(self) -> tuple[str, ...]:
        """Sentences that concern the one scanner."""
        statements = [
            *_undetermined(self.lsc, self.determined),
            *clock_warnings(self.lsc, self.trajectory),
        ]
        if self.scanner is not None:
            statements += self.scanner.statements
        return sentences_of(statements)

    @property
    def shared_warnings(self) -> tuple[str, ...]:
        """Sentences that concern all scanners."""
        targets = len(self.adjustment.target_rows)
        statements = list(self.notes)
        if targets == 0:
            statements.append(Statement("mounting by ties alone", "warning"))
        statements += few_targets(targets)
        statements += global_test_warnings(self.guards)
        statements += self.screening.warnings
        if self.ties is not None:
            statements += self.ties.statements
        return sentences_of(statements)

    @property
    def parameters(self) -> tuple[tuple[SignalParameters, float], ...]:
        """Parameters of the POS error and their probabilities."""
        return self.posterior.points

    def correction(self, method: str = "lsc") -> Correction:
        """Return the Correction that takes points from a recorded to its calibrated mounting.

        Parameters
        ----------
        method : {"lsc", "ls"}
        """
        mounting = getattr(self, method).mounting
        return Correction(self.trajectory, self.trajectory, self.recorded[0], mounting)

    @cached_property
    def corrections_with_drift(self) -> tuple[Correction, ...]:
        """The Correction of each scanner's mounting and of the POS error."""
        return mounted_corrections(self.drift, self.recorded, self.lsc.mountings)

    @property
    def correction_with_drift(self) -> Correction:
        """The Correction of the first scanner's mounting and of the POS error."""
        return self.corrections_with_drift[0]

    def with_residuals(self, ties: Ties, used: np.ndarray) -> Calibration:
        """The same with the residuals of ties.

        Parameters
        ----------
        ties : Ties
        used : (n,) bool array
        """
        still = Correction(self.trajectory, self.trajectory)
        mounted = mounted_corrections(still, self.recorded, self.lsc.mountings)
        both = mounted, self.corrections_with_drift
        bare, drifted = (TieResiduals.of(ties, used, corrections) for corrections in both)
        return replace(self, ties=bare, ties_with_drift=drifted)

    def fit_sigma(self, number: int) -> float | None:
        """Distance between the first and another scanner's images of objects of one pass. Units: m.

        One sigma from the uncertainty of both mountings: double walls of that size are to be
        expected. None without ties between them. A boresight that no such wall shows is not
        included.

        Parameters
        ----------
        number : int
            Of the other scanner, from 1.
        """
        if self.ties is None or self.adjustment.ties is None:
            return None
        ties = self.ties.ties[self.ties.used]
        first, last = self.trajectory.segment(ties.gps_time.ravel()).reshape(-1, 2).T
        is_both = (np.sort(ties.scanner) == [0, number]).all(axis=1) & (first == last)
        rows = self.adjustment.ties.columns[is_both, 0]
        variance = np.einsum("ni,ij,nj->n", rows, self.lsc.covariance, rows)
        if len(rows):
            return float(np.sqrt(variance.mean()))
        return None

    def of(self, number: int, scanner: np.ndarray) -> Calibration:
        """Return the calibration of a scanner, with the POS error from all of them.

        Parameters
        ----------
        number : int
            From 0.
        scanner : (n,) int array
            Scanner of each observation.
        """
        return replace(
            self,
            recorded=self.recorded[number : number + 1],
            lsc=self.lsc.of(number),
            ls=self.ls.of(number),
            determined=self.determined[6 * number : 6 * number + 6],
            used=self.used[scanner == number],
            ties=self.ties and self.ties.of_scanner(number),
            ties_with_drift=self.ties_with_drift and self.ties_with_drift.of_scanner(number),
            scanner=self.scanner and self.scanner.of(number),
        )


def sigma_note(determined: np.ndarray) -> str:
    """Note on the basis of sigmas of a mounting, given its determined components (6,)."""
    parts = ", ".join(compress(MOUNTING_COMPONENTS, ~determined))
    note = f"not determined: {parts}; its sigma depends on the sigmas stated by the POS"
    if parts:
        return note
    return ""


def mounted_corrections(
    drift: Correction, recorded: Sequence[Mounting], mountings: Sequence[Mounting]
) -> tuple[Correction, ...]:
    """Return the correction of each scanner: its mounting, and the common POS error.

    Parameters
    ----------
    drift : Correction
        Of the POS error.
    recorded, mountings : sequence of Mounting
        Of each scanner, as recorded and as calibrated.
    """
    return tuple(
        replace(drift, recorded_mounting=before, corrected_mounting=after)
        for before, after in zip(recorded, mountings, strict=True)
    )


def clock_warnings(estimate: MountingEstimate, trajectory: Trajectory) -> Iterator[Statement]:
    """Yield a Statement on a clock offset that is equivalent to an error of the lever arm forward.

    Parameters
    ----------
    estimate : MountingEstimate
        Of a scanner.
    trajectory : Trajectory
    """
    lack = estimate.correction[1]
    if abs(lack) > SETTINGS.setup_sigmas * estimate.sigma[1]:
        steps = np.linalg.norm(np.diff(trajectory.position, axis=0), axis=1)
        speeds = steps / np.diff(trajectory.gps_time)
        speed = np.average(speeds, weights=steps)  # while driving, not at halts
        spread = np.sqrt(np.average((speeds - speed) ** 2, weights=steps))
        values = {"lack": float(lack), "speed": float(speed), "spread": float(spread)}
        yield Statement("clock", "warning", values)


def _undetermined(estimate, determined):
    """Statement on undetermined components, with the sigma implied by that of the POS."""
    if not determined.all():
        values = {
            "components": tuple(compress(MOUNTING_COMPONENTS, ~determined)),
            "sigmas": tuple(estimate.sigma[~determined].tolist()),
        }
        yield Statement("undetermined", "warning", values)
