"""Settings of the observations of a survey, and of possible additions, with their reasons."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Settings:
    """Settings of planning: ``python benchmarks/target_study.py`` shows what targets give."""

    pass_interval: float = 60.0  # s between two passes, or of a stop: the POS error changes
    factor: float = 2.0  # times the speed, the distance: what a driver or surveyor can easily do
    stop_targets: int = 8  # that a stop needs
    smallest_fall: float = 0.05  # of the squared correlation, that makes an addition worthwhile
    farthest_target: float = 40.0  # m from the scanner: farther, 0.6 m have too few points
    facets: int = 400  # of a reference surface, at most
    centre_sigma: float = 0.002  # m, one sigma of a target's center (target_study)
    facet_points: int = 80  # of a patch of a reference surface: several hundred in a street
    brightness: float = 20000.0  # counts of 16 bits, as of targets


SETTINGS = Settings()
