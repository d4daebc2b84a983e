"""Numbers that an evaluation rests on."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Settings:
    """What the ASPRS standard calls for (Edition 2, 2023), and what no good survey shows."""

    check_points: int = 30  # points; fewer make no conformant test
    accuracy_ratio: float = 2.0  # how much more accurate the points must be than the product
    datum_sigmas: float = 5.0  # of what all control points share: 1 of 1e6 good surveys beyond it
    off_plane: float = 20.0  # deg; a wrong mounting leaves a few, another survey's points any angle


SETTINGS = Settings()
