"""Numbers that an evaluation rests on."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Settings:
    """What the ASPRS standard calls for (Edition 2, 2023), and what no good survey shows."""

    check_points: int = 30  # points; fewer make no conformant test
    accuracy_ratio: float = 2.0  # how much more accurate the points must be than the product
    check_significance: float = 0.05  # share of right sigmas that the test of z rejects; usual
    # One sigma of what control may differ by from the cloud's own frame, before the data are seen
    datum_shift: float = 1.0  # m; ETRS89 and ITRF differ by 0.8 m in 2025
    datum_scale: float = 1e-3  # ratio; UTM's factor is 0.9996 to 1.001
    datum_turn: float = 1e-2  # rad; the meridian convergence of a UTM zone in middle latitudes
    datum_tilt: float = 5e-4  # m/m; geoids slope by 1e-4, in mountains by 5e-4
    off_plane: float = 20.0  # deg; a wrong mounting leaves a few, another survey's points any angle


SETTINGS = Settings()
