"""A calibrated mounting, and what its geometry can and can't tell of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import compress

import numpy as np

from mlscorr.correction import Correction
from mlscorr.estimate._screening import Screening
from mlscorr.estimate.equations import Equations
from mlscorr.estimate.guards import Guards, few_targets, global_test_warnings
from mlscorr.estimate.mounting_estimate import (
    MOUNTING_COMPONENTS,
    MountingEstimate,
    clock_warnings,
)
from mlscorr.estimate.posterior import Posterior
from mlscorr.estimate.signals import SignalParameters
from mlscorr.estimate.target_tests import TargetTest
from mlscorr.estimate.tied import TieResiduals
from mlscorr.survey import Mounting, Summary, Ties, Trajectory

SCANNER_COMPONENTS = ("range offset", "encoder scale")


@dataclass(frozen=True)
class ScannerErrors:
    """What the own ranges and encoders of k scanners lack.

    Parameters
    ----------
    correction, sigma : (2 k,) array
        To be added to each range (m), and to each scan angle by its size (ratio). Held to what is
        known without any measurement where it is not significant.
    determined, significant : (2 k,) bool array
        Whether this geometry can tell it at all; whether the mounting is free of it.
    """

    correction: np.ndarray
    sigma: np.ndarray
    determined: np.ndarray
    significant: np.ndarray

    def of(self, number: int) -> ScannerErrors:
        """Those of a scanner.

        Parameters
        ----------
        number : int
            From 0.
        """
        rows = slice(2 * number, 2 * number + 2)
        return ScannerErrors(*(values[rows] for values in vars(self).values()))

    @property
    def warnings(self) -> tuple[str, ...]:
        """A sentence where something is significant, of one scanner."""
        units = "mm", "mrad per rad"
        rows = zip(SCANNER_COMPONENTS, units, *vars(self).values(), strict=True)
        lacks = [
            f"{part} {1000 * a:.1f} ± {1000 * s:.1f} {unit}{'' if known else ' (not determined)'}"
            for part, unit, a, s, known, wrong in rows
            if wrong
        ]
        if not lacks:
            return ()
        return (
            f"The scanner itself is off: it lacks {', '.join(lacks)}. The mounting is given free "
            "of that, but the points keep it: set it in the scanner's own software, export the "
            "clouds anew, and calibrate again.",
        )


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
        Which components this geometry can tell, whatever constant difference there is between the
        coordinates of control and trajectory.
    screening : Screening
        Of the control points, and the posterior of the parameters of the POS error.
    used : (n,) bool array
        Which observations took part.
    guards : Guards
    equations : Equations
        Of the observations that took part.
    drift : Correction
        Of the POS error beside the mountings, which all scanners share  (Eq. 14-15). It is zero on
        average, so the farther from a control point, the less of it is corrected.
    notes : tuple of str
        Of warnings, those on the inputs.
    ties, ties_with_drift : TieResiduals, optional
        What two passes both saw, and what the mountings leave of it, by themselves and with the POS
        error.
    scanner : ScannerErrors, optional
        What ranges and encoder lack.
    """

    trajectory: Trajectory
    recorded: tuple[Mounting, ...]
    lsc: MountingEstimate
    ls: MountingEstimate
    determined: np.ndarray
    screening: Screening
    used: np.ndarray
    guards: Guards
    equations: Equations
    drift: Correction
    notes: tuple[str, ...] = ()
    ties: TieResiduals | None = None
    ties_with_drift: TieResiduals | None = None
    scanner: ScannerErrors | None = None

    @property
    def sigma_note(self) -> str:
        """On what sigmas of the one mounting rest that this geometry can't tell; else empty."""
        return sigma_note(self.determined)

    @property
    def posterior(self) -> Posterior:
        """Of the parameters of the POS error."""
        return self.screening.posterior

    @property
    def outliers(self) -> tuple[TargetTest, ...]:
        """Targets that the others contradict."""
        return self.screening.outliers

    @property
    def warnings(self) -> tuple[str, ...]:
        """Sentences on what is doubtful, and what this geometry can't tell of the one scanner.

        Of several scanners each has its own: those of ``of``.
        """
        return *self.shared_warnings, *(self.own_warnings if len(self.recorded) == 1 else ())

    @property
    def own_warnings(self) -> tuple[str, ...]:
        """Those of the sentences that concern the one scanner."""
        scanner = () if self.scanner is None else self.scanner.warnings
        clock = clock_warnings(self.lsc, self.trajectory)
        return (*_warnings(self.lsc, self.determined), *clock, *scanner)

    @property
    def shared_warnings(self) -> tuple[str, ...]:
        """Those of the sentences that concern all scanners."""
        of_control = *_few_control(self.equations), *global_test_warnings(self.guards)
        of_ties = () if self.ties is None else self.ties.warnings
        return *self.notes, *of_control, *self.screening.warnings, *of_ties

    @property
    def parameters(self) -> tuple[tuple[SignalParameters, float], ...]:
        """Parameters of the POS error and their probabilities."""
        return self.posterior.points

    def correction(self, method: str = "lsc") -> Correction:
        """The Correction that brings points from a scanner's recorded to its calibrated mounting.

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
        """That of the first scanner."""
        return self.corrections_with_drift[0]

    def with_residuals(self, ties: Ties, used: np.ndarray) -> Calibration:
        """The same with what it leaves of ties.

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
        """How far apart the first scanner and another put what both saw on one pass. Units: m.

        One sigma by what is open of both mountings: double walls of that size are to be expected.
        None where nothing ties them. A boresight that no such wall shows takes no part.

        Parameters
        ----------
        number : int
            Of the other scanner, from 1.
        """
        if self.ties is None or self.equations.ties is None:
            return None
        ties = self.ties.ties[self.ties.used]
        first, last = self.trajectory.segment(ties.gps_time.ravel()).reshape(-1, 2).T
        is_both = (np.sort(ties.scanner) == [0, number]).all(axis=1) & (first == last)
        rows = self.equations.ties.mounting[is_both]
        variance = np.einsum("ni,ij,nj->n", rows, self.lsc.covariance, rows)
        if len(rows):
            return float(np.sqrt(variance.mean()))
        return None

    def of(self, number: int, scanner: np.ndarray) -> Calibration:
        """The calibration of a scanner, with the POS error by all of them.

        Parameters
        ----------
        number : int
            From 0.
        scanner : (n,) int array
            That of each observation.
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
            scanner=None if self.scanner is None else self.scanner.of(number),
        )


def sigma_note(determined: np.ndarray) -> str:
    """On what sigmas of a mounting rest, of its components (6,) that are determined or not."""
    parts = ", ".join(compress(MOUNTING_COMPONENTS, ~determined))
    note = f"not determined: {parts}; its sigma holds only as far as the POS's own do"
    if parts:
        return note
    return ""


def mounted_corrections(
    drift: Correction, recorded: Sequence[Mounting], mountings: Sequence[Mounting]
) -> tuple[Correction, ...]:
    """The correction of each scanner: its mounting, and the POS error that all share.

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


def _few_control(equations):
    """A sentence where control points are too few to test each other."""
    number = len(equations.target_rows)
    if number == 0:
        yield (
            "No control point takes part: the mounting is that which makes the passes agree, and "
            "where they are is what the POS says."
        )
    yield from few_targets(number)


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
