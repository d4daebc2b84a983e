"""Numbers of the search for ties; those of its features are in ``mlscorr.surfaces``."""

from dataclasses import dataclass

from mlscorr.survey import PAUSE


@dataclass(frozen=True)
class Settings:
    """Limits and sizes, each with its unit and reason."""

    # Features
    ties: int = 6  # of a second, direction and pass: 10 mm each make 4 mm, two may be wrong
    coarse_features: int = 6000  # for six unknowns of a mounting; more cost time alone
    # Pairs
    pause: float = PAUSE  # s between two visits of one pass
    parallel: float = 0.14  # rad, 8 deg: normals of few points, and a boresight error of 4 deg
    gate_sigmas: float = 3.0  # 3 in 1 000 normal errors are larger
    least_gate: float = 2.0  # m: a boresight error of 2 deg, in both passes, at 30 m
    neighbours: int = 16  # nearest features, or ties, considered: those of a plane within 2 m
    surface_sigma: float = 0.002  # m: walls and roads are not exact planes
    best_second: float = 0.005  # m per axis: thousands of ties share an unstated error
    # Agreement
    agreement_interval: float = 3.0  # s: over which a POS error is one shift


SETTINGS = Settings()
