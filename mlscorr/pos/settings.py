"""Numbers that beliefs about the POS rest on."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Settings:
    """Limits and scales, each with its unit and source."""

    held_percentile: float = 5.0  # of sigma(t): GNSS at its best, free of single epochs
    # of largest to held sigma, below which sigma(t) tells of no drift; of a change within
    # step_duration, below which GNSS is neither back nor of another solution
    steady_ratio: float = 2.0
    outage: float = 60.0  # s; for which data sheets of GNSS/INS state how far the position drifts
    smallest_step: float = 0.1  # m; two fixed RTK solutions of 2 cm per axis differ by less
    step_ratio: float = 10.0  # to the median of seconds' largest steps: updates, noise
    largest_jerk: float = 5.0  # m/s^3, of braking in town (ISO 15622); a step is beyond it
    step_duration: float = 0.4  # s; over which filters and resampling spread a fall-back
    sigma_interval: float = 1.0  # s; of sigmas in SBET's companion smrmsg, beside a path of 200 Hz
    whole_step: float = 0.9  # of the largest size; a span that shows less cuts the step
    reacquisition_time: float = 10.0  # s; in which receivers fix ambiguities anew (data sheets)
    # e-folds of a smoother's sigma(t) in one correlation time of its drift: an integrated random
    # walk's sigma grows as t^1.5 and its correlation falls as t^-0.5
    correlated_folds: float = 3.0
    # m, E, N, H: a fixed RTK solution, 1 cm and 1.5 cm + 1 ppm by receivers' data sheets, and as
    # much for what the inertial unit adds
    gnss_sigma: tuple[float, float, float] = (0.02, 0.02, 0.03)

    @property
    def change_interval(self) -> float:
        """How far from an event sigma(t) may tell of it: interval and spread. Units: s."""
        return self.sigma_interval + self.step_duration

    @property
    def gnss(self) -> np.ndarray:
        """gnss_sigma as an array (3,). Units: m."""
        return np.array(self.gnss_sigma)


SETTINGS = Settings()
