"""Covariance functions of time lag, as correlations: one at lag zero.

All are Markov, in one, two and three states. The paper calls the first one Gaussian (Eq. 20); it
is exponential. Inertial drift is an integrated process, which the smoother two describe better.
"""

from dataclasses import dataclass

import numpy as np

FAMILIES = ("exponential", "matern32", "matern52")


@dataclass(frozen=True)
class Covariance:
    """A stationary correlation function: its family and its correlation time in s.

    Sources: Mao et al. 2015, Eq. 20 (exponential); Rasmussen and Williams 2006, Eq. 4.17 (Matern).

    >>> Covariance("exponential", 30.0)(np.array([0.0, 30.0])).round(4)
    array([1.    , 0.3679])
    """

    family: str
    correlation_time: float

    def __post_init__(self):
        if self.family not in FAMILIES:
            raise ValueError(f"Covariance family '{self.family}' is none of {', '.join(FAMILIES)}.")
        if not self.correlation_time > 0:
            raise ValueError(f"Correlation time {self.correlation_time} s should be positive.")

    def __call__(self, lag):
        """Correlation at time lags of any shape. Units: s."""
        ratio = np.abs(lag) / self.correlation_time
        if self.family == "exponential":
            return np.exp(-ratio)
        if self.family == "matern32":
            a = np.sqrt(3.0) * ratio
            return (1.0 + a) * np.exp(-a)
        a = np.sqrt(5.0) * ratio
        return (1.0 + a + a * a / 3.0) * np.exp(-a)
