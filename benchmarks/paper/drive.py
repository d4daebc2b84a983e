"""Quantities measured on one simulated drive of the car."""

from dataclasses import dataclass

import numpy as np
from literal import Literal
from published import TIMES
from tables import quietly, rms, survey_of

from mlscorr.baselines import fit_polynomial
from mlscorr.estimate import estimate_correction

NORTH = 1  # Tables 3 and 4 are of this axis


@dataclass(frozen=True)
class Drive:
    """One simulated drive: its survey, and the POS error (q, 3) at 1 Hz, which is the truth."""

    survey: object
    gps_time: np.ndarray
    error: np.ndarray

    @classmethod
    def of(cls, seed):
        survey = survey_of("car", seed)
        true, recorded = (t.position[::10] for t in (survey.true, survey.recorded))
        return cls(survey, survey.true.gps_time[::10], true - recorded)

    def with_control(self, count):
        """The same drive with a number of evenly chosen control points."""
        seen = self.survey.observations
        names = [seen.name[i] for i in np.argsort(seen.gps_time)]
        rows = np.linspace(0, len(names) - 1, count).round().astype(int)
        kept = self.survey.keep({names[i] for i in rows})
        return Drive(kept, self.gps_time, self.error)

    def consistent(self, order=None):
        """Residual error (q, 3) with all parameters from the control points."""
        survey = self.survey
        chosen = {} if order is None else {"order": order}
        found = quietly(estimate_correction, survey.recorded, survey.matched, **chosen)
        return survey.position_left(found.correction)[::10]

    def least_squares(self, order):
        """Residual error (q, 3) of LS-n, by code independent of the literal mode's."""
        survey = self.survey
        found = fit_polynomial(survey.recorded, survey.matched, order)
        return survey.position_left(found)[::10]


def one_order(drive, order):
    """RMS (3,) by LS, literal tuned, literal untuned and consistent; and the tuned C0 (3,)."""
    literal = Literal.of(drive.survey, order)
    time = TIMES[21]
    left, base = literal.tuned(drive.gps_time, drive.error, time)
    untuned = drive.error - literal.predict(drive.gps_time, literal.variance, time)
    several = drive.least_squares(order), left, untuned, drive.consistent(order)
    return *(rms(one) for one in several), base


def sweep_base(drive, time, factors):
    """RMS north at multiples of the best C0, that C0, the parabola's 1 - R^2, and RMS(0)/LS - 1."""
    literal = Literal.of(drive.survey, 5)
    best = literal.best_base(drive.gps_time, drive.error, time)[NORTH]
    scale = best if best > 0 else literal.variance[NORTH]
    left = (
        drive.error - literal.predict(drive.gps_time, np.full(3, factor * scale), time)
        for factor in factors
    )
    found = np.array([rms(one)[NORTH] for one in left])
    at_zero = abs(found[0] / rms(drive.least_squares(5))[NORTH] - 1.0)
    return found, best, unexplained(factors, found**2), at_zero


def sweep_time(drive, times, nominals):
    """RMS north (m + 1, k) over k correlation times.

    A row for each of m nominal times, with the C0 that is best there; the last with C0 best at
    each of the k. The prediction is linear in C0, so its signal is needed once for each time.
    """
    literal = Literal.of(drive.survey, 5)
    at = drive.gps_time
    trend = literal.predict(at, np.zeros(3), times[0])[:, NORTH]
    left = drive.error[:, NORTH] - trend
    signal = np.array([literal.predict(at, np.ones(3), t)[:, NORTH] - trend for t in times])
    bases = [literal.best_base(at, drive.error, t)[NORTH] for t in nominals]
    bases.append(np.maximum(signal @ left / np.sum(signal**2, axis=1), 0.0)[:, None])
    return np.array([np.sqrt(np.mean((left - base * signal) ** 2, axis=1)) for base in bases])


def unexplained(base, square):
    """1 - R^2 of the parabola through squared RMS over C0."""
    left = square - np.polyval(np.polyfit(base, square, 2), base)
    return float(np.sum(left**2) / np.sum((square - square.mean()) ** 2))
