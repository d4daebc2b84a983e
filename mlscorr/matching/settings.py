"""Numbers that the matching rests on."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Settings:
    """Priors, competing beliefs and limits of who is who.

    Where no source is named, ``benchmarks/ablation.py matching`` shows what each does to the counts
    of matches that are right, refused and wrong.
    """

    # Pairs
    visit_gap: float = 2.0  # s; without a point, after which a pass may see a target twice
    size_tolerance: float = 0.01  # m; between a size taken down and one observed

    # Beliefs
    constant_sigma: float = 1.5  # m; of datum and mounting: frames of one name differ by metres
    turning_sigma: float = 0.3  # m; its part that is fixed to the vehicle
    visible_share: float = 0.8  # targets; in a pass: some are hidden
    street_length: float = 30.0  # m; a street is at least as long as it is wide
    lookalike_density: float = 1 / 600  # 1/m^2; for each target, along and across a street
    moved_share: float = 0.05  # targets; marks kicked, numbers mixed
    moved_sigma: float = 1.0  # m; per axis, by how much
    exchanged_share: float = 0.03  # targets; names exchanged, kind or size taken down wrong
    restart_time: float = 200.0  # s; of those not in the path: outages of GNSS are minutes apart

    # Hypotheses
    least_log_weight: float = -16.0  # log; against the best: 1e-7
    merging_matches: int = 4  # matches; hypotheses that agree in the last ones are merged
    joined_hypotheses: int = 12  # hypotheses; of each belief, when past and future are joined

    # Decision
    smallest_probability: float = 0.99  # probability; of a match that is used, given all others
    smallest_sound: float = 0.9  # probability; that its point isn't elsewhere; outlier test follows
    smallest_rival: float = 0.001  # probability; from which a rival is named


SETTINGS = Settings()
