"""A cause, and what it was found in: what a closure starts from."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mlscorr.gap.evidence import Cause, LabelEvidence
from mlscorr.gap.residuals import Rows
from mlscorr.gap.signatures import Bench, Signature, signature
from mlscorr.survey import Survey


@dataclass(frozen=True)
class FoundCause:
    """A cause, and what it was found in.

    Parameters
    ----------
    rows : Rows
        All of them, check points too.
    used : (m,) bool array
        False for those of check points.
    survey : Survey
        With what the simulator believes.
    signatures : sequence of Signature
        Of all rows.
    evidence : LabelEvidence
        Of the used rows.
    cause : Cause
        From them.
    """

    rows: Rows
    used: np.ndarray
    survey: Survey
    signatures: Sequence[Signature]
    evidence: LabelEvidence
    cause: Cause

    @property
    def shifting(self) -> list[tuple[Signature, np.ndarray]]:
        """The parts of the cause that are no noise, with their estimates."""
        return [pair for pair in self.cause.parts if pair[0].name not in self.evidence.noisy]

    @property
    def undecided(self) -> np.ndarray:
        """Rows (m,) bool of check points seen at the moment of a jump, between the used rows
        next to it: nothing says on which side of it they are.
        """
        rows = self.rows
        undecided = np.zeros(len(self.rows), bool)
        known = rows.gps_time[self.used & rows.metric], rows.gps_time_2[self.used & rows.two_times]
        known = np.sort(np.concatenate([[-np.inf], *known, [np.inf]]))
        for part, _ in self.shifting:
            if part.kind.moment() and "width" not in part.fixed:
                after = np.searchsorted(known, rows.reference.start + part.fixed["time"])
                between = (rows.gps_time > known[after - 1]) & (rows.gps_time < known[after])
                undecided |= between & ~self.used
        return undecided

    def columns(self) -> np.ndarray:
        """What these parts make of all rows (m, p), by their parameters."""
        # nothing is drawn
        bench = Bench(self.rows, self.survey)
        rng = np.random.default_rng(0)
        parts = [signature(bench, p.kind, p.fixed, rng).jacobian for p, _ in self.shifting]
        return np.hstack([np.zeros((len(self.rows), 0)), *parts])
