"""Covariance functions of time lag, as correlations with value one at lag zero.

All are Markov processes with one, two or three states. The paper calls the first one Gaussian (Eq.
20), but it is exponential. Inertial drift is an integrated process, which the two smoother ones
describe better.

In state-space form (Särkkä and Solin 2019, section 12.3) a process of d states is s and its first
d - 1 derivatives, each divided by the rate to its order, so that every state is of order one:

    s(t + dt) = F s(t) + w,   w ~ N(0, Q),   with x = rate dt:
    F(x) = exp(-x) sum_k (N x)^k / k!,       N nilpotent (all poles of the process are -rate)
    Q(x) = q int_0^x f(u) f(u)^T du,         f the last column of F

The integrals are incomplete gamma functions, summed without cancellation, so Q is accurate to the
last digits at any step although its elements decrease as x to the power 2 d - 1.

An integrated random walk from zero at t = 0 is stationary too, on a logarithmic clock x = log t and
over its own sigma, which grows as t^1.5 (Lamperti's transformation): with its velocity over t^0.5
it has the poles -3/2 and -1/2 and, with E = 1 - exp(-x),

    F(x) = exp(-x/2) [exp(-x), sqrt(3) E; 0, 1],   Q(x) = [E^3, sqrt(3)/2 E^2; sqrt(3)/2 E^2, E]
"""

import math
from dataclasses import dataclass

import numpy as np

from mlscorr.compiled_loops import loop

FAMILIES = ("exponential", "matern32", "matern52")  # of 1, 2, 3 states, which number them
INTEGRATED = "integrated"
INTEGRATED_KIND = len((*FAMILIES, INTEGRATED))
SERIES_BELOW = 1.0  # beyond it 1 - exp(-y) sum loses no more than three digits
LARGEST_LAG = float(-np.log(np.finfo(float).tiny))  # exp(-x) is the smallest positive number


@dataclass(frozen=True)
class Covariance:
    """A stationary correlation function.

    Sources: Mao et al. 2015, Eq. 20 (exponential); Rasmussen and Williams 2006, Eq. 4.17 (Matern).

    Parameters
    ----------
    family : str
        One of FAMILIES, or INTEGRATED, a function of lags on a logarithmic clock.
    correlation_time : float
        Dimensionless for the integrated family. Units: s.

    Raises
    ------
    ValueError
        If the family is unknown or the correlation time is not positive.

    Examples
    --------
    >>> Covariance("exponential", 30.0)(np.array([0.0, 30.0])).round(4)
    array([1.    , 0.3679])
    """

    family: str
    correlation_time: float

    def __post_init__(self):
        if self.family not in (*FAMILIES, INTEGRATED):
            known = ", ".join((*FAMILIES, INTEGRATED))
            raise ValueError(
                f"The covariance family '{self.family}' is unknown; known are {known}."
            )
        if not self.correlation_time > 0:
            raise ValueError(
                f"The correlation time is {self.correlation_time} s; it must be positive."
            )

    def __call__(self, lag: np.ndarray) -> np.ndarray:
        """Return the correlation at time lags of any shape. Units: s."""
        return _correlations(self.kind, np.asarray(self.rate * lag).ravel()).reshape(np.shape(lag))

    @property
    def states(self) -> int:
        """Number of states of the process."""
        if self.family == INTEGRATED:
            return 2
        return self.kind

    @property
    def kind(self) -> int:
        """Number of the family."""
        if self.family == INTEGRATED:
            return INTEGRATED_KIND
        return FAMILIES.index(self.family) + 1

    @property
    def rate(self) -> float:
        """Rate of the poles of the process. Units: 1/s."""
        if self.family == INTEGRATED:
            scale = 1.0
        else:
            scale = math.sqrt(2.0 * self.states - 1.0)
        return scale / self.correlation_time


@loop
def correlation(kind: int, x: float) -> float:
    """Correlation at a time lag of either sign.

    Parameters
    ----------
    kind : int
        Covariance.kind.
    x : float
        Time lag in units of 1 / rate.
    """
    x = abs(x)
    if kind == INTEGRATED_KIND:
        half = np.exp(-0.5 * x)
        return half * (1.5 - 0.5 * half * half)
    e = np.exp(-x)
    if kind == 1:
        return e
    if kind == 2:
        return (1.0 + x) * e
    return (1.0 + x + x * x / 3.0) * e


