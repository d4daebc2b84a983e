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

    # The error as one process, where sigma is about right (gap_study.py, seeds 5000, 6000, 7000)
    process_scales: tuple[float, ...] = (0.4, 0.7, 1.2, 2.0)  # ratio to sigma; more is a cause
    process_scale_spread: float = 0.45  # of log scale; sigmas are rarely wrong by more than half
    process_shapes: tuple[tuple[str, float, float], ...] = (  # family, factor on the time, prior
        *(("matern32", 0.1, 0.15), ("matern32", 0.3, 0.25), ("exponential", 1.0, 0.20)),
        *(("matern32", 1.0, 0.25), ("matern32", 3.0, 0.15)),
    )
    # ratio to a sigma that is raised, and its prior: a POS knows when it lacks GNSS, and errs by up
    # to five times what it states then (real units, pos_study.py)
    raised_scales: tuple[tuple[float, float], ...] = ((1.0, 0.5), (2.0, 0.3), (3.5, 0.2))

    # Hypotheses before any observation (``benchmarks/ablation.py matching`` shows what each does)
    sigma_scales: tuple[float, ...] = (0.1, 0.3, 1.0, 3.0, 10.0)  # of stated sigmas to the truth
    slow_biases: tuple[float, ...] = (1.0, 3.0)  # m; that no sigma states: multipath in a canyon
    unstated_sigmas: tuple[float, ...] = (0.02, 0.2)  # m; good mounting; calibration due, GNSS
    time_shares: tuple[float, ...] = (1.0, 0.3)  # of the POS's; drift ends with an outage
    rough_share: float = 0.1  # of the smooth sigma; steps when satellites come and go

    @property
    def change_interval(self) -> float:
        """How far from an event sigma(t) may tell of it: interval and spread. Units: s."""
        return self.sigma_interval + self.step_duration

    @property
    def gnss(self) -> np.ndarray:
        """gnss_sigma as an array (3,). Units: m."""
        return np.array(self.gnss_sigma)


SETTINGS = Settings()
