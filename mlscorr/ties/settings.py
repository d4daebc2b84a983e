"""Settings of the search for ties."""

from dataclasses import dataclass

from mlscorr.surfaces import SETTINGS as SURFACES
from mlscorr.survey import PAUSE


@dataclass(frozen=True)
class Settings:
    """Limits and sizes, each with its unit and reason."""

    # Features
    cell: float = SURFACES.cell  # m
    moment: float = SURFACES.moment  # s
    feature_points: int = SURFACES.feature_points
    roughest: float = SURFACES.roughest  # m
    narrowest: float = SURFACES.narrowest  # m
    widest_paint: float = SURFACES.widest_paint  # m
    ties: int = 6  # of a second, direction and pass: 10 mm each give 4 mm, two may be wrong
    thinning_block: float = SURFACES.thinning_block  # m
    coarse_features: int = 6000  # for six unknowns of a mounting; more only cost time
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
