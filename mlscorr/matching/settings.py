"""Settings of the matching."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Settings:
    """Priors, competing models and limits of the matching.

    If no source is given, ``benchmarks/ablation.py matching`` shows the effect on the counts of
    right, refused and wrong matches.
    """

    # Pairs
    visit_gap: float = 2.0  # s; after a break this long, a pass may observe a target again
    size_tolerance: float = 0.01  # m; between a recorded size and an observed one

    # Prior models
    constant_sigma: float = 1.5  # m; of datum and mounting: frames of one name differ by meters
    turning_sigma: float = 0.3  # m; part that is fixed to the vehicle
    visible_share: float = 0.8  # targets; in a pass: some are hidden
    street_length: float = 30.0  # m; a street is at least as long as it is wide
    lookalike_density: float = 1 / 600  # 1/m^2; for each target, along and across a street
    moved_share: float = 0.05  # targets; displaced marks, mixed-up numbers
    moved_sigma: float = 1.0  # m; per axis, size of the displacement
    exchanged_share: float = 0.03  # targets; exchanged names, kind or size recorded incorrectly
    restart_time: float = 200.0  # s; between restarts unseen in the path, as GNSS outages

    # Hypotheses
    least_log_weight: float = -16.0  # log; relative to the best: 1e-7
    merging_matches: int = 4  # matches; hypotheses that agree in the last ones are merged
    joined_hypotheses: int = 12  # hypotheses; of each model, when past and future are joined

    # Decision
    smallest_probability: float = 0.99  # probability; of a match that is used, given all others
    smallest_sound: float = 0.9  # probability; of a point not displaced; an outlier test follows
    smallest_rival: float = 0.001  # probability; above which a rival is named


SETTINGS = Settings()
