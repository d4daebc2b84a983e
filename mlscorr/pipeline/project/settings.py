"""Settings of projects."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Settings:
    """Limits and choices, each with its unit and reason."""

    losses: int = 2  # times that a task may lose its worker before it is blamed; guard
    waiting: int = 2  # tasks assigned to each worker: the next is ready when one ends; guard
    area_seconds: int = 6_500  # of drives in an area and its margin: 2 GB, minutes; guard
    interval: float = 10.0  # s between two progress lines, and checks of a cluster; guard
    cached: int = 2  # drives cached by a worker: current and previous task; guard


SETTINGS = Settings()