@loop
def _correlations(kind, lags):
    out = np.empty(lags.size)
    for i in range(lags.size):
        out[i] = correlation(kind, lags[i])
    return out


@loop
def transition(kind: int, x: float) -> tuple[float, ...]:
    """F(x), row by row, padded with zeros below three states.

    Parameters
    ----------
    kind : int
        Covariance.kind.
    x : float
        Time lag in units of 1 / rate.
    """
    x = min(x, LARGEST_LAG)  # avoid infinity
    e = np.exp(-x)
    if kind == 1:
        return e, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    if kind == INTEGRATED_KIND:
        half = np.exp(-0.5 * x)
        return half * e, -np.sqrt(3.0) * half * np.expm1(-x), 0.0, 0.0, half, 0.0, 0.0, 0.0, 0.0
    if kind == 2:
        return e * (1.0 + x), e * x, 0.0, -e * x, e * (1.0 - x), 0.0, 0.0, 0.0, 0.0
    h = 0.5 * x * x
    first = e * (1.0 + x + h), e * (x + 2.0 * h), e * h
    second = -e * h, e * (1.0 + x - 2.0 * h), e * (x - h)
    third = e * (h - x), e * (2.0 * h - 3.0 * x), e * (1.0 - 2.0 * x + h)
    return first + second + third


@loop
def process_noise(kind: int, x: float) -> tuple[float, ...]:
    """Q(x), upper triangle row by row, padded with zeros; Q(inf) is stationary.

    Parameters
    ----------
    kind : int
        Covariance.kind.
    x : float
        Time lag in units of 1 / rate.
    """
    x = min(x, LARGEST_LAG)
    y = 2.0 * x
    if kind == INTEGRATED_KIND:
        loss = -np.expm1(-x)
        across = 0.5 * np.sqrt(3.0) * loss * loss
        return loss * loss * loss, across, 0.0, loss, 0.0, 0.0
    if kind == 1:
        return -np.expm1(-y), 0.0, 0.0, 0.0, 0.0, 0.0
    e = np.exp(-x) ** 2
    if kind == 2:  # f = exp(-u) (u, 1 - u), q = 4
        gamma = _incomplete_gamma(3, y, e)
        return gamma, 0.5 * e * y * y, 0.0, gamma + 2.0 * e * y, 0.0, 0.0
    # f = exp(-u) (u^2 / 2, u - u^2 / 2, 1 - 2 u + u^2 / 2), q = 16 / 3
    y2 = y * y  # int u^k exp(-2 u) du = k! / 2^(k + 1) P(k + 1, y)
    gamma = _incomplete_gamma(5, y, e)
    i4 = 4.0 * gamma  # all integrals times q
    gamma += e * y2 * y2 / 24.0
    i3 = 2.0 * gamma
    gamma += e * y2 * y / 6.0
    i2 = 4.0 / 3.0 * gamma
    gamma += e * y2 / 2.0
    i1 = 4.0 / 3.0 * gamma
    i0 = 8.0 / 3.0 * (gamma + e * y)
    first = 0.25 * i4, 0.5 * i3 - 0.25 * i4, 0.5 * i2 - i3 + 0.25 * i4
    second = i2 - i3 + 0.25 * i4, i1 - 2.5 * i2 + 1.5 * i3 - 0.25 * i4
    return first + second + (i0 - 4.0 * i1 + 5.0 * i2 - 2.0 * i3 + 0.25 * i4,)


@loop
def _incomplete_gamma(k, y, e):
    """P(k, y) = exp(-y) sum_(j >= k) y^j / j!, with e = exp(-y)."""
    term = e
    below = 0.0
    for j in range(k):
        below += term
        term *= y / (j + 1)
    if y > SERIES_BELOW:
        return 1.0 - below
    above = 0.0
    while term > 1e-17 * above:
        above += term
        k += 1
        term *= y / k
    return above
