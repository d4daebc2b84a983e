"""LSC-n as the paper prints it, for its experiments: Eq. 13-15 of the position.

D_Lambda is diagonal and one for all epochs: the mean variance that the POS states there. So all
epochs weigh the same, and with C0 = 0 there remains LS-n, as the paper's Table 3 shows it. With
each epoch's own variance, which varies 10^4-fold in these clones, one C0 can't serve all epochs:
even the best then leaves about twice the RMS of LS-n. The signals of the orientation are left out:
at 10 m the roots of the paper's C0 of them are 1.1 mm (roll, pitch) and 2.4 mm (heading).
"""

from dataclasses import dataclass

import numpy as np

from mlscorr.collocation import LiteralSignal, Noise, collocate_literal, polynomial_design


@dataclass(frozen=True)
class Literal:
    """LSC-n of one set of control points.

    gps_time (n,), misclosure (n, 3) and noise (n, 3, 3) of the control; ``variance`` (3,) is the
    diagonal of D_Lambda. Units: s, m, m^2.
    """

    gps_time: np.ndarray
    misclosure: np.ndarray
    noise: np.ndarray
    variance: np.ndarray
    order: int

    @classmethod
    def of(cls, survey, order):
        """From a survey's control points."""
        matched = survey.matched
        stated = survey.recorded.at(matched.gps_time).position_sigma
        surveyed = matched.surveyed.sigma[:, :, None] ** 2 * np.eye(3)
        return cls(
            gps_time=matched.gps_time,
            misclosure=matched.misclosure,
            noise=matched.observations.covariance + surveyed,
            variance=np.mean(stated**2, axis=0),
            order=order,
        )

    @property
    def interval(self):
        """Mean interval between control epochs. Units: s."""
        return np.ptp(self.gps_time) / (len(self.gps_time) - 1)

    def predict(self, at, base, correlation_time):
        """Position error (q, 3) at times ``at`` (q,), with C0 = base (3,) in m^2."""
        one = np.broadcast_to(np.eye(3), (len(self.gps_time), 3, 3))
        signal = LiteralSignal(one, self.variance, np.asarray(base, float), correlation_time)
        solved = collocate_literal(
            self.gps_time, self.misclosure, Noise(self.noise), self._design(self.gps_time), [signal]
        )
        partials = np.broadcast_to(np.eye(3), (len(at), 3, 3))
        return solved.predict(at, self._design(at), [partials])[0]

    def best_base(self, at, error, correlation_time):
        """C0 (3,) of the smallest RMS against the truth ``error`` (q, 3), as tuned in the paper.

        The squared RMS is a parabola in C0. A vertex below zero would turn the signal round: 0.
        """
        trend = self.predict(at, np.zeros(3), correlation_time)
        signal = self.predict(at, np.ones(3), correlation_time) - trend
        vertex = np.sum((error - trend) * signal, axis=0) / np.sum(signal**2, axis=0)
        return np.maximum(vertex, 0.0)

    def tuned(self, at, error, correlation_time):
        """Residual error (q, 3) with C0 tuned on the error, and that C0 (3,)."""
        base = self.best_base(at, error, correlation_time)
        return error - self.predict(at, base, correlation_time), base

    def _design(self, gps_time):
        """Polynomials of each axis (q, 3, 3 (order + 1)), Legendre's on the control span."""
        span = self.gps_time.min(), self.gps_time.max()
        return polynomial_design(gps_time, span, self.order, extrapolate=True)
