"""Settings of an evaluation."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Settings:
    """Requirements of the ASPRS standard (Edition 2, 2023), and limits of good surveys."""

    check_points: int = 30  # points; fewer give no conformant test
    accuracy_ratio: float = 2.0  # accuracy of the points over that of the product
    check_significance: float = 0.05  # share of correct sigmas that the test of z rejects; usual
    # Prior sigmas of the difference between control and the cloud's own frame
    datum_shift: float = 1.0  # m; ETRS89 and ITRF differ by 0.8 m in 2025
    datum_scale: float = 1e-3  # ratio; UTM's factor is 0.9996 to 1.001
    datum_turn: float = 1e-2  # rad; the meridian convergence of a UTM zone in middle latitudes
    datum_tilt: float = 5e-4  # m/m; geoids slope by 1e-4, in mountains by 5e-4
    off_plane: float = 20.0  # deg; a wrong mounting causes a few, another survey's points any angle


SETTINGS = Settings()
