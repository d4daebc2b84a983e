"""Speed of a vehicle: slow variation, stops, and slowing down in a U-turn."""

from dataclasses import dataclass

import numpy as np
from scipy.integrate import cumulative_trapezoid

from mlscorr.simulate.settings import SETTINGS


@dataclass(frozen=True)
class Pace:
    """Speed of one pass over time.

    Parameters
    ----------
    cruise : float
        Units: m/s.
    phase : float
        Of the slow variation. Units: rad.
    slow_at : float
        Time of the slowdown. Units: s.
    stops : tuple of (start, duration)
        Standing still. Units: s.
    turn : (middle, duration, speed), optional
        The time of the U-turn (s) and the speed in it (m/s).
    swing, period : float
        Of the speed in traffic, as a share, and in s.
    slowdown, slow_for : float
        Of the speed, once at a crossing, as a share, and in s.
    """

    cruise: float
    phase: float
    slow_at: float
    stops: tuple[tuple[float, float], ...] = ()
    turn: tuple[float, float, float] | None = None
    swing: float = 0.1
    period: float = 23.0
    slowdown: float = 0.6
    slow_for: float = 4.0

    def speed(self, elapsed: np.ndarray) -> np.ndarray:
        """Return the speed (n,) at times (n,) since the start of the pass; exactly 0 in stops. m/s.

        Parameters
        ----------
        elapsed : (n,) array
            Since the start of the pass. Units: s.
        """
        swing = self.swing * np.sin(2 * np.pi * elapsed / self.period + self.phase)
        slow = self.slowdown * np.exp(-(((elapsed - self.slow_at) / self.slow_for) ** 2))
        speed = self.cruise * (1.0 + swing) * (1.0 - slow)
        ramp = 1.5 * (1.0 + self.swing) * self.cruise / SETTINGS.comfort  # s, of a smooth step
        for start, duration in self.stops:
            outside = np.maximum(start - elapsed, elapsed - start - duration) / ramp
            speed = speed * smooth_step(outside)
        if self.turn is not None:
            middle, duration, limit = self.turn
            outside = (np.abs(elapsed - middle) - duration / 2) / ramp
            share = min(1.0, limit / (self.cruise * (1.0 + self.swing)))
            speed = speed * (share + (1.0 - share) * smooth_step(outside))
        return speed

    def distance(self, elapsed: np.ndarray) -> np.ndarray:
        """Return the distance (n,) traveled at regular times (n,) from 0. Units: m.

        Parameters
        ----------
        elapsed : (n,) array
            Since the start of the pass. Units: s.
        """
        return cumulative_trapezoid(self.speed(elapsed), elapsed, initial=0.0)


def smooth_step(x: np.ndarray) -> np.ndarray:
    """Smooth transition from 0 below 0 to 1 above 1.

    Parameters
    ----------
    x : (...) array
        Any number.
    """
    x = np.clip(x, 0.0, 1.0)
    return x**2 * (3 - 2 * x)
