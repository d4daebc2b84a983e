"""A calibrated mounting, and what its geometry can and can't tell of it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from threadpoolctl import threadpool_limits

from mlscorr.correction import Correction
from mlscorr.estimate.equations import Equations
from mlscorr.estimate.guards import Guards, global_test_warnings
from mlscorr.estimate.posterior import Posterior
from mlscorr.estimate.prediction import predict_pose_error
from mlscorr.estimate.screening import Outlier, Screening
from mlscorr.estimate.settings import SETTINGS
from mlscorr.estimate.signals import SignalParameters
from mlscorr.estimate.tied import TieResiduals
from mlscorr.survey import Mounting, Trajectory
from mlscorr.survey.summary import Summary

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
class ScannerErrors:
    """What a scanner's own ranges and encoder lack.

    Parameters
    ----------
    correction, sigma : (2,) array
        To be added to each range (m), and to each scan angle by its size (ratio).
    determined, significant : (2,) bool array
        Whether this geometry can tell it at all; whether the mounting is free of it.
    """

    correction: np.ndarray
    sigma: np.ndarray
    determined: np.ndarray
    significant: np.ndarray

    @property
    def warnings(self) -> tuple[str, ...]:
        """A sentence where something is significant."""
        rows = zip(SCANNER_COMPONENTS, self.correction, self.sigma, self.significant, strict=True)
        lacks = [
            f"{part} {1000 * a:.1f} ± {1000 * s:.1f} {unit}"
            for (part, a, s, wrong), unit in zip(rows, ("mm", "mrad per rad"), strict=True)
            if wrong
        ]
        if not lacks:
            return ()
        return (
            f"The scanner itself is off: it lacks {', '.join(lacks)}. The mounting is given free "
            "of that, but the points keep it: set it in the scanner's own software, export the "
            "clouds anew, and calibrate again.",
        )


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
    def sigma(self) -> np.ndarray:
        """One sigma (6,) of the correction: m and rad."""
        return np.sqrt(np.diag(self.covariance))

    @property
    def correlation(self) -> np.ndarray:
        """Correlation matrix (6, 6) of the correction."""
        return self.covariance / np.outer(self.sigma, self.sigma)


@dataclass(frozen=True, repr=False)
class Calibration(Summary):
    """The calibrated mounting by collocation and by plain least squares.

    Parameters
    ----------
    trajectory, recorded : Trajectory, Mounting
        As recorded.
    lsc, ls : MountingEstimate
        By collocation and by least squares.
    determined : (6,) bool array
        Which components this geometry can tell, whatever constant difference there is between the
        coordinates of control and trajectory.
    screening : Screening
        Of the control points, and the posterior of the parameters of the POS error.
    used : (n,) bool array
        Which observations took part.
    guards : Guards
    equations : Equations
        Of the observations that took part.
    notes : tuple of str
        Of warnings, those on the inputs.
    ties : TieResiduals, optional
        What two passes both saw, and what the mounting and the POS error leave of it.
    scanner : ScannerErrors, optional
        What ranges and encoder lack.
    """

    trajectory: Trajectory
    recorded: Mounting
    lsc: MountingEstimate
    ls: MountingEstimate
    determined: np.ndarray
    screening: Screening
    used: np.ndarray
    guards: Guards
    equations: Equations
    notes: tuple[str, ...] = ()
    ties: TieResiduals | None = None
    scanner: ScannerErrors | None = None

    @property
    def posterior(self) -> Posterior:
        """Of the parameters of the POS error."""
        return self.screening.posterior

    @property
    def outliers(self) -> tuple[Outlier, ...]:
        """Targets that the others contradict."""
        return self.screening.outliers

    @property
    def warnings(self) -> tuple[str, ...]:
        """Sentences on what this geometry can't tell, and what is doubtful."""
        return (
            *self.notes,
            *_few_control(self.equations),
            *_warnings(self.lsc, self.determined),
            *global_test_warnings(self.guards),
            *self.screening.warnings,
            *(() if self.ties is None else self.ties.warnings),
            *(() if self.scanner is None else self.scanner.warnings),
        )

    @property
    def parameters(self) -> tuple[tuple[SignalParameters, float], ...]:
        """Parameters of the POS error and their probabilities."""
        return self.posterior.points

    def correction(self, method: str = "lsc") -> Correction:
        """The Correction that brings points from the recorded to the calibrated mounting.

        Parameters
        ----------
        method : {"lsc", "ls"}
        """
        mounting = getattr(self, method).mounting
        return Correction(self.trajectory, self.trajectory, self.recorded, mounting)

    @cached_property
    def correction_with_drift(self) -> Correction:
        """The Correction of the mounting and of the POS error at each epoch  (Eq. 14-15).

        The POS error is zero on average, so the farther from a control point, the less of it is
        corrected.
        """
        with threadpool_limits(limits=1, user_api="blas"):
            pose, covariance = predict_pose_error(self.equations, self.posterior)
        return Correction.by_pose_error(
            self.trajectory, pose, covariance, self.recorded, self.lsc.mounting
        )


def _few_control(equations):
    """A sentence where control points are too few to test each other."""
    number = len(equations.target_rows)
    if number == 0:
        yield (
            "No control point takes part: the mounting is that which makes the passes agree, and "
            "where they are is what the POS says."
        )
    elif number < SETTINGS.smallest_targets:
        yield (
            f"Only {number} control {'point takes' if number == 1 else 'points take'} part, which "
            "nothing but ties can test."
        )


def _warnings(estimate, determined):
    """Sentences on what this geometry can't tell, with the sigma that the POS's belief gives."""
    if determined.all():
        return ()
    sigma = [f"{s:.3f} m" for s in estimate.sigma[:3]]
    sigma += [f"{s:.3f} deg" for s in np.degrees(estimate.sigma[3:])]
    unknown = ", ".join(
        f"{MOUNTING_COMPONENTS[i]} (sigma {sigma[i]})" for i in np.flatnonzero(~determined)
    )
    return (
        f"This geometry does not determine {unknown}: a constant difference between the "
        "coordinates of control and trajectory, or another component, looks the same, and the "
        "sigma holds only as far as the POS's own do. Targets on both sides, near and far, high "
        "and low, passed in both directions tell more; no level street tells lever arm up from a "
        "height difference.",
    )
