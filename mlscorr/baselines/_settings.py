"""Settings of the baselines."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Settings:
    """Limits and resolutions, each with its unit and reason."""

    clear_spread: float = 10.0  # sigmas; with less, noise turns the cloud by 0.1 rad / sqrt(n)
    interval_ratio: float = 4.0  # correlation time over control interval: 3 to 5, section 3.1.4
    plane_tolerance: float = 0.03  # m; several sigmas of range noise, less than a frame's depth
    spacing: float = 0.02  # m; between points of a surveyed surface: a fifth of a small target
    inlier: float = 0.05  # m; a corrected target farther from its surveyed surface is wrong
    poor_fitness: float = 0.5  # share; with fewer inliers no rigid motion fits the targets
    icp_iterations: int = 200  # ICP from meters away takes more than Open3D's default of 30
    worsening: float = 0.001  # m; of control RMSE: less is within the targets' noise


SETTINGS = Settings()
