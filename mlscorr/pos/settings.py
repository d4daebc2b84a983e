"""Settings of the assumptions about the POS."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Settings:
    """Limits and scales, each with its unit and source."""

    fixed_percentile: float = 5.0  # of sigma(t): GNSS at its best, free of single epochs
    # of largest to remaining sigma, below which sigma(t) shows no drift; of a change within
    # step_duration, below which neither GNSS nor its solution changes
    steady_ratio: float = 2.0
    outage: float = 60.0  # s; for which data sheets of GNSS/INS state the drift of the position
    smallest_step: float = 0.1  # m; two fixed RTK solutions of 2 cm per axis differ by less
    step_ratio: float = 10.0  # to the median of seconds' largest steps: updates, noise
    largest_jerk: float = 5.0  # m/s^3, of braking in town (ISO 15622); a step is beyond it
    step_duration: float = 0.4  # s; over which filters and resampling spread a re-acquisition
    sigma_interval: float = 1.0  # s; of sigmas in SBET's companion smrmsg, for a path of 200 Hz
    whole_step: float = 0.9  # of the largest size; a span that shows less cuts the step
    reacquisition_time: float = 10.0  # s; in which receivers fix ambiguities anew (data sheets)
    # e-folds of a smoother's sigma(t) in one correlation time of its drift: an integrated random
    # walk's sigma grows as t^1.5 and its correlation falls as t^-0.5
    correlated_folds: float = 3.0
    # m, E, N, H: a fixed RTK solution, 1 cm and 1.5 cm + 1 ppm by receivers' data sheets, and as
    # much for errors of the inertial unit
    gnss_sigma: tuple[float, float, float] = (0.02, 0.02, 0.03)

    # The error as one process, with approximately correct sigma (gap_study.py, seeds 5000, 6000,
    # 7000)
    process_scales: tuple[float, ...] = (0.4, 0.7, 1.2, 2.0)  # ratio to sigma; more is a cause
    process_scale_spread: float = 0.45  # of log scale; sigmas are rarely wrong by more than half
    process_shapes: tuple[tuple[str, float, float], ...] = (  # family, factor on the time, prior
        *(("matern32", 0.1, 0.15), ("matern32", 0.3, 0.25), ("exponential", 1.0, 0.20)),
        *(("matern32", 1.0, 0.25), ("matern32", 3.0, 0.15)),
    )
    # ratio to an elevated sigma, and its prior: a POS knows of missing GNSS, and has errors up to
    # five times the sigma stated then (real units, pos_study.py)
    increased_scales: tuple[tuple[float, float], ...] = ((1.0, 0.5), (2.0, 0.3), (3.5, 0.2))

    # Hypotheses before any observation (``benchmarks/ablation.py matching`` shows the effect of
    # each)
    sigma_scales: tuple[float, ...] = (0.1, 0.3, 1.0, 3.0, 10.0)  # of stated sigmas to the truth
    slow_biases: tuple[float, ...] = (1.0, 3.0)  # m; not stated by any sigma: multipath in a canyon
    unstated_sigmas: tuple[float, ...] = (0.02, 0.2)  # m; good mounting; calibration due, GNSS
    time_shares: tuple[float, ...] = (1.0, 0.3)  # of the POS's; drift ends with an outage
    rough_share: float = 0.1  # of the smooth sigma; steps when satellites come and go

    @property
    def change_interval(self) -> float:
        """Largest delay of a change of sigma(t) after an event: interval and spread. Units: s."""
        return self.sigma_interval + self.step_duration

    @property
    def gnss(self) -> np.ndarray:
        """gnss_sigma as an array (3,). Units: m."""
        return np.array(self.gnss_sigma)


SETTINGS = Settings()
