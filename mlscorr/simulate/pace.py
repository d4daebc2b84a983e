"""How fast a vehicle goes: cruising with slow variation, stops, and slower through a U-turn."""

from dataclasses import dataclass

import numpy as np
from scipy.integrate import cumulative_trapezoid

SWING, PERIOD = 0.1, 23.0  # of the speed, and s: traffic
SLOWDOWN, SLOW_FOR = 0.6, 4.0  # of the speed, once, and s: a crossing
BRAKING = 2.0  # m/s^2 at most on the way to a stop, comfortable
CORNERING = 1.5  # m/s^2, lateral in a U-turn


@dataclass(frozen=True)
class Pace:
    """The speed of one pass over its time.

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
    """

    cruise: float
    phase: float
    slow_at: float
    stops: tuple[tuple[float, float], ...] = ()
    turn: tuple[float, float, float] | None = None

    def speed(self, elapsed):
        """Speed (n,) at times (n,) since the start of the pass; exactly 0 in stops. m/s."""
        swing = SWING * np.sin(2 * np.pi * elapsed / PERIOD + self.phase)
        slow = SLOWDOWN * np.exp(-(((elapsed - self.slow_at) / SLOW_FOR) ** 2))
        speed = self.cruise * (1.0 + swing) * (1.0 - slow)
        ramp = 1.5 * (1.0 + SWING) * self.cruise / BRAKING  # s, of a smooth step
        for start, duration in self.stops:
            outside = np.maximum(start - elapsed, elapsed - start - duration) / ramp
            speed = speed * smooth_step(outside)
        if self.turn is not None:
            middle, duration, limit = self.turn
            outside = (np.abs(elapsed - middle) - duration / 2) / ramp
            share = min(1.0, limit / (self.cruise * (1.0 + SWING)))
            speed = speed * (share + (1.0 - share) * smooth_step(outside))
        return speed

    def distance(self, elapsed):
        """Distance (n,) travelled at even times (n,) from 0. Units: m."""
        return cumulative_trapezoid(self.speed(elapsed), elapsed, initial=0.0)


def smooth_step(x):
    """0 below 0, 1 above 1, smooth in between."""
    x = np.clip(x, 0.0, 1.0)
    return x**2 * (3 - 2 * x)
