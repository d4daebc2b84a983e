"""Numbers of what a survey will see, and of what could be added to it, with their reasons."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Settings:
    """What is planned with: ``python benchmarks/target_study.py`` shows what targets give."""

    pass_interval: float = 60.0  # s between two passes, and of a stop: the POS error is another one
    factor: float = 2.0  # times the speed, the distance: what a driver or surveyor can do at once
    stop_targets: int = 8  # that a stop needs
    smallest_fall: float = 0.05  # of the squared correlation, that makes an addition worth while
    farthest_target: float = 40.0  # m from the scanner: farther, 0.6 m hold too few points
    facets: int = 400  # of a reference surface, at most
    centre_sigma: float = 0.002  # m, one sigma of a target's centre (target_study)
    facet_points: int = 80  # of a patch of a reference surface: several hundred in a street
    brightness: float = 20000.0  # counts of 16 bits: as targets are


SETTINGS = Settings()
