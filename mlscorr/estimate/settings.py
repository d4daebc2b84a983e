"""Settings of the estimate of POS error and mounting."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Settings:
    """Limits, priors and effort, each with its unit and source."""

    order: int = 0  # of the trend: a datum difference; signals carry what changes
    # With fewer control points neither the parameters nor a fault can be determined; and two don't
    # constrain the rotation of a mounting about the line between them
    smallest_targets: int = 3
    median_epochs: int = 5  # epochs, whose median preserves edges and drops outliers
    lone_jump: float = 3.0  # ratio to it that no filter makes from one epoch to the next and back
    setup_sigmas: float = 3.0  # two neighbors that differ by less may share a wrong setup
    resolution: float = 1e-6  # m, rad: less than any file's rounding, and no noise at all; guard

    # Tests
    significance: float = 0.001  # Baarda's (1968), but over all targets or steps together
    smallest_redundancy: float = 1e-6  # of all noise together, below which there is none to test
    undetected: float = 0.2  # share of detectable errors that w misses (Baarda 1968)
    determined_ratio: float = 0.5  # posterior over prior variance if control determined a component
    faded_times: float = 3.0  # correlation times after which a signal has faded to 5 %

    # The search for wrong targets
    screened_targets: int = 5  # four can't separate a wrong one from a POS worse than stated
    breakdown: float = 0.3  # share of wrong targets beyond which a majority means little
    gross_share: float = 0.02  # of control points, a priori
    gross_sizes: tuple[float, ...] = (0.1, 0.5, 2.5)  # m, one sigma: misread target to wrong setup
    scale_factors: tuple[float, ...] = (1.0, 0.5, 0.25, 0.125)  # so that some search isn't masked
    rounds: int = 3  # of eliminating or moving starts, and estimating; the third seldom changes any
    strong_evidence: float = 20.0  # Bayes factor (Kass and Raftery 1995)
    same_direction: float = 0.8  # cosine above which two misclosures agree
    start_epochs: int = 24  # of control, between which drift's start is sought; more only cost time

    # Ties
    tie_cut: float = 4.0  # sigmas; in one of sixteen surveys one of a thousand good ties exceeds it
    tie_majority: float = 0.5  # of the ties; with fewer the correct ones are not identifiable
    tie_epoch: float = 0.1  # s: in half of it a drift of 3 cm/s makes 1.5 mm
    # Uncertainty added by knots, relative to that of rows between them: results move by less than a
    # tenth of their sigma, in three quarters of the time that 0.1 takes
    knot_tolerance: float = 0.5
    coarse_tolerance: float = 4.0  # the same, to select accepted ties: by half of it, in a quarter
    tie_sample: int = 100  # least ties that choose parameters: a scale to a tenth
    dense_rows: int = 500  # with ties: for more, knots are faster than covariances; guard
    sufficient_ratio: float = 1.1  # of a median sigma: a difference that no check point shows
    tie_points: int = 12  # as points below, each with a solution of all ties
    tie_freedom: float = 4.0  # degrees of freedom of Student's t (Lange et al. 1989)

    # Prior of the parameters: their start, and one sigma of their logarithms about it as a factor,
    # fixed by benchmarks/lsc_study.py. Stated sigmas of position are correct within a factor of
    # ten, or in another unit; the paper's rule for correlation times within two.
    start_ratio: float = 4.0  # correlation time over control interval: 3 to 5, paper 3.1.4
    # s, if sigma(t) shows growth without GNSS; one control interval if that is shorter. After it
    # half of the variance of a GNSS/INS between outages has changed, and no more after a minute
    # than after 5 s (OB_GINS in Wuhan, 357962 to 358049 s, outside the graded windows)
    jitter_time: float = 3.0
    attitude_time: float = 120.0  # s, paper's Table 7: gyro biases change over minutes
    # m, of a coefficient: 1 cm of a base station to 1 m between ETRS89 and ITRF, as two sigmas
    trend_sigma: float = 0.1
    walk_scale: float = 0.1  # of the random walk in an integrated drift
    precise_factor: float = 2.0  # of drift_time and attitude_scale
    time_factor: float = 3.0  # of the other times, and of trend_sigma
    scale_factor: float = 10.0  # of the scales of position

    # The parameters' posterior, by Laplace and importance sampling
    block: int = 100  # observations; 25 correlation times at the start, so blocks separate little
    gradient_step: float = 0.01  # of a logarithm, for gradients
    curvature_step: float = 0.2  # for curvatures, which show a sigma's width, not a point
    farthest_spreads: float = 4.0  # spreads from the start; there a likelihood is flat
    posterior_points: int = 32  # over which a prediction is averaged: 64 change sigmas by 2 %
    smallest_share: float = 0.02  # probability of a family that is given points
    heaviest: float = 5.0  # times the mean weight: one point in the tail can't represent all
    least_parameter_weight: float = 1e-3  # of parameters whose prediction is worth its cost
    prediction_epochs: int = 300  # for the parameters' spread, which changes as slowly as sigmas

    # The mounting
    mounting_iterations: int = 10  # of Gauss-Newton; a boresight wrong by degrees needs four
    # One sigma without any measurement: a vehicle's size, and a drawing
    unmeasured: tuple[float, float] = (1.0, float(np.radians(5.0)))  # m, rad
    # Of a scanner's ranges (m) and encoder (ratio), without any measurement: ten times the data
    # sheets' values (RIEGL VQ-250: 5 to 10 mm; 0.001 deg of resolution at 100 deg)
    unmeasured_scanner: tuple[float, float] = (0.1, 1e-3)
    # Errors as large as the accuracy of a lever arm, or as much at a point 10 m and 60 deg away
    least_scanner_error: tuple[float, float] = (0.005, 5e-4)
    # A site determines components better than a tape does: 2 cm, or as much at a point 10 m away
    determined_sigma: tuple[float, float] = (0.02, 0.002)  # m, rad


SETTINGS = Settings()
