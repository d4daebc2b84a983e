"""Jumps of a correction, which it has only where the recorded path steps."""

from dataclasses import dataclass

import numpy as np

from mlscorr.correction import Correction
from mlscorr.pos import drift_history


@dataclass(frozen=True)
class Jump:
    """A jump of corrected - recorded position.

    Parameters
    ----------
    start, end : float
        Last epoch before and first one after it. Units: s.
    size : tuple of float
        Change of corrected - recorded E, N, H. Units: m.
    step : tuple of float
        Step of the recorded path beyond the vehicle's motion, E, N, H. Units: m.
    """

    start: float
    end: float
    size: tuple[float, float, float]
    step: tuple[float, float, float]

    @property
    def time(self) -> float:
        """Its middle. Units: s."""
        return (self.start + self.end) / 2

    @property
    def length(self) -> float:
        """Length of the change. Units: m."""
        return float(np.linalg.norm(self.size))

    def document(self) -> dict[str, object]:
        """The row of ``jumps[]`` in report.json."""
        row = {"time": self.time, "from": self.start, "to": self.end}
        return {**row, "size": list(self.size), "step": list(self.step)}


def find_jumps(correction: Correction) -> tuple[Jump, ...]:
    """Jumps of a correction, in time: one at each step of the recorded path.

    Parameters
    ----------
    correction : Correction
    """
    recorded = correction.recorded
    steps = drift_history(recorded).steps
    moved = correction.corrected.position - recorded.position
    first, last = np.searchsorted(recorded.gps_time, [steps.before, steps.after])
    sizes = moved[last] - moved[first]
    return tuple(
        Jump(float(start), float(end), tuple(size.tolist()), tuple(step.tolist()))
        for start, end, size, step in zip(steps.before, steps.after, sizes, steps.size, strict=True)
    )
